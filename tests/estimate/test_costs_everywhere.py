"""What a job will cost is told before anything is nested."""

import json

import pytest

from fabweave.design.inspection.facts import inspect_mesh
from fabweave.design.inspection.text import inspection_text
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings

pytestmark = pytest.mark.usefixtures("quick_jobs")

JOB = ("shape:torus?m=8&n=4", "--size", "240mm", "--effort", "quick")


@pytest.mark.slow
def test_inspect_tells_nearly_the_same_before_anything_is_nested(finished):
    folder = finished(*JOB, "--calibrate", "1.25")
    estimate = json.loads((folder / "waste.json").read_text("utf-8"))["estimate"]
    facts = inspect_mesh(
        Stations(Settings.of(JOB[0], size_mm=240.0, effort="quick", calibrate=1.25))
    ).facts
    costs = facts["costs"]
    assert costs["engrave_s"] == pytest.approx(estimate["engrave_s"], rel=0.02)
    assert costs["cut_s"] == pytest.approx(estimate["cut_s"], rel=1e-3)
    assert costs["travel_s"] == pytest.approx(estimate["travel_s"], rel=0.1)
    assert costs["hardware_price"] == estimate["hardware_price"]
    assert costs["planned"]
    assert dict(inspection_text(facts))["machine"] == costs["told"]["Machine"]
