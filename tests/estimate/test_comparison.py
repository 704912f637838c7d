"""The use of material stands beside the best, and verify measures it anew."""

import json
import math

import pytest

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
