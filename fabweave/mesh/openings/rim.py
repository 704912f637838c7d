"""Move the rim of an opening onto its circle, along the surface, as far as faces stay sound."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.mesh.polymesh import PolyMesh, face_centres, face_of_corner, next_corner

#: A vertex goes the whole way, or so many steps of it less.
_STEPS = 8
#: A corner is sound if its sides turn by so much at least (the sine of 10°), a face if its normal
#: turns by 60° at most and it keeps a quarter of its area.
_LEAST_TURN, _LEAST_COSINE, _LEAST_SHARE = 0.1736, 0.5, 0.25
#: How far outside a triangle in plan a point may be, as a share of it.
_WITHIN = 1e-9


def rim_on_circle(
    surface: PolyMesh, kept: PolyMesh, rim: IntArray, centre: FloatArray, radius: float
) -> FloatArray:
    """Move vertices of a rim onto a circle in plan, along a surface.

    Each goes straight to the circle or away from its middle as seen from above, and up or down with
    the surface; where the surface does not reach the circle, it stays. Where a face would get
    unsound, its vertices go less far, in eighths of the way.

    Parameters
    ----------
    surface : PolyMesh
        The faces along which the rim may go.
    kept : PolyMesh
        The faces that stay, with the same vertices.
    rim : (R,) int array
        The vertices that may move.
    centre : (2,) float array
        The middle of the circle in plan.
    radius : float

    Returns
    -------
    (V, 3) float array
        All vertices, those of the rim where they went.

    Examples
    --------
    >>> flat = PolyMesh.from_faces([[1.0, 0, 0], [3, -1, 0], [3, 1, 0]], [[0, 1, 2]])
    >>> rim_on_circle(flat, flat, np.array([0]), np.zeros(2), 1.5)[0].tolist()
    [1.5, 0.0, 0.0]
    """
    start = kept.vertices
    goal = start.copy()
    goal[rim] = _on_surface(surface, start[rim], centre, radius)
    share = np.zeros(len(start))
    share[rim] = _STEPS
    while True:
        moved = start + (share / _STEPS)[:, None] * (goal - start)
        back = _unsound(kept, start, moved) & (share > 0)
        if not back.any():
            return moved
        share[back] -= 1.0


def _on_surface(
    surface: PolyMesh, points: FloatArray, centre: FloatArray, radius: float
) -> FloatArray:
    """Return where points go in plan and with the surface; they stay where it does not reach."""
    centres, face = face_centres(surface), face_of_corner(surface)
    here = surface.vertices[surface.indices]
    triangles = np.stack([centres[face], here, here[next_corner(surface)]], axis=1)
    goals = points.copy()
    for number, point in enumerate(points):
        way = point[:2] - centre
        far = float(np.linalg.norm(way))
        if far > 0.0:
            goal = centre + way * (radius / far)
            heights = _heights(triangles, goal)
            if len(heights):
                nearest = heights[np.argmin(np.abs(heights - point[2]))]
                goals[number] = [*goal, nearest]
    return goals


def _heights(triangles: FloatArray, place: FloatArray) -> FloatArray:
    """Return the heights of triangles (T, 3, 3) at a place in plan, of those that are there."""
    a, b, c = (triangles[:, k, :2] for k in range(3))
    one, two, to = b - a, c - a, place - a
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        v = (to[:, 0] * two[:, 1] - to[:, 1] * two[:, 0]) / area
        w = (one[:, 0] * to[:, 1] - one[:, 1] * to[:, 0]) / area
    there = (v >= -_WITHIN) & (w >= -_WITHIN) & (v + w <= 1.0 + _WITHIN)
    z = triangles[there, :, 2]
    u, v, w = 1.0 - v[there] - w[there], v[there], w[there]
    return np.asarray(u * z[:, 0] + v * z[:, 1] + w * z[:, 2])


def _unsound(mesh: PolyMesh, start: FloatArray, moved: FloatArray) -> np.ndarray:
    """Return the vertices that make a face unsound, (V,)."""
    before, now = _areas(mesh, start), _areas(mesh, moved)
    long_before, long_now = np.linalg.norm(before, axis=1), np.linalg.norm(now, axis=1)
    along = np.einsum("fd,fd->f", before, now)
    bad_face = (along < _LEAST_COSINE * long_before * long_now) | (
        long_now < _LEAST_SHARE * long_before
    )
    face, ahead = face_of_corner(mesh), next_corner(mesh)
    back = np.empty_like(ahead)
    back[ahead] = np.arange(len(ahead))
    turn = _turns(mesh, moved, now[face], ahead, back)
    # A corner that was so before is no work of the rim.
    bad = (turn < _LEAST_TURN) & (turn < _turns(mesh, start, before[face], ahead, back))
    changed = (moved != start).any(axis=1)
    found = np.zeros(len(start), dtype=bool)
    found[mesh.indices[bad_face[face]]] = True
    # If the corner itself stays where it was, its neighbours have come too near.
    own = changed[mesh.indices]
    found[mesh.indices[bad & own]] = True
    found[mesh.indices[ahead[bad & ~own]]] = True
    found[mesh.indices[back[bad & ~own]]] = True
    return found & changed


def _areas(mesh: PolyMesh, points: FloatArray) -> FloatArray:
    """Return the vector areas of faces, twice, (F, 3)."""
    here = points[mesh.indices]
    there = here[next_corner(mesh)]
    origin = points[mesh.indices[mesh.offsets[:-1]]][face_of_corner(mesh)]
    return np.add.reduceat(np.cross(here - origin, there - origin), mesh.offsets[:-1], axis=0)


def _turns(
    mesh: PolyMesh, points: FloatArray, normals: FloatArray, ahead: IntArray, back: IntArray
) -> FloatArray:
    """Return the sine by which the boundary of a face turns at each corner, (H,)."""
    here = points[mesh.indices]
    arrive, leave = here - here[back], here[ahead] - here
    sine = np.einsum("hd,hd->h", np.cross(arrive, leave), normals)
    size = np.linalg.norm(arrive, axis=1) * np.linalg.norm(leave, axis=1)
    whole = size * np.linalg.norm(normals, axis=1)
    return np.asarray(sine / np.where(whole > 0.0, whole, 1.0))
