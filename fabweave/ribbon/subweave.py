"""Take some passes out of a weave, to lay and measure nothing but what lies between them."""

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value, offsets_of
from fabweave.ribbon.project import following_rung
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads


@frozen_value
class Part:
    """Some passes of a weave. Passes that follow each other are one thread of the part.

    What lies on and between them is laid as in the whole, to the last bit; what lies before the
    first and after the last pass of a thread of the part is not, unless the whole ends there, too.

    Parameters
    ----------
    weave : Weave
        The passes, with their crossings, as a weave of its own; a crossing may have one pass only.
    passes : (P',) int array
        The number in the whole of each pass.
    crossings : (X',) int array
        The number in the whole of each crossing.
    thread : (T',) int array
        The thread of the whole to which each thread of the part belongs.
    n_passes : int
        Of the whole.
    """

    weave: Weave
    passes: IntArray
    crossings: IntArray
    thread: IntArray
    n_passes: int

    def pass_numbers(self, passes: IntArray) -> IntArray:
        """Return the numbers in the part of passes of the whole; all must be in it."""
        number = np.full(self.n_passes, -1, dtype=np.int64)
        number[self.passes] = np.arange(len(self.passes))
        return number[passes]

    def stretch_numbers(self, stretches: IntArray) -> IntArray:
        """Return the numbers in the part of stretches of the whole; their ends must be in it."""
        count = len(self.passes)
        kind, which = np.divmod(np.minimum(stretches, 2 * self.n_passes), self.n_passes)
        result = kind * count + self.pass_numbers(np.where(kind < 2, which, 0))
        # What comes before an open thread's first panel is numbered by threads.
        before = kind == 2
        owner = stretches[before] - 2 * self.n_passes
        result[before] = 2 * count + np.searchsorted(self.thread, owner)
        return result

    def whole_stretches(self, stretches: IntArray) -> IntArray:
        """Return the numbers in the whole of stretches of the part."""
        names = np.concatenate(
            (self.passes, self.n_passes + self.passes, 2 * self.n_passes + self.thread)
        )
        return np.asarray(names[stretches])


def take_part(weave: Weave, passes: IntArray, *, beyond: tuple[int, int] = (0, 0)) -> Part:
    """Take passes out of a weave.

    Parameters
    ----------
    weave : Weave
    passes : (N,) int array
        In any order; several times the same does no harm.
    beyond : (int, int)
        So many passes before, and after, each of them are taken, too.

    Returns
    -------
    Part
        Threads of the part stand in the order of the whole.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import tetrahedron
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(tetrahedron())))
    >>> part = take_part(weave, np.array([3, 0, 5]))
    >>> part.passes.tolist(), part.weave.threads.offsets.tolist(), part.thread.tolist()
    ([3, 0, 5], [0, 2, 3], [0, 1])
    """
    threads = weave.threads
    count = len(threads.crossing)
    following = following_rung(threads.offsets, threads.closed)
    here = np.flatnonzero(following >= 0)
    preceding = np.full(count, -1, dtype=np.int64)
    preceding[following[here]] = here
    taken = np.zeros(count, dtype=bool)
    taken[passes] = True
    for way, steps in ((preceding, beyond[0]), (following, beyond[1])):
        for _ in range(steps):
            ahead = way[np.flatnonzero(taken)]
            taken[ahead[ahead >= 0]] = True

    thread = threads.thread_of_pass
    rings = threads.closed & (np.bincount(thread[taken], minlength=len(threads.closed)) > 0)
    rings &= np.bincount(thread[~taken], minlength=len(threads.closed)) == 0
    starts = taken & ~((preceding >= 0) & taken[preceding])
    starts[threads.offsets[:-1][rings]] = True
    first = np.flatnonzero(starts)
    run = np.cumsum(starts) - 1
    # What is taken of a ring before the first start in it belongs to the last one.
    wraps = taken & (np.searchsorted(first, threads.offsets[thread]) > run)
    run = np.where(wraps, run[threads.offsets[1:][thread] - 1], run)
    taken_passes = np.flatnonzero(taken)
    taken_passes = taken_passes[np.lexsort((wraps[taken_passes], run[taken_passes]))]

    crossings, crossing = np.unique(threads.crossing[taken_passes], return_inverse=True)
    closed = rings[thread[first]]
    offsets = offsets_of(np.bincount(run[taken_passes], minlength=len(first)))
    goes_on = following_rung(offsets, closed) >= 0
    number = np.full(count, -1, dtype=np.int64)
    number[taken_passes[goes_on]] = np.flatnonzero(goes_on)
    turns = np.flatnonzero(number[threads.turn_pass] >= 0)
    turns = turns[np.argsort(number[threads.turn_pass[turns]], kind="stable")]
    return Part(
        Weave(
            Threads(
                offsets=offsets,
                crossing=crossing.ravel(),
                halfedge=threads.halfedge[taken_passes],
                forward=threads.forward[taken_passes],
                closed=closed,
                crossing_halfedge=threads.crossing_halfedge[crossings],
                turn_pass=number[threads.turn_pass[turns]],
                turn_halfedge=threads.turn_halfedge[turns],
            ),
            weave.pattern,
            weave.twist[crossings],
            weave.over[taken_passes],
            weave.broken,
        ),
        taken_passes,
        crossings,
        thread[first],
        count,
    )
