"""Cut ribbons into stretches: crossing panels, and what lies between them."""

from collections.abc import Iterator

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
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


#: Pairs of facets are looked at in blocks of about this many, to bound memory.
_BLOCK = 1 << 18


@frozen_value
class Facets:
    """The facets of ribbons; filled only where they were wanted.

    Triangles ``2 r`` and ``2 r + 1`` make up the quad that follows rung ``r``; vertex ``2 r`` is
    the right and ``2 r + 1`` the left end of that rung.

    Parameters
    ----------
    vertices : (F, 3) int array
    corners : (F, 3, 3) float array
    low, high : (3, F) float arrays
        Boxes, by axes, so that every look-up runs through memory in order.
    """

    vertices: IntArray
    corners: FloatArray
    low: FloatArray
    high: FloatArray


def facet_vertices(ribbons: Ribbons, rungs: IntArray) -> IntArray:
    """Return the vertices of the two facets of the quads that follow some rungs, (2 N, 3).

    The facet at the near rung comes first.
    """
    after = following_rung(ribbons.offsets, ribbons.closed)[rungs]
    a, b, c, d = 2 * rungs, 2 * after, 2 * after + 1, 2 * rungs + 1
    slanted = ribbons.from_right[rungs]
    near = np.stack((a, np.where(slanted, c, b), d), axis=1)
    far = np.stack((np.where(slanted, a, b), np.where(slanted, b, c), np.where(slanted, c, d)), 1)
    return np.stack((near, far), axis=1).reshape(-1, 3)


def rung_ends(ribbons: Ribbons) -> FloatArray:
    """Return the vertices that facets use, (2 R, 3)."""
    return np.stack((ribbons.right, ribbons.left), axis=1).reshape(-1, 3)


def cut_facets(ribbons: Ribbons, rungs: IntArray) -> Facets:
    """Cut the quads that follow some rungs into facets."""
    count = 2 * ribbons.n_rungs
    rows = (2 * rungs[:, None] + [0, 1]).ravel()
    vertices, corners = np.empty((count, 3), dtype=np.int64), np.empty((count, 3, 3))
    vertices[rows] = facet_vertices(ribbons, rungs)
    corners[rows] = rung_ends(ribbons)[vertices[rows]]
    low, high = np.empty((2, 3, count))
    for axis in range(3):
        low[axis, rows] = np.minimum.reduce([corners[rows, k, axis] for k in range(3)])
        high[axis, rows] = np.maximum.reduce([corners[rows, k, axis] for k in range(3)])
    return Facets(vertices, corners, low, high)


def facet_pairs(
    stretches: Stretches, facets: Facets, pairs: IntArray, reach: FloatArray
) -> Iterator[tuple[IntArray, IntArray, IntArray]]:
    """Yield the pairs of facets, one of either stretch, whose boxes are within reach, in blocks.

    Parameters
    ----------
    stretches, facets
        Of the same ribbons.
    pairs : (P, 2) int array
        Stretches.
    reach : (P,) float array
        Of each pair, in millimetres.

    Yields
    ------
    which : (N,) int array
        The pair of stretches.
    first, second : (N,) int arrays
        The facets.
    """
    sizes = np.diff(stretches.offsets)
    counts = sizes[pairs[:, 0]] * sizes[pairs[:, 1]]
    bounds = np.searchsorted(np.cumsum(counts), np.arange(0, max(counts.sum(), 1), _BLOCK))
    for start, end in zip(bounds, [*bounds[1:], len(pairs)], strict=True):
        block = np.arange(start, end)
        which = np.repeat(block, counts[block])
        within = np.arange(len(which)) - np.repeat(offsets_of(counts[block])[:-1], counts[block])
        rows, columns = np.divmod(within, sizes[pairs[which, 1]])
        first = stretches.triangle[stretches.offsets[pairs[which, 0]] + rows]
        second = stretches.triangle[stretches.offsets[pairs[which, 1]] + columns]
        for below, above in zip(facets.low, facets.high, strict=True):
            far = reach[which]
            meet = (below[first] <= above[second] + far) & (below[second] <= above[first] + far)
            which, first, second = which[meet], first[meet], second[meet]
        yield which, first, second
