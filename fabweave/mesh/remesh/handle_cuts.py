"""Cut the handles of a surface open along short loops, so that rings can be laid around it."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.chart import loops_of
from fabweave.mesh.remesh.level_cuts import CutSurface, parts_of
from fabweave.mesh.topology import label_links

#: Loops are looked for from so many places, fewer where there are several handles, and then from so
#: many on the shortest that was found.
_PLACES, _OF_ALL, _FEWEST, _AGAIN = 12, 36, 3, 2
#: An edge at a rim counts so many times, so that no loop goes through it.
_AT_RIM = 1e6

Pair = tuple[IntArray, IntArray]


def cut_handles(mesh: PolyMesh) -> tuple[PolyMesh, list[Pair]]:
    """Cut each handle along a short loop that parts nothing.

    A shortest path tree, and an edge across which what the tree leaves of the dual graph still
    hangs together, make such a loop (tree and cotree).

    Parameters
    ----------
    mesh : PolyMesh
        One body of triangles.

    Returns
    -------
    cut : PolyMesh
        Without handles, with two more rims for each.
    pairs : list of two (K,) int arrays
        The vertices of these two, which are the same places.

    References
    ----------
    Erickson, Har-Peled, "Optimally cutting a surface into a disk", Discrete & Computational
    Geometry 31 (2004).

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.triangulate import triangulate
    >>> cut, pairs = cut_handles(triangulate(torus(24, 8, 3.0, 1.0)))
    >>> len(pairs), len(pairs[0][0]), check_mesh(cut).component_genus
    (1, 8, (0,))
    """
    n_before = mesh.n_vertices
    origin = np.arange(n_before)
    loops: list[IntArray] = []
    handles = check_mesh(mesh).genus or 0
    for _ in range(handles):
        loop = _short_loop(mesh, max(min(_PLACES, _OF_ALL // handles), _FEWEST))
        if loop is None:
            break
        loops.append(origin[loop])
        lines = np.column_stack([loop, np.roll(loop, -1)])
        triangles = mesh.indices.reshape(-1, 3)
        flat = np.zeros(mesh.n_vertices)
        (part,) = parts_of(CutSurface(mesh.vertices, flat, triangles, lines))
        mesh, origin = part.mesh, origin[part.vertex]
    half = build_halfedges(mesh)
    rims = [half.tail[loop.sides] for loop in loops_of(mesh, half)]
    pairs = []
    for loop in loops:
        one, other = (rim for rim in rims if set(origin[rim].tolist()) == set(loop.tolist()))
        at = {v: k for k, v in enumerate(origin[other].tolist())}
        pairs.append((one, other[[at[v] for v in origin[one].tolist()]]))
    return mesh, pairs


def _short_loop(mesh: PolyMesh, n_places: int) -> IntArray | None:
    """Return the vertices of a short loop that parts nothing, in order."""
    half = build_halfedges(mesh)
    faces, count = [*mesh.faces()], mesh.n_vertices
    at_rim = np.zeros(count, dtype=bool)
    for loop in loops_of(mesh, half):
        ring = half.tail[loop.sides].tolist()
        at_rim[ring] = True
        faces += [[b, a, count] for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)]
        count += 1
    points = np.concatenate([mesh.vertices, np.zeros((count - mesh.n_vertices, 3))])
    closed = build_halfedges(PolyMesh.from_faces(points, faces))
    first = closed.edge_halfedge
    ends = np.sort(np.column_stack([closed.tail[first], closed.head[first]]), axis=1)
    outside = np.concatenate([at_rim, np.ones(count - mesh.n_vertices, dtype=bool)])
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    usual = float(length[~outside[ends].any(axis=1)].sum())
    length = np.where(outside[ends].any(axis=1), _AT_RIM * usual, np.maximum(length, 1e-9 * usual))
    graph = sparse.csr_array((length, (ends[:, 0], ends[:, 1])), shape=(count, count))
    sides = np.column_stack([closed.face[first], closed.face[closed.twin[first]]])
    inside = np.flatnonzero(~outside)
    best: tuple[float, IntArray] | None = None
    near = np.full(count, np.inf)
    at = int(inside[0])
    places: list[int] = []
    for number in range(n_places + _AGAIN):
        if number == n_places and best is not None:
            places = best[1][:: max(len(best[1]) // _AGAIN, 1)].tolist()[:_AGAIN]
        if number >= n_places:
            if not places:
                break
            at = places.pop()
        tree = dijkstra(graph, directed=False, indices=np.array([at]), return_predecessors=True)
        away, before = tree[0][0], tree[1][0].astype(np.int64)
        found = _loop_of(away, before, ends, length, sides, usual)
        if found is not None and (best is None or found[0] < best[0] * (1.0 - 1e-9)):
            best = found
        near = np.minimum(near, away)
        at = int(inside[np.argmax(near[inside])])
    return None if best is None else best[1]


def _loop_of(
    away: FloatArray,
    before: IntArray,
    ends: IntArray,
    length: FloatArray,
    sides: IntArray,
    most: float,
) -> tuple[float, IntArray] | None:
    """Return the shortest loop of one edge and the tree that parts nothing, and its length."""
    in_tree = (before[ends[:, 0]] == ends[:, 1]) | (before[ends[:, 1]] == ends[:, 0])
    core = _core(sides, ~in_tree)
    total = away[ends[:, 0]] + away[ends[:, 1]] + length
    for edge in core[np.argsort(total[core], kind="stable")].tolist():
        if total[edge] >= most:
            return None
        used, number = np.unique(sides[core], return_inverse=True)
        number = number.reshape(-1, 2)[core != edge]
        if len(number) and label_links(number[:, 0], number[:, 1], len(used))[0] == 1:
            one, other = (_path(before, int(v)) for v in ends[edge])
            while len(one) > 1 and len(other) > 1 and one[-2] == other[-2]:
                one.pop()
                other.pop()
            return float(total[edge]), np.array(one + other[-2::-1])
    return None


def _core(sides: IntArray, kept: BoolArray) -> IntArray:
    """Return the links of a graph that are left when ends are taken off again and again."""
    links = np.flatnonzero(kept)
    while True:
        degree = np.bincount(sides[links].reshape(-1), minlength=int(sides.max()) + 1)
        loose = (degree[sides[links]] == 1).any(axis=1)
        if not loose.any():
            return links
        links = links[~loose]


def _path(before: IntArray, start: int) -> list[int]:
    """Return the vertices from one to the root of the tree."""
    path = [start]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return path
