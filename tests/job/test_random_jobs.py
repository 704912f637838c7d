"""Random meshes with random settings are proved, or refused.

    FABWEAVE_FUZZ=1000 pytest tests/job/test_random_jobs.py -n 8 --dist load

makes a thousand jobs of each kind in place of some.
"""

import os

import numpy as np
import pytest
from random_jobs import earlier_stock, hull, outcome, outcome_of, outcome_of_newest

from fabweave.core.errors import TooFineError
from fabweave.piece import joined_object

pytestmark = [pytest.mark.usefixtures("quick_jobs"), pytest.mark.slow]
ENDS = ("proved", "cannot be made", "bad input")
MANY = int(os.environ.get("FABWEAVE_FUZZ", "6"))


#: Small ones are made quickly, of seeds that others do not have.
@pytest.mark.parametrize(
    ("seed", "small"),
    [(70001, True), (70003, True)] + [(n, False) for n in range(MANY)],
)
def test_a_random_job_is_proved_or_refused(seed, small):
    found, said = outcome_of(seed, small=small)
    assert found in ENDS, said


@pytest.fixture(scope="module")
def stocks(tmp_path_factory):
    return earlier_stock(tmp_path_factory.mktemp("earlier"))


#: In the last, letters so near one another that their surroundings could not be united.
@pytest.mark.parametrize("seed", [*range(91000, 91000 + 2 * MANY // 5), 99281])
def test_a_random_job_on_offcuts_of_earlier_ones_is_proved_or_refused(seed, stocks):
    found, said = outcome_of(seed, small=True, stocks=stocks)
    assert found in ENDS, said


@pytest.mark.parametrize("seed", range(MANY))
def test_a_random_job_of_what_is_newest_is_proved_or_refused(seed, tmp_path):
    found, said = outcome_of_newest(seed, tmp_path)
    assert found in ENDS, said


#: Jobs that found faults once: their seeds, and what was wrong.
FAULTS = {
    79: "a flat sheet, rounded to radii of 10^15 and of 10^6 mm, was two different ones",
    50175: "on flat triangles far from regular the mean of portals is not where strands meet",
    30146: "cross-lines of blocks meet the border of facets exactly, and rounding chose the side",
    71113: "a line across a piece at a station in the gap of a dovetail meets nothing of it",
    71316: "laps longer than any panel add to what is cut",
    71669: "a neck is measured from its middle",
    72089: "what is flat to the last digit of its model is flat",
    72114: "a slot stays in a lap that is shorter than its panel",
    76619: "two bodies of two slim triangles each: strands run nearly the same way across an edge",
    76674: "the same",
    77583: "the same, on a quad that had to be made convex",
    78108: "the normal of a dart was taken from the corner that is bent in",
    96302: "panels at two faces nearly folded onto each other ran through themselves",
    97002: "the same, at one end of a panel",
}
LARGE = (79, 50175, 30146)


@pytest.mark.parametrize("seed", FAULTS)
def test_jobs_that_found_faults_are_proved(seed):
    assert outcome_of(seed, small=seed not in LARGE) == ("proved", "")


def test_a_long_lap_that_ends_askew_is_proved():
    # Its last cross-line slants across the ribbon, with an end farther from the crossing than
    # half the lap and half the width there.
    options = {"size": "400mm", "joint": "rivet,lap=100mm", "effort": "quick", "force": True}
    assert outcome(hull(np.random.default_rng(6)), options) == ("proved", "")


def test_what_joints_make_too_stiff_is_refused(monkeypatch):
    # Which job bends just enough with laps at every crossing, but not with laps where its joints
    # are, changes with every change of widths: here the material is too stiff for any joints.
    def too_stiff(laid, *_):
        if laid.laps is not None:
            raise TooFineError("it bends too little")

    assert outcome_of(74758, small=True)[0] == "proved"
    monkeypatch.setattr(joined_object, "require_stiffness", too_stiff)
    assert outcome_of(74758, small=True)[0] == "cannot be made"
