"""The board of a base is proved: the check objects to each hole that is not about its foot."""

import numpy as np
import pytest
from replacing import replace
from sealing import result_of

from fabweave.verify.check.base import check_base
from fabweave.verify.check.fastening import carrying, check_fastening
from fabweave.verify.check.form import check_form
from fabweave.verify.drawing import HOLES
from fabweave.verify.read.job_files import BASE, Job, load_job
from fabweave.verify.report import Tally

# A whole job stands behind each.
pytestmark = pytest.mark.slow

MADE = "shape:tube?m=8&n=4 --size 200mm --base on --effort quick"


@pytest.fixture(scope="module")
def job(finished) -> Job:
    return load_job(finished(*MADE.split()), Tally("files"))


def findings(job: Job) -> str:
    return str(result_of(check_base, job).findings)


def with_board(job: Job, change, formats=("dxf", "svg")) -> Job:
    """Return a job whose board's shapes are those that a function makes of them, in some files."""
    drawn = {
        kind: {BASE: replace(board, shapes=tuple(change(list(board.shapes))))}
        for kind, board in ((kind, getattr(job.base, kind)[BASE]) for kind in formats)
    }
    return replace(job, base=replace(job.base, **drawn))


def moved(which: int, by: tuple[float, float]):
    """Return what moves one hole of the board."""

    def change(shapes):
        holes = [at for at, one in enumerate(shapes) if one.layer == HOLES]
        at = holes[which]
        shapes[at] = replace(shapes[at], points=shapes[at].points + np.array(by))
        return shapes

    return change


def test_what_is_made_is_about_its_feet(job):
    assert findings(job) == "()"
    assert len(carrying(job)) == 8
    assert result_of(check_fastening, job).findings == result_of(check_form, job).findings == ()


@pytest.mark.parametrize("which", range(0, 16, 3))
@pytest.mark.parametrize("by", [(0.1, 0.0), (0.0, -0.1), (40.0, 0.0)])
def test_each_hole_that_is_moved_is_found(job, which, by):
    assert "off the middle of its holes" in findings(with_board(job, moved(which, by)))


def test_a_board_may_lie_anywhere(job):
    def all_moved(shapes):
        return [replace(one, points=one.points + 7.0) for one in shapes]

    assert findings(with_board(job, all_moved)) == "()"


def test_other_faults_of_a_board_are_found(job):
    def without_a_hole(shapes):
        shapes.remove(next(one for one in shapes if one.layer == HOLES))
        return shapes

    def larger(shapes):
        at = next(at for at, one in enumerate(shapes) if one.layer == HOLES)
        shapes[at] = replace(shapes[at], radius=2.0 * shapes[at].radius)
        return shapes

    def small(shapes):
        return [replace(one, points=one.points / 2.0) if one.layer == "CUT_OUTER" else one
                for one in shapes]  # fmt: skip

    assert "how many holes" in findings(with_board(job, without_a_hole))
    assert "of one size" in findings(with_board(job, larger))
    assert "not on the board" in findings(with_board(job, small))
    # What differs between the two files is found, too.
    assert "differs from the DXF" in findings(with_board(job, moved(0, (0.1, 0.0)), ("svg",)))


def test_a_board_that_is_missing_or_was_not_asked_for_is_found(job):
    assert "whether there is a board" in findings(replace(job, base=None))
    asked = {name: value for name, value in job.settings["job"].items() if name != "base"}
    assert "whether there is a board" in findings(replace(job, settings={"job": asked}))


def test_other_feet_than_the_lowest_crossings_beside_the_rim_are_found(job):
    crossings = list(job.map.crossings)
    foot = next(at for at, one in enumerate(crossings) if one.hang)
    crossings[foot] = replace(crossings[foot], hang=None)
    spoiled = replace(job, map=replace(job.map, crossings=tuple(crossings)))
    assert "lack" in str(result_of(check_fastening, spoiled).findings)
    held = [one for one in job.form["held"] if one != foot]
    loose = replace(job, form={**job.form, "held": held})
    assert result_of(check_form, loose).findings
