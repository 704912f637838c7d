"""Part a surface along a smooth line where faces alone would leave a ragged rim."""

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, unit
from fabweave.mesh.halfedge import group_edges
from fabweave.mesh.polymesh import PolyMesh, without_loose
from fabweave.mesh.topology import keep_faces
from fabweave.mesh.triangulate import plain_triangles, triangles_above

#: A loop is ragged if its turns go to less than this share when it is smoothed twice.
_RAGGED, _LEAST_EDGES = 0.6, 12
#: The cut is smooth over so many edges of the loop to both sides.
_REACH = 3.0
#: A vertex nearer to the cut than this share of an edge comes onto it, so that no sliver is left.
_SNAP = 0.25


def part_along_rim(mesh: PolyMesh, kept: BoolArray) -> tuple[PolyMesh, int]:
    """Return the faces that are kept, ended smoothly where their boundary is ragged.

    Beside a ragged loop a harmonic function runs from the faces that stay to those that go, and
    triangles are cut where it is zero.

    Parameters
    ----------
    mesh : PolyMesh
    kept : (F,) bool array
        The faces that stay.

    Returns
    -------
    mesh : PolyMesh
        Of triangles if a loop was ragged; else of the faces that stay.
    ragged : int
        How many loops were.
    """
    before = flags(mesh.n_vertices, group_edges(mesh).rim)
    loops = boundary_walks(keep_faces(mesh, kept))
    ragged = [one for one in loops if not before[one].any() and _ragged(mesh, one)]
    if not ragged:
        return without_loose(keep_faces(mesh, kept)), 0
    points, triangles = plain_triangles(mesh)
    stays = kept if len(triangles) == mesh.n_faces else np.repeat(kept, mesh.face_sizes)
    height = _heights(points, triangles, stays, ragged)
    near = np.isfinite(height)
    beside = near[triangles].any(axis=1)
    inside = flags(len(points), triangles[stays])
    level = np.where(near, height, np.where(inside, 1.0, -1.0))
    cut_points, parts = _cut(points, triangles[beside], level)
    every = np.concatenate([triangles[stays & ~beside], parts])
    return without_loose(PolyMesh.from_triangles(cut_points, every)), len(ragged)


def boundary_walks(mesh: PolyMesh) -> list[IntArray]:
    """Return the vertices along each boundary loop, in order; where loops touch, in parts."""
    edges = group_edges(mesh)
    half = edges.first[edges.sizes == 1]
    ahead: dict[int, list[int]] = {}
    for tail, head in zip(edges.tail[half].tolist(), edges.head[half].tolist(), strict=True):
        ahead.setdefault(tail, []).append(head)
    loops = []
    while ahead:
        loop = [next(iter(ahead))]
        while following := ahead.get(loop[-1]):
            loop.append(following.pop())
            if not following:
                del ahead[loop[-2]]
            if loop[-1] == loop[0]:
                break
        loops.append(np.array(loop[:-1]))
    return loops


def _ragged(mesh: PolyMesh, loop: IntArray) -> bool:
    """Tell whether a loop turns to and fro from edge to edge."""
    points = mesh.vertices[loop]
    before = _turns(points)
    for _ in range(2):
        points = 0.25 * (np.roll(points, 1, axis=0) + np.roll(points, -1, axis=0)) + 0.5 * points
    return len(loop) >= _LEAST_EDGES and _turns(points) < _RAGGED * before


def _turns(points: FloatArray) -> float:
    """Return by how much a closed line turns in all."""
    ways = unit(np.roll(points, -1, axis=0) - points)
    cosine = np.einsum("ij,ij->i", ways, np.roll(ways, 1, axis=0))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)).sum())


def _heights(
    points: FloatArray, triangles: IntArray, stays: BoolArray, loops: list[IntArray]
) -> FloatArray:
    """Return the harmonic function beside loops, (V,); not a number away from them."""
    count = len(points)
    rim = np.concatenate(loops)
    reach = _REACH * np.mean(
        [np.linalg.norm(points[loop] - points[np.roll(loop, 1)], axis=1).mean() for loop in loops]
    )
    one, two = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    length = np.maximum(np.linalg.norm(points[one] - points[two], axis=1), 1e-9 * reach)
    low, high = np.minimum(one, two), np.maximum(one, two)
    _, first = np.unique(low * count + high, return_index=True)
    low, high, length = low[first], high[first], length[first]
    net = csr_array((length, (low, high)), (count, count))
    away = dijkstra(net, directed=False, indices=rim, limit=reach, min_only=True)
    free = np.isfinite(away)
    # The rest of the boundary, and what is farther off, stay where they are.
    boundary = group_edges(PolyMesh.from_triangles(points, triangles)).rim
    free[np.setdiff1d(boundary, rim)] = False
    side = np.where(flags(count, triangles[stays]), 1.0, -1.0)
    weight = csr_array((1.0 / length, (low, high)), (count, count))
    weight = weight + weight.T
    system = diags_array(weight.sum(axis=1)) - weight
    known = np.where(free, 0.0, side)
    inner = np.flatnonzero(free)
    rows = system.tocsr()[inner]
    height = np.full(count, np.nan)
    height[inner] = spsolve(rows[:, inner].tocsc(), -(rows @ known))
    return height


def _cut(points: FloatArray, triangles: IntArray, level: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return points, moved and new, and what is left of triangles where a level is above zero."""
    places, level = points.copy(), level.copy()
    one, two = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    one, two = np.concatenate([one, two]), np.concatenate([two, one])
    across = level[one] * level[two] < 0.0
    one, two = one[across], two[across]
    share = level[one] / (level[one] - level[two])
    # Each vertex goes along that of its edges on which it is nearest to the cut.
    order = np.lexsort((two, share))
    vertex, first = np.unique(one[order], return_index=True)
    best = order[first][share[order[first]] < _SNAP]
    vertex = one[best]
    places[vertex] += share[best, None] * (points[two[best]] - points[vertex])
    level[vertex] = 0.0
    return triangles_above(places, triangles, level)
