"""Check that a remeshed surface is the surface that was given."""

from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.messages import agree
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.irregular import interior_valences
from fabweave.mesh.polymesh import PolyMesh, face_centres, next_corner, triangle_normals
from fabweave.mesh.remesh.evenness import edge_lengths
from fabweave.mesh.triangulate import triangulate

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


@dataclass(frozen=True)
class Fit:
    """How a remeshed surface agrees with the given one.

    Parameters
    ----------
    faults : tuple of str
        What is wrong; empty if the result can be used.
    off_max, lost_max : float
        Largest distance of a new vertex from the given surface, and of a given vertex from the
        new surface, in the mesh's unit; NaN if it was not measured.
    """

    faults: tuple[str, ...]
    off_max: float = np.nan
    lost_max: float = np.nan


def check_remeshed(given: PolyMesh, result: PolyMesh, corners: int | None = 4) -> Fit:
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

    Returns
    -------
    Fit
        What is wrong with the result, and how well it fits.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> check_remeshed(torus(9, 6, 3.0, 1.0), torus(12, 8, 3.0, 1.0)).faults
    ()
    >>> check_remeshed(torus(9, 6, 3.0, 1.0), torus(9, 6, 6.0, 2.0)).faults[0][:42]
    'vertices are up to 4 off the given surface'
    """
    faults = surface_faults(given, result, corners)
    # Distances are measured by foreign code that must not see a broken mesh.
    if not result.n_faces or check_mesh(result).fatal:
        return Fit(faults)
    wrong, off_max, lost_max = _distance_faults(given, result)
    return Fit((*faults, *wrong), off_max, lost_max)


def surface_faults(given: PolyMesh, result: PolyMesh, corners: int | None = 4) -> tuple[str, ...]:
    """Say how a result differs from the given surface as a surface, wherever its vertices are.

    Parameters
    ----------
    given : PolyMesh
        An oriented manifold mesh.
    result : PolyMesh
        Any mesh.
    corners : int or None
        How many corners each face should have; None for any number.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere, torus
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
    faults += [problem.message for problem in after.problems if problem.code not in before.codes]
    counts = (
        ("bodies", before.n_components, after.n_components),
        ("boundary loops", before.n_boundary_loops, after.n_boundary_loops),
        ("Euler characteristic", before.euler, after.euler),
    )
    faults += [f"{what}: {now} instead of {once}" for what, once, now in counts if once != now]
    if not faults and sorted(map(str, before.component_genus)) != sorted(
        map(str, after.component_genus)
    ):
        faults.append(f"genus: {after.component_genus} instead of {before.component_genus}")
    if not faults:
        few = int(np.count_nonzero(interior_valences(build_halfedges(result))[1] < _LEAST_EDGES))
        if few:
            faults.append(agree(few, "{n} [vertex|vertices] inside with two edges only"))
    return tuple(faults)


def _distance_faults(given: PolyMesh, result: PolyMesh) -> tuple[list[str], float, float]:
    """Say how the surface differs in space."""
    old, new = triangulate(given), triangulate(result)
    edge = float(edge_lengths(result).mean())
    off = _distances(result.vertices, old)[0]
    lost = _distances(given.vertices, new)[0]
    faults = []
    if not edge > 0 or off.max() > _OFF_MAX * edge:
        faults.append(
            f"vertices are up to {off.max():.3g} off the given surface (an edge is {edge:.3g})"
        )
    if lost.mean() > _LOST_MEAN * edge or lost.max() > _LOST_MAX * edge:
        faults.append(
            f"the given vertices are up to {lost.max():.3g} off the new surface, "
            f"{lost.mean():.3g} on average (an edge is {edge:.3g}): more faces would "
            "follow it better"
        )
    near = _distances(face_centres(result), old)[1]
    reversed_share = float(np.mean(_inward(result, triangle_normals(old)[near])))
    if reversed_share > _REVERSED:
        faults.append(f"{reversed_share:.0%} of the faces point the wrong way")
    return faults, float(off.max()), float(lost.max())


def _distances(points: FloatArray, surface: PolyMesh) -> tuple[FloatArray, IntArray]:
    """Return the distance of points from a surface of triangles, and the nearest triangles."""
    # igl takes a while to import, and most jobs never need it.
    from igl import point_mesh_squared_distance  # noqa: PLC0415 -- see above

    triangles = np.ascontiguousarray(surface.indices.reshape(-1, 3))
    square, nearest, _ = point_mesh_squared_distance(
        np.array(points), np.array(surface.vertices), triangles
    )
    return np.sqrt(np.maximum(square, 0.0)), np.asarray(nearest, dtype=np.int64).reshape(-1)


def _inward(mesh: PolyMesh, outward: FloatArray) -> FloatArray:
    """Return 1 for each face whose normal points against a given direction, else 0, (F,)."""
    here = mesh.vertices[mesh.indices]
    there = here[next_corner(mesh)]
    origin = np.repeat(face_centres(mesh), mesh.face_sizes, axis=0)
    normal = np.add.reduceat(np.cross(here - origin, there - origin), mesh.offsets[:-1], axis=0)
    return (np.einsum("ij,ij->i", normal, outward) < 0).astype(np.float64)
