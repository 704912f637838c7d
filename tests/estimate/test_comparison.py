"""The use of material stands beside the best and two naive ways, and verify measures it anew."""

import json
import math

import numpy as np
import pytest

from fabweave.estimate.comparison import shelf_sheets

JOB = (
    "shape:cube", "--refine", "catmull-clark:1", "--size", "200mm", "--sheet", "600x400mm",
    "--effort", "quick",
)  # fmt: skip


@pytest.fixture(scope="module")
def waste(finished):
    return json.loads((finished(*JOB) / "waste.json").read_text(encoding="utf-8"))


def test_holes_are_waste_in_every_figure(waste) -> None:
    for figures in (*waste["sheets"], *waste["materials"], waste["totals"]):
        area = figures["area_mm2"]
        assert figures["hole_area_mm2"] > 0
        assert figures["piece_area_mm2"] + figures["waste_mm2"] == pytest.approx(area)
        assert figures["utilisation"] == pytest.approx(figures["piece_area_mm2"] / area, abs=1e-6)
    assert waste["comparison"]["gross"] == pytest.approx(waste["totals"]["utilisation"], abs=1e-6)


def test_net_of_kept_offcuts_more_is_used_and_the_best_is_no_less(waste) -> None:
    told, totals = waste["comparison"], waste["totals"]
    kept = sum(offcut["area_mm2"] for offcut in waste["offcuts"])
    assert told["kept_mm2"] == pytest.approx(kept)
    assert kept > 0
    used = totals["piece_area_mm2"]
    assert told["net"] == pytest.approx(used / (totals["area_mm2"] - kept), abs=1e-6)
    assert told["gross"] < told["net"]
    assert told["gross"] <= told["best"] <= used / (told["bound_sheets"] * 240_000.0) + 1e-6
    # Half the gap may reach into the margin, on all four sides.
    assert told["bound_sheets"] == math.ceil(told["bound_mm2"] / (582.0 * 382.0))


def test_the_naive_ways_take_more(waste) -> None:
    told = waste["comparison"]
    outlines_mm2 = waste["totals"]["piece_area_mm2"] + waste["totals"]["hole_area_mm2"]
    assert outlines_mm2 < told["rectangles"]["area_mm2"] < told["strips"]["area_mm2"]
    for way in (told["rectangles"], told["strips"]):
        assert (way["utilisation"] is None) == (way["too_large"] > 0)
        assert way["utilisation"] is None or way["utilisation"] <= told["best"]


def test_shelves_hold_what_a_count_by_hand_says() -> None:
    # A sheet of 100 x 50 with no gap holds five rows of ten squares of 10.
    squares = np.full((51, 2), 10.0)
    assert shelf_sheets(squares[:50], (100.0, 50.0), 0.0) == (1, 0)
    assert shelf_sheets(squares, (50.0, 100.0), 0.0) == (2, 0)
    # With a gap of 2 it holds four rows of eight.
    assert shelf_sheets(squares[:32], (100.0, 50.0), 2.0) == (1, 0)
    assert shelf_sheets(squares[:33], (100.0, 50.0), 2.0) == (2, 0)
    assert shelf_sheets(np.array([[101.0, 1.0]]), (100.0, 50.0), 0.0) == (0, 1)
    assert shelf_sheets(np.zeros((0, 2)), (100.0, 50.0), 0.0) == (0, 0)
