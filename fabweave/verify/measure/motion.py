"""Time a laser head along the shapes of a drawing, side by side of every shape.

As controllers plan it: one acceleration a, a junction deviation δ, rest at both ends of a shape. A
corner between legs that stand at an angle of t to one another is passed at no more than
√(a δ s / (1 - s)) with s = sin(t/2), and an arc of radius r at no more than √(a r).
"""

from dataclasses import dataclass

import numpy as np

from fabweave.verify.drawing import Drawing, Flags, Floats, Ints

#: A side that is shorter leads nowhere.
_POINT_MM = 1e-9


@dataclass(frozen=True)
class Pace:
    """How a head moves: commanded speed, acceleration, deviation at corners, rest before a line."""

    speed_mm_s: float
    acceleration_mm_s2: float
    deviation_mm: float
    rest_s: float


def burn_time(drawing: Drawing, shapes: Ints, pace: Pace) -> float:
    """Return how long some shapes take, without the ways between them, seconds.

    Examples
    --------
    A head that gathers speed along half a stroke of 2 mm and loses it along the other takes
    2 √(2 mm / a).

    >>> stroke = Drawing(
    ...     layer=["CUT_INNER"], piece=[None], name=[""], points=np.array([[0.0, 0.0], [2.0, 0.0]]),
    ...     bulges=np.zeros(2), start=np.array([0, 2]), closed=np.array([False]),
    ...     radius=np.array([np.nan]), layers=(), width_mm=None, height_mm=None, problems=(),
    ... )
    >>> round(burn_time(stroke, np.array([0]), Pace(200.0, 1000.0, 0.01, 0.0)), 6)
    0.089443
    """
    rate = pace.acceleration_mm_s2
    round_ones = ~np.isnan(drawing.radius[shapes])
    radius = drawing.radius[shapes[round_ones]]
    circles = _straight_times(
        2.0 * np.pi * radius, np.minimum(pace.speed_mm_s, np.sqrt(rate * radius)), rate
    )
    runs = _sides(drawing, shapes[~round_ones])
    return float(circles.sum() + _run_times(*runs, pace).sum() + pace.rest_s * len(shapes))


def hop_time(drawing: Drawing, shapes: Ints, speed_mm_s: float, acceleration_mm_s2: float) -> float:
    """Return how long the ways between shapes take, from the origin on, seconds.

    A circle begins and ends at its right.
    """
    first = drawing.points[drawing.start[shapes]]
    last = np.where(
        drawing.closed[shapes, None], first, drawing.points[drawing.start[shapes + 1] - 1]
    )
    shift = np.column_stack([np.nan_to_num(drawing.radius[shapes]), np.zeros(len(shapes))])
    come = np.concatenate([np.zeros((1, 2)), (last + shift)[:-1]])[: len(shapes)]
    way = np.hypot(*(first + shift - come).T)
    return float(_straight_times(way, np.full(len(way), speed_mm_s), acceleration_mm_s2).sum())


def _straight_times(way: Floats, speed: Floats, rate: float) -> Floats:
    """Return times from rest to rest."""
    peak = np.minimum(speed, np.sqrt(rate * way))
    return np.asarray(np.where(way > 0.0, way / np.where(way > 0.0, peak, 1.0) + peak / rate, 0.0))


def _sides(drawing: Drawing, shapes: Ints) -> tuple[Floats, Floats, Floats, Ints]:
    """Return length, radius and sine at the corner before each side; and sides of each shape."""
    sizes, closed = drawing.sizes[shapes], drawing.closed[shapes]
    slots = drawing.slots(shapes)
    owner = np.repeat(np.arange(len(shapes)), sizes)
    after = np.arange(1, len(owner) + 1)
    ends = np.cumsum(sizes)
    after[ends - 1] = ends - sizes
    place = drawing.points[slots] @ np.array([1.0, 1.0j])
    leg, bulge = place[after] - place, drawing.bulges[slots]
    there: Flags = np.abs(leg) > _POINT_MM
    there[ends[~closed] - 1] = False
    leg, bulge, owner = leg[there], bulge[there], owner[there]
    half = 2.0 * np.arctan(bulge)
    bent = np.abs(half) > 1e-12
    chord = np.abs(leg)
    sine = np.where(bent, np.sin(np.abs(half)), 1.0)
    radius = np.where(bent, chord / (2.0 * sine), np.inf)
    length = np.where(bent, 2.0 * np.abs(half) * np.where(bent, radius, 0.0), chord)
    # Directions as unit numbers: where a side is entered, and where it is left.
    enter, leave = leg / chord * np.exp(-1j * half), leg / chord * np.exp(1j * half)
    # Legs at an angle of t: |1 + e^(i turn)| / 2 is the sine of t/2, as t is 180° less the turn.
    sharp = np.abs(1.0 + enter * np.conj(np.roll(leave, 1))) / 2.0
    return length, radius, sharp, np.bincount(owner, minlength=len(shapes))


def _run_times(length: Floats, radius: Floats, sharp: Floats, count: Ints, pace: Pace) -> Floats:
    """Return how long each shape takes: forwards, then backwards, side by side of all shapes."""
    rate = pace.acceleration_mm_s2
    top = np.minimum(pace.speed_mm_s, np.sqrt(rate * radius))
    with np.errstate(divide="ignore"):
        corner = np.sqrt(rate * pace.deviation_mm * sharp / np.maximum(1.0 - sharp, 0.0))
    order = np.argsort(-count, kind="stable")
    begin, number = (np.cumsum(count) - count)[order], count[order]
    most = int(number.max(initial=0))
    # How many shapes have a side of each rank; those with the most come first.
    having = [int(np.searchsorted(-number, -rank, side="left")) for rank in range(most)]
    come, gone = np.zeros(len(length)), np.zeros(len(length))
    for rank in range(1, most):
        at = begin[: having[rank]] + rank
        before = at - 1
        fastest = np.sqrt(come[before] ** 2 + 2.0 * rate * length[before])
        come[at] = np.minimum.reduce([corner[at], top[before], top[at], fastest])
    for rank in range(most - 1, 0, -1):
        at = begin[: having[rank]] + rank
        come[at] = np.minimum(come[at], np.sqrt(gone[at] ** 2 + 2.0 * rate * length[at]))
        gone[at - 1] = come[at]
    peak = np.minimum(top, np.sqrt((come**2 + gone**2) / 2.0 + rate * length))
    ramps = (2.0 * peak**2 - come**2 - gone**2) / (2.0 * rate)
    time = (2.0 * peak - come - gone) / rate + (length - ramps) / peak
    sums = np.bincount(np.repeat(np.arange(len(count)), count), time, minlength=len(count))
    return np.asarray(sums, dtype=np.float64)
