"""Unfold strips and superpose figures, by methods of the verifier's own."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.read.glb import Strip

#: Figures that superpose to this have no point out of place.
_CLOSE_MM = 1e-3
#: How often points that are out of place lose weight.
_ROUNDS = 12


@dataclass(frozen=True)
class Motion:
    """A motion of the plane without reflection: z -> turn * z + shift, for complex z."""

    turn: complex
    shift: complex

    def apply(self, points: Floats) -> Floats:
        """Move points, (..., 2)."""
        moved = self.turn * (points[..., 0] + 1j * points[..., 1]) + self.shift
        return np.stack([moved.real, moved.imag], axis=-1)


def fit_motion(source: Floats, target: Floats) -> Motion:
    """Return the rotation and shift that bring points nearest to others, in least squares.

    Reflections are not among the candidates: a mirrored figure stays badly superposed.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> motion = fit_motion(square, square @ [[0.0, 1.0], [-1.0, 0.0]] + 5.0)
    >>> motion.apply(square[1:2]).round(9).tolist()
    [[5.0, 6.0]]
    """
    return _weighted_motion(source, target, np.ones(len(source)))


def fit_most(source: Floats, target: Floats) -> Motion:
    """Return the motion without reflection that lays most points on their targets.

    Least squares, reweighted so that the sum of distances falls: one point that is out of place
    stays out of place, and does not turn the whole figure.

    Examples
    --------
    >>> row = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0]])
    >>> target = row + [[0.0, 0.0], [0.0, 0.5], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    >>> bool(np.abs(fit_most(row, target).apply(row) - row).max() < 1e-3)
    True
    """
    motion = fit_motion(source, target)
    for _ in range(_ROUNDS):
        miss = np.hypot(*(motion.apply(source) - target).T)
        if np.max(miss) < _CLOSE_MM:
            break
        motion = _weighted_motion(source, target, 1.0 / np.maximum(miss, 1e-5))
    return motion


def _weighted_motion(source: Floats, target: Floats, weights: Floats) -> Motion:
    """Return the weighted least-squares motion."""
    share = weights / weights.sum()
    a = source[:, 0] + 1j * source[:, 1]
    b = target[:, 0] + 1j * target[:, 1]
    middle, goal = complex(share @ a), complex(share @ b)
    product = complex(np.vdot(share * (a - middle), b - goal))
    turn = product / abs(product) if abs(product) > 0.0 else 1.0 + 0.0j
    return Motion(turn, goal - turn * middle)


def farthest(points: Floats, others: Floats) -> float:
    """Return the largest distance between corresponding points; 0 for none."""
    return float(np.max(np.hypot(*(points - others).T), initial=0.0))


def distances(points: Floats, others: Floats) -> Floats:
    """Return the distance of each of some points from each of others, (N, M)."""
    return np.hypot(*(points[:, None] - others[None, :]).transpose(2, 0, 1))


def widest_miss(distance: Floats) -> float:
    """Return how far the loneliest point of two sets is from the other set, given (N, M)."""
    return float(max(distance.min(axis=0).max(), distance.min(axis=1).max()))


@dataclass(frozen=True, eq=False)
class Steps:
    """Each step of a strip laid in the plane, in the frame of its first rung.

    In that frame the right end of the rung is 0 and the left end lies on the positive imaginary
    axis; the strip sets off towards the positive real axis, as seen from outside.
    """

    right: npt.NDArray[np.complexfloating]
    left: npt.NDArray[np.complexfloating]
    width: Floats


def lay_steps(strip: Strip) -> Steps:
    """Lay the two triangles of every step in the plane; all three sides keep their lengths."""
    count = len(strip.rungs)
    near = strip.rungs[: len(strip.from_right)]
    far = strip.rungs[(np.arange(len(strip.from_right)) + 1) % count]
    r0, l0, r1, l1 = near[:, 0], near[:, 1], far[:, 0], far[:, 1]

    def length(a: Floats, b: Floats) -> Floats:
        return np.asarray(np.linalg.norm(a - b, axis=1))

    width = length(r0, l0)
    zero = np.zeros(len(width), dtype=np.complex128)
    up = 1j * width
    # Right to far left first: that corner lies right of the rung, seen along it.
    left_a = _third(zero, up, length(r0, l1), length(l0, l1), -1.0)
    right_a = _third(zero, left_a, length(r0, r1), length(l1, r1), -1.0)
    right_b = _third(zero, up, length(r0, r1), length(l0, r1), -1.0)
    left_b = _third(up, right_b, length(l0, l1), length(r1, l1), 1.0)
    return Steps(
        right=np.where(strip.from_right, right_a, right_b),
        left=np.where(strip.from_right, left_a, left_b),
        width=np.asarray(np.linalg.norm(strip.rungs[:, 1] - strip.rungs[:, 0], axis=1)),
    )


def _third(
    start: npt.NDArray[np.complexfloating],
    end: npt.NDArray[np.complexfloating],
    from_start: Floats,
    from_end: Floats,
    side: float,
) -> npt.NDArray[np.complexfloating]:
    """Return the point at given distances from two others, on one side of the line (+1 left)."""
    base = np.abs(end - start)
    safe = np.maximum(base, 1e-300)
    along = (from_start**2 - from_end**2 + base**2) / (2.0 * safe)
    across = np.sqrt(np.maximum(from_start**2 - along**2, 0.0))
    return start + (along + 1j * side * across) * (end - start) / safe


def unfold(strip: Strip, steps: Steps, first: int, last: int) -> Floats:
    """Unfold the rungs from ``first`` to ``last``, which may run on around a ring.

    Returns
    -------
    (N, 2, 2) float array
        Right and left end of each rung; the first rung stands on the origin.
    """
    count = len(strip.rungs)
    walk = np.arange(first, last) % count
    rung_turn = (steps.left[walk] - steps.right[walk]) / 1j
    heading = np.concatenate([[0.0], np.cumsum(np.angle(rung_turn))])
    facing = np.exp(1j * heading)
    right = np.concatenate([[0.0], np.cumsum(facing[:-1] * steps.right[walk])])
    left = right + 1j * facing * steps.width[np.arange(first, last + 1) % count]
    return np.stack(
        [np.column_stack([right.real, right.imag]), np.column_stack([left.real, left.imag])],
        axis=1,
    )


def panel_bounds(strip: Strip, start: int, number: int) -> tuple[Ints, Ints]:
    """Return the entry and exit rungs of stations that follow one another along a thread.

    ``start`` is the first station's place along the thread. Rungs count on around a ring.
    """
    count = len(strip.rungs)
    size = len(strip.entry)
    place = (start + np.arange(number)) % size
    entry, leave = strip.entry[place], strip.exit[place]
    panels = (leave - entry) % count
    gaps = (entry[1:] - leave[:-1]) % count
    begin = entry[0] + np.concatenate([[0], np.cumsum(panels[:-1] + gaps)])
    return begin, begin + panels
