"""Build half-edge arrays over a polygon mesh, by sorting."""

from functools import cached_property

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh, face_of_corner, next_corner, previous_corner


@frozen_value
class Halfedges:
    """The connectivity of an oriented manifold mesh as half-edge arrays.

    Half-edge ``h`` is corner ``h`` of the mesh: it runs from ``tail[h]`` to the tail of
    ``next[h]``, with its face on the left seen from outside.

    Parameters
    ----------
    tail, face, next, prev : (H,) int arrays
        Start vertex, face, and neighbours around the face.
    twin : (H,) int array
        The opposite half-edge, or -1 along the boundary.
    edge : (H,) int array
        Edge numbers, in the order of each edge's first half-edge.
    edge_halfedge : (E,) int array
        The first half-edge of each edge.
    """

    tail: IntArray
    face: IntArray
    next: IntArray
    prev: IntArray
    twin: IntArray
    edge: IntArray
    edge_halfedge: IntArray

    @property
    def n_halfedges(self) -> int:
        """Number of half-edges."""
        return len(self.tail)

    @property
    def n_edges(self) -> int:
        """Number of edges, boundary edges included."""
        return len(self.edge_halfedge)

    @property
    def hanging(self) -> BoolArray:
        """Which faces hang on by a single edge, (F,)."""
        return np.asarray(np.bincount(self.face, weights=self.twin >= 0) == 1)

    @property
    def head(self) -> IntArray:
        """End vertex of each half-edge, (H,)."""
        return self.tail[self.next]


def pair_corners(tail: IntArray, head: IntArray, n_vertices: int) -> tuple[IntArray, IntArray]:
    """Sort half-edges by the unordered pair of their end vertices.

    Returns
    -------
    order : (H,) int array
        Half-edges grouped by edge, in their own order inside a group.
    starts : (E + 1,) int array
        Bounds of the groups in ``order``.
    """
    code = np.minimum(tail, head) * n_vertices + np.maximum(tail, head)
    order = np.argsort(code, kind="stable")
    code = code[order]
    new = np.ones(len(code) + 1, dtype=bool)
    new[1:-1] = code[1:] != code[:-1]
    return order, np.flatnonzero(new)


@frozen_value
class EdgeGroups:
    """The half-edges of a mesh, grouped by edge; an edge may have any number of faces.

    Parameters
    ----------
    tail, head, face, next : (H,) int arrays
        Ends, face and following half-edge of each half-edge.
    order : (H,) int array
        Half-edges grouped by edge.
    starts : (E + 1,) int array
        Bounds of the groups.
    """

    tail: IntArray
    head: IntArray
    face: IntArray
    next: IntArray
    order: IntArray
    starts: IntArray

    @cached_property
    def sizes(self) -> IntArray:
        """Number of faces along each edge, (E,)."""
        return np.diff(self.starts)

    @cached_property
    def first(self) -> IntArray:
        """First half-edge of each edge, (E,)."""
        return self.order[self.starts[:-1]]

    @cached_property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """The two half-edges of every edge that has exactly two, two (N,) arrays."""
        at = self.starts[:-1][self.sizes == 2]
        return self.order[at], self.order[at + 1]

    @cached_property
    def rim(self) -> IntArray:
        """Vertices on the boundary, (R,), in rising order."""
        return np.unique(self.ends(np.flatnonzero(self.sizes == 1)))

    @cached_property
    def same_way(self) -> IntArray:
        """Edges whose two faces run along them the same way, (N,)."""
        first, second = self.pairs
        wrong: IntArray = np.flatnonzero(self.sizes == 2)[self.tail[first] == self.tail[second]]
        return wrong

    def ends(self, edges: IntArray) -> IntArray:
        """Return the end vertices of some edges, smaller number first, (N, 2)."""
        half = self.first[edges]
        return np.sort(np.column_stack([self.tail[half], self.head[half]]), axis=1)


def group_edges(mesh: PolyMesh) -> EdgeGroups:
    """Group the half-edges of a mesh by edge.

    Parameters
    ----------
    mesh : PolyMesh
        Faces that name vertices that exist.

    Returns
    -------
    EdgeGroups
        The groups.

    Examples
    --------
    >>> fin = PolyMesh.from_faces([[0, 0, 0]] * 5, [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    >>> sorted(group_edges(fin).sizes.tolist())
    [1, 1, 1, 1, 1, 1, 3]
    """
    following = next_corner(mesh)
    tail = mesh.indices
    head = tail[following]
    order, starts = pair_corners(tail, head, mesh.n_vertices)
    return EdgeGroups(tail, head, face_of_corner(mesh), following, order, starts)


def build_halfedges(mesh: PolyMesh) -> Halfedges:
    """Build the half-edge arrays of an edge-manifold, consistently oriented mesh.

    Parameters
    ----------
    mesh : PolyMesh
        Every edge in one or two faces, and two faces run along it in opposite directions.

    Returns
    -------
    Halfedges
        The connectivity.

    Raises
    ------
    InputError
        If an edge has more than two faces, or two faces that run the same way.

    Examples
    --------
    >>> tetrahedron = PolyMesh.from_faces(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
    ...     [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    >>> build_halfedges(tetrahedron).n_edges
    6
    """
    groups = group_edges(mesh)
    crowded = int(np.count_nonzero(groups.sizes > 2))
    if crowded:
        raise InputError(
            f"{crowded} edges have more than two faces; run the mesh check, which names them, "
            "and separate or remove the extra faces"
        )
    if len(groups.same_way):
        raise InputError(
            f"{len(groups.same_way)} edges have two faces that run along them in the same "
            "direction; orient the mesh first"
        )
    first, second = groups.pairs
    twin = np.full(mesh.n_corners, -1, dtype=np.int64)
    twin[first], twin[second] = second, first
    # Edge numbers follow the first half-edge of each edge, so they do not depend on how the
    # vertices are numbered.
    leading = np.flatnonzero((twin < 0) | (np.arange(mesh.n_corners) < twin))
    edge = np.empty(mesh.n_corners, dtype=np.int64)
    edge[leading] = np.arange(len(leading))
    inner = leading[twin[leading] >= 0]
    edge[twin[inner]] = edge[inner]
    return Halfedges(
        tail=groups.tail,
        face=groups.face,
        next=groups.next,
        prev=previous_corner(mesh),
        twin=twin,
        edge=edge,
        edge_halfedge=leading,
    )
