"""Measure how near ribbons come to one another where they do not cross."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, unit
from fabweave.core.errors import CannotMakeError
from fabweave.ribbon.facets import Facets, cut_facets, facet_pairs
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.rules.distance import apart_by, piercing, triangle_distances
from fabweave.ribbon.stretches import (
    Stretches,
    cut_stretches,
    neighbours,
    passes_along,
    steps_apart,
    triangles_of,
)


def folded_pairs(
    stretches: Stretches, facets: Facets, pairs: IntArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the pairs of neighbouring stretches that run through each other.

    Facets that follow each other along a ribbon share an edge or a corner, and are always near:
    no distance can be asked of them, but they must meet in what they share only. Where
    cross-lines of a tight bend cross one another, they do not.

    Parameters
    ----------
    stretches : Stretches
    facets : Facets
    pairs : (N, 2) int array
        Each the same stretch twice, or two that follow each other.

    Returns
    -------
    pairs : (K, 2) int array
    distance : (K,) float array
        All 0.
    place : (K, 3) float array
        In the middle of one pair of facets that run through each other.
    """
    kept, places = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    for which, first, second in facet_pairs(stretches, facets, pairs, np.zeros(len(pairs))):
        twice = pairs[which, 0] == pairs[which, 1]
        once = np.flatnonzero(~twice | (first < second))
        same = facets.vertices[first[once]][:, :, None] == facets.vertices[second[once]][:, None, :]
        n_shared = same.sum(axis=(1, 2))
        loose = np.flatnonzero(n_shared < 2)
        once, same = once[loose], same[loose]
        shared = np.full((len(once), 2), -1, dtype=np.int64)
        at, corner, other_corner = np.nonzero(same)
        shared[at] = np.column_stack((corner, other_corner))
        a, b = facets.corners[first[once]], facets.corners[second[once]]
        bad = np.flatnonzero(piercing(a, b, shared))
        numbers, begin = np.unique(which[once[bad]], return_index=True)
        kept.append(numbers)
        places.append((a[bad[begin]].mean(axis=1) + b[bad[begin]].mean(axis=1)) / 2)
    folded = pairs[np.concatenate(kept)]
    return folded, np.zeros(len(folded)), np.concatenate(places)


def run_straight(ribbons: Ribbons, stretches: Stretches) -> BoolArray:
    """Tell after which passes a ribbon surely does not run through itself, (P,).

    Looked at is what leads from the panel of a pass to the next panel, both included. Seen along
    one direction, let all its rails run within 45 degrees of one way, and all its cross-lines
    within 45 degrees of the way at right angles to it. Each facet is bounded by a bit of rail and a
    cross-line. So from any point of the strip to any other that lies further along it, or as far
    along and further across, one of the two diagonals of these ways rises all the time: no two
    points come to lie on each other.

    Parameters
    ----------
    ribbons : Ribbons
    stretches : Stretches
        Of these ribbons.

    Returns
    -------
    (P,) bool array
        False where it may, or may not, run through itself.
    """
    count = len(ribbons.entry)
    following = following_rung(ribbons.offsets, ribbons.closed)
    next_pass = following_rung(ribbons.pass_offsets, ribbons.closed)
    panel = ribbons.entry
    ahead = panel[np.where(next_pass >= 0, next_pass, np.arange(count))]
    rung, middle = ribbons.left - ribbons.right, ribbons.left + ribbons.right
    way = np.where(
        (next_pass >= 0)[:, None],
        middle[ahead] + middle[ahead + 1] - middle[panel] - middle[panel + 1],
        middle[panel + 1] - middle[panel],
    )
    way = unit(way)
    across = rung[panel] + rung[panel + 1] + rung[ahead] + rung[ahead + 1]
    across = unit(across - np.einsum("ij,ij->i", across, way)[:, None] * way)
    starts, ends = stretches.offsets[count : 2 * count] // 2, stretches.offsets[count + 1 :] // 2
    between = np.repeat(np.arange(count), ends[:count] - starts)
    straight = np.ones(count, dtype=bool)
    for owner, quads in (
        (
            (np.arange(count), panel),
            (between, stretches.triangle[2 * starts[0] : 2 * ends[count - 1] : 2] // 2),
            (np.arange(count), ahead),
        )
        if count
        else ()
    ):
        after = following[quads]
        for rail in (ribbons.right, ribbons.left):
            step = rail[after] - rail[quads]
            straight[owner[~_steeper(step, way[owner], across[owner])]] = False
        for line in (rung[quads], rung[after]):
            straight[owner[~_steeper(line, across[owner], way[owner])]] = False
    return straight


def _steeper(vectors: FloatArray, main: FloatArray, side: FloatArray) -> BoolArray:
    """Tell which vectors go farther along one direction than either way along another."""
    farther = np.einsum("ij,ij->i", vectors, main) > np.abs(np.einsum("ij,ij->i", vectors, side))
    return np.asarray(farther)


#: Stretches are looked up, and pairs measured, in blocks of this many.
_BLOCK = 1 << 14
#: Blocks are smaller where so many pairs of boxes might come of one.
_MOST_CANDIDATES = 1 << 23
#: Of objects that can be made, and of those that a larger size would mend, a stretch is near to a
#: few others. With more near pairs than so many for each stretch, and so many at all, the object is
#: all but filled with material, and looking for more would take memory and time without end.
_NEAR_EACH, _FEW_NEAR = 8, 8000
#: A view along which no wall of a usual shape is seen edge-on: the rows are a rotation.
_TILT = np.linalg.qr(np.array([[1.0, 0.37, 0.61], [-0.29, 1.0, 0.43], [-0.53, -0.31, 1.0]]))[0].T


@frozen_value
class Nearness:
    """Pairs of stretches that come within reach of each other.

    Parameters
    ----------
    pairs : (N, 2) int array
        Stretches as :func:`~fabweave.ribbon.stretches.cut_stretches` numbers them; the smaller
        number first.
    distance_mm : (N,) float array
        Between the middle surfaces; 0 where they run through each other.
    place : (N, 3) float array
        Where, midway between the closest points.
    """

    pairs: IntArray
    distance_mm: FloatArray
    place: FloatArray


def near_pairs(
    ribbons: Ribbons,
    crossing: IntArray,
    reach_mm: float,
    among: IntArray | None = None,
    beside: IntArray | None = None,
    wanted: Callable[[IntArray], FloatArray] | None = None,
) -> Nearness:
    """Find stretches of ribbon that come within reach of each other and do not cross there.

    The two panels of one crossing, which lie on each other by design, are left out. A stretch and
    itself, or the next one along its thread, are a pair where they run through each other.
    Boxes around stretches are looked up in a tree, planes between facets sort out most pairs, and
    the others are measured exactly.

    Parameters
    ----------
    ribbons : Ribbons
    crossing : (P,) int array
        The crossing that each pass makes.
    reach_mm : float
        Pairs farther apart are left out.
    among : (N, 2) int array, optional
        Look only at these pairs of stretches.
    beside : (M,) int array, optional
        Look only at pairs of which one, or both, is one of these stretches.
    wanted : callable
        Tells how near pairs must be to be listed, (N,), no farther than the reach; without it,
        within reach.

    Returns
    -------
    Nearness
        Sorted by pairs.

    Raises
    ------
    CannotMakeError
        If so many pairs are near that the object is all but filled with material.
    """
    stretches = cut_stretches(ribbons)
    if among is None:
        facets = cut_facets(ribbons, stretches.triangle[::2] // 2)
        selected = np.full(len(stretches.thread), beside is None)
        if beside is not None:
            selected[beside] = True
        blocks: Iterable[IntArray] = _boxes_within_reach(ribbons, stretches, reach_mm, selected)
        next_to = neighbours(stretches)
        next_to = next_to[selected[next_to].any(axis=1)]
    else:
        triangles = triangles_of(stretches, np.unique(among))
        facets = cut_facets(ribbons, triangles[::2] // 2)
        blocks = (among[start : start + _BLOCK] for start in range(0, len(among), _BLOCK))
        steps = steps_apart(stretches, among)
        next_to = among[(steps == 0) | (steps == 1)]
    along = passes_along(stretches, next_to)
    straight = (along >= 0) & run_straight(ribbons, stretches)[along]
    measurements = [folded_pairs(stretches, facets, next_to[~straight])]
    most = max(_FEW_NEAR, _NEAR_EACH * (len(stretches.offsets) - 1))
    count = 0
    for block in blocks:
        pairs = block[_apart(stretches, crossing, block)]
        reach = np.full(len(pairs), reach_mm) if wanted is None else wanted(pairs)
        measurements.append(_measure(stretches, facets, pairs, reach))
        count += len(measurements[-1][0])
        if count > most:
            raise CannotMakeError(
                f"the object is too small for its material: more than {most} pairs of ribbons, "
                f"which do not cross there, are nearer than the {reach_mm:g} mm of one thickness "
                "and the clearance, so most of the object is filled with material; use a much "
                "larger --size, a thinner material, a smaller --clearance, or a coarser mesh"
            )
    return in_order(*(np.concatenate(part) for part in zip(*measurements, strict=True)))


def in_order(pairs: IntArray, distance_mm: FloatArray, place: FloatArray) -> Nearness:
    """Return pairs of stretches sorted by their numbers."""
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return Nearness(pairs[order], distance_mm[order], place[order])


def _boxes_within_reach(
    ribbons: Ribbons, stretches: Stretches, reach_mm: float, selected: BoolArray
) -> Iterator[IntArray]:
    """Yield pairs of stretches, one of them asked for, whose boxes are within reach, in blocks."""
    filled = np.flatnonzero(np.diff(stretches.offsets) > 0)
    if not len(filled):
        return
    quads = stretches.triangle[::2] // 2
    after = following_rung(ribbons.offsets, ribbons.closed)[quads]
    rails = [rail @ _TILT.T for rail in (ribbons.right, ribbons.left)]
    ends = [rail[rungs] for rail in rails for rungs in (quads, after)]
    starts = stretches.offsets[:-1][filled] // 2
    low = np.minimum.reduceat(np.minimum.reduce(ends), starts) - reach_mm / 2
    high = np.maximum.reduceat(np.maximum.reduce(ends), starts) + reach_mm / 2
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    tree = shapely.STRtree(boxes)
    selected = selected[filled]
    rows = np.flatnonzero(selected)
    # Where all is near to all, a block holds no more pairs than memory has room for.
    block = min(_BLOCK, max(_MOST_CANDIDATES // len(filled), 1))
    for start in range(0, len(rows), block):
        first, second = tree.query(boxes[rows[start : start + block]])
        first = rows[first + start]
        keep = (first < second) | ((first > second) & ~selected[second])
        first, second = first[keep], second[keep]
        keep = (low[first, 2] <= high[second, 2]) & (low[second, 2] <= high[first, 2])
        first, second = filled[first[keep]], filled[second[keep]]
        for at in range(0, len(first), _BLOCK):
            pairs = np.column_stack((first[at : at + _BLOCK], second[at : at + _BLOCK]))
            pairs.sort(axis=1)
            yield pairs


def _apart(stretches: Stretches, crossing: IntArray, pairs: IntArray) -> IntArray:
    """Return which pairs are neither neighbours along a thread nor the two panels of a crossing."""
    first, second = pairs.T
    count = len(crossing)
    steps = steps_apart(stretches, pairs)
    panels = (first < count) & (second < count)
    crossed = np.zeros(len(pairs), dtype=bool)
    crossed[panels] = crossing[first[panels]] == crossing[second[panels]]
    return np.flatnonzero(((steps < 0) | (steps > 1)) & ~crossed)


def _measure(
    stretches: Stretches, facets: Facets, pairs: IntArray, reach: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Measure pairs of stretches by all pairs of their facets; drop those out of their reach."""
    distance = np.full(len(pairs), np.inf)
    place = np.zeros((len(pairs), 3))
    corners = facets.corners
    for which, first, second in facet_pairs(stretches, facets, pairs, reach):
        keep = np.flatnonzero(~apart_by(corners[first], corners[second], reach[which]))
        if not len(keep):
            continue
        gap, midway = triangle_distances(corners[first[keep]], corners[second[keep]])
        # The pairs of facets of one pair of stretches stand in a row.
        starts = np.flatnonzero(np.diff(which[keep], prepend=-1))
        least = np.minimum.reduceat(gap, starts)
        rows = np.flatnonzero(gap == np.repeat(least, np.diff(starts, append=len(gap))))
        rows = rows[np.flatnonzero(np.diff(which[keep[rows]], prepend=-1))]
        pair = which[keep[rows]]
        distance[pair], place[pair] = gap[rows], midway[rows]
    near = distance <= reach
    return pairs[near], distance[near], place[near]
