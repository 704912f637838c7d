"""Rigid motions in space, and the twists between them: the group SE(3), as arrays.

A twist is (N, 6): a displacement and a rotation vector, both in the moved frame. Between two
frames it is the strain of a strip that leads from one to the other, times its length: what a strip
of constant curvature and torsion has everywhere (Sonneville, Cardona, Brüls, "Geometrically exact
beam finite element formulated on the special Euclidean group SE(3)", CMAME 268, 2014).
"""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value, lengths

#: Below these angles, functions of them are series.
_SMALL, _MIDDLE = 0.05, 0.5


@frozen_value
class Frames:
    """Places and attitudes in space.

    Parameters
    ----------
    origin : (N, 3) float array
    axes : (N, 3, 3) float array
        Rotations; the columns are the directions of x, y and z.
    """

    origin: FloatArray
    axes: FloatArray

    def __getitem__(self, which: IntArray | slice) -> "Frames":
        """Return some of them."""
        return Frames(self.origin[which], self.axes[which])

    def then(self, other: "Frames") -> "Frames":
        """Return frames that are given in these."""
        origin = self.origin + np.einsum("nij,nj->ni", self.axes, other.origin)
        return Frames(origin, self.axes @ other.axes)

    def seen_from(self, other: "Frames") -> "Frames":
        """Return these frames as seen in others."""
        apart = np.einsum("nji,nj->ni", other.axes, self.origin - other.origin)
        return Frames(apart, np.swapaxes(other.axes, 1, 2) @ self.axes)

    def moved(self, twist: FloatArray) -> "Frames":
        """Return these frames after twists."""
        return self.then(exponential(twist))


def skew(vector: FloatArray) -> FloatArray:
    """Return the matrices that take a cross product with vectors, (N, 3, 3).

    Examples
    --------
    >>> skew(np.array([[0.0, 0.0, 1.0]])) @ np.array([1.0, 0.0, 0.0])
    array([[0., 1., 0.]])
    """
    x, y, z = vector.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), 2, 0)


def exponential(twist: FloatArray) -> Frames:
    """Return where twists lead, as frames.

    Examples
    --------
    A quarter turn to the left along an arc of radius 2:

    >>> exponential(np.array([[np.pi, 0, 0, 0, 0, np.pi / 2]])).origin.round(9)
    array([[2., 2., 0.]])
    """
    angle = lengths(twist[:, 3:])
    small = angle < _SMALL
    safe, square = np.where(small, 1.0, angle), angle**2
    one = np.where(small, 1 - square / 6 + square**2 / 120, np.sin(safe) / safe)
    two = np.where(small, 0.5 - square / 24 + square**2 / 720, (1 - np.cos(safe)) / safe**2)
    three = np.where(
        small, 1 / 6 - square / 120 + square**2 / 5040, (safe - np.sin(safe)) / safe**3
    )
    turn = skew(twist[:, 3:])
    again, unit = turn @ turn, np.eye(3)
    axes = unit + one[:, None, None] * turn + two[:, None, None] * again
    along = unit + two[:, None, None] * turn + three[:, None, None] * again
    return Frames(np.einsum("nij,nj->ni", along, twist[:, :3]), axes)


def logarithm(frames: Frames) -> FloatArray:
    """Return the twists that lead to frames, (N, 6); less than half a turn each.

    Examples
    --------
    >>> twist = np.array([[3.0, 0.2, -1.0, 0.4, 1.2, -0.3]])
    >>> bool(np.allclose(logarithm(exponential(twist)), twist, rtol=0, atol=1e-12))
    True
    """
    axes = frames.axes
    odd = axes - np.swapaxes(axes, 1, 2)
    sine = np.stack([odd[:, 2, 1], odd[:, 0, 2], odd[:, 1, 0]], axis=1) / 2
    size = lengths(sine)
    angle = np.arctan2(size, (np.trace(axes, axis1=1, axis2=2) - 1) / 2)
    small = angle < _SMALL
    square, safe = angle**2, np.where(small, 1.0, angle)
    ratio = np.where(
        small,
        1 + square / 6 + 7 * square**2 / 360 + 31 * square**3 / 15120,
        safe / np.where(small, 1.0, size),
    )
    turn = ratio[:, None] * sine
    cross = skew(turn)
    half = safe / 2
    bend = np.where(
        small, 1 / 12 + square / 720 + square**2 / 30240, (1 - half / np.tan(half)) / safe**2
    )
    back = np.eye(3) - cross / 2 + bend[:, None, None] * (cross @ cross)
    return np.concatenate([np.einsum("nij,nj->ni", back, frames.origin), turn], axis=1)


def adjoint(frames: Frames) -> FloatArray:
    """Return the matrices that tell twists in a frame as twists of the one it is given in."""
    result = np.zeros((len(frames.origin), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = frames.axes
    result[:, :3, 3:] = skew(frames.origin) @ frames.axes
    return result


def brackets(twist: FloatArray) -> FloatArray:
    """Return the matrices that take the Lie bracket of twists with others, (N, 6, 6)."""
    result = np.zeros((len(twist), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = skew(twist[:, 3:])
    result[:, :3, 3:] = skew(twist[:, :3])
    return result


def back_from(twist: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return by how much a twist changes as its start moves, and as its end moves, (N, 6, 6) each.

    Both motions are twists in the frames that move (Selig, "Exponential and Cayley maps for dual
    quaternions", 2010, for the closed form).
    """
    angle = lengths(twist[:, 3:])
    small = angle < _MIDDLE
    square, safe = angle**2, np.where(small, 1.0, angle)
    less = np.cos(safe) - 1
    second = np.where(
        small,
        1 / 12 - square**2 / 30240 - square**3 / 604800 - square**4 / 15966720,
        2 / safe**2 + (safe + 3 * np.sin(safe)) / (4 * safe * less),
    )
    fourth = np.where(
        small,
        -1 / 720 - square / 15120 - square**2 / 403200 - square**3 / 11975040,
        1 / safe**4 + (safe + np.sin(safe)) / (4 * safe**3 * less),
    )
    bracket = brackets(twist)
    two = bracket @ bracket
    even = np.eye(6) + second[:, None, None] * two + fourth[:, None, None] * (two @ two)
    return bracket / 2 - even, even + bracket / 2
