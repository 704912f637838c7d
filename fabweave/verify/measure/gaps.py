"""Measure the gap between two triangles in space, for many pairs at once."""

import numpy as np

from fabweave.verify.drawing import Flags, Floats

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
