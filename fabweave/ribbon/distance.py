"""Measure how far triangles are from one another, many pairs at once."""

import numpy as np

from fabweave.arrays import BoolArray, FloatArray

#: Pairs are measured in blocks of this many, to bound memory.
_BLOCK = 1 << 15
_TURNED = ((0, 1), (1, 2), (2, 0))


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
    for start in range(0, len(first), _BLOCK):
        block = slice(start, start + _BLOCK)
        distance[block], place[block] = _distances(first[block], second[block])
    return distance, place


def apart_by(first: FloatArray, second: FloatArray, reach: float) -> BoolArray:
    """Tell which pairs of triangles a plane shows to be farther apart than a distance.

    Tried are planes along either triangle and through their edges; pairs that stay may still be
    farther apart.

    Parameters
    ----------
    first, second : (N, 3, 3) float arrays
    reach : float

    Returns
    -------
    (N,) bool array
    """
    apart = np.zeros(len(first), dtype=bool)
    left = np.arange(len(first))
    for one, other in ((first, second), (second, first)):
        own, far = one[left], other[left]
        normal = _unit(np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0]))
        beyond = _beyond(own[:, 0], normal, far, reach) | _beyond(own[:, 0], -normal, far, reach)
        for i, j in _TURNED:
            outward = _unit(np.cross(own[:, j] - own[:, i], normal))
            beyond |= _beyond(own[:, i], outward, far, reach)
        apart[left[beyond]] = True
        left = left[~beyond]
    return apart


def _beyond(
    point: FloatArray, outward: FloatArray, triangle: FloatArray, reach: float
) -> BoolArray:
    """Tell which triangles lie wholly beyond planes, by more than a distance."""
    limit = _dot(point, outward) + reach
    beyond = _dot(triangle[:, 0], outward) > limit
    beyond &= _dot(triangle[:, 1], outward) > limit
    return beyond & (_dot(triangle[:, 2], outward) > limit)


def _distances(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure one block."""
    best = np.full(len(first), np.inf)
    place = np.zeros((len(first), 3))

    def offer(distance: FloatArray, midway: FloatArray) -> None:
        nearer = distance < best
        best[nearer], place[nearer] = distance[nearer], midway[nearer]

    for i, j in _TURNED:
        for k, m in _TURNED:
            offer(*_between_edges(first[:, i], first[:, j], second[:, k], second[:, m]))
    for one, other in ((first, second), (second, first)):
        for i, j in _TURNED:
            offer(*_corner_over(one[:, i], other))
            offer(*_edge_through(one[:, i], one[:, j], other))
    return best, place


def _between_edges(
    a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Measure segments a-b and c-d."""
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
    near, far = a + s[:, None] * u, c + t_held[:, None] * v
    return np.sqrt(_dot(near - far, near - far)), (near + far) / 2


def _inside(point: FloatArray, triangle: FloatArray, normal: FloatArray) -> BoolArray:
    """Tell which points lie above or below the inside of their triangles."""
    inside = np.ones(len(point), dtype=bool)
    for i, j in _TURNED:
        side = np.cross(triangle[:, j] - triangle[:, i], point - triangle[:, i])
        inside &= _dot(side, normal) >= 0
    return inside


def _corner_over(point: FloatArray, triangle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure points over triangles; infinite beside them."""
    normal = _unit(np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]))
    height = _dot(point - triangle[:, 0], normal)
    over = _inside(point, triangle, normal) & np.any(normal != 0, axis=1)
    return np.where(over, np.abs(height), np.inf), point - height[:, None] / 2 * normal


def _edge_through(
    a: FloatArray, b: FloatArray, triangle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return 0 for segments that run through triangles, else infinity."""
    normal = _unit(np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]))
    start, end = _dot(a - triangle[:, 0], normal), _dot(b - triangle[:, 0], normal)
    crosses = start * end < 0
    share = np.where(crosses, start / np.where(crosses, start - end, 1.0), 0.0)
    point = a + share[:, None] * (b - a)
    through = crosses & _inside(point, triangle, normal)
    return np.where(through, 0.0, np.inf), point


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", first, second))


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.sqrt(_dot(vectors, vectors))[:, None]
    return vectors / np.where(length > 0, length, 1.0)
