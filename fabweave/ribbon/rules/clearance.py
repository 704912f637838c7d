"""Measure how near ribbons come to one another where they do not cross."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.errors import CannotMakeError
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.stretches import (
    Facets,
    Stretches,
    cut_facets,
    cut_stretches,
    facet_pairs,
    neighbours,
    steps_apart,
    triangles_of,
)

#: Pairs are measured in blocks of this many, which stay in the processor's cache.
_PAIRS_AT_ONCE = 1 << 12
_TURNED = ((0, 1), (1, 2), (2, 0))
#: What stands out of a plane by less touches it, and does not run through it.
_GRAZING_MM = 1e-6

# Within this module vectors are (3, N) arrays, so that every operation runs through memory in
# order; triangles are (3, 3, N): corner, axis, pair.


def triangle_distances(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the distances of pairs of triangles, and points midway between the closest points.

    Two triangles that do not meet are closest either between two edges, or between a corner of one
    and the inside of the other.

    Parameters
    ----------
    first, second : (N, 3, 3) float arrays
        Corners of the triangles of each pair.

    Returns
    -------
    distance : (N,) float array
        0 where the triangles meet.
    place : (N, 3) float array

    References
    ----------
    C. Ericson, Real-Time Collision Detection (2005), section 5.1.

    Examples
    --------
    >>> flat = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]])
    >>> float(triangle_distances(flat, flat + [0, 0, 1.5])[0][0])
    1.5
    >>> float(triangle_distances(flat, flat[:, :, [2, 0, 1]] + [0.5, 0.5, -0.5])[0][0])
    0.0
    """
    distance, place = np.empty(len(first)), np.empty((len(first), 3))
    for start in range(0, len(first), _PAIRS_AT_ONCE):
        block = slice(start, start + _PAIRS_AT_ONCE)
        distance[block], midway = _distances(_turned(first[block]), _turned(second[block]))
        place[block] = midway.T
    return distance, place


def piercing(first: FloatArray, second: FloatArray, shared: IntArray) -> BoolArray:
    """Tell which triangles of a chain run through each other, beyond a corner that they share.

    Parameters
    ----------
    first, second : (N, 3, 3) float arrays
        Corners of the triangles of each pair; no two with an edge in common.
    shared : (N, 2) int array
        Which corner of either is the same point; -1 for none.

    Returns
    -------
    (N,) bool array

    Examples
    --------
    >>> flat = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]])
    >>> steep = np.array([[[0.0, 0, 0], [1, 1, -1], [1, 1, 2]]])
    >>> piercing(flat, steep, np.array([[0, 0]])), piercing(flat, -steep, np.array([[0, 0]]))
    (array([ True]), array([False]))
    """
    pierces = np.zeros(len(first), dtype=bool)
    for start in range(0, len(first), _PAIRS_AT_ONCE):
        block = slice(start, start + _PAIRS_AT_ONCE)
        sides = (_turned(first[block]), _turned(second[block]))
        for side in (0, 1):
            plane, far = _Plane(sides[side]), sides[1 - side]
            heights = [plane.height(corner) for corner in far]
            heights = [np.where(np.abs(height) > _GRAZING_MM, height, 0.0) for height in heights]
            for i, j in _TURNED:
                # An edge that ends in the common corner touches the triangle there, by design.
                away = (shared[block, 1 - side] != i) & (shared[block, 1 - side] != j)
                through, _ = _edge_through(far[i], far[j], heights[i], heights[j], plane)
                pierces[block] |= through & away
    return pierces


class _Plane:
    """Triangles with their unit normals and, in their planes, outward directions of their edges."""

    def __init__(self, corners: FloatArray) -> None:
        self.corners = corners
        sides = [corners[j] - corners[i] for i, j in _TURNED]
        self.normal = _unit(_cross(sides[0], -sides[2]))
        self.outward = [_cross(side, self.normal) for side in sides]

    def height(self, point: FloatArray) -> FloatArray:
        """Return how far points stand over the planes."""
        return _dot(point - self.corners[0], self.normal)

    def holds(self, point: FloatArray) -> BoolArray:
        """Tell which points lie above or below the inside of the triangles."""
        inside = _dot(point - self.corners[0], self.outward[0]) <= 0
        for corner, outward in zip(self.corners[1:], self.outward[1:], strict=True):
            inside &= _dot(point - corner, outward) <= 0
        return inside


def _distances(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure one block."""
    best = np.full(first.shape[2], np.inf)
    place = np.zeros(first.shape[1:])

    def offer(distance: FloatArray, midway: FloatArray) -> None:
        nearer = np.flatnonzero(distance < best)
        best[nearer] = distance[nearer]
        place[:, nearer] = midway[:, nearer]

    for i, j in _TURNED:
        for k, m in _TURNED:
            offer(*segment_distances(first[i], first[j], second[k], second[m]))
    for base, far in ((first, second), (second, first)):
        plane = _Plane(base)
        heights = [plane.height(corner) for corner in far]
        flat = ~np.any(plane.normal != 0, axis=0)
        for corner, height in zip(far, heights, strict=True):
            over = plane.holds(corner) & ~flat
            offer(np.where(over, np.abs(height), np.inf), corner - height / 2 * plane.normal)
        for i, j in _TURNED:
            through, point = _edge_through(far[i], far[j], heights[i], heights[j], plane)
            offer(np.where(through, 0.0, np.inf), point)
    return best, place


def segment_distances(
    a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how far segments a-b and c-d are apart, (N,), and points midway, (3, N).

    Parameters
    ----------
    a, b, c, d : (3, N) float arrays
        End points.

    Examples
    --------
    >>> ends = ([-1.0, 0, 0], [1, 0, 0], [4, 4, 0], [4, 9, 0])
    >>> segment_distances(*(np.array([end]).T for end in ends))[0].tolist()
    [5.0]
    """
    u, v, w = b - a, d - c, a - c
    uu, vv, uv, uw, vw = _dot(u, u), _dot(v, v), _dot(u, v), _dot(u, w), _dot(v, w)
    denominator = uu * vv - uv * uv
    skew = denominator > 1e-14 * uu * vv
    s = np.where(skew, (uv * vw - uw * vv) / np.where(skew, denominator, 1.0), 0.0)
    s = np.clip(s, 0.0, 1.0)
    t = (uv * s + vw) / np.where(vv > 0, vv, 1.0)
    t_held = np.clip(t, 0.0, 1.0)
    again = np.clip((uv * t_held - uw) / np.where(uu > 0, uu, 1.0), 0.0, 1.0)
    s = np.where(t == t_held, s, again)
    near, far = a + s * u, c + t_held * v
    gap = near - far
    return np.sqrt(_dot(gap, gap)), (near + far) / 2


def _edge_through(
    a: FloatArray, b: FloatArray, start: FloatArray, end: FloatArray, plane: _Plane
) -> tuple[BoolArray, FloatArray]:
    """Tell which segments run through triangles, and where; start and end are their heights."""
    crosses = start * end < 0
    share = np.where(crosses, start / np.where(crosses, start - end, 1.0), 0.0)
    point = a + share * (b - a)
    return crosses & plane.holds(point), point


def _turned(triangles: FloatArray) -> FloatArray:
    """Return triangles (N, 3, 3) as (3, 3, N): corner, axis, pair."""
    return np.ascontiguousarray(triangles.transpose(1, 2, 0))


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(first[0] * second[0] + first[1] * second[1] + first[2] * second[2])


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.stack(
        (
            first[1] * second[2] - first[2] * second[1],
            first[2] * second[0] - first[0] * second[2],
            first[0] * second[1] - first[1] * second[0],
        )
    )


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.sqrt(_dot(vectors, vectors))
    return vectors / np.where(length > 0, length, 1.0)


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
    wanted: Callable[[IntArray], FloatArray],
    among: IntArray | None = None,
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
    wanted : callable
        Tells how near pairs must be to be listed, (N,), no farther than the reach.
    among : (N, 2) int array, optional
        Look only at these pairs of stretches.

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
        blocks: Iterable[IntArray] = _boxes_within_reach(ribbons, stretches, reach_mm)
        next_to = neighbours(stretches)
    else:
        triangles = triangles_of(stretches, np.unique(among))
        facets = cut_facets(ribbons, triangles[::2] // 2)
        blocks = (among[start : start + _BLOCK] for start in range(0, len(among), _BLOCK))
        steps = steps_apart(stretches, among)
        next_to = among[(steps == 0) | (steps == 1)]
    measurements = [folded_pairs(stretches, facets, next_to)]
    most = max(_FEW_NEAR, _NEAR_EACH * (len(stretches.offsets) - 1))
    count = 0
    for block in blocks:
        pairs = block[_apart(stretches, crossing, block)]
        measurements.append(_measure(stretches, facets, pairs, wanted(pairs)))
        count += len(measurements[-1][0])
        if count > most:
            raise CannotMakeError(
                f"the object is too small for its material: more than {most} pairs of ribbons, "
                f"which do not cross there, are nearer than the {reach_mm:g} mm of one thickness "
                "and the clearance, so most of the object is filled with material; use a much "
                "larger --size, a thinner material, a smaller --clearance, or a coarser mesh"
            )
    pairs, distance_mm, place = (np.concatenate(part) for part in zip(*measurements, strict=True))
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return Nearness(pairs[order], distance_mm[order], place[order])


def _boxes_within_reach(
    ribbons: Ribbons, stretches: Stretches, reach_mm: float
) -> Iterator[IntArray]:
    """Yield pairs of stretches whose boxes are within reach, in blocks."""
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
    # Where all is near to all, a block holds no more pairs than memory has room for.
    block = min(_BLOCK, max(_MOST_CANDIDATES // len(filled), 1))
    for start in range(0, len(filled), block):
        first, second = tree.query(boxes[start : start + block])
        first = first + start
        keep = first < second
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
        if not len(which):
            continue
        gap, midway = triangle_distances(corners[first], corners[second])
        # The pairs of facets of one pair of stretches stand in a row.
        starts = np.flatnonzero(np.diff(which, prepend=-1))
        least = np.minimum.reduceat(gap, starts)
        rows = np.flatnonzero(gap == np.repeat(least, np.diff(starts, append=len(gap))))
        rows = rows[np.flatnonzero(np.diff(which[rows], prepend=-1))]
        pair = which[rows]
        distance[pair], place[pair] = gap[rows], midway[rows]
    near = distance <= reach
    return pairs[near], distance[near], place[near]
