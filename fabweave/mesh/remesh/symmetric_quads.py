"""Remesh half of a mirror-symmetric surface to quads, and join it to its mirror image."""

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import Progress, no_progress
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.irregular import find_irregular, interior_valences
from fabweave.mesh.likeness import likeness
from fabweave.mesh.mirror import Mirror, find_mirror
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import AttemptFailedError, Engine
from fabweave.mesh.remesh.fit import fit
from fabweave.mesh.remesh.halves import half_of, joined_with_image
from fabweave.mesh.remesh.model import Model, model_of
from fabweave.mesh.remesh.remesh_check import check_remeshed, surface_faults
from fabweave.mesh.remesh.runs import LARGE, results, seam_runs

#: A symmetric result is not worse than another up to these factors, in its distances from the model
#: and in its irregular vertices, which come in pairs.
_FARTHER, _MORE_IRREGULAR = 1.2, 1.3
#: Boundary vertices of half an open surface nearer to the mirror than this share of the size belong
#: on it; of a closed one, all do.
_REACH = 0.01
#: Turns of fitting and of making symmetric again, and the rounds of each fit.
_TURNS, _ROUNDS = 3, 3


def symmetric_quads(
    engine: Engine,
    source: PolyMesh,
    surface: PolyMesh,
    wanted: int,
    *,
    seed: int = 0,
    progress: Progress = no_progress,
) -> tuple[PolyMesh | None, str]:
    """Remesh half of a surface so that its boundary is on the mirror, and join it to its image.

    Where two quads met at the seam in a vertex with two edges, they become one. Then the whole is
    fitted to the surface, and kept symmetric.

    Parameters
    ----------
    engine : Engine
        The remesher.
    source, surface : PolyMesh
        The given surface, and triangles that the remesher sees.
    wanted : int
        About how many quads both halves have.
    seed : int
        The first seed.
    progress : callable
        Told about each run.

    Returns
    -------
    result : PolyMesh or None
        Exactly symmetric, and with the topology of the given surface; None if that is not symmetric
        or nothing sound came of it.
    why : str
        Why nothing did; empty where there is a result, or no symmetry.
    """
    mirror = find_mirror(surface)
    if not mirror.symmetric:
        return None, ""
    half = half_of(surface, mirror)
    report = check_mesh(half)
    if not half.n_faces or report.fatal or report.closed:
        return None, "its halves are no surfaces"
    size = float(np.ptp(surface.vertices, axis=0).max())
    reach = np.inf if check_mesh(source).closed else _REACH * size
    model = model_of(source, wanted)
    good: list[tuple[bool, float, PolyMesh]] = []
    why: list[str] = []
    runs = seam_runs(engine, wanted // 2, seed, large=half.n_faces > LARGE)
    for _, found in results(engine, half, runs, progress):
        if isinstance(found, AttemptFailedError):
            why.append(str(found))
            continue
        result, faults = _joined(found, half, mirror, reach)
        if not faults:
            result = _fitted(model, result, mirror)
            faults = check_remeshed(source, result).faults
        if faults:
            why.append("; ".join(faults))
            continue
        clashes = len(self_intersections(result)) > 0
        good.append((clashes, likeness(source, result).in_rms_mm, result))
    if not good:
        return None, min(why, key=len)
    return min(good, key=lambda one: one[:2])[2], ""


def _joined(
    found: PolyMesh, half: PolyMesh, mirror: Mirror, reach: float
) -> tuple[PolyMesh, tuple[str, ...]]:
    """Join half a result to its image; say what is wrong with it."""
    faults = surface_faults(half, found)
    if faults:
        return found, faults
    joined = joined_with_image(found, mirror, reach)
    if check_mesh(joined).fatal:
        return joined, ("the halves do not join to a surface",)
    return without_doublets(joined), ()


def _fitted(model: Model, mesh: PolyMesh, mirror: Mirror) -> PolyMesh:
    """Fit a symmetric mesh to a model so that it stays symmetric."""
    partner = cKDTree(mesh.vertices).query(mirror.image(mesh.vertices))[1]
    for _ in range(_TURNS):
        points = fit(model, mesh, _ROUNDS).vertices
        mesh = mesh.with_vertices((points + mirror.image(points[partner])) / 2.0)
    return mesh


def without_doublets(mesh: PolyMesh) -> PolyMesh:
    """Return a mesh of quads in which no two lie on one another around a vertex with two edges.

    The two become one quad, and the vertex goes; that may make another such vertex, and so on.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> faces = cube().indices.reshape(-1, 4).tolist()
    >>> a, p, c, q = faces[0]
    >>> points = np.concatenate([cube().vertices, cube().vertices[[p]]])
    >>> doubled = PolyMesh.from_faces(points, [[8, a, p, c], [8, c, q, a], *faces[1:]])
    >>> without_doublets(doubled).n_faces, without_doublets(doubled).n_vertices
    (6, 8)
    """
    while True:
        vertices, valences = interior_valences(build_halfedges(mesh))
        faces = [face.tolist() for face in mesh.indices.reshape(-1, 4)]
        gone: set[int] = set()
        new = []
        for vertex in vertices[valences == 2].tolist():
            one, two = (at for at, face in enumerate(faces) if vertex in face)
            (a, p, c), (_, q, _) = (_after(faces[at], vertex) for at in (one, two))
            if p != q and not gone & {one, two}:
                gone |= {one, two}
                new.append([a, p, c, q])
        if not new:
            return mesh
        kept = np.array([*(face for at, face in enumerate(faces) if at not in gone), *new])
        used, indices = np.unique(kept, return_inverse=True)
        mesh = PolyMesh.from_faces(mesh.vertices[used], indices.reshape(-1, 4))


def _after(face: list[int], vertex: int) -> list[int]:
    """Return the other corners of a face, in order from one."""
    at = face.index(vertex)
    return face[at + 1 :] + face[:at]


def not_worse(source: PolyMesh, symmetric: PolyMesh, whole: PolyMesh) -> bool:
    """Whether a symmetric mesh of quads is about as good as another.

    That is: its distances from the model, root mean square and greatest, are no more by more than a
    fifth, its irregular vertices by no more than three tenths, there are no more of them on the
    boundary, and it runs through itself in no more places.
    """
    one, two = likeness(source, symmetric), likeness(source, whole)
    odd, usual = find_irregular(symmetric), find_irregular(whole)
    return (
        one.in_rms_mm <= _FARTHER * two.in_rms_mm
        and one.greatest_mm <= _FARTHER * two.greatest_mm
        and len(odd) <= _MORE_IRREGULAR * len(usual)
        and odd.boundary.sum() <= usual.boundary.sum()
        and len(self_intersections(symmetric)) <= len(self_intersections(whole))
    )
