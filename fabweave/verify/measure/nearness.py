"""Measure how near the ribbons of the model come to one another, facet by facet."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.gaps import GRAZING_MM, triangle_gaps, triangles_cut
from fabweave.verify.read.glb import Strip

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
    for thread in plan.threads:
        strip = model.get(thread.label)
        if strip is None or not thread.crossings or len(strip.entry) != len(thread.crossings):
            continue
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


def _cut(thread: int, crossings: Ints, strip: Strip, base: int) -> tuple[Floats | Ints, ...]:
    """Cut one strip into steps."""
    count, n_stations = len(strip.rungs), len(crossings)
    here = np.arange(count if strip.closed else count - 1)
    after = (here + 1) % count
    right, left = 2 * here, 2 * here + 1
    beyond, across = 2 * after, 2 * after + 1
    slanted = strip.from_right
    near = np.column_stack((right, np.where(slanted, across, beyond), left))
    far = np.column_stack((beyond, across, np.where(slanted, right, left)))
    vertex = np.stack((near, far), axis=1)
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
