"""What a half-built object wants: no force where it is flat, else as stiff as its material."""

from dataclasses import replace

import numpy as np
import pytest

from fabweave.form.body import body_of, off_places
from fabweave.form.building import _bound, _placed, homings
from fabweave.form.hold import pins_of
from fabweave.form.net import NetState
from fabweave.form.relax import relax
from fabweave.form.settle import settle
from fabweave.job.stations import Stations
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.ribbon.rules.remedy import Depth

pytestmark = pytest.mark.usefixtures("quick_jobs")


def built(asked, mesh=None):
    """Return an object as an elastic body, its pins, and how its pieces lie."""
    job = Stations(asked, mesh, depth=Depth.ALONG)
    body = body_of(job.planned.woven, job.brief)
    pins = pins_of(body, job.piece_set)
    return body, pins, job.weave.weave.threads, job.joined.plan.runs


def found(body, pins, threads, runs):
    # One thread after another: the last rings close late.
    return homings(body, pins, threads, runs, np.arange(len(runs.thread)))


@pytest.fixture(scope="module")
def torus():
    return built(Settings.of("shape:torus?m=8&n=4", size_mm=300.0, effort="quick"))


def test_what_is_flat_is_laid_without_force_and_does_not_sway_on_the_table(monkeypatch):
    x, y = np.meshgrid(np.arange(7.0), np.arange(7.0), indexing="ij")
    corners = np.arange(49).reshape(7, 7)
    quads = np.stack([corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]], -1)
    flat = PolyMesh(np.stack([x, y, 0 * x], -1).reshape(-1, 3), np.arange(0, 145, 4), quads.ravel())
    asked = Settings.of("flat.obj", size_mm=300.0, effort="quick", up="z", boundary="end")
    made = built(asked, flat)
    for one in found(*made):
        # Strips that go over and under are not quite flat.
        assert one.force_n < 0.5
        assert one.hands == "by hand"
    # Where it stood on a foot, it would: it weighs a hundred times as much as card.
    monkeypatch.setattr("fabweave.form.woven_net.GRAVITY", 9.81 * 100)
    body, pins, *_ = built(asked, flat)
    assert settle(body, pins).form.loose == 0


def test_what_is_ten_times_as_stiff_takes_ten_times_the_force_and_springs_as_far(torus):
    body, pins, threads, runs = torus
    stiffer = replace(body, net=replace(body.net, stiffness=10 * body.net.stiffness))
    for one, ten in zip(found(*torus), found(stiffer, 10 * pins, threads, runs), strict=True):
        assert one.closes
        assert ten.force_n == pytest.approx(10 * one.force_n, rel=1e-3)
        assert ten.springs_mm == pytest.approx(one.springs_mm, rel=1e-3)
        assert one.force_n > 0.0
        assert ten.hands != "by hand" or ten.force_n <= 5.0


def test_it_springs_about_as_far_as_a_half_built_object_that_is_let_go(torus):
    body, pins, threads, runs = torus
    last = found(*torus)[-1]
    spans = _placed(threads, runs, np.arange(len(runs.thread))) < last.step
    net, bound = body.net, _bound(body.net, spans)
    twice = np.flatnonzero(np.tile(spans, 2))
    some = replace(
        net, ends=net.ends[spans], at=net.at[twice], turns=net.turns[spans], rest=net.rest[spans],
        stiffness=net.stiffness[spans], weight=0 * net.weight, pins=np.where(bound, pins, 0.0),
    )  # fmt: skip
    inner = np.flatnonzero(np.repeat(spans, net.rest.shape[1] - 1))
    wished = body.wished
    rest = relax(some, NetState(wished.bodies, wished.angles, wished.inner[inner])).state
    away = off_places(rest.bodies.origin[bound], body.places[bound])
    assert last.springs_mm == pytest.approx(np.linalg.norm(away, axis=1).max(), rel=0.3)
