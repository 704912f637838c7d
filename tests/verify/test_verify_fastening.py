"""What is said to be fastened is proved: the check objects to every crossing that is not so."""

import json

import pytest
from replacing import replace
from sealing import result_of, verify_job

from fabweave.verify.check.fastening import check_fastening
from fabweave.verify.check.form import check_form
from fabweave.verify.read.job_files import Job, load_job
from fabweave.verify.report import Tally

# A whole job of its own stands behind each.
pytestmark = pytest.mark.slow

MADE = "shape:hypar?n=4 --size 200mm --fasten {} --effort quick"


@pytest.fixture(scope="module", params=["rim", "every:3"])
def job(finished, request) -> Job:
    return load_job(finished(*MADE.format(request.param).split()), Tally("files"))


def findings(job: Job) -> tuple[str, ...]:
    return result_of(check_fastening, job).findings


def with_map(job: Job, **changes) -> Job:
    return replace(job, map=replace(job.map, **changes))


def with_options(job: Job, **changes) -> Job:
    return replace(job, settings={**job.settings, "job": {**job.settings["job"], **changes}})


def test_what_is_made_is_fastened_as_asked(job):
    assert findings(job) == ()
    assert {crossing.fastened for crossing in job.map.crossings} == {True, False}


def test_one_more_or_one_less_is_found(job):
    for at in (0, len(job.map.crossings) // 2):
        crossings = list(job.map.crossings)
        crossings[at] = replace(crossings[at], fastened=not crossings[at].fastened)
        (found,) = findings(with_map(job, crossings=tuple(crossings)))
        assert "whether it is fastened" in found


def test_a_hole_without_a_fastener_is_found_unless_all_are_to_have_holes(job):
    def drill(piece):
        return replace(piece, stations=tuple(replace(one, hole_mm=2.5) for one in piece.stations))

    everywhere = with_map(job, pieces=tuple(map(drill, job.map.pieces)))
    assert any("not to be fastened" in finding for finding in findings(everywhere))
    assert findings(with_options(everywhere, holes="all")) == ()


@pytest.mark.parametrize("fasten", ["all", "joints", "none", "every:2", "most", "none,3"])
def test_settings_that_say_something_else_are_found(job, fasten):
    assert findings(with_options(job, fasten=fasten))


HUNG = ("shape:sphere?n=3", "--size", "150mm", "--hang", "top,bottom:3", "--effort", "quick")


def test_crossings_that_carry_something_are_the_ones_that_were_asked_for(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *HUNG)
    assert verify_job(folder).ok
    path = folder / "crossing_map.json"
    plan = json.loads(path.read_text("utf-8"))
    hung = [one for one in plan["crossings"] if one.get("hang")]
    assert len(hung) == 4
    assert all(one["fastened"] for one in hung)
    notes = json.loads((folder / "waste.json").read_text("utf-8"))["notes"]
    (note,) = [note for note in notes if note.startswith("hang:")]
    assert all(f" {one['id']} (" in note for one in hung)
    del hung[0]["hang"]
    other = next(one for one in plan["crossings"] if not one.get("hang"))
    other["hang"] = True
    path.write_text(json.dumps(plan), "utf-8")
    (check,) = [one for one in verify_job(folder).checks if one.name == "fastened"]
    assert f"lack {hung[0]['id']}" in str(check.findings)
    assert f"have {other['id']}" in str(check.findings)


def test_to_keep_a_form_joints_and_ends_are_fastened_and_more_may_be(finished):
    words = (
        "shape:tube?m=12&n=6 --size 300mm --boundary end --fasten form:1mm --holes fastened "
        "--effort quick --as-drawn off"
    )
    job = load_job(finished(*words.split()), Tally("files"))
    assert findings(job) == ()
    due = {joint.crossing for joint in job.map.joints}
    due |= {
        at for thread in job.map.threads for at in (*thread.crossings[:1], *thread.crossings[-1:])
    }
    fastened = {crossing.id for crossing in job.map.crossings if crossing.fastened}
    assert due < fastened
    for at, crossing in enumerate(job.map.crossings):
        crossings = list(job.map.crossings)
        crossings[at] = replace(crossing, fastened=not crossing.fastened)
        (found,) = findings(with_map(job, crossings=tuple(crossings)))
        assert f"crossing {crossing.id}" in found


def test_glue_holds_every_crossing_and_has_no_holes_but_at_joints(finished):
    words = "shape:tube?m=8&n=4 --size 200mm --fasten glue --holes fastened --effort quick"
    job = load_job(finished(*words.split()), Tally("files"))
    assert findings(job) == result_of(check_form, job).findings == ()
    assert {one.id for one in job.map.crossings if one.fastened} <= {
        joint.crossing for joint in job.map.joints
    }
    crossings = [replace(one, fastened=not one.fastened) for one in job.map.crossings]
    assert findings(with_map(job, crossings=tuple(crossings)))
