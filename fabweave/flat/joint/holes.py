"""Decide where fasteners go: few sizes of holes for a job, and their places at every crossing."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.flat.joint.planning import JointPlan
from fabweave.ribbon.project import Ribbons
from fabweave.weave.threads import Threads

#: Joints are looked for where there is room for a hole that this share of all crossings has.
WANTED_SHARE = 0.9
#: A job has at most so many sizes. What one more has to save, and what it costs a crossing or a
#: joint to have no hole, all as shares of a hole: where 19 crossings hold a large one, another that
#: holds a small one is worth a size, and a joint is worth five crossings. Estimates of a maker's
#: trouble.
_MOST_SIZES, _ONE_MORE, _NO_HOLE, _NO_FASTENER = 3, 0.2, 5.0, 25.0
#: Holes are this many diameters apart, from centre to centre (AC 43.13-1B: 3 D or more).
PITCH_D = 3.0
#: A group of fasteners is tried in this many turns.
_TURNS = 24


@dataclass(frozen=True)
class HoleRule:
    """A hole diameter and how far its centre must keep from every edge, in millimetres."""

    hole_mm: float
    edge_mm: float


@frozen_value
class Groups:
    """Where the fasteners of each joint may go, if there are several.

    All of them go through every layer at the crossing: both laps and the strand above.

    Parameters
    ----------
    angle : (J,) float array
        The turn, in radians, that leaves the first of them most room.
    room_mm : (J,) float array
        Their least distance from the rails of both strands and the ends of the laps.
    """

    angle: FloatArray
    room_mm: FloatArray


def group_offsets(count: int, hole_mm: float, angle: FloatArray) -> FloatArray:
    """Return where fasteners of a group stand about the middle of their crossing.

    They stand evenly on a circle, three diameters from one another: two in a line, three in a
    triangle, four in a square.

    Parameters
    ----------
    count : int
        Two or more.
    hole_mm : float
    angle : (N,) float array
        Of the first one, in radians from the direction of the thread.

    Returns
    -------
    (N, count, 2) float array
        Along the thread that goes under, and to its left.

    Examples
    --------
    >>> group_offsets(2, 2.0, np.zeros(1)).round(9).tolist()
    [[[3.0, 0.0], [-3.0, 0.0]]]
    """
    radius = PITCH_D * hole_mm / (2 * np.sin(np.pi / count))
    turns = angle[:, None] + 2 * np.pi * np.arange(count) / count
    return np.asarray(radius * np.stack((np.cos(turns), np.sin(turns)), axis=2))


def panel_axes(
    ribbons: Ribbons, threads: Threads, passes: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors in space along passes and to their left, in their crossing panels.

    The left one is the direction of the cross-line where a pass enters its panel.
    """
    entry = ribbons.entry[passes]
    left = ribbons.left[entry] - ribbons.right[entry]
    left = left / np.linalg.norm(left, axis=1, keepdims=True)
    normal = ribbons.normal[threads.crossing[passes]]
    return np.cross(left, normal), left


def group_rooms(ribbons: Ribbons, threads: Threads, plan: JointPlan, rule: HoleRule) -> Groups:
    """Find for each joint the turn in which its group of fasteners has most room.

    The room is measured to the straight lines of the panels' sides, of both strands, and to the
    ends of the laps.
    """
    count = plan.rule.fasteners
    angles = np.pi * np.arange(_TURNS) / _TURNS
    room = np.full((len(plan.passes), _TURNS), np.inf)
    along, left = panel_axes(ribbons, threads, plan.passes)
    centre = ribbons.centre[plan.crossing]
    offsets = group_offsets(count, rule.hole_mm, angles).reshape(-1, 2)
    for passes in (plan.passes, other_passes(threads)[plan.passes]):
        entry = ribbons.entry[passes]
        for rail in (ribbons.right, ribbons.left):
            ends = [rail[at] - centre for at in (entry, entry + 1)]
            flat = [np.column_stack([np.einsum("ij,ij->i", end, axis) for axis in (along, left)])
                    for end in ends]  # fmt: skip
            distance = _inside(flat[0], flat[1], offsets).reshape(-1, _TURNS, count)
            room = np.minimum(room, distance.min(axis=2))
    reach = np.abs(offsets[:, 0]).reshape(_TURNS, count).max(axis=1)
    room = np.minimum(room, (plan.lap_mm / 2)[:, None] - reach)
    # Rounding makes ties fall the same way on every machine.
    best = np.argmax(np.round(room, 6), axis=1)
    return Groups(angles[best], room[np.arange(len(room)), best])


def _inside(start: FloatArray, end: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far points (P, 2) are on the origin's side of lines (J, 2), (J, P)."""
    way = end - start
    normal = np.column_stack((-way[:, 1], way[:, 0])) / np.hypot(*way.T)[:, None]
    height = -np.einsum("ij,ij->i", start, normal)
    normal[height < 0] *= -1
    return np.asarray(normal @ points.T + np.abs(height)[:, None])


def other_passes(threads: Threads) -> IntArray:
    """Return for each pass the other one at its crossing."""
    order = np.argsort(threads.crossing, kind="stable").reshape(-1, 2)
    other = np.empty(len(threads.crossing), dtype=np.int64)
    other[order[:, 0]], other[order[:, 1]] = order[:, 1], order[:, 0]
    return other


def choose_rules(
    fits: BoolArray, rules: Sequence[HoleRule], joined: BoolArray | None = None
) -> tuple[int, ...]:
    """Choose the holes for a job: as large as crossings have room for, in few sizes.

    A crossing with a smaller hole than it has room for loses the share by which it is smaller; one
    without a hole loses ``_NO_HOLE``, and a joint, which is glued then, ``_NO_FASTENER``. A size
    more must save ``_ONE_MORE`` of a hole in the mean.

    Parameters
    ----------
    fits : (N, R) bool array
        Which crossings that want a hole have room for each.
    rules : sequence of R HoleRule
        The largest first.
    joined : (N,) bool array, optional
        Which of them have joints; by default none.

    Returns
    -------
    tuple of int
        Numbers of the rules, at most ``_MOST_SIZES``, the largest first; empty if none fits.

    Examples
    --------
    >>> rules = [HoleRule(hole, 2 * hole) for hole in (4.1, 3.3, 1.6)]
    >>> choose_rules(np.array([[True, True, True]] * 5 + [[False, False, True]] * 5), rules)
    (0, 2)
    >>> choose_rules(np.array([[True, True, True]] * 5 + [[False, True, True]] * 5), rules)
    (1,)
    """
    some_fit = fits.any(axis=1)
    without = np.full(len(fits), _NO_HOLE)
    without[np.zeros(len(fits), dtype=np.bool_) if joined is None else joined] = _NO_FASTENER
    fits, without = fits[some_fit], without[some_fit]
    hole = np.array([rule.hole_mm for rule in rules])
    cost = {}
    for count in range(1, min(_MOST_SIZES, len(rules)) + 1):
        for some in combinations(range(len(rules)), count):
            if fits[:, some].any():
                had = (fits[:, some] * hole[list(some)]).max(axis=1)
                lost = np.where(had > 0.0, 1.0 - had / (fits * hole).max(axis=1), without)
                cost[some] = round(float(lost.mean()) + _ONE_MORE * count, 9)
    return min(cost, key=cost.__getitem__, default=())
