"""Spoil what job.toml and the layout's notes tell: the check objects, and no other."""

import copy
import shutil
from dataclasses import replace

import pytest

from fabweave.app.job_folder import run_job
from fabweave.app.settings import Settings
from fabweave.verify import verify_job
from fabweave.verify.checks.outcome import check_outcome
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "job"
    settings = Settings("shape:octahedron", size_mm=300.0, effort="quick")
    proof = run_job(settings, folder).proof
    (check,) = [check for check in proof.checks if check.name == "outcome"]
    assert check.ok
    assert check.count >= 9
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
    assert findings(job) == ("the notes of job.toml and of waste.json differ",)
    job.settings["outcome"]["notes"] = [1]
    assert "not texts" in findings(job)[0]


def test_a_note_must_tell_the_true_number_of_sheets_and_be_recorded(job):
    tell(job, "nesting was cut short: the pieces are on 1 sheet; there may be fewer")
    assert findings(job) == ()
    tell(job, "the same settings may give another layout")
    assert findings(job) == (
        "the settings may give another layout, and job.toml does not take the recorded one",
    )
    job.settings["job"]["layout"] = "crossing_map.json"
    assert findings(job) == ()
    tell(job, "nesting was cut short: the pieces are on 2 sheets")
    assert findings(job) == ("a note says '2 sheets', and there are 1",)


@pytest.mark.parametrize("name", ["margin", "gap"])
def test_margin_and_gap_are_those_that_were_asked_for(job, name):
    job.settings["job"][name] = "1.5mm"
    (finding,) = findings(job)
    assert f"a {name} of" in finding


def test_a_note_of_the_layout_that_is_not_told_is_missed(job):
    tell(job, "nesting is done")
    job.settings["outcome"]["notes"].pop()
    job.waste["notes"].pop()
    assert findings(job) == ("job.toml does not tell the layout's note 'nesting is done'",)


def test_a_spoiled_file_is_found_by_this_check_alone(folder, tmp_path):
    spoiled = shutil.copytree(folder, tmp_path / "job")
    text = (spoiled / "job.toml").read_text(encoding="utf-8")
    (spoiled / "job.toml").write_text(text.replace("\nsheets = 1\n", "\nsheets = 2\n"))
    assert verify_job(spoiled).failed == ("outcome",)
