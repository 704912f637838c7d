"""Sweep cross-sections along polylines, without needless twist."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.model.yarn_course import Spines


def sweep(spines: Spines, sides: int) -> FloatArray:
    """Return the corners of a regular polygon around each point, turned as little as can be.

    From point to point the frame is carried on by two reflections, which turn it about the
    curve's direction as little as can be. Around a ring some angle is left over; it is spread
    evenly over the ring's length, so that the ends meet.

    Parameters
    ----------
    spines : Spines
        The middle lines.
    sides : int
        Corners of each polygon.

    Returns
    -------
    (N, sides, 3) float array
        Counter-clockwise around the walking direction, at the radius of each point.

    References
    ----------
    Wang, Jüttler, Zheng, Liu, "Computation of rotation minimizing frames", ACM TOG 27(1), 2008.
    """
    direction = spines.direction
    first = _any_normals(direction)
    second = np.cross(direction, first)
    turn = _frame_angles(spines, direction, first, second)
    around = turn[:, None] + 2.0 * np.pi * np.arange(sides) / sides
    radius = spines.radius_mm[:, None]
    corner = (radius * np.cos(around))[:, :, None] * first[:, None, :]
    corner += (radius * np.sin(around))[:, :, None] * second[:, None, :]
    return np.asarray(spines.point[:, None, :] + corner, dtype=np.float64)


def _any_normals(direction: FloatArray) -> FloatArray:
    """Return some unit vector at right angles to each direction."""
    axis = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    normal = np.cross(direction, axis)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)


def _frame_angles(
    spines: Spines, direction: FloatArray, first: FloatArray, second: FloatArray
) -> FloatArray:
    """Return how far the least turned frame stands from the given one at each point, (N,)."""
    following = spines.following
    here = np.flatnonzero(following >= 0)
    after = following[here]
    edge = spines.point[after] - spines.point[here]
    carried = _carried(first[here], direction[here], direction[after], edge)
    step = np.zeros(len(direction))
    step[here] = np.arctan2(
        np.einsum("ij,ij->i", carried, second[after]), np.einsum("ij,ij->i", carried, first[after])
    )
    length = np.zeros(len(direction))
    length[here] = np.linalg.norm(edge, axis=1)
    turn, way = _running(step, spines.offsets), _running(length, spines.offsets)
    filled = np.flatnonzero(np.diff(spines.offsets) > 0)
    last = spines.offsets[filled + 1] - 1
    around, total = np.zeros(len(spines.closed)), np.ones(len(spines.closed))
    # What is left over after a ring, the nearer way round.
    left_over = np.remainder(turn[last] + step[last] + np.pi, 2.0 * np.pi) - np.pi
    around[filled] = np.where(spines.closed[filled], left_over, 0.0)
    total[filled] = np.maximum(way[last] + length[last], 1e-300)
    thread = spines.thread
    return turn - around[thread] * way / total[thread]


def _carried(
    normal: FloatArray, direction: FloatArray, onward: FloatArray, edge: FloatArray
) -> FloatArray:
    """Carry normals by two reflections: across each edge's middle, then into the new plane."""
    normal, reflected = _reflected(normal, edge), _reflected(direction, edge)
    return _reflected(normal, onward - reflected)


def _reflected(vector: FloatArray, mirror: FloatArray) -> FloatArray:
    """Reflect vectors in the planes across others; where these vanish, nothing changes."""
    size = np.einsum("ij,ij->i", mirror, mirror)
    share = np.einsum("ij,ij->i", vector, mirror) / np.where(size > 1e-300, size, 1.0)
    return np.asarray(vector - 2.0 * np.where(size > 1e-300, share, 0.0)[:, None] * mirror)


def _running(values: FloatArray, offsets: IntArray) -> FloatArray:
    """Return the sum of all values of the same thread before each one."""
    before = np.concatenate(([0.0], np.cumsum(values)))[:-1]
    filled = np.diff(offsets) > 0
    return before - np.repeat(before[offsets[:-1][filled]], np.diff(offsets)[filled])
