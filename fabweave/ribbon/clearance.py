"""Measure how near ribbons come to one another where they do not cross."""

from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.arrays import FloatArray, IntArray, frozen, offsets_of
from fabweave.ribbon.distance import apart_by, triangle_distances
from fabweave.ribbon.project import Ribbons, following_rung

#: Stretches are looked up in blocks of this many, and pairs of facets measured likewise.
_BLOCK = 1 << 14
#: A view along which no wall of a usual shape is seen edge-on: the rows are a rotation.
_TILT = np.linalg.qr(np.array([[1.0, 0.37, 0.61], [-0.29, 1.0, 0.43], [-0.53, -0.31, 1.0]]))[0].T


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class Nearness:
    """Pairs of stretches that come within reach of each other.

    Parameters
    ----------
    pairs : (N, 2) int array
        Stretches as :func:`cut_stretches` numbers them; the smaller number first.
    distance_mm : (N,) float array
        Between the middle surfaces; 0 where they run through each other.
    place : (N, 3) float array
        Where, midway between the closest points.
    """

    pairs: IntArray
    distance_mm: FloatArray
    place: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("pairs", "distance_mm", "place"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, eq=False)
class _Facets:
    """Corners of the facets, (F, 3, 3), and their boxes, (3, F); filled only where needed."""

    corners: FloatArray
    low: FloatArray
    high: FloatArray


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


def ends_of_stretches(ribbons: Ribbons, pairs: IntArray) -> IntArray:
    """Return the passes at both ends of the stretches of some pairs, (N, 2, 2).

    A panel has its own pass at both ends, and so has what comes before an open thread's first
    panel, or after its last one.
    """
    count = len(ribbons.entry)
    following = following_rung(ribbons.pass_offsets, ribbons.closed)
    panel = np.arange(count)
    first = np.minimum(ribbons.pass_offsets[:-1], max(count - 1, 0))
    start = np.concatenate((panel, panel, first))
    end = np.concatenate((panel, np.where(following >= 0, following, panel), first))
    return np.stack((start[pairs], end[pairs]), axis=2)


def facet_corners(ribbons: Ribbons, rungs: IntArray) -> FloatArray:
    """Return the corners of the two facets of the quads that follow some rungs, (2 N, 3, 3)."""
    after = following_rung(ribbons.offsets, ribbons.closed)[rungs]
    a, b, c, d = (
        ribbons.right[rungs],
        ribbons.right[after],
        ribbons.left[after],
        ribbons.left[rungs],
    )
    slanted = ribbons.from_right[rungs][:, None]
    near = np.stack((a, np.where(slanted, c, b), d), axis=1)
    far = np.stack((np.where(slanted, a, b), np.where(slanted, b, c), np.where(slanted, c, d)), 1)
    return np.stack((near, far), axis=1).reshape(-1, 3, 3)


def near_pairs(
    ribbons: Ribbons, crossing: IntArray, reach_mm: float, among: IntArray | None = None
) -> Nearness:
    """Find stretches of ribbon that come within reach of each other and do not cross there.

    Stretches that follow each other along a thread are left out, and so are the two panels of one
    crossing, which lie on each other by design. Boxes around stretches are looked up in a tree,
    planes between facets sort out most pairs, and the others are measured exactly.

    Parameters
    ----------
    ribbons : Ribbons
    crossing : (P,) int array
        The crossing that each pass makes.
    reach_mm : float
        Pairs farther apart are left out.
    among : (N, 2) int array, optional
        Look only at these pairs of stretches.

    Returns
    -------
    Nearness
        Sorted by pairs.
    """
    stretches = cut_stretches(ribbons)
    wanted = stretches.triangle[::2] // 2
    if among is not None:
        wanted = _triangles_of(stretches, np.unique(among))[::2] // 2
    corners = np.empty((2 * ribbons.n_rungs, 3, 3))
    rows = (2 * wanted[:, None] + [0, 1]).ravel()
    corners[rows] = facet_corners(ribbons, wanted)
    # By axes, so that every look-up runs through memory in order.
    low, high = np.empty((2, 3, len(corners)))
    for axis in range(3):
        low[axis, rows] = np.minimum.reduce([corners[rows, k, axis] for k in range(3)])
        high[axis, rows] = np.maximum.reduce([corners[rows, k, axis] for k in range(3)])
    facets = _Facets(corners, low, high)
    found = []
    if among is not None:
        blocks = [among[start : start + _BLOCK] for start in range(0, len(among), _BLOCK)]
    else:
        blocks = _boxes_within_reach(stretches, corners, reach_mm)
    for block in blocks:
        pairs = block[_separate(stretches, crossing, block)]
        found.append(_measure(stretches, facets, pairs, reach_mm))
    if not found:
        return Nearness(np.zeros((0, 2), dtype=np.int64), np.zeros(0), np.zeros((0, 3)))
    pairs, distance, place = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return Nearness(pairs[order], distance[order], place[order])


def _triangles_of(stretches: Stretches, wanted: IntArray) -> IntArray:
    """Return the triangles of some stretches, one after another."""
    counts = np.diff(stretches.offsets)[wanted]
    starts = offsets_of(counts)
    within = np.arange(starts[-1]) - np.repeat(starts[:-1], counts)
    return stretches.triangle[np.repeat(stretches.offsets[wanted], counts) + within]


def _boxes_within_reach(
    stretches: Stretches, corners: FloatArray, reach_mm: float
) -> list[IntArray]:
    """Return the pairs of stretches whose boxes are within reach, in blocks."""
    filled = np.flatnonzero(np.diff(stretches.offsets) > 0)
    if not len(filled):
        return []
    points = corners[stretches.triangle] @ _TILT.T
    starts = stretches.offsets[:-1][filled]
    low = np.minimum.reduceat(points.min(axis=1), starts) - reach_mm / 2
    high = np.maximum.reduceat(points.max(axis=1), starts) + reach_mm / 2
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    tree = shapely.STRtree(boxes)
    blocks = []
    for start in range(0, len(filled), _BLOCK):
        one, other = tree.query(boxes[start : start + _BLOCK])
        one = one + start
        keep = one < other
        one, other = one[keep], other[keep]
        keep = (low[one, 2] <= high[other, 2]) & (low[other, 2] <= high[one, 2])
        blocks.append(np.column_stack((filled[one[keep]], filled[other[keep]])))
    return blocks


def _separate(stretches: Stretches, crossing: IntArray, pairs: IntArray) -> IntArray:
    """Return which pairs are neither neighbours along a thread nor the two panels of a crossing."""
    one, other = pairs.T
    count = len(crossing)
    same = stretches.thread[one] == stretches.thread[other]
    apart = np.abs(stretches.order[one] - stretches.order[other])
    apart = np.minimum(apart, stretches.around[stretches.thread[one]] - apart)
    panels = (one < count) & (other < count)
    crossed = np.zeros(len(pairs), dtype=bool)
    crossed[panels] = crossing[one[panels]] == crossing[other[panels]]
    return np.flatnonzero(~(same & (apart <= 1)) & ~crossed)


def _measure(
    stretches: Stretches, facets: _Facets, pairs: IntArray, reach_mm: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Measure pairs of stretches by all pairs of their facets; drop those out of reach."""
    sizes = np.diff(stretches.offsets)
    counts = sizes[pairs[:, 0]] * sizes[pairs[:, 1]]
    distance = np.full(len(pairs), np.inf)
    place = np.zeros((len(pairs), 3))
    corners = facets.corners
    bounds = np.searchsorted(np.cumsum(counts), np.arange(0, counts.sum(), 1 << 18))
    for start, end in zip(bounds, [*bounds[1:], len(pairs)], strict=True):
        own = np.arange(start, end)
        which = np.repeat(own, counts[own])
        within = np.arange(len(which)) - np.repeat(offsets_of(counts[own])[:-1], counts[own])
        rows, columns = np.divmod(within, sizes[pairs[which, 1]])
        first = stretches.triangle[stretches.offsets[pairs[which, 0]] + rows]
        second = stretches.triangle[stretches.offsets[pairs[which, 1]] + columns]
        keep = _boxes_meet(facets, first, second, reach_mm)
        keep = keep[~apart_by(corners[first[keep]], corners[second[keep]], reach_mm)]
        gap, midway = triangle_distances(corners[first[keep]], corners[second[keep]])
        order = np.lexsort((gap, which[keep]))
        pair = which[keep][order]
        fresh = np.flatnonzero(np.diff(pair, prepend=-1))
        distance[pair[fresh]], place[pair[fresh]] = gap[order][fresh], midway[order][fresh]
    near = distance <= reach_mm
    return pairs[near], distance[near], place[near]


def _boxes_meet(facets: _Facets, first: IntArray, second: IntArray, reach_mm: float) -> IntArray:
    """Return which pairs of facets have boxes within reach."""
    meet = np.arange(len(first))
    for below, above in zip(facets.low, facets.high, strict=True):
        one, other = first[meet], second[meet]
        meet = meet[
            (below[one] <= above[other] + reach_mm) & (below[other] <= above[one] + reach_mm)
        ]
    return meet
