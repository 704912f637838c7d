"""Build nets of tubes on a sphere: at every node an even number of tubes meet."""

import math

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.one_rings import mean_at
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import solids
from fabweave.mesh.shapes.grids import grid_quads
from fabweave.mesh.shapes.soft_tubes import settle, soft_tubes
from fabweave.mesh.upright import resize_mesh

#: Samples of each curve from node to node.
_SAMPLES = 33
#: Radius of tubes: of those between nodes on a polyhedron, of meridians, and of tubes between nodes
#: on the equator; all as shares of how far curves are from one another.
_ON_SOLID, _ON_POLES, _ON_EQUATOR = 0.12, 0.17, 0.13
#: Over this share of a tube's length it widens to its node; and the width of the bell that rounds
#: tubes off, in radii.
_FLARE, _BLEND = 0.5, 0.8
#: By number of faces; the dual of a solid has the same edges' middles.
_SOLIDS = {4: solids.tetrahedron, 6: solids.cube, 12: solids.dodecahedron}


def cage(faces: int, m: int, n: int, size: float) -> PolyMesh:
    """Return tubes that join the middles of neighbouring edges of a regular polyhedron.

    Four tubes meet at each of the E nodes, where E is the number of edges, so the genus is E + 1.
    Each tube has a line along its outside and one along its inside, and these lines meet in two
    vertices of valence 8 at each node, outside and inside; between them the tube's two sides are
    quads: a regular mesh (4, 8, E + 1). Neighbouring tubes can be given opposite directions (around
    the solid's faces one way, around its vertices the other), so quads keep theirs around every
    loop, and the mesh has an exact 2/2 twill if m or n / 2 is even.

    Parameters
    ----------
    faces : int
        Faces of the polyhedron: 4, 6 or 12. Tubes run along the edges of an octahedron, of a
        cuboctahedron or of an icosidodecahedron.
    m, n : int
        Quads along and around each tube, n even; m may be 0, for quads that are about square.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        A closed surface of ``2 E · m · n`` quads.

    Raises
    ------
    InputError
        If there is no such polyhedron, or the counts do not fit.

    Examples
    --------
    >>> mesh = cage(4, 6, 8, 100.0)
    >>> mesh.n_vertices - mesh.n_faces, np.bincount(np.bincount(mesh.indices))[[4, 8]].tolist()
    (-12, [552, 12])
    """
    if faces not in _SOLIDS:
        raise InputError(
            f"the shape cage: no regular polyhedron with {faces} faces is known here; choose 4, 6 "
            "or 12 (8 gives the same net as 6, and 20 the same as 12)"
        )
    m = m or n
    if n % 2 or (m % 2 and n % 4):
        raise InputError(
            f"the shape cage: n ({n}) must be even, and for a twill m ({m}) or n / 2 as well; make "
            "n a multiple of 4"
        )
    solid = _SOLIDS[faces]()
    half = build_halfedges(solid)
    heads = half.tail[half.next]
    middle = solid.vertices[half.tail] + solid.vertices[heads]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    nodes = np.zeros((half.n_edges, 3))
    nodes[half.edge] = middle
    ends = np.column_stack((half.edge, half.edge[half.next]))
    curves = _great_arcs(nodes[ends[:, 0]], nodes[ends[:, 1]])
    apart = math.acos(float(nodes[ends[0, 0]] @ nodes[ends[0, 1]]))
    mesh = tube_net(nodes, ends, curves, _ON_SOLID * apart, along=m, across=n // 2)
    return resize_mesh(mesh, size_mm=size)[0]


def necklace(tubes: int, nodes: int, along: int, across: int, size: float) -> PolyMesh:
    """Return nodes in a ring, each joined to the next one by some tubes.

    With an even number of nodes, the outer vertex of one node and the inner one of the next can be
    of one sort, and the others of the other: each quad between them joins two of either sort. One
    sort are the vertices of a regular mesh, the other are the middles of its faces:
    (4 k, 4 k, 1 + nodes (k - 1)), where k is the number of tubes. Two nodes are the poles of a
    lantern of 2 k tubes.

    Parameters
    ----------
    tubes : int
        Tubes between neighbours, 2 or more.
    nodes : int
        Number of nodes, even.
    along, across : int
        Quads along each tube, and over half of its circumference.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        A closed surface of ``2 · nodes · tubes · along · across`` quads.

    Examples
    --------
    >>> mesh = necklace(2, 4, 8, 4, 100.0)
    >>> mesh.n_vertices - mesh.n_faces, np.bincount(np.bincount(mesh.indices))[[4, 8]].tolist()
    (-8, [496, 8])
    """
    share = np.linspace(0.0, 1.0, _SAMPLES)
    if nodes == 2:
        radius = _ON_POLES * math.pi / tubes
        turn: FloatArray = np.arange(2.0 * tubes)[:, None] * (math.pi / tubes)
        places = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
        ends = np.tile([0, 1], (2 * tubes, 1))
        curves = _on_sphere(turn, math.pi * (0.5 - share))
    else:
        step = 2.0 * math.pi / nodes
        radius = 2.0 * _ON_EQUATOR * step / tubes
        first = step * np.repeat(np.arange(nodes), tubes)
        # Tubes leave a node with equal angles between them.
        way = (np.arange(tubes) - (tubes - 1) / 2) * (math.pi / tubes)
        rise = np.tile(np.tan(way), nodes) * step / math.pi
        ends = np.repeat(np.arange(nodes), tubes)
        ends = np.column_stack((ends, (ends + 1) % nodes))
        turn = first[:, None] + step * share
        curves = _on_sphere(turn, rise[:, None] * np.sin(math.pi * share))
        places = _on_sphere(step * np.arange(float(nodes)), np.zeros(nodes))
    mesh = tube_net(places, ends, curves, radius, along=along, across=across)
    return resize_mesh(mesh, size_mm=size)[0]


def tube_net(
    nodes: FloatArray, ends: IntArray, curves: FloatArray, radius: float, *, along: int, across: int
) -> PolyMesh:
    """Return the surface of tubes along curves on the unit sphere, as quads.

    Each tube is two strips, left and right of its line along the outside. Strips that are
    neighbours at a node share a line there, from the outer vertex of the node to the inner one.

    Parameters
    ----------
    nodes : (N, 3) float array
        Places on the unit sphere.
    ends : (T, 2) int array
        The nodes that each tube joins.
    curves : (T, S, 3) float array
        Places along each tube on the unit sphere, from node to node.
    radius : float
        Radius of tubes, where the sphere has 1.
    along, across : int
        Quads along each strip, and across it.

    Returns
    -------
    PolyMesh
        Two vertices at each node with twice as many edges as tubes, and all others with four.
    """
    count, tubes = len(nodes), len(ends)
    # Half-tubes leave their nodes, 2 t the first end of tube t, and 2 t + 1 the other.
    leaving = np.stack((curves[:, 1] - curves[:, 0], curves[:, -2] - curves[:, -1]), axis=1)
    node = ends.reshape(-1)
    after, wedge = _corners(nodes[node], leaving.reshape(-1, 3), node)
    before = np.argsort(after)
    # The corner of a half-tube lies to its left, as seen from outside.
    first, last = 2 * np.arange(tubes), 2 * np.arange(tubes) + 1
    inner = across - 1
    number = np.empty((2, tubes, along + 1, across + 1), dtype=np.int64)
    crotch = 2 * count + inner * np.arange(2 * tubes)[:, None] + np.arange(inner)
    total = 2 * count + 2 * tubes * inner
    lines = total + np.arange(2 * tubes * (along - 1)).reshape(2, tubes, -1)
    total += lines.size
    number[:, :, 1:-1, 1:-1] = total + np.arange(2 * tubes * (along - 1) * inner).reshape(
        2, tubes, along - 1, inner
    )
    for side, corners in enumerate(((first, before[last]), (before[first], last))):
        for end, corner in zip((0, -1), corners, strict=True):
            number[side, :, end, 0] = ends[:, end]
            number[side, :, end, -1] = count + ends[:, end]
            number[side, :, end, 1:-1] = crotch[corner]
        number[side, :, 1:-1, 0], number[side, :, 1:-1, -1] = lines
    grid = grid_quads(along, across, wrap=(False, False))
    quads = number.reshape(2, tubes, -1)[:, :, grid]
    quads = np.concatenate((quads[0], quads[1][..., ::-1])).reshape(-1, 4)
    ways = np.stack((wedge[first], wedge[before[last]], wedge[before[first]], wedge[last]))
    places = _first_places(curves, ways.reshape(2, 2, tubes, 3), radius, along, across)
    mesh = PolyMesh.from_faces(mean_at(number.reshape(-1), places), quads)
    surface = soft_tubes(list(curves), radius=radius, blend=_BLEND * radius, closed=False)
    return settle(mesh, surface)


def _corners(nodes: FloatArray, leaving: FloatArray, node: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the half-tube to the left of each, and the way to the corner between, in radii."""
    across = np.eye(3)[np.argmin(np.abs(nodes), axis=1)]
    across = np.cross(nodes, across)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(nodes, across)
    angle = np.arctan2((leaving * up).sum(axis=1), (leaving * across).sum(axis=1))
    order = np.lexsort((angle, node))
    starts = np.flatnonzero(np.diff(node[order], prepend=-1))
    following = np.roll(order, -1)
    following[np.append(starts[1:], len(order)) - 1] = order[starts]
    after = np.empty_like(order)
    after[order] = following
    half = np.mod(angle[after] - angle, 2.0 * math.pi) / 2.0
    turn = angle + half
    way = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * up
    return after, way / np.sin(half)[:, None]


def _first_places(
    curves: FloatArray, ways: FloatArray, radius: float, along: int, across: int
) -> FloatArray:
    """Return where the corners of the quads of all strips stand at first, left strips first."""
    share = np.linspace(0.0, _SAMPLES - 1.0, along + 1)
    low = np.minimum(share.astype(np.int64), _SAMPLES - 2)
    part = (share - low)[:, None]
    middle = curves[:, low] * (1.0 - part) + curves[:, low + 1] * part
    out = middle / np.linalg.norm(middle, axis=-1, keepdims=True)
    left = np.cross(out, curves[:, low + 1] - curves[:, low])
    left /= np.linalg.norm(left, axis=-1, keepdims=True)
    turn = np.linspace(0.0, math.pi, across + 1)[:, None]
    near = np.maximum(0.0, 1.0 - np.linspace(0.0, 1.0 / _FLARE, along + 1))[:, None]
    places = []
    for side, (begin, end) in zip((left, -left), ways, strict=True):
        wide = side + near * (begin[:, None] - side) + near[::-1] * (end[:, None] - side)
        ring = np.cos(turn) * out[:, :, None] + np.sin(turn) * wide[:, :, None]
        places.append(middle[:, :, None] + radius * ring)
    return np.concatenate(places).reshape(-1, 3)


def _great_arcs(start: FloatArray, stop: FloatArray) -> FloatArray:
    """Return places along the shorter great arcs between places on the unit sphere."""
    angle = np.arccos((start * stop).sum(axis=1))[:, None, None]
    share = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    parts = np.sin((1.0 - share) * angle) * start[:, None] + np.sin(share * angle) * stop[:, None]
    return np.asarray(parts / np.sin(angle))


def _on_sphere(turn: FloatArray, rise: FloatArray) -> FloatArray:
    """Return places on the unit sphere by longitude and latitude, in radians."""
    turn, rise = np.broadcast_arrays(turn, rise)
    flat = np.cos(rise)
    return np.stack((flat * np.cos(turn), flat * np.sin(turn), np.sin(rise)), axis=-1)
