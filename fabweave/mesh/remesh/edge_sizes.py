"""Split long edges of a mesh of triangles, and let short ones vanish: ribbons are as even then."""

import numpy as np
from scipy import sparse

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, unit
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh, triangle_normals
from fabweave.mesh.remesh.evenness import edge_lengths
from fabweave.mesh.remesh.model import Model, line_edges
from fabweave.mesh.triangulate import surface_area

#: Edges shorter than this share of an even mesh's edges vanish.
_SHORT = 0.4
#: Rounds of edges that vanish at once.
_MOST_ROUNDS = 50
#: No face turns farther than this cosine when an edge beside it vanishes, ...
_TURN = 0.5
#: ... and no vertex inside, or on the boundary, is left with fewer edges.
_LEAST, _LEAST_RIM = 3, 2


def even_edges(model: Model, mesh: PolyMesh, n_triangles: int) -> PolyMesh:
    """Bring a mesh to a number of triangles whose edges are neither very long nor very short.

    Parameters
    ----------
    model : Model
        Its sharp edges and its boundary stay lines.
    mesh : PolyMesh
        An oriented manifold of triangles near it, with no more of them than are wanted.
    n_triangles : int
        How many are wanted.

    Returns
    -------
    PolyMesh
        As many triangles, or one more.

    Examples
    --------
    >>> from fabweave.mesh.remesh.model import model_of
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> few = parse_shape("shape:octahedron")
    >>> even_edges(model_of(few, 6), few, 32).n_faces
    32
    """
    least = _SHORT * np.sqrt(4.0 * surface_area(mesh) / (np.sqrt(3.0) * n_triangles))
    return split_long(collapse_short(model, mesh, float(least)), n_triangles)


def split_long(mesh: PolyMesh, n_triangles: int) -> PolyMesh:
    """Split edges that are the longest of the triangles on both sides, until there are enough.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold of triangles.
    n_triangles : int
        How many triangles there should be at least.

    Returns
    -------
    PolyMesh
        The same surface, with one triangle more than asked for at the most.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> square = PolyMesh.from_faces(corners, [[0, 1, 2], [0, 2, 3]])
    >>> split_long(square, 4).vertices[4].tolist()
    [0.5, 0.5, 0.0]
    """
    while mesh.n_faces < n_triangles:
        halfedges = build_halfedges(mesh)
        length = edge_lengths(mesh)[halfedges.edge_halfedge]
        longest = _longest_of_both(halfedges, length)
        order = longest[np.lexsort((longest, -length[longest]))]
        added = np.cumsum(1 + (halfedges.twin[halfedges.edge_halfedge[order]] >= 0))
        missing = n_triangles - mesh.n_faces
        chosen = order[: np.searchsorted(added, missing) + 1]
        mesh = _split(mesh, halfedges, np.sort(chosen))
    return mesh


def _longest_of_both(halfedges: Halfedges, length: FloatArray) -> IntArray:
    """Return the edges that are the longest of their triangles; the first of equal ones."""
    edges = halfedges.edge.reshape(-1, 3)
    rank = np.empty(len(length), dtype=np.int64)
    rank[np.lexsort((np.arange(len(length)), -length))] = np.arange(len(length))
    best = edges[np.arange(len(edges)), np.argmin(rank[edges], axis=1)]
    first = halfedges.edge_halfedge
    twin = halfedges.twin[first]
    here = best[halfedges.face[first]]
    there = np.where(twin >= 0, best[halfedges.face[twin]], here)
    number = np.arange(len(length))
    return np.flatnonzero((here == number) & (there == number))


def _split(mesh: PolyMesh, halfedges: Halfedges, edges: IntArray) -> PolyMesh:
    """Put a vertex in the middle of edges, no two of which share a triangle."""
    first = halfedges.edge_halfedge[edges]
    middle = mesh.n_vertices + np.arange(len(edges))
    ends = mesh.vertices[halfedges.tail[first]] + mesh.vertices[halfedges.head[first]]
    twin = halfedges.twin[first]
    sides = np.concatenate([first, twin[twin >= 0]])
    middle = np.concatenate([middle, middle[twin >= 0]])
    tail, head = halfedges.tail[sides], halfedges.head[sides]
    tip = halfedges.tail[halfedges.prev[sides]]
    faces = mesh.indices.reshape(-1, 3).copy()
    faces[halfedges.face[sides]] = np.column_stack([tail, middle, tip])
    faces = np.concatenate([faces, np.column_stack([middle, head, tip])])
    return PolyMesh.from_triangles(np.concatenate([mesh.vertices, ends / 2.0]), faces)


def collapse_short(model: Model, mesh: PolyMesh, least_mm: float) -> PolyMesh:
    """Let edges vanish that are shorter than a length, where that leaves a sound surface.

    The ends of an edge come together in its middle; where one of them lies on a sharp edge of the
    model or on the boundary, or on more of them, there. In each round edges vanish that are the
    shortest of all near them.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
        An oriented manifold of triangles near it.
    least_mm : float

    Returns
    -------
    PolyMesh
        A surface of the same kind, with no more triangles.
    """
    barred: BoolArray = np.zeros(mesh.n_vertices, dtype=bool)  # where it was tried in vain
    for _ in range(_MOST_ROUNDS):
        halfedges = build_halfedges(mesh)
        places, sound = _meeting_places(model, mesh, halfedges)
        length = edge_lengths(mesh)[halfedges.edge_halfedge]
        first = halfedges.edge_halfedge
        ends = np.column_stack([halfedges.tail[first], halfedges.head[first]])
        sound &= (length < least_mm) & ~barred[ends].any(axis=1)
        chosen = _shortest_apart(mesh, halfedges, ends, np.where(sound, length, np.inf))
        if not len(chosen):
            break
        faces = _faces_after(mesh, ends[chosen])
        moved = mesh.vertices.copy()
        moved[ends[chosen, 0]] = moved[ends[chosen, 1]] = places[chosen]
        spoilt = _spoilt(mesh, moved, faces)
        good = chosen[~spoilt[ends[chosen]].any(axis=1)]
        bad = np.setdiff1d(chosen, good)
        barred[ends[bad]] = True
        vertices = mesh.vertices.copy()
        vertices[ends[good, 0]] = places[good]
        faces = _faces_after(mesh, ends[good])
        used = np.unique(faces)
        barred = barred[used]
        mesh = PolyMesh.from_triangles(vertices[used], np.searchsorted(used, faces))
    return mesh


def _meeting_places(
    model: Model, mesh: PolyMesh, halfedges: Halfedges
) -> tuple[FloatArray, BoolArray]:
    """Return where the ends of each edge would meet, (E, 3), and whether they may at all, (E,)."""
    first = halfedges.edge_halfedge
    u, v = halfedges.tail[first], halfedges.head[first]
    twin = halfedges.twin[first]
    line = line_edges(model, mesh, halfedges)
    count = mesh.n_vertices
    lines = np.bincount(np.concatenate([u[line], v[line]]), minlength=count)
    beside = sparse.coo_matrix((np.ones(len(u), dtype=np.int64), (u, v)), (count, count))
    near = (beside + beside.T).tocsr()
    shared = np.asarray(near[u].multiply(near[v]).sum(axis=1)).reshape(-1)
    valence = np.diff(near.indptr)
    tips = np.column_stack(
        [
            halfedges.tail[halfedges.prev[first]],
            np.where(twin >= 0, halfedges.tail[halfedges.prev[twin]], -1),
        ]
    )
    rim = np.zeros(count, dtype=bool)
    rim[[u[twin < 0], v[twin < 0]]] = True
    spare = valence > np.where(rim, _LEAST_RIM, _LEAST)
    enough = np.where(tips >= 0, spare[tips], True).all(axis=1)
    # Two points of lines would tie these together, unless the edge is of one line.
    may = (shared == 1 + (twin >= 0)) & enough & (line | (lines[u] == 0) | (lines[v] == 0))
    weight = np.where(lines[u] == lines[v], 0.5, (lines[u] > lines[v]).astype(np.float64))[:, None]
    return weight * mesh.vertices[u] + (1 - weight) * mesh.vertices[v], may


def _shortest_apart(
    mesh: PolyMesh, halfedges: Halfedges, ends: IntArray, length: FloatArray
) -> IntArray:
    """Return edges of finite length, each the shortest of all that change the same triangles."""
    some = np.flatnonzero(np.isfinite(length))
    order = some[np.lexsort((some, length[some]))]
    rank = np.full(mesh.n_vertices, len(order), dtype=np.int64)
    np.minimum.at(rank, ends[order].reshape(-1), np.repeat(np.arange(len(order)), 2))
    own = rank
    for _ in range(2):
        spread = own.copy()
        np.minimum.at(spread, halfedges.tail, own[halfedges.head])
        np.minimum.at(spread, halfedges.head, own[halfedges.tail])
        own = spread
    return np.sort(order[np.all(own[ends[order]] == np.arange(len(order))[:, None], axis=1)])


def _faces_after(mesh: PolyMesh, ends: IntArray) -> IntArray:
    """Return the triangles that are left, (T, 3), when the second end becomes the first."""
    now = np.arange(mesh.n_vertices)
    now[ends[:, 1]] = ends[:, 0]
    faces = now[mesh.indices.reshape(-1, 3)]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return faces[whole]


def _spoilt(mesh: PolyMesh, moved: FloatArray, faces: IntArray) -> BoolArray:
    """Return at which vertices, (V,), triangles turn over or run through others."""
    old, new = triangle_normals(mesh), triangle_normals(mesh.with_vertices(moved))
    turned = np.einsum("nd,nd->n", unit(old), unit(new)) < _TURN
    turned &= np.linalg.norm(new, axis=1) > 0
    bad = np.zeros(mesh.n_vertices, dtype=bool)
    bad[mesh.indices.reshape(-1, 3)[turned]] = True
    left = PolyMesh.from_triangles(moved, faces)
    through = self_intersections(left)
    if len(through) and not len(self_intersections(mesh)):
        bad[faces[through.reshape(-1)]] = True
    return bad
