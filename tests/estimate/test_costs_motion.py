"""A laser head is as slow as its acceleration: exact answers, and a planner step by step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.estimate.machine_time import ends_of, hop_times, run_times, runs_of
from fabweave.sheet.drawing import Circle, Layer, Polyline

DEVIATION_MM = 0.01


def stroke(*points, closed=False, bulges=None):
    bent = None if bulges is None else np.array(bulges, dtype=float)
    return Polyline(Layer.ENGRAVE_LABEL, np.array(points, dtype=float), closed, bent)


def seconds(entity, speed=200.0, rate=1000.0):
    (time,) = run_times(runs_of([entity]), speed, rate, DEVIATION_MM).tolist()
    return time


@pytest.mark.parametrize(("rate", "mean"), [(500.0, 16), (1000.0, 22), (3000.0, 39)])
def test_a_stroke_of_two_millimetres_never_gets_fast(rate, mean):
    time = seconds(stroke([0, 0], [2, 0]), rate=rate)
    assert time == pytest.approx(math.sqrt(4 * 2.0 / rate))
    assert round(2.0 / time) == mean


@pytest.mark.parametrize(
    ("rate", "turn_deg", "wanted"),
    [(500, 90, 3.5), (1000, 90, 4.9), (3000, 90, 8.5), (500, 20, 18), (1000, 20, 25.5),
     (3000, 20, 44), (500, 5, 72), (1000, 5, 103), (3000, 5, 178)],
)  # fmt: skip
def test_corners_are_passed_as_grbl_passes_them(rate, turn_deg, wanted):
    """Two long legs: what the corner costs beside a straight line tells its speed."""
    turn, speed, leg = math.radians(turn_deg), 300.0, 1000.0
    bent = stroke([0, 0], [leg, 0], [leg + leg * math.cos(turn), leg * math.sin(turn)])
    lost = seconds(bent, speed, rate) - seconds(stroke([0, 0], [2 * leg, 0]), speed, rate)
    # Slowing down from V to v and back costs (V - v)² / (a V).
    passed = speed - math.sqrt(lost * rate * speed)
    assert passed == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize(("rate", "wanted"), [(500, 27), (1000, 39), (3000, 67)])
def test_small_holes_are_cut_no_faster_than_their_arc_allows(rate, wanted):
    hole = Circle(Layer.CUT_INNER, 5.0, 5.0, 1.5)
    top = math.sqrt(rate * 1.5)
    assert round(top) == wanted
    assert seconds(hole, 500.0, rate) == pytest.approx(3 * math.pi / top + top / rate)
    # Drawn as a run of two half circles it is the same hole.
    halves = stroke([6.5, 5], [3.5, 5], closed=True, bulges=[1, 1])
    assert seconds(halves, 500.0, rate) == pytest.approx(seconds(hole, 500.0, rate))


def test_hops_are_trapezoids():
    speed, rate = 200.0, 1000.0
    ways = np.array([400.0, 40.0, 39.9, 0.0])
    expected = [400 / speed + speed / rate, 0.4, 2 * math.sqrt(39.9 / rate), 0.0]
    assert hop_times(ways, speed, rate) == pytest.approx(expected)


def test_what_is_closed_ends_where_it_begins():
    ring, hole = stroke([0, 0], [1, 0], [1, 1], closed=True), Circle(Layer.CUT_INNER, 2.0, 0.0, 0.5)
    begins, ends = ends_of([ring, hole, stroke([0, 0], [3, 4])])
    assert begins.tolist() == [[0, 0], [2.5, 0], [0, 0]]
    assert ends.tolist() == [[0, 0], [2.5, 0], [3, 4]]


def planned(runs, run, speed, rate):
    """Plan one run as a controller does, side by side: forwards, backwards, then the time."""
    at = np.flatnonzero(runs.run == run).tolist()
    if not at:
        return 0.0
    top = [min(speed, math.sqrt(rate * runs.radius_mm[k])) for k in at]
    pace = [0.0]
    for k in range(1, len(at)):
        sine = float(runs.corner[at[k]])
        corner = math.inf if sine >= 1 else math.sqrt(rate * DEVIATION_MM * sine / (1 - sine))
        pace.append(min(corner, top[k - 1], top[k]))
    pace.append(0.0)
    for k, side in enumerate(at):
        reached = math.sqrt(pace[k] ** 2 + 2 * rate * runs.length_mm[side])
        pace[k + 1] = min(pace[k + 1], reached)
    for k, side in reversed(list(enumerate(at))):
        pace[k] = min(pace[k], math.sqrt(pace[k + 1] ** 2 + 2 * rate * runs.length_mm[side]))
    total = 0.0
    for k, side in enumerate(at):
        peak = min(
            top[k], math.sqrt((pace[k] ** 2 + pace[k + 1] ** 2) / 2 + rate * runs.length_mm[side])
        )
        up, down = (peak - pace[k]) / rate, (peak - pace[k + 1]) / rate
        ramps = (pace[k] + peak) / 2 * up + (peak + pace[k + 1]) / 2 * down
        total += up + down + (runs.length_mm[side] - ramps) / peak
    return total


@given(
    seed=st.integers(0, 2**32 - 1),
    speed=st.floats(1.0, 1000.0),
    rate=st.floats(50.0, 20_000.0),
)
def test_all_runs_at_once_are_as_a_planner_plans_each(seed, speed, rate):
    dice = np.random.default_rng(seed)
    entities = []
    for _ in range(8):
        if dice.integers(4) == 0:
            entities.append(Circle(Layer.CUT_INNER, 1.0, 2.0, float(dice.uniform(0.2, 20.0))))
            continue
        count = int(dice.integers(2, 12))
        steps = dice.normal(0.0, dice.choice([0.1, 1.0, 20.0]), (count, 2))
        bulges = dice.integers(0, 2, count) * dice.normal(0.0, 0.3, count)
        entities.append(
            stroke(*np.cumsum(steps, axis=0), closed=bool(dice.integers(2)), bulges=bulges)
        )
    runs = runs_of(entities)
    found = run_times(runs, speed, rate, DEVIATION_MM)
    expected = [planned(runs, run, speed, rate) for run in range(len(entities))]
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)
    # No run is faster than its length at the greatest speed.
    lengths = np.bincount(runs.run, runs.length_mm, minlength=runs.count)
    assert np.all(found >= lengths / speed * (1 - 1e-9))
