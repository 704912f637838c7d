"""What is cut settles onto the model: nearer than as drawn, as symmetric, within the same rules."""

from functools import cache

import numpy as np
import pytest

import fabweave.form.compensate as module
from fabweave.form.body import body_of
from fabweave.form.hold import pins_of
from fabweave.form.settle import let_go, settle
from fabweave.job.stations import Stations
from fabweave.mesh.automorphisms import find_symmetry

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


@pytest.mark.parametrize("name", [*MOVED])
def test_what_is_moved_rests_where_it_does_whatever_it_is_let_go_from(name):
    drawn, moved = (body_of(job(name, how).joined.woven, job(name).brief) for how in ("off", "on"))
    pins = pins_of(moved, job(name).piece_set)
    near, far = let_go(moved, pins, like=let_go(drawn, pins)), let_go(moved, pins)
    for one, other in ((near.free, far.free), (near.end, far.end)):
        assert one.settled
        assert one.energy_nmm == pytest.approx(other.energy_nmm, rel=1e-3)
        apart = one.state.bodies.origin - other.state.bodies.origin
        assert (
            np.linalg.norm(apart, axis=1).max()
            < 0.03 * np.linalg.norm(other.state.bodies.origin - moved.target, axis=1).max() + 0.02
        )
    # It begins near to rest.
    assert near.free.history[0] - near.free.energy_nmm < 0.1 * far.free.history[0]


def test_no_edge_is_drawn_out_or_pressed_by_much():
    drawn, moved = (job("torus", how).joined.woven for how in ("off", "on"))
    ends = drawn.halfedges.tail, drawn.halfedges.head
    was, now = (np.diff(one.mesh.vertices[np.stack(ends)], axis=0)[0] for one in (drawn, moved))
    length = np.linalg.norm(was, axis=1)
    assert 0.0 < (np.linalg.norm(now - was, axis=1) / length).max() <= module._PULLED
    # Where less is allowed, less is done.
    most = 0.6 * (np.linalg.norm(now - was, axis=1) / length).max()
    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(module, "_PULLED", most)
        shape, options, _ = MOVED["torus"]
        less = Stations.read(shape, {**options, "effort": "quick"}).joined.woven
    now = np.diff(less.mesh.vertices[np.stack(ends)], axis=0)[0]
    assert (np.linalg.norm(now - was, axis=1) / length).max() <= most
    assert less.aim.left_mm.mean() < less.aim.drawn_mm.mean()


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
