"""Trace the threads of a mesh: the straight-ahead walks of its medial graph."""

from dataclasses import field

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, flags, frozen_value, offsets_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.topology import walk_from


def order_states(successor: IntArray, count: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Return one direction of every walk of a permutation that holds each walk in both.

    State ``s`` and state ``s + count`` (modulo ``2 count``) are the same place passed the two
    ways, so the reverse of a walk visits the partners of its states in reverse order. Of the two,
    the walk that holds the smallest state is kept.

    Parameters
    ----------
    successor : (2 N,) int array
        The state that follows each state; -1 where the walk ends. Injective apart from the -1.
    count : int
        The number of places, N.

    Returns
    -------
    states : (K,) int array
        The states of the kept walks, walk after walk, in walking order.
    walk : (K,) int array
        The walk of each of them, 0 upwards in the order of the first states.
    closed : (W,) bool array
        Whether each walk is a cycle; one that is not begins at the state that nothing precedes.

    Examples
    --------
    Two places, joined in a ring:

    >>> import numpy as np
    >>> states, walk, closed = order_states(np.array([1, 0, 3, 2]), 2)
    >>> states.tolist(), walk.tolist(), closed.tolist()
    ([0, 1], [0, 0], [True])
    """
    n_states = len(successor)
    states = np.arange(n_states, dtype=np.int32)
    goes_on = successor >= 0
    links = sparse.csr_array(
        (
            np.ones(np.count_nonzero(goes_on), dtype=np.int8),
            successor[goes_on].astype(np.int32),
            np.concatenate(([0], np.cumsum(goes_on))).astype(np.int32),
        ),
        shape=(n_states, n_states),
    )
    n_walks, walk = csgraph.connected_components(links, directed=True, connection="weak")
    smallest = np.empty(n_walks, dtype=np.int64)
    smallest[walk[::-1]] = states[::-1]  # the last write wins, which is the smallest state
    # The same corner passed the other way lies in the reverse of the walk.
    reverse_walk = walk[(smallest + count) % n_states]
    kept = smallest < smallest[reverse_walk]
    has_predecessor = flags(n_states, successor[goes_on])
    starts = np.flatnonzero(~has_predecessor)
    first = smallest.copy()
    first[walk[starts]] = starts
    closed = ~flags(n_walks, walk[starts])

    first, closed = first[kept], closed[kept]
    by_first = np.argsort(first, kind="stable")
    first, closed = first[by_first], closed[by_first]
    new_number = np.full(n_walks, -1, dtype=np.int32)
    new_number[walk[first]] = np.arange(len(first))
    # Side by side each walk is visited in its own order; the stable sort puts every walk together.
    ordered, _ = walk_from(first, links.indptr, links.indices)
    number = new_number[walk[ordered]]
    by_thread = np.argsort(number, kind="stable")
    return ordered[by_thread], number[by_thread].astype(np.int64), closed


@frozen_value
class Threads:
    """The threads of a weave as walks over crossings, in compressed rows.

    A *pass* is one visit of a thread to a crossing. Every crossing has two passes, one that
    arrives *forward* and one that arrives *backward*, whichever way the threads are walked.

    Parameters
    ----------
    offsets : (T + 1,) int array
        Thread ``t`` owns the passes ``offsets[t]:offsets[t + 1]``, in walking order.
    crossing : (P,) int array
        The crossing of each pass. Crossings are the interior edges in the order of edge numbers.
    halfedge : (P,) int array
        The half-edge of the crossed edge whose face the thread comes from.
    forward : (P,) bool array
        Whether the thread arrives from the corner at the half-edge's tail (and so from the left).
    closed : (T,) bool array
        Whether the thread is a ring; open threads end at boundary edges.
    crossing_halfedge : (X,) int array
        The first half-edge of each crossing's edge.
    turn_pass, turn_halfedge : (B,) int arrays
        Where threads turn back at the boundary: the pass after which (and before the next one of
        the ring), and the boundary half-edge, in walking order. Empty on closed meshes and where
        threads end at the boundary. Threads without any pass have no turns here either.
    """

    offsets: IntArray
    crossing: IntArray
    halfedge: IntArray
    forward: BoolArray
    closed: BoolArray
    crossing_halfedge: IntArray
    turn_pass: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    turn_halfedge: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def n_threads(self) -> int:
        """Number of threads, those without any crossing included."""
        return len(self.offsets) - 1

    @property
    def lengths(self) -> IntArray:
        """Number of passes of each thread, (T,)."""
        return np.diff(self.offsets)

    @property
    def woven(self) -> BoolArray:
        """Which threads cross anything, (T,); the others are left out."""
        return self.lengths > 0

    @property
    def thread_of_pass(self) -> IntArray:
        """The thread of each pass, (P,)."""
        return np.repeat(np.arange(self.n_threads), self.lengths)

    @property
    def n_crossings(self) -> int:
        """Number of crossings."""
        return len(self.crossing_halfedge)

    @property
    def turn_forward(self) -> BoolArray:
        """Whether each turn follows its half-edge (else it runs against it), (B,)."""
        # A crossing swaps the direction and a turn keeps it.
        return ~self.forward[self.turn_pass]


def corner_successor(halfedges: Halfedges, *, turn: bool = False) -> IntArray:
    """Return the straight-ahead successor of every directed corner.

    State ``h`` passes the corner between ``edge(h)`` and ``edge(next(h))`` forward, state
    ``H + h`` passes it backward. A forward pass goes on along ``edge(next(h))``, a backward pass
    along ``edge(h)``. The thread goes on in the other face and in the other direction.

    A boundary edge has no other side. There the thread ends or, with ``turn``, runs along it into
    the other corner at that edge in the same face: in the medial graph the node of a boundary edge
    joins its two corner arcs. The successor is then a permutation, so every thread is closed.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of an oriented manifold mesh.
    turn : bool
        Whether threads turn back at boundary edges; otherwise they end there.

    Returns
    -------
    (2 H,) int array
        The following state, or -1 where the thread ends at a boundary edge.

    References
    ----------
    Akleman, Chen, Xing, Gross, "Cyclic plain-weaving on polygonal mesh surfaces with graph
    rotation systems", ACM TOG 28(3), 2009: face tracing of an extended rotation system.
    """
    count = halfedges.n_halfedges
    inner = halfedges.twin >= 0
    # Along each half-edge from its tail on the left, and from its head on the right.
    onwards = np.where(
        inner, halfedges.prev[halfedges.twin] + count, np.arange(count) if turn else -1
    )
    back = np.where(inner, halfedges.twin, halfedges.prev + count if turn else -1)
    return np.concatenate((onwards[halfedges.next], back))


def trace_threads(halfedges: Halfedges, *, turn: bool = False) -> Threads:
    """Trace every thread once.

    The successor of a directed corner is a permutation (on an open mesh, a partial one); threads
    are its cycles and paths. Each is found in both directions, and the one that holds the
    smallest state is kept, so the result depends on nothing but the half-edges.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of an oriented manifold mesh; boundaries are allowed.
    turn : bool
        Whether threads turn back at the boundary; otherwise they end there. Nothing else changes:
        crossings are the interior edges either way, and a thread's passes go on arriving forward
        and backward in turn.

    Returns
    -------
    Threads
        Closed threads start at their smallest corner, open ones at the end that comes first.

    Examples
    --------
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> tetrahedron = PolyMesh.from_faces(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
    ...     [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    >>> trace_threads(build_halfedges(tetrahedron)).lengths.tolist()
    [4, 4, 4]

    On a mat of two by three squares, one thread goes round all the crossings:

    >>> from fabweave.mesh.shapes.grids import hypar
    >>> mat = trace_threads(build_halfedges(hypar(2, 3, 1.0, 0.0)), turn=True)
    >>> mat.lengths.tolist(), mat.closed.tolist(), len(mat.turn_pass)
    ([14], [True], 10)
    """
    count = halfedges.n_halfedges
    states, thread, closed = order_states(corner_successor(halfedges, turn=turn), count)
    backward = states >= count
    corner = np.where(backward, states - count, states)
    # A forward pass of a corner arrives at edge(next) from its tail, a backward one at edge(h).
    arrival = np.where(backward, corner, halfedges.next[corner])
    crosses = halfedges.twin[arrival] >= 0
    lengths = np.bincount(thread[crosses], minlength=len(closed))
    interior = halfedges.edge_halfedge[halfedges.twin[halfedges.edge_halfedge] >= 0]
    offsets = offsets_of(lengths)
    none = np.zeros(0, dtype=np.int64)
    turn_pass, turn_state = _place_turns(offsets, thread, crosses) if turn else (none, none)
    turn_halfedge = arrival[turn_state]
    arrival = arrival[crosses]
    return Threads(
        offsets=offsets,
        crossing=crossing_of_halfedges(halfedges, interior)[arrival],
        halfedge=arrival,
        forward=~backward[crosses],
        closed=closed,
        crossing_halfedge=interior,
        turn_pass=turn_pass,
        turn_halfedge=turn_halfedge,
    )


def crossing_of_halfedges(halfedges: Halfedges, crossing_halfedge: IntArray) -> IntArray:
    """Return the crossing of each half-edge's edge, (H,); -1 on the boundary."""
    crossing = np.full(halfedges.n_edges, -1, dtype=np.int64)
    crossing[halfedges.edge[crossing_halfedge]] = np.arange(len(crossing_halfedge))
    return crossing[halfedges.edge]


def _place_turns(
    offsets: IntArray, thread: IntArray, crosses: BoolArray
) -> tuple[IntArray, IntArray]:
    """Return for each turn the pass before it and its state, in the order of rings from a pass.

    Turns before the first pass of a ring follow those after its last one.
    """
    state = np.flatnonzero(~crosses & (np.diff(offsets)[thread] > 0))
    ring = thread[state]
    before = np.cumsum(crosses)[state] - 1
    wraps = before < offsets[ring]
    before = np.where(wraps, offsets[ring + 1] - 1, before)
    order = np.lexsort((wraps, before))
    return before[order], state[order]


#: No I, O or Q: engraved, they pass for 1 and 0.
ALPHABET = "ABCDEFGHJKLMNPRSTUVWXYZ"


def thread_labels(count: int) -> tuple[str, ...]:
    """Return distinct labels A … Z, AA, AB … for the given number of threads.

    Examples
    --------
    >>> thread_labels(25)[-3:]
    ('Z', 'AA', 'AB')
    """
    labels = []
    for number in range(count):
        text, rest = "", number + 1
        while rest:
            rest, digit = divmod(rest - 1, len(ALPHABET))
            text = ALPHABET[digit] + text
        labels.append(text)
    return tuple(labels)
