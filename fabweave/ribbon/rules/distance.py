"""Measure how far triangles are from one another, many pairs at once."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray

#: Pairs are measured in blocks of this many, which stay in the processor's cache.
_BLOCK = 1 << 12
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
    for start in range(0, len(first), _BLOCK):
        block = slice(start, start + _BLOCK)
        distance[block], midway = _distances(_turned(first[block]), _turned(second[block]))
        place[block] = midway.T
    return distance, place


def apart_by(first: FloatArray, second: FloatArray, reach: FloatArray) -> BoolArray:
    """Tell which pairs of triangles a plane shows to be farther apart than a distance.

    Tried are planes along either triangle and through their edges; pairs that stay may still be
    farther apart.

    Parameters
    ----------
    first, second : (N, 3, 3) float arrays
    reach : (N,) float array

    Returns
    -------
    (N,) bool array
    """
    apart = np.empty(len(first), dtype=bool)
    for start in range(0, len(first), _BLOCK):
        block = slice(start, start + _BLOCK)
        a, b = _turned(first[block]), _turned(second[block])
        here = _beyond_planes(a, b, reach[block])
        # Those that the first triangle's planes do not set apart may be by the other's.
        left = np.flatnonzero(~here)
        here[left] = _beyond_planes(b[:, :, left], a[:, :, left], reach[block][left])
        apart[block] = here
    return apart


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
    for start in range(0, len(first), _BLOCK):
        block = slice(start, start + _BLOCK)
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


def _beyond_planes(triangles: FloatArray, far: FloatArray, reach: FloatArray) -> BoolArray:
    """Return which pairs of one block are set apart by a plane of their near triangle."""
    plane = _Plane(triangles)
    heights = [plane.height(corner) for corner in far]
    apart = (np.minimum.reduce(heights) > reach) | (np.maximum.reduce(heights) < -reach)
    for corner, outward in zip(triangles, plane.outward, strict=True):
        limit = reach * np.sqrt(_dot(outward, outward))
        beyond = [_dot(point - corner, outward) for point in far]
        apart |= np.minimum.reduce(beyond) > limit
    return apart


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
            offer(*_between_edges(first[i], first[j], second[k], second[m]))
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
