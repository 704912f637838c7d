"""Cut ribbons into stretches: crossing panels, and what lies between them."""

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value, offsets_of
from fabweave.ribbon.project import Ribbons, following_rung


@frozen_value
class Stretches:
    """Ribbons cut into stretches: the panel of each pass, and what follows it to the next panel.

    Stretch ``p`` is the panel of pass ``p``, ``P + p`` what follows it, and ``2 P + t`` what comes
    before the first panel of an open thread ``t``.

    Parameters
    ----------
    offsets : (2 P + T + 1,) int array
        Stretch ``s`` owns the entries ``offsets[s]:offsets[s + 1]`` of ``triangle``.
    triangle : (F,) int array
        Triangles; triangles ``2 r`` and ``2 r + 1`` make up the quad that follows rung ``r``.
    thread : (2 P + T,) int array
        The thread of each stretch.
    order : (2 P + T,) int array
        Place along the thread: 0 the first panel, 1 what follows it; -1 what comes before.
    around : (T,) int array
        How many stretches lead around a ring; more than there are on an open thread.
    """

    offsets: IntArray
    triangle: IntArray
    thread: IntArray
    order: IntArray
    around: IntArray


def cut_stretches(ribbons: Ribbons) -> Stretches:
    """Cut ribbons into panels and what lies between them."""
    count = len(ribbons.entry)
    quads = np.flatnonzero(following_rung(ribbons.offsets, ribbons.closed) >= 0)
    thread = np.searchsorted(ribbons.offsets, quads, side="right") - 1
    owner = np.searchsorted(ribbons.entry, quads, side="right") - 1
    ahead = owner < ribbons.pass_offsets[thread]
    last = ribbons.pass_offsets[thread + 1] - 1
    on_panel = ~ahead & (ribbons.entry[owner] == quads)
    stretch = np.where(on_panel, owner, count + np.where(ahead, last, owner))
    stretch = np.where(ahead & ~ribbons.closed[thread], 2 * count + thread, stretch)
    by_stretch = np.argsort(stretch, kind="stable")
    triangle = 2 * np.repeat(quads[by_stretch], 2) + np.tile([0, 1], len(quads))
    n_threads = len(ribbons.closed)
    of_pass = np.repeat(np.arange(n_threads), np.diff(ribbons.pass_offsets))
    position = np.arange(count) - ribbons.pass_offsets[of_pass]
    return Stretches(
        offsets=offsets_of(2 * np.bincount(stretch, minlength=2 * count + n_threads)),
        triangle=triangle,
        thread=np.concatenate((of_pass, of_pass, np.arange(n_threads))),
        order=np.concatenate((2 * position, 2 * position + 1, np.full(n_threads, -1))),
        around=np.where(ribbons.closed, 2 * np.diff(ribbons.pass_offsets), 4 * count + 4),
    )


def ends_of_stretches(pass_offsets: IntArray, closed: BoolArray, pairs: IntArray) -> IntArray:
    """Return the passes at both ends of the stretches of some pairs, (N, 2, 2).

    Threads make the passes ``pass_offsets[t]:pass_offsets[t + 1]``, and are rings or not.

    A panel has its own pass at both ends, and so has what comes before an open thread's first
    panel, or after its last one.
    """
    count = int(pass_offsets[-1])
    following = following_rung(pass_offsets, closed)
    panel = np.arange(count)
    first = np.minimum(pass_offsets[:-1], max(count - 1, 0))
    start = np.concatenate((panel, panel, first))
    end = np.concatenate((panel, np.where(following >= 0, following, panel), first))
    return np.stack((start[pairs], end[pairs]), axis=2)


def triangles_of(stretches: Stretches, wanted: IntArray) -> IntArray:
    """Return the triangles of some stretches, one after another."""
    counts = np.diff(stretches.offsets)[wanted]
    starts = offsets_of(counts)
    within = np.arange(starts[-1]) - np.repeat(starts[:-1], counts)
    return stretches.triangle[np.repeat(stretches.offsets[wanted], counts) + within]


def steps_apart(stretches: Stretches, pairs: IntArray) -> IntArray:
    """Return how many stretches lead along a thread from one to another, (N,); -1 for two threads.

    A stretch is 0 from itself, and 1 from the next.
    """
    first, second = pairs.T
    apart = np.abs(stretches.order[first] - stretches.order[second])
    apart = np.minimum(apart, stretches.around[stretches.thread[first]] - apart)
    return np.where(stretches.thread[first] == stretches.thread[second], apart, -1)


def neighbours(stretches: Stretches) -> IntArray:
    """Return every filled stretch with itself, and with the next along its thread, (N, 2)."""
    filled = np.flatnonzero(np.diff(stretches.offsets) > 0)
    along = filled[np.lexsort((stretches.order[filled], stretches.thread[filled]))]
    thread = stretches.thread[along]
    last = np.flatnonzero(np.diff(thread, append=-1))
    ahead = np.roll(along, -1)
    ahead[last] = along[np.concatenate(([0], last[:-1] + 1))] if len(along) else along
    pairs = np.sort(np.column_stack((along, ahead)), axis=1)
    pairs = pairs[steps_apart(stretches, pairs) == 1]
    count = len(stretches.thread)
    both = np.unique(np.concatenate((filled * (count + 1), pairs[:, 0] * count + pairs[:, 1])))
    return np.column_stack(np.divmod(both, count))


def passes_along(stretches: Stretches, pairs: IntArray) -> IntArray:
    """Return for stretches that are one or follow each other the pass along which they lie, (N,).

    That is the pass at whose panel both begin, or one of them does; what leads to the next panel
    comes with it. -1 for what comes before an open thread's first panel.

    Examples
    --------
    Of three passes, the panel of the last, and what follows the second with the panel after it:

    >>> none = np.zeros(0, dtype=np.int64)
    >>> rows = Stretches(none, none, np.zeros(7, dtype=np.int64), none, np.zeros(1, dtype=np.int64))
    >>> passes_along(rows, np.array([[2, 2], [2, 4], [0, 6]])).tolist()
    [2, 1, -1]
    """
    # There are two stretches a pass, and then one a thread.
    last = pairs[:, 1]
    count = (len(stretches.thread) - len(stretches.around)) // 2
    return np.where(last < count, last, np.where(last < 2 * count, last - count, -1))
