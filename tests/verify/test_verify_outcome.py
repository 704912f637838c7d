"""Spoil what job.toml and the layout's notes tell: the check objects, and no other."""

import copy
import json
import shutil
from dataclasses import replace

import pytest
from jobs import OCTAHEDRON

from fabweave.verify import verify_job
from fabweave.verify.checks.reports.outcome import check_outcome
from fabweave.verify.read.job_files import load_job
from fabweave.verify.statement import Tally


@pytest.fixture(scope="module")
def folder(finished):
    folder = finished(*OCTAHEDRON)
    proof = json.loads((folder / "verify.json").read_text(encoding="utf-8"))
    (check,) = [check for check in proof["checks"] if check["name"] == "outcome"]
    assert check["ok"] is True
    assert check["count"] >= 9
    return folder


@pytest.fixture(scope="module")
def true_job(folder):
    tally = Tally("files")
    job = load_job(folder, tally)
    assert tally.result().ok
    return job


@pytest.fixture
def job(true_job):
    """Return a job as read, of which settings, waste and map may be spoiled."""
    parts = ("settings", "waste", "document")
    return replace(true_job, **{name: copy.deepcopy(getattr(true_job, name)) for name in parts})


def findings(job):
    tally = Tally("outcome")
    check_outcome(job, tally)
    return tally.result().findings


def tell(job, note):
    """Let the layout have a note, and job.toml and waste.json tell it."""
    for place in (job.document["layout"], job.settings["outcome"], job.waste):
        place["notes"].append(note)


@pytest.mark.parametrize(
    "name", ["threads", "crossings", "pieces", "joints", "sheets", "utilisation"]
)
@pytest.mark.parametrize("change", [1, 0.001, None, "3", float("nan"), True])
def test_every_figure_is_held_to_the_map(job, name, change):
    outcome = job.settings["outcome"]
    if change is None:
        del outcome[name]
    else:
        outcome[name] = outcome[name] + change if type(change) in (int, float) else change
    (finding,) = findings(job)
    assert f"outcome: {name} is" in finding


def test_notes_must_be_texts_and_the_same_everywhere(job):
    job.settings["outcome"]["notes"].append("all is well")
    (finding,) = findings(job)
    assert finding.startswith("waste.json: the list of notes is")
    job.settings["outcome"]["notes"] = [1]
    assert "not texts" in findings(job)[0]


def test_a_layout_that_may_not_be_found_again_is_taken_from_the_map(job):
    job = replace(job, map=replace(job.map, recorded=True))
    (finding,) = findings(job)
    assert "layout: recorded is True, but should be False, as in job.toml" in finding
    job.settings["job"]["layout"] = "crossing_map.json"
    assert findings(job) == ()
    (finding,) = findings(replace(job, map=replace(job.map, recorded=False)))
    assert "layout: recorded is False, but should be True, as in job.toml" in finding


def test_the_map_states_what_the_makers_know_of_the_layout(true_job):
    assert true_job.document["layout"]["recorded"] is False
    assert true_job.map.recorded is False


@pytest.mark.parametrize("name", ["margin", "gap"])
def test_margin_and_gap_are_those_that_were_asked_for(job, name):
    job.settings["job"][name] = "1.5mm"
    (finding,) = findings(job)
    assert f"layout: {name} is" in finding


def test_a_note_of_the_layout_that_is_not_told_is_missed(job):
    tell(job, "nesting is done")
    job.settings["outcome"]["notes"].pop()
    job.waste["notes"].pop()
    (finding,) = findings(job)
    assert "its note 'nesting is done' is not in job.toml" in finding


def test_a_spoiled_file_is_found_by_this_check_alone(folder, tmp_path):
    spoiled = shutil.copytree(folder, tmp_path / "job")
    text = (spoiled / "job.toml").read_text(encoding="utf-8")
    (spoiled / "job.toml").write_text(text.replace("\nsheets = 1\n", "\nsheets = 2\n"))
    assert verify_job(spoiled).failed == ("outcome",)
