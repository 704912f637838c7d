"""Find the irregular vertices of a quad mesh, and say what they mean."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh

#: How many places a note names.
_NAMED = 5


@frozen_value
class Irregular:
    """The irregular vertices of a mesh.

    Parameters
    ----------
    vertex, valence : (K,) int arrays
        Vertices, and the number of edges at each.
    position : (K, 3) float array
        Where they are, in the mesh's unit.
    boundary : (K,) bool array
        Whether they lie on the boundary.
    """

    vertex: IntArray
    valence: IntArray
    position: FloatArray
    boundary: BoolArray

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.vertex)

    @property
    def breaks_twill(self) -> BoolArray:
        """Which of them break a biaxial twill: inside, of a valence not a multiple of 4, (K,)."""
        return ~self.boundary & (self.valence % 4 != 0)


def interior_valences(halfedges: Halfedges) -> tuple[IntArray, IntArray]:
    """Return the vertices inside the surface and their valences.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> interior_valences(build_halfedges(octahedron()))[1].tolist()
    [4, 4, 4, 4, 4, 4]
    """
    n_vertices = int(halfedges.tail.max(initial=-1)) + 1
    valence = np.bincount(halfedges.tail, minlength=n_vertices)
    rim = halfedges.twin < 0
    valence[halfedges.tail[rim]] = 0
    valence[halfedges.head[rim]] = 0
    inside = np.flatnonzero(valence)
    return inside, valence[inside]


def find_irregular(mesh: PolyMesh, regular: int = 4) -> Irregular:
    """Find the vertices at which a mesh is not a regular grid of quads, or of triangles.

    Inside, a regular vertex has four edges among quads; on the boundary it has three, or two at a
    corner. Among triangles it has six, and on the boundary up to four.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.
    regular : int
        The edges of a regular vertex inside: 4 for quads, 6 for triangles.

    Returns
    -------
    Irregular
        In the order of vertices; vertices without faces are passed over.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar, sphere
    >>> len(find_irregular(hypar(3, 2, 1.0, 1.0))), find_irregular(sphere(4, 1.0)).valence.tolist()
    (0, [3, 3, 3, 3, 3, 3, 3, 3])
    """
    halfedges = build_halfedges(mesh)
    rim = halfedges.twin < 0
    faces = np.bincount(mesh.indices, minlength=mesh.n_vertices)
    boundary = np.zeros(mesh.n_vertices, dtype=bool)
    boundary[halfedges.tail[rim]] = True
    valence = faces + boundary
    fits = np.where(boundary, (valence >= 2) & (valence <= regular // 2 + 1), valence == regular)
    vertex = np.flatnonzero(~fits & (faces > 0))
    return Irregular(vertex, valence[vertex], mesh.vertices[vertex], boundary[vertex])


def irregular_note(irregular: Irregular) -> str:
    """Say how many irregular vertices there are, of which valences, and where.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere, torus
    >>> irregular_note(find_irregular(torus(4, 4, 2.0, 1.0)))
    'no irregular vertices: every vertex inside has four edges'
    >>> irregular_note(find_irregular(sphere(1, 3**0.5)))[:62]
    '8 irregular vertices (8 of valence 3): vertex 0 (valence 3) at'
    """
    if not len(irregular):
        return "no irregular vertices: every vertex inside has four edges"
    valences, numbers = np.unique(irregular.valence, return_counts=True)
    kinds = ", ".join(
        f"{number} of valence {valence}"
        for valence, number in zip(valences.tolist(), numbers.tolist(), strict=True)
    )
    places = "; ".join(
        f"vertex {vertex} (valence {valence}) at ({x:.1f}, {y:.1f}, {z:.1f}) mm"
        for vertex, valence, (x, y, z) in zip(
            irregular.vertex[:_NAMED].tolist(),
            irregular.valence[:_NAMED].tolist(),
            irregular.position[:_NAMED].tolist(),
            strict=True,
        )
    )
    more = "; …" if len(irregular) > _NAMED else ""
    broken = int(np.count_nonzero(irregular.breaks_twill))
    where = "there" if broken == len(irregular) == 1 else f"at {broken} of them"
    twill = (
        f"a biaxial twill breaks {where}, whose valence is not a multiple of 4"
        if broken
        else "none of them breaks a biaxial twill: all are on the boundary, or have a valence that "
        "is a multiple of 4"
    )
    number = agree(len(irregular), "{n} irregular [vertex|vertices]")
    return f"{number} ({kinds}): {places}{more}; {twill}"
