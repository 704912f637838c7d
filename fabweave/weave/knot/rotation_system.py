"""Trace the threads of an extended graph rotation system: any number of half-twists an edge."""

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import BoolArray, IntArray, frozen_value, offsets_of, places_in_groups
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.cycles import order_states
from fabweave.weave.threads import PassesByThread

#: More crossings than this must be a typing error, and would fill the memory.
_MOST_CROSSINGS = 1 << 28


@frozen_value
class TwistedThreads(PassesByThread):
    """The threads of a mesh whose edges carry any number of half-twists.

    Two strands run along every edge. An edge with ``k`` half-twists has ``|k|`` crossings, one
    after the other; the sense of the helix is that of :func:`fabweave.weave.pattern.over_of_passes`
    for true where ``k > 0``. A *pass* is one visit of a thread to a crossing.

    Parameters
    ----------
    half_twists : (E,) int array
        Half-twists of each edge: 0 is untwisted, positive is counter-clockwise.
    edge_halfedge : (E,) int array
        The half-edge that gives each edge its direction.
    crossing_offsets : (E + 1,) int array
        Edge ``e`` owns the crossings ``crossing_offsets[e]:crossing_offsets[e + 1]``, in order
        along its half-edge.
    offsets : (T + 1,) int array
        Thread ``t`` owns the passes ``offsets[t]:offsets[t + 1]``, in walking order.
    crossing : (P,) int array
        The crossing of each pass.
    halfedge : (P,) int array
        The half-edge of the pass's edge whose face the thread comes from.
    along : (P,) bool array
        Whether the thread walks the edge from the tail of ``edge_halfedge`` to its head.
    from_left : (P,) bool array
        Whether the thread changes from the left side of its way to the right one.
    over : (P,) bool array
        Whether the pass lies on top.
    closed : (T,) bool array
        Whether the thread is a ring.
    corner_offsets : (T + 1,) int array
        Thread ``t`` runs through the corners ``corner_offsets[t]:corner_offsets[t + 1]``.
    corner : (K,) int array
        Those corners, in walking order: where a thread without any crossing runs, too.
    """

    half_twists: IntArray
    edge_halfedge: IntArray
    crossing_offsets: IntArray
    offsets: IntArray
    crossing: IntArray
    halfedge: IntArray
    along: BoolArray
    from_left: BoolArray
    over: BoolArray
    closed: BoolArray
    corner_offsets: IntArray
    corner: IntArray

    @property
    def n_crossings(self) -> int:
        """Number of crossings."""
        return int(self.crossing_offsets[-1])

    @property
    def edge_of_crossing(self) -> IntArray:
        """The edge that each crossing lies along, (X,)."""
        return np.repeat(np.arange(len(self.half_twists)), np.abs(self.half_twists))

    @property
    def passes(self) -> IntArray:
        """The pass on top and the pass below of each crossing, (X, 2)."""
        result = np.empty((self.n_crossings, 2), dtype=np.int64)
        numbers = np.arange(len(self.crossing))
        result[self.crossing[self.over], 0] = numbers[self.over]
        result[self.crossing[~self.over], 1] = numbers[~self.over]
        return result

    @property
    def signs(self) -> IntArray:
        """Sign of each crossing, +1 or -1, if threads are oriented as they are walked, (X,).

        Positive is right-handed: a counter-clockwise edge whose two strands walk the same way.
        The sign of a crossing of a thread with itself does not depend on the orientations.
        """
        top, below = self.passes.T
        same_way = self.along[top] == self.along[below]
        sense = np.sign(self.half_twists[self.edge_of_crossing])
        return np.where(same_way, sense, -sense)

    @property
    def self_crossings(self) -> IntArray:
        """Number of crossings of each thread with itself, (T,)."""
        top, below = self.thread_of_pass[self.passes].T
        return np.bincount(top[top == below], minlength=self.n_threads)

    @property
    def writhe(self) -> int:
        """Sum of all signs, with threads oriented as they are walked."""
        return int(self.signs.sum())


def twisted_successor(
    halfedges: Halfedges, half_twists: npt.ArrayLike, *, turn: bool = False
) -> IntArray:
    """Return the successor of every directed corner, whatever the edges carry.

    State ``h`` passes the corner between ``edge(h)`` and ``edge(next(h))`` forward, state
    ``H + h`` passes it backward. A forward pass then runs along ``edge(next(h))``, a backward pass
    along ``edge(h)``. An odd number of half-twists swaps the sides of the edge, so the thread goes
    on in the other face and in the other direction; an even number keeps side and direction.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of an oriented manifold mesh.
    half_twists : (E,) int array
        Half-twists of each edge.
    turn : bool
        Whether threads turn back at boundary edges (which is to run along them, untwisted);
        otherwise they end there.

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
    swaps = (_checked(halfedges, half_twists) % 2 == 1)[halfedges.edge]
    inner = halfedges.twin >= 0
    # Along each half-edge from its tail on the left, and from its head on the right.
    onwards = np.where(swaps, halfedges.prev[halfedges.twin] + count, np.arange(count))
    back = np.where(swaps, halfedges.twin, halfedges.prev + count)
    if not turn:
        onwards, back = np.where(inner, onwards, -1), np.where(inner, back, -1)
    return np.concatenate((onwards[halfedges.next], back))


def trace_twisted(
    halfedges: Halfedges, half_twists: npt.ArrayLike, *, turn: bool = False
) -> TwistedThreads:
    """Trace the threads of a mesh whose edges carry any number of half-twists.

    All are cycles (on an open mesh, cycles and paths) of one permutation of the directed corners.
    With no edge twisted they are the boundaries of the faces; with every edge twisted once they
    are those of :func:`fabweave.weave.threads.trace_threads`, pass for pass. In a helix of several
    half-twists the strand that is on top at one crossing goes under at the next.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of an oriented manifold mesh; boundaries are allowed.
    half_twists : (E,) int array
        Half-twists of each edge, 0 on boundary edges: 0 is untwisted, positive is
        counter-clockwise, negative is clockwise.
    turn : bool
        Whether threads turn back at the boundary; otherwise they end there.

    Returns
    -------
    TwistedThreads
        Closed threads start at their smallest corner, open ones at the end that comes first.

    Raises
    ------
    InputError
        If there is not one whole number for each edge, or a boundary edge is to be twisted.

    Examples
    --------
    The faces of a cube are six rings; one twisted edge joins two of them:

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import cube
    >>> halfedges = build_halfedges(cube())
    >>> trace_twisted(halfedges, [0] * 12).n_threads
    6
    >>> joined = trace_twisted(halfedges, [1] + [0] * 11)
    >>> joined.n_threads, joined.self_crossings.tolist()
    (5, [1, 0, 0, 0, 0])

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 3: extended graph rotation systems.
    """
    twists = _checked(halfedges, half_twists)
    count = halfedges.n_halfedges
    successor = twisted_successor(halfedges, twists, turn=turn)
    states, thread, closed = order_states(successor, count)

    backward = states >= count
    corner = np.where(backward, states - count, states)
    # A forward pass of a corner goes on along edge(next) from its tail, a backward one along
    # edge(h) from its head.
    arrival = np.where(backward, corner, halfedges.next[corner])
    edge = halfedges.edge[arrival]
    turns = np.abs(twists[edge])
    crossing_offsets = offsets_of(np.abs(twists))

    # One pass for every half-twist on the way.
    step = np.repeat(np.arange(len(states)), turns)
    nth = places_in_groups(turns)
    is_first = halfedges.edge_halfedge[edge] == arrival
    along = (is_first != backward)[step]
    at = np.where(along, nth, turns[step] - 1 - nth)
    from_left = (nth % 2 == 0) != backward[step]
    edge = edge[step]
    n_threads = len(closed)
    return TwistedThreads(
        half_twists=twists,
        edge_halfedge=halfedges.edge_halfedge,
        crossing_offsets=crossing_offsets,
        offsets=offsets_of(np.bincount(thread[step], minlength=n_threads)),
        crossing=crossing_offsets[edge] + at,
        halfedge=arrival[step],
        along=along,
        from_left=from_left,
        over=from_left == (twists[edge] > 0),
        closed=closed,
        corner_offsets=offsets_of(np.bincount(thread, minlength=n_threads)),
        corner=corner,
    )


def _checked(halfedges: Halfedges, half_twists: npt.ArrayLike) -> IntArray:
    """Return half-twists as an array that fits the mesh."""
    given = np.asarray(half_twists)
    if given.shape != (halfedges.n_edges,):
        raise InputError(
            f"half-twists need one number for each of {halfedges.n_edges} edges, but have the "
            f"shape {given.shape}"
        )
    if given.size and not np.issubdtype(given.dtype, np.integer):
        raise InputError("half-twists must be whole numbers")
    twists = given.astype(np.int64)
    if np.abs(twists.astype(np.float64)).sum() > _MOST_CROSSINGS:
        raise InputError(f"these half-twists make more than {_MOST_CROSSINGS} crossings")
    wrong = np.flatnonzero((halfedges.twin[halfedges.edge_halfedge] < 0) & (twists != 0))
    if len(wrong):
        raise InputError(
            f"{len(wrong)} boundary edges have half-twists ({few_of(wrong.tolist(), 5)}); only "
            "one strand runs along a boundary edge, so give it none"
        )
    return twists
