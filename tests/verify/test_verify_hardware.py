"""The hardware that a job names is proved to fit: the check objects to what does not."""

import copy
from dataclasses import replace

import pytest

from fabweave.verify.checks.reports.bill import check_bom
from fabweave.verify.read.job_files import Job, load_job
from fabweave.verify.statement import Tally


@pytest.fixture(scope="module")
def job(finished) -> Job:
    words = "shape:octahedron --size 200mm --effort quick"
    return load_job(finished(*words.split()), Tally("files"))


def findings(job: Job, waste: dict) -> tuple[str, ...]:
    tally = Tally("bom")
    check_bom(replace(job, waste=waste), tally)
    return tally.result().findings


def test_what_is_named_fits(job):
    assert findings(job, job.waste) == ()
    assert all(row["fits"] for row in job.waste["fasteners"])


def drop_a_name(waste):
    waste["fasteners"][0]["fits"].pop()


def name_another(waste):
    waste["fasteners"][0]["fits"].append("screw-m2")


def shorten_the_grips(waste):
    for sort in waste["hardware"]:
        sort["grips_mm"] = [[5.0, 6.0]]


def widen_the_holes(waste):
    for sort in waste["hardware"]:
        sort["hole_mm"] = [8.0, 9.0]


def forget_the_catalogue(waste):
    del waste["hardware"]


@pytest.mark.parametrize(
    "spoil",
    [drop_a_name, name_another, shorten_the_grips, widen_the_holes, forget_the_catalogue],
)
def test_what_does_not_fit_is_found(job, spoil):
    waste = copy.deepcopy(job.waste)
    spoil(waste)
    assert any("the hardware that fits" in finding for finding in findings(job, waste))
