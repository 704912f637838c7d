"""Measure how near the ribbons of the model come to one another, facet by facet."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.walks import thread_strips
from fabweave.verify.read.glb import Strip

_SIDES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
#: What stands out of a plane by less touches it only; the model is rounded to 32 bits.
GRAZING_MM = 1e-4


def triangle_gaps(first: Floats, second: Floats, reach_mm: float) -> Floats:
    """Return the gaps of pairs of triangles, (N,); 0 where they meet, infinite beyond a reach.

    Parameters
    ----------
    first, second : (N, 3, 3) float arrays
        Corners.
    reach_mm : float
        Wider gaps need not be measured.

    Examples
    --------
    >>> flat = np.array([[[0.0, 0, 0], [3, 0, 0], [0, 3, 0]]])
    >>> triangle_gaps(flat, flat + [1.0, 1, 2], 5.0).tolist()
    [2.0]
    >>> triangle_gaps(flat, flat + [9.0, 0, 0], 5.0).tolist()
    [inf]
    """
    gap = np.full(len(first), np.inf)
    left = np.flatnonzero(~_surely_apart(first, second, reach_mm))
    a, b = first[left], second[left]
    least = np.full(len(left), np.inf)
    for i, j, _ in _SIDES:
        for k, m, _ in _SIDES:
            least = np.minimum(least, _segment_gaps(a[:, i], a[:, j], b[:, k], b[:, m]))
    for triangle, far in ((a, b), (b, a)):
        for k in range(3):
            least = np.minimum(least, _height_inside(far[:, k], triangle))
    none = np.zeros((len(left), 3), dtype=bool)
    least[triangles_cut(a, b, none, none)] = 0.0
    gap[left] = least
    return gap


def triangles_cut(
    first: Floats, second: Floats, own: Flags, others: Flags, slack_mm: float = 0.0
) -> Flags:
    """Tell which triangles have a side that runs through the other triangle.

    Parameters
    ----------
    first, second : (N, 3, 3) float arrays
    own, others : (N, 3) bool arrays
        Which corners both have in common; sides that end there are passed over.
    slack_mm : float
        A line that passes a triangle's border by less still runs through it; or, if negative, must
        pass so far within.

    Returns
    -------
    (N,) bool array

    Examples
    --------
    A side that runs through the very corner of a triangle may cut it, or not:

    >>> flat = np.array([[[0.0, 0, 0], [3, 0, 0], [0, 3, 0]]])
    >>> upright = np.array([[[0.0, 0, -1], [0, 0, 1], [-3, -3, 0]]])
    >>> none = np.zeros((1, 3), dtype=bool)
    >>> [bool(triangles_cut(flat, upright, none, none, slack)[0]) for slack in (0.001, -0.001)]
    [True, False]
    """
    cut = np.zeros(len(first), dtype=bool)
    for triangle, far, common in ((first, second, others), (second, first, own)):
        a, b, c = (triangle[:, k] for k in range(3))
        area = np.cross(b - a, c - a)
        size = np.maximum(np.sqrt(dot(area, area)), 1e-300)
        height = [dot(far[:, k] - a, area) / size for k in range(3)]
        for i, j, _ in _SIDES:
            through = np.minimum(height[i], height[j]) < -GRAZING_MM
            through &= np.maximum(height[i], height[j]) > GRAZING_MM
            rows = np.flatnonzero(through & ~common[:, i] & ~common[:, j])
            if not len(rows):
                continue
            p, q = far[rows, i], far[rows, j]
            # The line passes all three sides of the triangle on one hand: three equal signs.
            way = q - p
            hand = []
            for u, v in ((a, b), (b, c), (c, a)):
                beside = np.cross(way, (v - u)[rows])
                apart = np.maximum(np.sqrt(dot(beside, beside)), 1e-300)
                hand.append(dot(way, np.cross(u[rows] - p, v[rows] - p)) / apart)
            cut[rows] |= np.minimum.reduce(hand) >= -slack_mm
            cut[rows] |= np.maximum.reduce(hand) <= slack_mm
    return cut


def _surely_apart(first: Floats, second: Floats, reach_mm: float) -> Flags:
    """Tell which pairs are farther apart than a reach along one of a few directions."""
    apart = np.zeros(len(first), dtype=bool)
    ways = [second.mean(axis=1) - first.mean(axis=1)]
    ways += [np.cross(one[:, 1] - one[:, 0], one[:, 2] - one[:, 0]) for one in (first, second)]
    for way in ways:
        size = np.sqrt(dot(way, way))
        low, high = (np.einsum("nkd,nd->nk", one, way) for one in (first, second))
        gap = np.maximum(high.min(axis=1) - low.max(axis=1), low.min(axis=1) - high.max(axis=1))
        apart |= gap > reach_mm * size
    return apart


def _segment_gaps(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Return the gaps between segments: inside both, or at one of the four ends."""
    u, v, w = b - a, d - c, c - a
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    area = uu * vv - uv * uv
    skew = area > 1e-12 * uu * vv
    safe = np.where(skew, area, 1.0)
    s = (dot(w, u) * vv - dot(w, v) * uv) / safe
    t = (dot(w, u) * uv - dot(w, v) * uu) / safe
    inside = skew & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    between = w + t[:, None] * v - s[:, None] * u
    least = np.where(inside, dot(between, between), np.inf)
    for point, start, way, square in ((a, c, v, vv), (b, c, v, vv), (c, a, u, uu), (d, a, u, uu)):
        reach = point - start
        share = np.clip(dot(reach, way) / np.maximum(square, 1e-300), 0.0, 1.0)
        off = reach - share[:, None] * way
        least = np.minimum(least, dot(off, off))
    return np.sqrt(least)


def _height_inside(point: Floats, triangle: Floats) -> Floats:
    """Return how far points stand over triangles; infinite where they stand beside them."""
    u, v = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    w = point - triangle[:, 0]
    uu, vv, uv, wu, wv = dot(u, u), dot(v, v), dot(u, v), dot(w, u), dot(w, v)
    area = uu * vv - uv * uv
    good = area > 1e-12 * uu * vv
    safe = np.where(good, area, 1.0)
    s, t = (vv * wu - uv * wv) / safe, (uu * wv - uv * wu) / safe
    inside = good & (s >= 0) & (t >= 0) & (s + t <= 1)
    foot = w - s[:, None] * u - t[:, None] * v
    return np.where(inside, np.sqrt(dot(foot, foot)), np.inf)


def dot(first: Floats, second: Floats) -> Floats:
    """Return the inner products of vectors, row by row."""
    return np.asarray(np.einsum("ij,ij->i", first, second))


#: So many steps are looked up at once, and so many pairs of facets measured.
_BLOCK = 1 << 13


@dataclass(frozen=True, eq=False)
class Steps:
    """All steps from rung to rung of all strips, each two facets, and where along its thread it is.

    Parameters
    ----------
    corner : (S, 2, 3, 3) float array
        Corners of the two facets of each step.
    vertex : (S, 2, 3) int array
        Numbers of those corners: equal numbers are one point.
    thread : (S,) int array
    part : (S,) int array
        Even numbers are panels and odd ones what follows them; -1 what comes before the first.
    parts : (S,) int array
        How many parts lead around the thread; on an open one more than there are.
    crossing : (S, 2) int array
        The crossings at both ends of the part; on a panel twice the same.
    """

    corner: Floats
    vertex: Ints
    thread: Ints
    part: Ints
    parts: Ints
    crossing: Ints


@dataclass(frozen=True, eq=False)
class Near:
    """Parts of ribbons that are within reach of each other and do not lie on each other by design.

    Parameters
    ----------
    parts : (N, 4) int array
        Thread and part of either.
    gap_mm : (N,) float array
        0 where they run through each other.
    sure_mm : (N,) float array
        The same, but infinite where two that follow each other run through each other by no more
        than a rounding.
    parting : (N,) bool array
        Whether they part from one crossing.
    """

    parts: Ints
    gap_mm: Floats
    sure_mm: Floats
    parting: Flags


def cut_steps(plan: CrossingMap, model: dict[str, Strip]) -> Steps:
    """Cut the strips of the map's threads into steps; a thread without its strip is left out."""
    columns: list[tuple[Floats | Ints, ...]] = []
    base = 0
    strips = thread_strips(plan, model)
    for thread in (thread for thread in plan.threads if thread.id in strips):
        strip = strips[thread.id]
        columns.append(_cut(thread.id, np.array(thread.crossings), strip, base))
        base += 2 * len(strip.rungs)
    if not columns:
        none = np.zeros((0, 2), dtype=np.int64)
        empty = none[:, 0]
        return Steps(np.zeros((0, 2, 3, 3)), np.zeros((0, 2, 3), int), empty, empty, empty, none)
    corner, vertex, owner, part, parts, crossing = (
        np.concatenate(column) for column in zip(*columns, strict=True)
    )
    return Steps(corner, vertex, owner, part, parts, crossing)


def facets(strip: Strip) -> Ints:
    """Return which ends of rungs the two facets of each step of a strip have, (S, 2, 3).

    The right ends of rungs are the even numbers, and the left ones the odd.
    """
    right = 2 * np.arange(len(strip.from_right))
    left, beyond = right + 1, (right + 2) % (2 * len(strip.rungs))
    across = beyond + 1
    near = np.column_stack((right, np.where(strip.from_right, across, beyond), left))
    far = np.column_stack((beyond, across, np.where(strip.from_right, right, left)))
    return np.stack((near, far), axis=1)


def _cut(thread: int, crossings: Ints, strip: Strip, base: int) -> tuple[Floats | Ints, ...]:
    """Cut one strip into steps."""
    count, n_stations = len(strip.rungs), len(crossings)
    here, vertex = np.arange(len(strip.from_right)), facets(strip)
    # How many rungs it is since the panel was entered that was entered last.
    by_entry = np.argsort(strip.entry)
    station = by_entry[np.searchsorted(strip.entry[by_entry], here, side="right") - 1]
    since = (here - strip.entry[station]) % count
    panel = since < (strip.exit[station] - strip.entry[station]) % count
    part = 2 * station + ~panel
    end = np.where(panel, station, (station + 1) % n_stations)
    if not strip.closed:
        before = here < strip.entry.min()
        part = np.where(before, -1, part)
        end = np.where((part == 2 * n_stations - 1) | before, station, end)
        station = np.where(before, 0, station)
        end = np.where(before, 0, end)
    around = 2 * n_stations if strip.closed else 4 * n_stations + 4
    return (
        strip.rungs.reshape(-1, 3)[vertex],
        vertex + base,
        np.full(len(here), thread),
        part,
        np.full(len(here), around),
        np.column_stack((crossings[station], crossings[end])),
    )


def near_parts(steps: Steps, reach_mm: float) -> Near:
    """Find the parts of ribbons that come within reach of each other.

    The two panels of one crossing are left out. So are a part and itself, and two parts that
    follow each other along a thread, unless they run through each other.

    Returns
    -------
    Near
        Each pair of parts once.
    """
    keys, gaps, parting = (
        [np.zeros((0, 4), dtype=np.int64)],
        [np.zeros((0, 2))],
        [np.zeros(0, bool)],
    )
    for one, other in _step_pairs(steps, reach_mm):
        beside, kept, parts = _relation(steps, one, other)
        gap = np.full((len(one), 2), np.inf)
        # Each of the two facets of one step against each of the other's.
        for k in (0, 1):
            for m in (0, 1):
                for rows, measure in ((kept, _gaps), (beside, _cuts)):
                    found = measure(steps, one[rows], k, other[rows], m, reach_mm)
                    gap[rows] = np.minimum(gap[rows], found)
        near = np.flatnonzero(gap[:, 0] <= reach_mm)
        key = np.column_stack((steps.thread[one], steps.part[one],
                               steps.thread[other], steps.part[other]))[near]  # fmt: skip
        swap = (key[:, 0] > key[:, 2]) | ((key[:, 0] == key[:, 2]) & (key[:, 1] > key[:, 3]))
        keys.append(np.where(swap[:, None], key[:, [2, 3, 0, 1]], key))
        gaps.append(gap[near])
        parting.append(parts[near])
    key, which = np.unique(np.concatenate(keys), axis=0, return_inverse=True)
    least = np.full((len(key), 2), np.inf)
    np.minimum.at(least, which.ravel(), np.concatenate(gaps))
    from_one = np.zeros(len(key), dtype=bool)
    from_one[which.ravel()] = np.concatenate(parting)
    return Near(key, least[:, 0], least[:, 1], from_one)


def _step_pairs(steps: Steps, reach_mm: float) -> Iterator[tuple[Ints, Ints]]:
    """Yield the pairs of steps whose boxes are within reach, each once, in blocks."""
    low, high = steps.corner.min(axis=(1, 2)), steps.corner.max(axis=(1, 2)) + reach_mm
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    tree = shapely.STRtree(boxes)
    for start in range(0, len(low), _BLOCK):
        one, other = tree.query(boxes[start : start + _BLOCK])
        one = one + start
        keep = one < other
        one, other = one[keep], other[keep]
        keep = (low[one, 2] <= high[other, 2]) & (low[other, 2] <= high[one, 2])
        yield one[keep], other[keep]


def _relation(steps: Steps, one: Ints, other: Ints) -> tuple[Ints, Ints, Flags]:
    """Return which pairs are neighbours along a thread, which others count, and which part."""
    apart = np.abs(steps.part[one] - steps.part[other])
    apart = np.minimum(apart, steps.parts[one] - apart)
    beside = (steps.thread[one] == steps.thread[other]) & (apart <= 1)
    mine, theirs = steps.crossing[one], steps.crossing[other]
    panels = (steps.part[one] % 2 == 0) & (steps.part[other] % 2 == 0)
    stacked = panels & (mine[:, 0] == theirs[:, 0])
    meeting = (mine[:, :, None] == theirs[:, None, :]).any(axis=(1, 2))
    return np.flatnonzero(beside), np.flatnonzero(~beside & ~stacked), meeting


def _gaps(steps: Steps, one: Ints, k: int, other: Ints, m: int, reach_mm: float) -> Floats:
    """Measure facets; what is surely out of reach is infinitely far."""
    gap = np.full(len(one), np.inf)
    for start in range(0, len(one), _BLOCK):
        rows = slice(start, start + _BLOCK)
        gap[rows] = triangle_gaps(
            steps.corner[one[rows], k], steps.corner[other[rows], m], reach_mm
        )
    return gap[:, None]


def _cuts(steps: Steps, one: Ints, k: int, other: Ints, m: int, _reach_mm: float) -> Floats:
    """Return 0 for facets that run through each other though they meet in a corner only.

    In two columns: with those that may do so, and with those only that surely do.
    """
    a, b = steps.vertex[one, k], steps.vertex[other, m]
    shared = a[:, :, None] == b[:, None, :]
    loose = np.flatnonzero(shared.sum(axis=(1, 2)) < 2)
    gap = np.full((len(one), 2), np.inf)
    for column, slack_mm in enumerate((GRAZING_MM, -GRAZING_MM)):
        cut = triangles_cut(
            steps.corner[one[loose], k],
            steps.corner[other[loose], m],
            shared[loose].any(axis=2),
            shared[loose].any(axis=1),
            slack_mm,
        )
        gap[loose[cut], column] = 0.0
    return gap
