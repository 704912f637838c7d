"""Times and prices are what drawings, steps, speeds and prices make; anything else is found."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fabweave.cut.drawing import Circle, Layer, Polyline
from fabweave.report.costs.motion import ends_of, hop_times, run_times, runs_of
from fabweave.verify.checks.reports.estimate import check_estimate
from fabweave.verify.drawing import Drawing
from fabweave.verify.measure.motion import Pace, burn_time, hop_time
from fabweave.verify.read.job_files import load_job
from fabweave.verify.statement import Tally

JOB = ("shape:torus?m=8&n=4", "--size", "240mm", "--effort", "quick", "--joint", "glue",
       "--sheet", "300x250mm")  # fmt: skip


@pytest.fixture(scope="module")
def read(finished):
    """Return a finished job as read."""
    return load_job(finished(*JOB), Tally("files"))


def found(job, change):
    waste = json.loads(json.dumps(job.waste))
    change(waste)
    tally = Tally("estimate")
    check_estimate(replace(job, waste=waste), tally)
    return " | ".join(tally.result().findings)


def first(waste):
    return waste["estimate"]["sheets"][0]


def rates(waste):
    return waste["estimate"]["materials"][0]


def put(where, key, value):
    """Return a change: the value at a key of what stands somewhere in the waste report."""
    return lambda waste: where(waste).__setitem__(key, value)


def estimate(waste):
    return waste["estimate"]


CHANGES = [
    (lambda _: None, None),
    (lambda w: w.update(estimate=None), None),
    (
        lambda w: w["sheets"][0].update(cut_length_mm=5.0),
        "sheet 1: cut_length_mm is 5, but should be",
    ),
    (lambda w: w["sheets"][0].update(pierces=999), "sheet 1: pierces is 999, but should be"),
    (lambda w: w["totals"].update(pierces=999), "totals: pierces is 999, but should be"),
    (lambda w: first(w)["cut_s"].reverse(), "sheet 1, cut_s: fastest is"),
    (lambda w: first(w).update(cut_s=None), "cut_s: slowest is nothing, but should be"),
    (put(first, "engrave_s", [1.0, 2.0]), "sheet 1, engrave_s: fastest is 1, but should be"),
    (put(first, "travel_s", [1.0, 2.0]), "sheet 1, travel_s: slowest is 2, but should be"),
    (lambda w: first(w)["price"].update(high=99.0), "sheet 1, price: high is 99, but should be"),
    (lambda w: first(w)["price"].update(currency="USD"), "price: currency is 'USD'"),
    (put(first, "price", None), "sheet 1: price is nothing, but should be"),
    (put(first, "sheet", 9), "estimate: sheets lack 1, and have 9, which should not be there"),
    (put(estimate, "cut_s", [1.0, 2.0]), "estimate, cut_s: fastest is 1, but should be"),
    (put(estimate, "engrave_s", [1.0, 2.0]), "estimate, engrave_s: fastest is 1, but should be"),
    (put(estimate, "travel_s", [1.0, 2.0]), "estimate, travel_s: fastest is 1, but should be"),
    (put(estimate, "machine_s", [1.0, 2.0]), "estimate, machine_s: fastest is 1, but should be"),
    (put(estimate, "machine_s", None), "estimate, machine_s: slowest is nothing, but should be"),
    (put(estimate, "calibration", 1.5), "estimate: calibration is 1.5, but should be 1"),
    (put(rates, "speed_mm_s", None), "], but should be nothing"),
    (put(rates, "speed_mm_s", [1.0, 2.0]), "cut_s: slowest is"),
    (put(rates, "engrave_mm_s", [1.0, 2.0]), "engrave_s: slowest is"),
    (put(rates, "rapid_mm_s", [1.0, 2.0]), "travel_s: slowest is"),
    (put(rates, "acceleration_mm_s2", [1.0, 2.0]), "engrave_s: slowest is"),
    (put(rates, "deviation_mm", 1.0), "cut_s: slowest is"),
    (put(rates, "pierce_s", [0.5, 0.5]), "cut_s: fastest is"),
    (put(rates, "laser_on_s", [0.5, 0.5]), "engrave_s: fastest is"),
    (put(rates, "price_per_m2", None), "but should be nothing"),
    (put(rates, "price_per_m2", 77.0), "sheet 1, price: low is"),
    (put(rates, "machine_per_h", 60.0), "machine_price is nothing, but should be"),
    (lambda w: estimate(w)["sheet_price"].update(low=0.0), "sheet_price: low is 0, but should be"),
    (
        lambda w: estimate(w)["hardware_price"].update(high=99.0),
        "hardware_price: high is 99, but should be",
    ),
    (lambda w: estimate(w)["price"].update(high=99.0), "estimate, price: high is 99, but should"),
    (put(estimate, "price", None), "estimate: price is nothing, but should be"),
    (lambda w: estimate(w)["assembly"].update(practised_h=9.0), "practised_h is 9, but should be"),
    (lambda w: estimate(w)["assembly"].update(hours=[1.0, 9.0]), "hours: slow is 9, but should be"),
    (
        lambda w: estimate(w)["assembly"]["actions"][0].update(count=1),
        "assembly: actions lack ('sort', ",
    ),
    (
        lambda w: estimate(w)["assembly"]["actions"][3].update(count=1, each_s=0.0),
        "and have ('over', 1, 0.0, ",
    ),
    (lambda w: estimate(w)["difficulty"].update(score=1.0), "difficulty: score is 1, but should"),
    (lambda w: estimate(w)["difficulty"].update(unders=9.0), "difficulty: unders is 9, but should"),
]


@pytest.mark.parametrize("number", range(len(CHANGES)))
def test_spoiled_figures_are_found(read, number):
    change, words = CHANGES[number]
    told = found(read, change)
    assert told == "" if words is None else words in told


def test_a_sheet_whose_drawing_is_gone_is_not_checked_and_that_is_said(read):
    tally = Tally("estimate")
    check_estimate(replace(read, dxf={}), tally)
    assert "its DXF could not be read" in " | ".join(tally.result().findings)


def test_a_drawing_with_other_letters_is_found(read):
    """The times are those of what is drawn, not of what the report says of itself."""
    (number, drawing), *_ = read.dxf.items()
    longer = replace(drawing, points=drawing.points * 1.1)
    tally = Tally("estimate")
    check_estimate(replace(read, dxf={number: longer}), tally)
    told = " | ".join(tally.result().findings)
    for name in ("engrave_s", "cut_s", "travel_s"):
        assert f"sheet 1, {name}: fastest is" in told


def test_the_head_is_timed_as_the_maker_times_it_by_other_means():
    dice = np.random.default_rng(5)
    entities = [Circle(Layer.CUT_INNER, 3.0, 4.0, 1.25)]
    for _ in range(60):
        count = int(dice.integers(2, 30))
        steps = dice.normal(0.0, dice.choice([0.1, 1.0, 20.0]), (count, 2))
        bulges = dice.integers(0, 2, count) * dice.normal(0.0, 0.3, count)
        closed = bool(dice.integers(2))
        entities.append(Polyline(Layer.CUT_OUTER, np.cumsum(steps, axis=0), closed, bulges))
    rings = [
        (entity.points, entity.bulges, entity.closed, np.nan)
        if isinstance(entity, Polyline)
        else (np.array([[entity.x, entity.y]]), np.zeros(1), False, entity.radius)
        for entity in entities
    ]
    points, bulges, closed, radius = zip(*rings, strict=True)
    drawing = Drawing(
        layer=["CUT_OUTER"] * len(rings), piece=[None] * len(rings), name=[""] * len(rings),
        points=np.concatenate(points), bulges=np.concatenate(bulges),
        start=np.cumsum([0, *map(len, points)]), closed=np.array(closed), radius=np.array(radius),
        layers=(), width_mm=None, height_mm=None, problems=(),
    )  # fmt: skip
    every = np.arange(len(rings))
    for speed, rate in ((20.0, 500.0), (200.0, 3000.0), (900.0, 100.0)):
        for shape in every.tolist():
            (ours,) = run_times(runs_of([entities[shape]]), speed, rate, 0.01).tolist()
            one = burn_time(drawing, np.array([shape]), Pace(speed, rate, 0.01, 0.0))
            assert one == pytest.approx(ours, rel=1e-9)
        ours = run_times(runs_of(entities), speed, rate, 0.01).sum() + 0.25 * len(rings)
        assert burn_time(drawing, every, Pace(speed, rate, 0.01, 0.25)) == pytest.approx(ours)
        begins, ends = ends_of(entities)
        ways = np.hypot(*(begins - np.concatenate((np.zeros((1, 2)), ends[:-1]))).T)
        ours = hop_times(ways, speed, rate).sum()
        assert hop_time(drawing, every, speed, rate) == pytest.approx(ours)
    nothing = np.zeros(0, dtype=np.int64)
    assert burn_time(drawing, nothing, Pace(20.0, 500.0, 0.01, 0.5)) == 0.0
    assert hop_time(drawing, nothing, 20.0, 500.0) == 0.0
