"""Say how long a laser head takes along lines and arcs, as the planner of its controller moves it.

The model is that of open controllers such as grbl (``gnea/grbl``, ``planner.c``). Along a side the
speed rises and falls with one acceleration (a trapezoid over time). From side to side it is at most
v² = a δ s / (1 - s), where a is the acceleration, δ the deviation that the planner allows at a
corner, and s the sine of half the angle between the two sides; on an arc of radius r at most
v² = a r. A run begins and ends at rest.

Squares of speeds are linear in the way. So the greatest speeds that can be reached from the sides
before, and from which the sides after can be slowed down to, are running minima over all corners of
all runs at once: this is exact, and no approximation of a planner that looks ahead without end.
"""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arc_path import stretch
from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.cut.drawing import Circle, Entity

#: Sides that are shorter are none, millimetres.
_NOTHING_MM = 1e-9


@frozen_value
class Runs:
    """Runs of sides and arcs, one after another.

    Parameters
    ----------
    length_mm : (S,) float array
        Of each side.
    radius_mm : (S,) float array
        Of each arc; infinite for a straight side.
    corner : (S,) float array
        The cosine of half the angle by which the head turns where it comes to each side; NaN where
        a run begins. (It is s above: legs that turn by t have an angle of 180° - t between them.)
    run : (S,) int array
        Which run each side belongs to, from 0.
    count : int
        How many runs there are.
    """

    length_mm: FloatArray
    radius_mm: FloatArray
    corner: FloatArray
    run: IntArray
    count: int


def runs_of(entities: Sequence[Entity]) -> Runs:
    """Return entities as runs, one each, in their order."""
    points, bulges, sizes = _sides(entities)
    # What leads from the end of a run to the start of the next is no side.
    last = np.zeros(len(points), dtype=np.bool_)
    last[np.cumsum(sizes) - 1] = True
    chord = np.roll(points, -1, axis=0) - points
    straight = np.hypot(*chord.T)
    kept = ~last & (straight > _NOTHING_MM)
    run = np.repeat(np.arange(len(sizes)), sizes)[kept]
    chord, straight, bulges = chord[kept], straight[kept], bulges[kept]
    bent = bulges != 0.0
    safe = np.where(bent, np.abs(bulges), 1.0)
    radius = np.where(bent, straight * (1.0 + safe**2) / (4.0 * safe), np.inf)
    # An arc comes in half its sweep to one side of its chord, and leaves half to the other.
    heading, half = np.arctan2(chord[:, 1], chord[:, 0]), 2.0 * np.arctan(bulges)
    turn = (heading - half) - np.roll(heading + half, 1)
    corner = np.abs(np.cos(turn / 2.0))
    first = run != np.roll(run, 1)
    first[:1] = True
    corner[first] = np.nan
    return Runs(straight * stretch(bulges), radius, corner, run, len(sizes))


def _sides(entities: Sequence[Entity]) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the points of all entities, the bulge after each, and how many points each has.

    The first point of what is closed is there again at its end; a circle is two half circles.
    """
    points, bulges = [np.zeros((0, 2))], [np.zeros(0)]
    for entity in entities:
        if isinstance(entity, Circle):
            x, y, radius = entity.x, entity.y, entity.radius
            points.append(np.array([[x + radius, y], [x - radius, y], [x + radius, y]]))
            bulges.append(np.ones(3))
            continue
        corners = entity.points
        bent = np.zeros(len(corners)) if entity.bulges is None else entity.bulges
        if entity.closed:
            corners, bent = np.concatenate((corners, corners[:1])), np.append(bent, 0.0)
        points.append(corners)
        bulges.append(bent)
    sizes = np.array([len(part) for part in points[1:]], dtype=np.int64)
    return np.concatenate(points), np.concatenate(bulges), sizes


def run_times(
    runs: Runs, speed_mm_s: float, acceleration_mm_s2: float, deviation_mm: float
) -> FloatArray:
    """Return how long each run takes, (R,), seconds.

    Parameters
    ----------
    runs : Runs
    speed_mm_s : float
        What is commanded; sides that are too short do not reach it.
    acceleration_mm_s2, deviation_mm : float
        Of the machine: a and δ of this module's text.

    Examples
    --------
    A stroke of 2 mm at 1000 mm/s² takes 2 √(L/a): 22 mm/s in the mean.

    >>> from fabweave.cut.drawing import Layer, Polyline
    >>> stroke = Polyline(Layer.ENGRAVE_MARK, np.array([[0.0, 0.0], [2.0, 0.0]]))
    >>> (2.0 / run_times(runs_of([stroke]), 200.0, 1000.0, 0.01)).round(1).tolist()
    [22.4]
    """
    way, rate = runs.length_mm, acceleration_mm_s2
    top = np.minimum(speed_mm_s**2, rate * runs.radius_mm)  # squares of speeds
    sine = np.where(np.isnan(runs.corner), 0.0, runs.corner)
    # Sides that lead straight on have no corner, and may be passed at any speed.
    tight = np.divide(
        rate * deviation_mm * sine, 1.0 - sine, out=np.full(len(way), np.inf), where=sine < 1.0
    )
    enter = np.minimum(tight, np.minimum(top, np.roll(top, 1)))
    begins = np.isnan(runs.corner)
    enter[begins] = 0.0
    # Where one run ends and the next begins, both are at rest, so minima do not reach across.
    come = 2.0 * rate * (np.cumsum(way) - way)
    goes = come + 2.0 * rate * way
    enter = np.minimum.accumulate(enter - come) + come
    leave = np.where(np.roll(begins, -1), 0.0, np.roll(enter, -1))
    slowed = np.minimum.accumulate((leave + goes)[::-1])[::-1] - goes
    leave = np.clip(slowed, 0.0, None)
    enter = np.where(begins, 0.0, np.roll(leave, 1))
    peak = np.minimum(top, (enter + leave) / 2.0 + rate * way)
    fast = np.sqrt(peak)
    ramps = (2.0 * fast - np.sqrt(enter) - np.sqrt(leave)) / rate
    even = (way - (2.0 * peak - enter - leave) / (2.0 * rate)) / fast
    sums = np.bincount(runs.run, ramps + even, minlength=runs.count)
    return np.asarray(sums, dtype=np.float64)


def hop_times(length_mm: FloatArray, speed_mm_s: float, acceleration_mm_s2: float) -> FloatArray:
    """Return how long straight moves from rest to rest take, seconds.

    Examples
    --------
    Where the speed is reached it is L/v + v/a, else 2 √(L/a).

    >>> hop_times(np.array([400.0, 10.0, 0.0]), 200.0, 1000.0).tolist()
    [2.2, 0.2, 0.0]
    """
    ramp_mm = speed_mm_s**2 / acceleration_mm_s2
    far = length_mm / speed_mm_s + speed_mm_s / acceleration_mm_s2
    times: FloatArray = np.where(
        length_mm >= ramp_mm, far, 2.0 * np.sqrt(length_mm / acceleration_mm_s2)
    )
    return times


def ends_of(entities: Sequence[Entity]) -> tuple[FloatArray, FloatArray]:
    """Return where each entity begins and where it ends, both (N, 2); a circle at its right."""
    begins = np.empty((len(entities), 2))
    ends = np.empty((len(entities), 2))
    for at, entity in enumerate(entities):
        if isinstance(entity, Circle):
            begins[at] = ends[at] = entity.x + entity.radius, entity.y
        else:
            begins[at] = entity.points[0]
            ends[at] = entity.points[0 if entity.closed else -1]
    return begins, ends
