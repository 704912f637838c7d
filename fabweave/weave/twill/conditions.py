"""List the conditions of a 2/2 twill, and count those that a choice of twists breaks."""

from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.threads import Threads


@frozen_value
class TwillConditions:
    """The conditions of a 2/2 twill as tuples of crossings.

    Parameters
    ----------
    n_crossings : int
        Number of crossings.
    edge : (M, 2) int array
        The first and the last of three crossings consecutive along a thread: they must twist in
        opposite senses.
    thread : (M,) int array
        The thread along which each edge condition lies.
    face : (N, 4) int array
        Four edges consecutive around a face: where the middle two differ, the outer two agree.
    vertex : (O, 4) int array
        The same around a vertex.
    """

    n_crossings: int
    edge: IntArray
    thread: IntArray
    face: IntArray
    vertex: IntArray

    @property
    def gaps(self) -> IntArray:
        """Face and vertex conditions together, (N + O, 4)."""
        return np.concatenate((self.face, self.vertex))

    @property
    def count(self) -> int:
        """Number of all conditions."""
        return len(self.edge) + len(self.face) + len(self.vertex)


@dataclass(frozen=True)
class Broken:
    """How many conditions are broken."""

    edge: int = 0
    face: int = 0
    vertex: int = 0

    @property
    def total(self) -> int:
        """All of them."""
        return self.edge + self.face + self.vertex

    def __str__(self) -> str:
        """Say how many of which."""
        return f"{self.total} ({self.edge} edge, {self.face} face, {self.vertex} vertex)"


def twill_conditions(halfedges: Halfedges, threads: Threads) -> TwillConditions:
    """List all conditions of a 2/2 twill.

    Four edges consecutive around a face or a vertex make a condition if they are four different
    places, so triangles and vertices of valence three make none. A boundary edge has no twist: no
    condition reaches over one, nor over the place where a thread turns back at one.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of the mesh.
    threads : Threads
        Its threads.

    Returns
    -------
    TwillConditions

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), definition 5.1.

    Examples
    --------
    >>> from fabweave.mesh.shapes import solids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(solids.cube())
    >>> conditions = twill_conditions(halfedges, trace_threads(halfedges))
    >>> len(conditions.edge), len(conditions.face), len(conditions.vertex)
    (24, 24, 0)
    """
    # The medial graph knows no difference between the two: a face of it for each face and vertex.
    around_vertex = halfedges.twin[halfedges.prev]
    edge, thread = _along_threads(threads)
    return TwillConditions(
        n_crossings=threads.n_crossings,
        edge=edge,
        thread=thread,
        face=_windows(halfedges.next, halfedges, threads),
        vertex=_windows(around_vertex, halfedges, threads),
    )


def count_broken(conditions: TwillConditions, twist: BoolArray) -> Broken:
    """Count the broken conditions of each kind.

    Examples
    --------
    >>> import numpy as np
    >>> pairs = np.array([[0, 1], [1, 2]])
    >>> windows = np.array([[0, 1, 2, 3]])
    >>> conditions = TwillConditions(4, pairs, np.array([0, 0]), windows, windows[:0])
    >>> count_broken(conditions, np.array([True, True, False, False]))
    Broken(edge=1, face=1, vertex=0)
    """
    return Broken(
        edge=int(np.count_nonzero(broken_pairs(conditions.edge, twist))),
        face=int(np.count_nonzero(broken_windows(conditions.face, twist))),
        vertex=int(np.count_nonzero(broken_windows(conditions.vertex, twist))),
    )


def broken_pairs(pairs: IntArray, twist: BoolArray) -> BoolArray:
    """Return which edge conditions are broken: both ends twist the same way."""
    return np.asarray(twist[pairs[:, 0]] == twist[pairs[:, 1]])


def broken_windows(windows: IntArray, twist: BoolArray) -> BoolArray:
    """Return which face or vertex conditions are broken: middle and outer two differ."""
    a, b, c, d = twist[windows].T
    return np.asarray((b != c) & (a != d))


def _along_threads(threads: Threads) -> tuple[IntArray, IntArray]:
    """Pair each pass with the second after it along its thread; return crossings and threads.

    Where a thread turns back at the boundary, a boundary edge lies between, and none is paired.
    """
    thread = threads.thread_of_pass
    after = np.arange(len(threads.crossing)) + 2
    end = threads.offsets[thread + 1]
    length = threads.lengths[thread]
    wraps = after >= end
    # A ring of one crossing meets it again at every step.
    around = threads.offsets[thread] + (after - threads.offsets[thread]) % np.maximum(length, 1)
    after = np.where(wraps, around, after)
    following = np.arange(len(threads.crossing)) + 1
    following = np.where(following == end, threads.offsets[thread], following)
    turns = np.zeros(len(threads.crossing), dtype=bool)
    turns[threads.turn_pass] = True
    kept = (~wraps | threads.closed[thread]) & ~turns & ~turns[following]
    pairs = np.column_stack((threads.crossing[kept], threads.crossing[after[kept]]))
    return pairs, thread[kept]


def _windows(turn: IntArray, halfedges: Halfedges, threads: Threads) -> IntArray:
    """Return the crossings of four half-edges consecutive under a (partial) permutation."""
    crossing_of_edge = np.full(halfedges.n_edges, -1, dtype=np.int64)
    crossing_of_edge[halfedges.edge[threads.crossing_halfedge]] = np.arange(threads.n_crossings)
    crossing = crossing_of_edge[halfedges.edge]
    first = np.flatnonzero(crossing >= 0)
    steps = [first]
    for _ in range(3):
        after = turn[steps[-1]]
        # Round again too soon: fewer than four different places; -1: over the boundary.
        kept = (after >= 0) & (after != steps[0])
        kept[kept] = crossing[after[kept]] >= 0
        steps = [places[kept] for places in steps] + [after[kept]]
    return np.column_stack([crossing[places] for places in steps])
