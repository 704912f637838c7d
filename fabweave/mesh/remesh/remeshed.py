"""Check that a remeshed surface is the surface that was given."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.core.messages import agree
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import (
    Irregular,
    find_irregular,
    interior_valences,
    irregular_note,
)
from fabweave.mesh.polymesh import (
    PolyMesh,
    face_centres,
    face_normals,
    next_corner,
    triangle_normals,
)
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.triangulate import fans, plain_triangles, triangulate
from fabweave.mesh.weld import weld_mesh


@frozen_value
class Remeshed:
    """A remeshed surface, and how it came about.

    Parameters
    ----------
    mesh : PolyMesh
        Quads or triangles; some other faces may have stayed if it was paired or unrefined, and a
        note says so.
    method : str
        ``unchanged``, ``pairing``, ``unrefining``, or the name of the remesher.
    notes : tuple of str
        What a person should know.
    irregular : Irregular
        The irregular vertices that remain: inside, those with other than four edges in meshes of
        quads, other than six in meshes of triangles.
    """

    mesh: PolyMesh
    method: str
    notes: tuple[str, ...]
    irregular: Irregular


def finished_quads(mesh: PolyMesh, method: str, notes: Sequence[str]) -> Remeshed:
    """Return a mesh of quads as a result, with a note on its irregular vertices."""
    irregular = find_irregular(mesh)
    return Remeshed(mesh, method, (*notes, irregular_note(irregular)), irregular)


def ready_source(mesh: PolyMesh) -> tuple[PolyMesh, list[str]]:
    """Join vertices at the same place and orient the faces, so that remeshers can see the mesh.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.

    Returns
    -------
    source : PolyMesh
        An oriented manifold surface.
    notes : list of str
        What was done.

    Raises
    ------
    InputError
        If it cannot be made one.
    """
    if check_mesh(mesh).rules & {"index-range", "small-face"} or not mesh.n_faces:
        prepare_mesh(mesh)  # says what is wrong
    welded, joined, dropped = weld_mesh(mesh)
    notes: list[str] = []
    source = mesh
    # Bodies that only touch are better left apart than joined to something that cannot be woven.
    if joined and (not check_mesh(welded).fatal or check_mesh(mesh).fatal):
        source = welded
        notes.append(
            agree(
                joined,
                "{n} [vertex was|vertices were] at the same place as another vertex and merged "
                "with it",
            )
            + (agree(dropped, "; {n} [face|faces] vanished as a result") if dropped else "")
        )
    source, _, repairs = prepare_mesh(source)
    return source, [*notes, *repairs]


def cut_surface(source: PolyMesh) -> PolyMesh:
    """Cut a surface into triangles that are a manifold surface too.

    Faces are cut along their shorter diagonals; where two faces then share a diagonal, all faces
    are cut around their centres instead.

    Parameters
    ----------
    source : PolyMesh
        An oriented manifold surface.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> cut_surface(cube()).n_faces
    12
    """
    surface = triangulate(source)
    return surface if not check_mesh(surface).fatal else PolyMesh.from_faces(*fans(source))


#: The share of the edges that may be short, and that of the faces that may be long.
_FEW, _SOME = 0.05, 0.25


def edge_lengths(mesh: PolyMesh) -> FloatArray:
    """Return the length of each half-edge, (H,)."""
    here = mesh.vertices[mesh.indices]
    lengths: FloatArray = np.linalg.norm(here[next_corner(mesh)] - here, axis=1)
    return lengths


def evenness(mesh: PolyMesh) -> float:
    """Return how even the edges of a mesh are: as a whole, and around its faces.

    That is the length of all but the shortest twentieth of the edges over the median edge; or, of
    all but the longest quarter of the faces, the shortest edge over the longest, if that is less.

    Parameters
    ----------
    mesh : PolyMesh

    Returns
    -------
    float
        From 0 to 1; 1 if all edges are as long.

    Examples
    --------
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> cube = parse_shape("shape:cube")
    >>> round(evenness(cube), 9), round(evenness(cube.with_vertices(cube.vertices * [1, 1, 4])), 9)
    (1.0, 0.25)
    """
    length, first = edge_lengths(mesh), mesh.offsets[:-1]
    short, middle = np.quantile(length, (_FEW, 0.5)).tolist()
    longest = np.maximum.reduceat(length, first)
    round_ = np.minimum.reduceat(length, first) / np.maximum(longest, 1e-300)
    return min(float(short / middle), float(np.quantile(round_, _SOME))) if middle > 0 else 0.0


#: All bounds are shares of the mean edge of the quads. How far a new vertex may be off the given
#: surface, ...
_OFF_MAX = 1.0
#: ... and how far the given vertices may be off the new surface: in the mean, and at worst
#: (a horn thinner than a quad loses its tip).
_LOST_MEAN = 0.5
_LOST_MAX = 3.0
#: Which share of the faces may look away from the given surface (where two sheets of it are near
#: one another, the nearest point may be on the wrong one).
_REVERSED = 0.05
#: Fewer edges at a vertex inside would make two faces lie on one another.
_LEAST_EDGES = 3


def check_remeshed(
    given: PolyMesh, result: PolyMesh, corners: int | None = 4, *, simpler: bool = False
) -> tuple[str, ...]:
    """Check a remeshed surface against the given one.

    Every face has as many corners as it should; the surface is a consistently oriented manifold
    without odd places that the given one does not have; components, boundary loops, Euler
    characteristic and genus of each component are those of the given one; no vertex is far off,
    nothing of the given surface is lost, and outside is where it was.

    Parameters
    ----------
    given : PolyMesh
        An oriented manifold mesh.
    result : PolyMesh
        Any mesh.
    corners : int or None
        How many corners each face should have; None for any number.
    simpler : bool
        Whether it may have fewer openings and handles.

    Returns
    -------
    tuple of str
        What is wrong with the result; empty if nothing is.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> check_remeshed(torus(9, 6, 3.0, 1.0), torus(12, 8, 3.0, 1.0))
    ()
    >>> check_remeshed(torus(9, 6, 3.0, 1.0), torus(9, 6, 6.0, 2.0))[0][:42]
    'vertices are up to 4 off the given surface'
    """
    faults = surface_faults(given, result, corners, simpler=simpler)
    # Distances are measured by foreign code that must not see a broken mesh.
    if not result.n_faces or check_mesh(result).fatal:
        return faults
    return (*faults, *_distance_faults(given, result))


def sound_faults(given: PolyMesh, result: PolyMesh, corners: int | None) -> tuple[str, ...]:
    """Say what is wrong with a surface that must not run through itself if the given one does not.

    Parameters
    ----------
    given, result, corners
        As for `check_remeshed`.
    """
    faults = check_remeshed(given, result, corners)
    if faults:
        return faults
    pairs = self_intersections(result)
    if not len(pairs) or len(self_intersections(given)):
        return ()
    return (agree(len(pairs), "{n} [pair|pairs] of faces run[s|] through one another"),)


def surface_faults(
    given: PolyMesh, result: PolyMesh, corners: int | None = 4, *, simpler: bool = False
) -> tuple[str, ...]:
    """Say how a result differs from the given surface as a surface, wherever its vertices are.

    Parameters
    ----------
    given : PolyMesh
        An oriented manifold mesh.
    result : PolyMesh
        Any mesh.
    corners : int or None
        How many corners each face should have; None for any number.
    simpler : bool
        Whether it may have fewer openings and handles.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere, torus
    >>> surface_faults(torus(9, 6, 3.0, 1.0), sphere(2, 1.0), simpler=True)
    ()
    >>> surface_faults(torus(9, 6, 3.0, 1.0), sphere(2, 1.0))
    ('Euler characteristic: 2 instead of 0',)
    """
    before, after = check_mesh(given), check_mesh(result)
    faults = [
        f"{number} faces have {size} corners"
        for size, number in after.face_sizes
        if corners not in (None, size)
    ]
    if not after.n_faces:
        faults.append("there are no faces")
    faults += [item.text for item in after.findings if item.rule not in before.rules]
    counts = (
        ("bodies", before.n_components, after.n_components),
        ("boundary loops", before.n_boundary_loops, after.n_boundary_loops),
        ("Euler characteristic", before.euler, after.euler),
    )
    fewer = after.n_boundary_loops <= before.n_boundary_loops and after.euler >= before.euler
    allowed = counts[1:] if simpler and fewer else ()
    faults += [
        f"{what}: {now} instead of {once}"
        for what, once, now in counts
        if once != now and (what, once, now) not in allowed
    ]
    if (
        not faults
        and not allowed
        and sorted(map(str, before.component_genus)) != sorted(map(str, after.component_genus))
    ):
        faults.append(f"genus: {after.component_genus} instead of {before.component_genus}")
    if not faults:
        few = int(np.count_nonzero(interior_valences(build_halfedges(result))[1] < _LEAST_EDGES))
        if few:
            faults.append(agree(few, "{n} [vertex|vertices] inside with two edges only"))
    return tuple(faults)


@lru_cache(maxsize=2)
def surface_of(given: PolyMesh) -> Surface:
    """Return what is remeshed as a surface: each of its results is compared with it."""
    return Surface(*plain_triangles(triangulate(given)))


def _distance_faults(given: PolyMesh, result: PolyMesh) -> list[str]:
    """Say how the surface differs in space."""
    new = triangulate(result)
    if not triangle_normals(new).any():
        return ["no face has an area"]
    edge = float(edge_lengths(result).mean())
    surface, remade = surface_of(given), Surface(*plain_triangles(new))
    off = surface.feet(result.vertices).distances
    lost = remade.feet(given.vertices).distances
    faults = []
    if off.max() > _OFF_MAX * edge:
        faults.append(
            f"vertices are up to {off.max():.3g} off the given surface (an edge is {edge:.3g})"
        )
    if lost.mean() > _LOST_MEAN * edge or lost.max() > _LOST_MAX * edge:
        faults.append(
            f"the given vertices are up to {lost.max():.3g} off the new surface, "
            f"{lost.mean():.3g} on average (an edge is {edge:.3g}): more faces would "
            "follow it better"
        )
    near = surface.feet(face_centres(result)).normals
    outward = np.einsum("nd,nd->n", face_normals(result), near)
    reversed_share = float(np.mean(outward < 0))
    if reversed_share > _REVERSED:
        faults.append(f"{reversed_share:.0%} of the faces point the wrong way")
    return faults
