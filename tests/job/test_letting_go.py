"""What collapses is told what holds it, and only what did so when it was tried."""

import pytest
from jobs import laid, plan_job

from fabweave.form import woven_net
from fabweave.job import letting_go as module
from fabweave.job.letting_go import let_job_go
from fabweave.ribbon.rules.remedy import Depth

pytestmark = pytest.mark.usefixtures("quick_jobs")


@pytest.fixture(scope="module")
def planned():
    woven, settings, _supplies = laid("shape:octahedron", size_mm=200.0, fasten="all")
    return plan_job(woven, settings, depth=Depth.ALONG)


@pytest.fixture
def heavy(planned, monkeypatch):
    """Let all weigh so much that it sags by some 15 % of its size."""
    form = let_job_go(planned).settled.form
    times = 0.15 * form.size_mm / form.sags_mm
    monkeypatch.setattr(woven_net, "GRAVITY", times * woven_net.GRAVITY)
    return planned


def test_what_stands_wants_no_cure(planned):
    found = let_job_go(planned)
    assert found.settled.form.stands
    assert found.cure == ""


def test_thicker_material_holds_what_collapses_and_is_named_once_it_did(heavy, monkeypatch):
    tried, real = [], module._holds

    def holds(planned, settings):
        tried.append((settings.stock.thickness_mm, real(planned, settings)))
        return tried[-1][1]

    monkeypatch.setattr(module, "_holds", holds)
    found = let_job_go(heavy)
    assert found.settled.form.collapse
    assert [held for _, held in tried] == [False] * (len(tried) - 1) + [True]
    assert f"--thickness {tried[-1][0]:g}mm" in found.cure


def test_no_cure_is_named_that_did_not_hold(heavy, monkeypatch):
    monkeypatch.setattr(module, "_holds", lambda *_: False)
    assert "--" not in let_job_go(heavy).cure
