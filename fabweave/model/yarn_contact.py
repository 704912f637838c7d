"""Find where yarns would touch one another or themselves."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.model.yarn_course import Spines

#: Pairs of segments are measured in batches of about this many, which bounds the memory.
_BATCH = 400_000


def bends_too_tightly(spines: Spines) -> IntArray:
    """Return the points at which a yarn's cross-sections would cut one another.

    Cross-sections stand at right angles to the curve. Each must lie wholly behind the next one's
    plane, and in front of the one before; then the stretches between them meet in the
    cross-sections only.

    Returns
    -------
    int array
        Points that are too near to the next one for the angles there.
    """
    following = spines.following
    here = np.flatnonzero(following >= 0)
    after = following[here]
    edge = spines.point[after] - spines.point[here]
    tangent, radius = spines.direction, spines.radius_mm
    # The sine of the angle between the two planes bounds what a section reaches towards the other.
    sine = np.linalg.norm(np.cross(tangent[here], tangent[after]), axis=1)
    ahead = np.einsum("ij,ij->i", edge, tangent[here])
    behind = np.einsum("ij,ij->i", edge, tangent[after])
    turned = np.einsum("ij,ij->i", tangent[here], tangent[after]) <= 0.0
    bad = (ahead <= radius[after] * sine) | (behind <= radius[here] * sine) | turned
    return here[bad]


def touching_points(spines: Spines, *, enough: int | None = None) -> IntArray:
    """Return where yarns touch that are not the same bit of yarn, (K, 2) pairs of points.

    Yarns whose middle lines are everywhere farther apart than both radii together do not touch,
    and nor do their facets: every point of a facet is nearer to the middle line than the radius.
    Along one and the same yarn, points nearer than half a turn of the tightest bend are left to
    ``bends_too_tightly``.

    Parameters
    ----------
    spines : Spines
    enough : int or None
        Of more pairs than these, not all need be found.

    Returns
    -------
    (K, 2) int array
        The stretches from these points to the next ones touch.
    """
    following = spines.following
    here = np.flatnonzero(following >= 0)
    ends = spines.point[here], spines.point[following[here]]
    length = np.linalg.norm(ends[1] - ends[0], axis=1)
    radius = np.maximum(spines.radius_mm[here], spines.radius_mm[following[here]])
    thread = spines.thread[here]
    past = np.cumsum(length)
    around = np.bincount(thread, weights=length, minlength=len(spines.closed))
    around = np.where(spines.closed, around, np.inf)
    middle = (ends[0] + ends[1]) / 2
    found, count = [np.zeros((0, 2), dtype=np.int64)], 0
    for one, other in _near_pairs(middle, radius + length / 2):
        same = thread[one] == thread[other]
        away = np.abs((past - length / 2)[one] - (past - length / 2)[other])
        away = np.minimum(away, around[thread[one]] - away) - (length[one] + length[other]) / 2
        reach = np.maximum(radius[one], radius[other])
        apart = np.flatnonzero(~same | (away >= np.pi * reach))
        one, other = one[apart], other[apart]  # noqa: PLW2901 - the batch, thinned out
        distance = segment_distances(ends[0][one], ends[1][one], ends[0][other], ends[1][other])
        bad = np.flatnonzero(distance <= radius[one] + radius[other])
        found.append(np.column_stack((here[one[bad]], here[other[bad]])))
        count += len(bad)
        if enough is not None and count > enough:
            break
    return np.concatenate(found)


def _near_pairs(middle: FloatArray, reach: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield pairs of balls that overlap, each once, in batches.

    Balls go in classes by half powers of two of their size, so that small ones are not compared
    over the distances of large ones.
    """
    level = np.floor(2.0 * np.log2(np.maximum(reach, 1e-300))).astype(np.int64)
    for size in np.unique(level).tolist():
        own, lower = np.flatnonzero(level == size), np.flatnonzero(level < size)
        tree = cKDTree(middle[own])
        most = 2.0 * float(reach[own].max())
        pairs = tree.query_pairs(most, output_type="ndarray")
        yield from _overlapping(own[pairs[:, 0]], own[pairs[:, 1]], middle, reach)
        if len(lower):
            found = tree.query_ball_point(middle[lower], float(reach[own].max()) + reach[lower])
            counts = np.fromiter(map(len, found), dtype=np.int64, count=len(found))
            near = np.flatnonzero(counts)
            if len(near):
                other = np.concatenate([found[index] for index in near.tolist()]).astype(np.int64)
                yield from _overlapping(
                    own[other], np.repeat(lower[near], counts[near]), middle, reach
                )


def _overlapping(
    one: IntArray, other: IntArray, middle: FloatArray, reach: FloatArray
) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield those of the pairs whose balls overlap, in batches."""
    for first in range(0, len(one), _BATCH):
        a, b = one[first : first + _BATCH], other[first : first + _BATCH]
        away = middle[a] - middle[b]
        kept = np.einsum("ij,ij->i", away, away) <= (reach[a] + reach[b]) ** 2
        if kept.any():
            yield a[kept], b[kept]


def segment_distances(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Return the distance between each segment from a to b and the one from c to d.

    Either both nearest points are inside, or one of them is an end: the least of the five cases
    is the distance.

    Parameters
    ----------
    a, b, c, d : (P, 3) float arrays
        End points.

    Returns
    -------
    (P,) float array

    Examples
    --------
    >>> a, b = np.array([[-1.0, 0, 0]]), np.array([[1.0, 0, 0]])
    >>> segment_distances(a, b, np.array([[0, -1.0, 2]]), np.array([[0, 1.0, 2]])).tolist()
    [2.0]
    >>> segment_distances(a, b, np.array([[4.0, 4, 0]]), np.array([[4.0, 9, 0]])).tolist()
    [5.0]
    """
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = (np.einsum("ij,ij->i", x, y) for x, y in ((u, u), (u, v), (v, v)))
    uw, vw = np.einsum("ij,ij->i", u, w), np.einsum("ij,ij->i", v, w)
    det = uu * vv - uv * uv
    crossing = det > 1e-12 * uu * vv
    safe = np.where(crossing, det, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inside = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    gap = w + s[:, None] * u - t[:, None] * v
    least = np.where(inside, np.einsum("ij,ij->i", gap, gap), np.inf)
    for point, start, way, size in ((a, c, v, vv), (b, c, v, vv), (c, a, u, uu), (d, a, u, uu)):
        from_start = point - start
        share = np.einsum("ij,ij->i", from_start, way) / np.maximum(size, 1e-300)
        off = from_start - np.clip(share, 0.0, 1.0)[:, None] * way
        least = np.minimum(least, np.einsum("ij,ij->i", off, off))
    return np.sqrt(least)
