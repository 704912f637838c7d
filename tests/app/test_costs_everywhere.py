"""The costs of one job are the same wherever they are told."""

import io
import json
import tomllib
from contextlib import redirect_stdout
from html import unescape

import pypdf
import pytest

from fabweave.app.inspection.facts import inspect_mesh
from fabweave.app.inspection.text import inspection_text
from fabweave.app.settings import Settings
from fabweave.cli.main import main
from fabweave.core.records import from_json
from fabweave.report.costs.money import Price, price_text
from fabweave.report.costs.texts import hours_text, time_text
from fabweave.verify import verify_job

JOB = ("shape:torus?m=8&n=4", "--size", "240mm", "--effort", "quick")


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """Return the folder of a calibrated job, and what the terminal said."""
    folder, out = tmp_path_factory.mktemp("costs") / "job", io.StringIO()
    with redirect_stdout(out):
        main(["make", *JOB, "--calibrate", "1.25", "-o", str(folder)])
    return folder, " ".join(out.getvalue().split())


@pytest.mark.slow
def test_terminal_outcome_page_and_manual_say_what_waste_json_says(told):
    folder, terminal = told
    estimate = json.loads((folder / "waste.json").read_text("utf-8"))["estimate"]
    outcome = tomllib.loads((folder / "job.toml").read_text("utf-8"))["outcome"]["costs"]
    page = unescape((folder / "waste.html").read_text("utf-8"))
    pages = pypdf.PdfReader(folder / "assembly.pdf").pages
    manual = " ".join(" ".join(page.extract_text() for page in pages[:2]).split())
    times = [time_text(tuple(estimate[key])) for key in ("cut_s", "engrave_s", "travel_s")]
    hours = hours_text(tuple(estimate["assembly"]["hours"]))
    price = price_text(from_json(Price, estimate["hardware_price"]))
    for text in (terminal, outcome, page, manual):
        for figure in (*times, hours, price, estimate["difficulty"]["word"]):
            assert figure in text
    assert outcome in terminal
    for text in estimate["assumptions"]:
        assert text in page
    assert estimate["calibration"] == 1.25
    assert verify_job(folder).ok


def test_inspect_tells_nearly_the_same_before_anything_is_nested(told):
    folder, _ = told
    estimate = json.loads((folder / "waste.json").read_text("utf-8"))["estimate"]
    facts = inspect_mesh(Settings(JOB[0], size_mm=240.0, effort="quick", calibrate=1.25)).facts
    costs = facts["costs"]
    assert costs["engrave_s"] == pytest.approx(estimate["engrave_s"], abs=5e-3)
    assert costs["cut_s"] == pytest.approx(estimate["cut_s"], rel=1e-3)
    assert costs["travel_s"] == pytest.approx(estimate["travel_s"], rel=0.1)
    assert costs["hardware_price"] == estimate["hardware_price"]
    assert costs["planned"]
    words = dict(inspection_text(facts))
    assert words["machine"] == costs["told"]["Machine"]
    assert json.loads(json.dumps(costs)) == json.loads(json.dumps(facts["costs"]))
