"""Measure how near ribbons come to one another where they do not cross."""

from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.arrays import FloatArray, IntArray, frozen
from fabweave.ribbon.distance import apart_by, triangle_distances
from fabweave.ribbon.facets import Facets, cut_facets, facet_pairs
from fabweave.ribbon.folding import folded_pairs
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.stretches import (
    Stretches,
    cut_stretches,
    neighbours,
    steps_apart,
    triangles_of,
)

#: Stretches are looked up in blocks of this many.
_BLOCK = 1 << 14
#: A view along which no wall of a usual shape is seen edge-on: the rows are a rotation.
_TILT = np.linalg.qr(np.array([[1.0, 0.37, 0.61], [-0.29, 1.0, 0.43], [-0.53, -0.31, 1.0]]))[0].T


@dataclass(frozen=True, eq=False)
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

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("pairs", "distance_mm", "place"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def near_pairs(
    ribbons: Ribbons, crossing: IntArray, reach_mm: float, among: IntArray | None = None
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

    Returns
    -------
    Nearness
        Sorted by pairs.
    """
    stretches = cut_stretches(ribbons)
    if among is None:
        facets = cut_facets(ribbons, stretches.triangle[::2] // 2)
        blocks = _boxes_within_reach(stretches, facets, reach_mm)
        beside = neighbours(stretches)
    else:
        own = triangles_of(stretches, np.unique(among))
        facets = cut_facets(ribbons, own[::2] // 2)
        blocks = [among[start : start + _BLOCK] for start in range(0, len(among), _BLOCK)]
        steps = steps_apart(stretches, among)
        beside = among[(steps == 0) | (steps == 1)]
    found = [folded_pairs(stretches, facets, beside)]
    for block in blocks:
        pairs = block[_apart(stretches, crossing, block)]
        found.append(_measure(stretches, facets, pairs, reach_mm))
    pairs, distance, place = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return Nearness(pairs[order], distance[order], place[order])


def _boxes_within_reach(stretches: Stretches, facets: Facets, reach_mm: float) -> list[IntArray]:
    """Return the pairs of stretches whose boxes are within reach, in blocks."""
    filled = np.flatnonzero(np.diff(stretches.offsets) > 0)
    if not len(filled):
        return []
    points = facets.corners[stretches.triangle] @ _TILT.T
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


def _apart(stretches: Stretches, crossing: IntArray, pairs: IntArray) -> IntArray:
    """Return which pairs are neither neighbours along a thread nor the two panels of a crossing."""
    one, other = pairs.T
    count = len(crossing)
    steps = steps_apart(stretches, pairs)
    panels = (one < count) & (other < count)
    crossed = np.zeros(len(pairs), dtype=bool)
    crossed[panels] = crossing[one[panels]] == crossing[other[panels]]
    return np.flatnonzero(((steps < 0) | (steps > 1)) & ~crossed)


def _measure(
    stretches: Stretches, facets: Facets, pairs: IntArray, reach_mm: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Measure pairs of stretches by all pairs of their facets; drop those out of reach."""
    distance = np.full(len(pairs), np.inf)
    place = np.zeros((len(pairs), 3))
    corners = facets.corners
    for which, first, second in facet_pairs(stretches, facets, pairs, reach_mm):
        keep = np.flatnonzero(~apart_by(corners[first], corners[second], reach_mm))
        gap, midway = triangle_distances(corners[first[keep]], corners[second[keep]])
        order = np.lexsort((gap, which[keep]))
        pair = which[keep][order]
        fresh = np.flatnonzero(np.diff(pair, prepend=-1))
        distance[pair[fresh]], place[pair[fresh]] = gap[order][fresh], midway[order][fresh]
    near = distance <= reach_mm
    return pairs[near], distance[near], place[near]
