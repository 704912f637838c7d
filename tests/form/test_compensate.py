"""What is cut settles onto the model: nearer than as drawn, as symmetric, within the same rules."""

from functools import cache

import numpy as np
import pytest

from fabweave.form import compensate
from fabweave.form.body import body_of
from fabweave.form.hold import pins_of
from fabweave.form.settle import settle
from fabweave.job.stations import Stations
from fabweave.mesh.automorphisms import find_symmetry
from fabweave.ribbon.rules.remedy import Depth

pytestmark = pytest.mark.usefixtures("quick_jobs")

#: By its shape and options, and how much of what it is off as drawn may be left, in the mean.
MOVED = {
    "torus": ("shape:torus?m=8&n=6", {"size": "300mm"}, 0.3),
    "hung": ("shape:tube?m=8&n=4", {"size": "200mm", "hang": "top:3", "load": "50g@bottom"}, 0.6),
}


@cache
def job(name, as_drawn="on"):
    shape, options, _ = MOVED[name]
    return Stations.read(shape, {**options, "effort": "quick", "as_drawn": as_drawn})


def form_of(stations):
    """Return what becomes of a job's object when it is let go, as closely as jobs do."""
    body = body_of(stations.joined.woven, stations.brief)
    return settle(body, pins_of(body, stations.piece_set)).form


@pytest.mark.parametrize("name", [*MOVED])
def test_it_settles_nearer_to_the_model_and_keeps_its_rules(name):
    after, before = form_of(job(name)), form_of(job(name, "off"))
    assert before.moved_mm is None
    assert after.moved_mm > 0.0
    assert after.off_mean_mm <= MOVED[name][2] * before.off_mean_mm
    assert after.off_mm < before.off_mm
    assert after.drawn_mean_mm == pytest.approx(before.off_mean_mm, rel=0.1, abs=0.02)
    broken = {one.rule: one.count for one in job(name).check.findings}
    assert broken.keys() <= {one.rule for one in job(name, "off").check.findings}


def test_it_is_wished_where_it_would_be_drawn():
    aim, drawn = job("torus").joined.woven.aim, job("torus", "off").joined.woven
    assert np.array_equal(aim.mesh.vertices, drawn.mesh.vertices)
    assert np.array_equal(aim.places, drawn.ribbons.centre)
    moved = job("torus").joined.woven.mesh.vertices - aim.mesh.vertices
    assert aim.moved_mm == pytest.approx(np.linalg.norm(moved, axis=1).max())


def test_what_is_symmetric_stays_so_and_alike_pieces_stay_alike():
    moved, drawn = (job("torus", how).joined.woven for how in ("on", "off"))
    orders = [find_symmetry(one.mesh, one.halfedges).order for one in (moved, drawn)]
    assert orders[0] == orders[1] > 1
    assert job("torus").piece_set.kinds.count == job("torus", "off").piece_set.kinds.count


def test_the_same_comes_out_twice():
    shape, options, _ = MOVED["torus"]
    again = Stations.read(shape, {**options, "effort": "quick"})
    once, twice = (one.joined.woven.mesh.vertices for one in (job("torus"), again))
    assert once.tobytes() == twice.tobytes()


@pytest.mark.parametrize(
    "options",
    [
        # What keeps its form to less than its thickness; straight strips; what lies on a former.
        {"size": "40mm", "material": "card", "thickness": "0.4mm", "force": True},
        {"size": "300mm", "strips": "straight"},
        {"size": "300mm", "former": "auto"},
    ],
)
def test_what_gains_nothing_or_may_not_move_is_left_as_it_is_drawn(options):
    stations = Stations.read("shape:icosahedron", {"refine": "loop:1", "effort": "quick"} | options)
    assert stations.joined is stations.drawn
    assert stations.joined.woven.aim is None


def test_nothing_better_is_foretold_than_vertices_may_take_back(monkeypatch):
    asked, woven = job("torus").asked, job("torus").joined.woven

    def foretold():
        return Stations(asked, depth=Depth.NEAR).foretold

    moved = woven.aim.moved_mm / woven.size_mm
    far, left = foretold().settles_mm, {}
    for share in (10.0, 0.7, 1e-3):
        monkeypatch.setattr(compensate, "_MOVED", share * moved)
        left[share] = foretold().left_mm
    assert left[10.0] < left[0.7] < far
    # Where not even half of it may be taken back, it is cut as it is drawn, and foretold so.
    assert left[1e-3] is None
    assert Stations(asked).joined.woven.aim is None
