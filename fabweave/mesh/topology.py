"""Find the edges, components, fans, orientations and boundary loops of any polygon mesh."""

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from fabweave.core.arrays import BoolArray, IntArray, flags, frozen_value, offsets_of
from fabweave.mesh.halfedge import EdgeGroups
from fabweave.mesh.polymesh import PolyMesh, face_of_corner

_Integers: TypeAlias = npt.NDArray[np.integer[Any]]


def label_links(first: IntArray, second: IntArray, count: int) -> tuple[int, IntArray]:
    """Label the connected components of a graph given by its links.

    Parameters
    ----------
    first, second : (N,) int arrays
        Ends of the links.
    count : int
        Number of nodes.

    Returns
    -------
    number : int
        Number of components.
    labels : (count,) int array
        Component of each node, numbered in the order of the first node of each.

    Examples
    --------
    >>> import numpy as np
    >>> label_links(np.array([0, 3]), np.array([2, 2]), 5)[1].tolist()
    [0, 1, 0, 0, 2]
    """
    if not count:
        return 0, np.zeros(0, dtype=np.int64)
    graph = csr_array((np.ones(len(first)), (first, second)), shape=(count, count))
    number, labels = connected_components(graph, directed=False)
    return int(number), labels.astype(np.int64)


def walk_from(roots: _Integers, offsets: _Integers, links: _Integers) -> tuple[IntArray, IntArray]:
    """Walk a graph from some nodes at once, step after step.

    Parameters
    ----------
    roots : (R,) int array
        Where the walks begin.
    offsets, links : (N + 1,) and (L,) int arrays
        Node ``n`` leads to ``links[offsets[n]:offsets[n + 1]]``.

    Returns
    -------
    order : (K,) int array
        The nodes that are reached, the roots first.
    before : (K,) int array
        From which node each was reached; N for the roots.

    Examples
    --------
    >>> order, before = walk_from(np.array([2]), np.array([0, 1, 1, 2]), np.array([1, 0]))
    >>> order.tolist(), before.tolist()
    ([2, 0, 1], [3, 2, 0])
    """
    count = len(offsets) - 1
    every = np.concatenate((links, roots)).astype(np.int32)
    bounds = np.append(offsets, len(every)).astype(np.int32)
    shape = (count + 1, count + 1)
    graph = csr_array((np.ones(len(every), dtype=np.int8), every, bounds), shape=shape)
    reached, came_from = breadth_first_order(graph, count, directed=True)
    return reached[1:].astype(np.int64), came_from[reached[1:]].astype(np.int64)


@frozen_value
class ParityClasses:
    """Nodes that depend on one another, each equal or opposite to its class.

    Parameters
    ----------
    classes : (N,) int array
        The class of each node, numbered in the order of the first node of each.
    opposite : (N,) bool array
        Whether a node is opposite to the first node of its class; without meaning in a class
        that contradicts itself.
    torn : (N,) bool array
        Whether its class contradicts itself.
    odd_ring : tuple of int
        Nodes in order round a ring of equations that contradict one another; empty if there is
        none.
    """

    classes: IntArray
    opposite: BoolArray
    torn: BoolArray
    odd_ring: tuple[int, ...]

    @property
    def n_classes(self) -> int:
        """Number of classes."""
        return int(self.classes.max(initial=-1)) + 1


def solve_parity(count: int, first: IntArray, second: IntArray, differ: BoolArray) -> ParityClasses:
    """Solve a system of equations, each saying that two nodes are equal or opposite.

    Two copies of every node, one for each value, are linked as the equations say. A class that
    agrees falls into two components, one that contradicts itself into one.

    Parameters
    ----------
    count : int
        Number of nodes, N.
    first, second : (M,) int arrays
        The nodes of each equation.
    differ : (M,) bool array
        Whether they are opposite.

    Returns
    -------
    ParityClasses
        The solution, but for one free choice a class, or a contradiction.

    Examples
    --------
    >>> import numpy as np
    >>> solution = solve_parity(4, np.array([0, 1]), np.array([1, 3]), np.array([True, True]))
    >>> solution.classes.tolist(), solution.opposite.tolist()
    ([0, 0, 1, 0], [False, True, False, False])
    >>> ring = np.array([1, 2, 3])
    >>> sorted(solve_parity(4, np.r_[0, ring], np.r_[1, 2, 3, 1], np.ones(4, dtype=bool)).odd_ring)
    [1, 2, 3]
    """
    across = second + count * differ
    rows = np.concatenate((first, first + count))
    columns = np.concatenate((across, (across + count) % (2 * count)))
    component = label_links(rows, columns, 2 * count)[1]
    # Of the two components of a class the smaller number stands for it: that of its first node.
    low = np.minimum(component[:count], component[count:])
    _, first_node, classes = np.unique(low, return_index=True, return_inverse=True)
    opposite = component[:count] != component[first_node[classes]]
    torn = component[:count] == component[count:]
    ring = _ring(rows, columns, int(np.argmax(torn)), count) if torn.any() else ()
    return ParityClasses(classes.reshape(-1), opposite, torn, ring)


def _ring(first: IntArray, second: IntArray, start: int, count: int) -> tuple[int, ...]:
    """Return a ring of equations that leads some node near another to its own opposite."""
    double = csr_array((np.ones(len(first)), (first, second)), shape=(2 * count, 2 * count))
    _, before = breadth_first_order(double, start, directed=False, return_predecessors=True)
    way = [start + count]
    while way[-1] != start:
        way.append(int(before[way[-1]]))
    # The way may go to a ring, round it and back again: keep the ring.
    seen: dict[int, int] = {}
    bounds = (0, len(way) - 1)
    for at, node in enumerate(way):
        since = seen.get(node % count)
        if since is not None and at - since < bounds[1] - bounds[0]:
            bounds = (since, at)
        seen[node % count] = at
    return tuple(node % count for node in way[bounds[1] : bounds[0] : -1])


def vertex_fans(edges: EdgeGroups, n_vertices: int) -> IntArray:
    """Count the fans at each vertex: groups of faces that hang together by edges there.

    A vertex of a surface has one fan; a vertex without faces has none.

    Parameters
    ----------
    edges : EdgeGroups
        The edges.
    n_vertices : int
        Number of vertices.

    Returns
    -------
    (V,) int array
        Number of fans.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import group_edges
    >>> bow_tie = PolyMesh.from_faces([[0, 0, 0]] * 5, [[0, 1, 2], [0, 3, 4]])
    >>> vertex_fans(group_edges(bow_tie), 5).tolist()
    [2, 1, 1, 1, 1]
    """
    return np.bincount(_label_fans(edges, *_neighbours(edges))[0], minlength=n_vertices)


def split_fans(mesh: PolyMesh, edges: EdgeGroups) -> tuple[PolyMesh, IntArray]:
    """Give each fan at a vertex a vertex of its own, at the same place.

    Bodies that touch only at a vertex are bodies apart then. The first fan keeps the vertex; new
    ones come after all others.

    Parameters
    ----------
    mesh : PolyMesh
    edges : EdgeGroups
        Its edges.

    Returns
    -------
    mesh : PolyMesh
    vertices : (N,) int array
        The vertices that were split, each once.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import group_edges
    >>> bow_tie = PolyMesh.from_faces([[0, 0, 0]] * 5, [[0, 1, 2], [0, 3, 4]])
    >>> apart, vertices = split_fans(bow_tie, group_edges(bow_tie))
    >>> apart.faces(), vertices.tolist(), apart.n_vertices
    ([[0, 1, 2], [5, 3, 4]], [0], 6)
    """
    return split_corners(mesh, edges, *_neighbours(edges))


def split_corners(
    mesh: PolyMesh, edges: EdgeGroups, one: IntArray, two: IntArray
) -> tuple[PolyMesh, IntArray]:
    """Give faces vertices of their own, at the same places, but where half-edges join them.

    Parameters
    ----------
    mesh : PolyMesh
    edges : EdgeGroups
        Its edges.
    one, two : (N,) int arrays
        Half-edges of one edge each, whose faces stay together there.

    Returns
    -------
    mesh : PolyMesh
    vertices : (N,) int array
        The vertices that were split, each once.
    """
    vertex, label = _label_fans(edges, one, two)
    # Fans are numbered in the order of their first corners.
    first = flags(len(vertex), np.unique(vertex, return_index=True)[1])
    own = vertex.copy()
    own[~first] = mesh.n_vertices + np.arange(np.count_nonzero(~first))
    vertices = np.concatenate((mesh.vertices, mesh.vertices[vertex[~first]]))
    return PolyMesh(vertices, mesh.offsets, own[label]), np.unique(vertex[~first])


def _neighbours(edges: EdgeGroups) -> tuple[IntArray, IntArray]:
    """Return half-edges and others of the same edge: neighbours inside a group of half-edges."""
    at = np.flatnonzero(~flags(len(edges.order), edges.starts[:-1]))
    return edges.order[at - 1], edges.order[at]


def _label_fans(edges: EdgeGroups, one: IntArray, two: IntArray) -> tuple[IntArray, IntArray]:
    """Return the vertex of each fan, and the fan of each corner, in order of corners.

    Faces hang together at both ends of the half-edges that are named.
    """
    same = edges.tail[one] == edges.tail[two]
    one_head, two_head = edges.next[one], edges.next[two]
    links_from = np.concatenate([one, one_head])
    links_to = np.concatenate([np.where(same, two, two_head), np.where(same, two_head, two)])
    number, label = label_links(links_from, links_to, len(edges.order))
    vertex = np.empty(number, dtype=np.int64)
    vertex[label] = edges.tail
    return vertex, label


def boundary_loops(edges: EdgeGroups) -> tuple[int, IntArray]:
    """Count the boundary loops: groups of boundary edges that hang together by vertices.

    Returns
    -------
    number : int
        Number of loops.
    vertex : (number,) int array
        One vertex of each loop.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import group_edges
    >>> square = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2, 3]])
    >>> boundary_loops(group_edges(square))[0]
    1
    """
    half = edges.first[edges.sizes == 1]
    vertices, place = np.unique(
        np.concatenate([edges.tail[half], edges.head[half]]), return_inverse=True
    )
    number, label = label_links(place[: len(half)], place[len(half) :], len(vertices))
    some = np.empty(number, dtype=np.int64)
    some[label] = vertices
    return number, some


def sound_faces(mesh: PolyMesh) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Sort the faces of a mesh of any content by what is wrong with each.

    Returns
    -------
    small, out_of_range, repeating : (F,) bool arrays
        Faces with fewer than three corners; with a vertex that does not exist; with the same
        vertex more than once (of those that are otherwise right).

    Examples
    --------
    >>> mesh = PolyMesh.from_faces([[0, 0, 0]] * 3, [[0, 1], [0, 1, 7], [0, 1, 0, 2], [0, 1, 2]])
    >>> [values.tolist() for values in sound_faces(mesh)]
    [[True, False, False, False], [False, True, False, False], [False, False, True, False]]
    """
    small = mesh.face_sizes < 3
    face = face_of_corner(mesh)
    wrong = (mesh.indices < 0) | (mesh.indices >= mesh.n_vertices)
    out_of_range = flags(mesh.n_faces, face[wrong])
    repeating = np.zeros(mesh.n_faces, dtype=bool)
    rows, members = sorted_faces(mesh)
    equal = (rows[1:] == rows[:-1]) & (members[1:] == members[:-1])
    repeating[rows[1:][equal]] = True
    return small, out_of_range & ~small, repeating & ~small & ~out_of_range


def sorted_faces(mesh: PolyMesh) -> tuple[IntArray, IntArray]:
    """Return the face of each corner, and the vertices of each face in rising order."""
    face = face_of_corner(mesh)
    # Numbers of vertices that do not exist are all alike here.
    vertex = np.clip(mesh.indices, -1, mesh.n_vertices) + 1
    return face, np.sort(face * (mesh.n_vertices + 2) + vertex) % (mesh.n_vertices + 2) - 1


def first_alike(mesh: PolyMesh) -> IntArray:
    """Return the first face with exactly the vertices of each face, (F,); mostly the face itself.

    Examples
    --------
    >>> mesh = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2], [1, 2, 3], [2, 1, 0]])
    >>> first_alike(mesh).tolist()
    [0, 1, 0]
    """
    members = sorted_faces(mesh)[1]
    first = np.arange(mesh.n_faces)
    for size in np.unique(mesh.face_sizes).tolist():
        faces = np.flatnonzero(mesh.face_sizes == size)
        rows = members[mesh.offsets[faces, None] + np.arange(size)]
        order = np.lexsort(rows.T)
        new = np.append(True, np.any(rows[order[1:]] != rows[order[:-1]], axis=1))
        first[faces[order]] = faces[order][np.flatnonzero(new)][np.cumsum(new) - 1]
    return first


def keep_faces(mesh: PolyMesh, keep: BoolArray) -> PolyMesh:
    """Return the mesh with some faces only, all vertices kept.

    Examples
    --------
    >>> import numpy as np
    >>> mesh = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2], [1, 2, 3]])
    >>> keep_faces(mesh, np.array([False, True])).faces()
    [[1, 2, 3]]
    """
    if keep.all():
        return mesh
    corners = np.repeat(keep, mesh.face_sizes)
    return PolyMesh(mesh.vertices, offsets_of(mesh.face_sizes[keep]), mesh.indices[corners])


def face_patches(edges: EdgeGroups, n_faces: int) -> IntArray:
    """Return the component, by shared edges, of each face, (F,).

    Examples
    --------
    >>> from fabweave.mesh.halfedge import group_edges
    >>> mesh = PolyMesh.from_faces([[0, 0, 0]] * 6, [[0, 1, 2], [3, 4, 5], [1, 0, 3]])
    >>> face_patches(group_edges(mesh), 3).tolist()
    [0, 1, 0]
    """
    first, second = edges.pairs
    return label_links(edges.face[first], edges.face[second], n_faces)[1]


def orient_faces(edges: EdgeGroups, n_faces: int) -> tuple[BoolArray, BoolArray]:
    """Find which faces to turn so that neighbours run along a common edge in opposite directions.

    The double cover holds every face twice, as it is and turned; neighbours that agree are
    linked on each sheet, neighbours that disagree across the sheets. A component of the mesh is
    orientable exactly if its cover falls into two components; on a Möbius strip it is one.
    Edges with more than two faces link nothing.

    Parameters
    ----------
    edges : EdgeGroups
        The edges.
    n_faces : int
        Number of faces.

    Returns
    -------
    turned : (F,) bool array
        Faces to turn; in each component the majority stays, and in a tie its first face.
    one_sided : (F,) bool array
        Faces of components that cannot be oriented.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import group_edges
    >>> flipped = PolyMesh.from_faces([[0, 0, 0]] * 5, [[0, 1, 2], [0, 1, 3], [1, 4, 3]])
    >>> [values.tolist() for values in orient_faces(group_edges(flipped), 3)]
    [[True, False, False], [False, False, False]]
    """
    first, second = edges.pairs
    one, two = edges.face[first], edges.face[second]
    sides = solve_parity(n_faces, one, two, edges.tail[first] == edges.tail[second])
    patch, turned = sides.classes, sides.opposite
    minority_stays = 2 * np.bincount(patch, weights=turned) > np.bincount(patch)
    return (turned ^ minority_stays[patch]) & ~sides.torn, sides.torn


def turn_faces(mesh: PolyMesh, turned: BoolArray) -> PolyMesh:
    """Reverse some faces; each keeps its first corner.

    Examples
    --------
    >>> import numpy as np
    >>> quad = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2, 3]])
    >>> turn_faces(quad, np.array([True])).faces()
    [[0, 3, 2, 1]]
    """
    face = face_of_corner(mesh)
    start = mesh.offsets[:-1][face]
    size = mesh.face_sizes[face]
    place = np.arange(mesh.n_corners) - start
    mirrored = start + (size - place) % np.maximum(size, 1)
    source = np.where(turned[face], mirrored, np.arange(mesh.n_corners))
    return PolyMesh(mesh.vertices, mesh.offsets, mesh.indices[source])
