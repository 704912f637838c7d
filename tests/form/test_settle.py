"""An object that its crossings brace keeps its form; one that they do not settles."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import laid

import fabweave as fw
from fabweave.form import body as module
from fabweave.form.body import (
    BARE,
    PINNED,
    RIVETED,
    YOUNG,
    body_of,
    elastic,
    fitted,
    rigid_motions,
)
from fabweave.form.net import NetState
from fabweave.form.screw import exponential
from fabweave.form.settle import Form, settle
from fabweave.job.ask import brief_of
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.plan.verdict import judge
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.stock.material import material_library, material_named

GOOD = Form(settles_mm=1.0, mean_mm=0.5, where="top", bound_mm=3.0, size_mm=300.0, sags_mm=0.1,
            loose=0, pushed_mm=2.0, gives_mm_n=1.0, soft="top", apart=0, apart_n=0.0, strain=0.2,
            settled=True, air_mm=None, off_mm=1.0, off_mean_mm=0.5, off_where="top",
            bodies=None)  # fmt: skip


def body(shape, size_mm, **options):
    woven, settings, supplies = laid(shape, size_mm=size_mm, **options)
    return body_of(woven, brief_of(settings, supplies))


#: A rule that is broken in few places.
BROKEN = BrokenRule("bend", "warn", 30.0, 46.0, "mm", "A", 3, 17, None, (0, 0, 0), 5, 120)


def let_go(shape, size_mm, pin, **options):
    some = body(shape, size_mm, **options)
    return settle(some, np.full(len(some.places), pin)).form


@pytest.fixture(scope="module")
def shade():
    """A lampshade of plain weave: open, and of quads that are a mechanism."""
    tube, end = "shape:tube?m=16&n=8", {"boundary": "end"}
    return {pin: let_go(tube, 300.0, pin, **end) for pin in (BARE, PINNED, RIVETED)}


def test_fasteners_hold_a_lampshade(shade):
    bare, pinned, riveted = shade.values()
    assert bare.settles_mm > 5 * pinned.settles_mm
    assert bare.loose > pinned.loose > riveted.loose == 0
    assert bare.sags_mm > riveted.sags_mm
    assert not bare.keeps
    assert pinned.keeps


def test_triangles_brace_themselves():
    """A kagome ball hardly moves, whether its crossings turn or not."""
    ball = let_go("shape:icosahedron", 300.0, 0.0, pattern="kagome", refine="loop:2")
    assert ball.settles_mm < 0.002 * 300.0
    assert ball.loose == 0
    assert ball.keeps


@given(st.integers(0, 99))
def test_the_best_rigid_motion_is_found(seed):
    random = np.random.default_rng(seed)
    frames = exponential(random.normal(size=(9, 6)) * 3.0)
    motion = exponential(random.normal(size=(1, 6)))
    one = np.zeros(9, dtype=np.int64)
    moved = NetState(motion[one].then(frames), np.zeros(0), motion[one[:2]].then(frames[one[:2]]))
    found = fitted(moved, frames.origin)
    assert found.bodies.origin == pytest.approx(frames.origin, abs=1e-9)
    assert found.bodies.axes == pytest.approx(frames.axes, abs=1e-9)
    assert found.inner.origin == pytest.approx(frames.origin[one[:2]], abs=1e-9)
    mirrored = frames.origin * (1.0, 1.0, -1.0)
    assert np.linalg.norm(fitted(moved, mirrored).bodies.origin - mirrored) > 1.0


def test_every_material_of_the_library_is_known_well_enough():
    for material in material_library():
        along, across = material.young_mpa
        assert along >= across > 0
        assert material.young_source
        assert elastic(material, grain=True).young_mpa == along
        assert elastic(replace(material, laid_across=True), grain=True).young_mpa == across
        assert across <= elastic(material, grain=False).young_mpa <= along
    unknown = replace(material_named("card"), young_mpa=None)
    assert elastic(unknown, grain=True).young_mpa == YOUNG


def test_what_would_take_minutes_is_not_let_go(monkeypatch):
    woven, settings, supplies = laid("shape:octahedron", size_mm=200.0)
    monkeypatch.setattr(module, "MOST_CROSSINGS", woven.weave.threads.n_crossings - 1)
    assert body_of(woven, brief_of(settings, supplies)) is None


def test_crossings_resist_as_they_are_fastened_and_as_was_measured():
    some = body("shape:octahedron", 200.0)
    fastened = np.zeros(12, dtype=bool)
    fastened[1:3] = True
    assert some.pins(fastened, np.array([2])).tolist()[:4] == [BARE, PINNED, RIVETED, BARE]
    own = replace(some, turning_nmm=(0.5, 60.0)).pins(fastened, np.array([2]))
    assert own.tolist()[:4] == [0.5, 60.0, RIVETED, 0.5]


def test_rigid_motions_strain_nothing():
    some = body("shape:octahedron", 200.0)
    motions = rigid_motions(some.places)
    assert motions.T @ motions == pytest.approx(np.eye(6), abs=1e-12)
    apart = some.places[:, None] - some.places
    moved = motions.T.reshape(6, 1, -1, 3) - motions.T.reshape(6, -1, 1, 3)
    # To first order, no two places come nearer to one another.
    assert np.abs((moved * np.swapaxes(apart, 0, 1)).sum(axis=3)).max() < 1e-9


def test_an_object_hangs_from_what_was_asked_for_and_else_stands_on_what_is_low():
    standing = body("shape:sphere?n=3", 200.0)
    held = standing.held(standing.places)
    low = standing.places[:, 2] < standing.places[:, 2].min() + 0.02 * standing.size_mm
    assert held.sum() == max(3, low.sum())
    hanging = body("shape:sphere?n=3", 200.0, hang="top")
    assert np.flatnonzero(hanging.held(hanging.places)) == hanging.places[:, 2].argmax()


def test_a_load_is_borne_where_it_is_said():
    some = body("shape:sphere?n=3", 200.0, load="2kg@bottom:3")
    bears = some.load.any(axis=1)
    assert bears.sum() == 3
    assert some.load.sum(axis=0) == pytest.approx((0.0, 0.0, -19.62))
    assert some.places[bears, 2].max() < some.places[:, 2].mean()


def test_plain_weaves_press_together_and_floats_part():
    plain = let_go("shape:torus?m=12&n=8", 300.0, BARE)
    twill = let_go("shape:torus?m=12&n=8", 300.0, BARE, pattern="twill")
    assert twill.apart > 4 * plain.apart
    assert twill.apart_n > 4 * plain.apart_n


@pytest.mark.parametrize(
    ("change", "keeps", "stands"),
    [
        ({}, True, True),
        ({"settles_mm": 3.1}, False, True),
        ({"settled": False}, False, False),
        ({"loose": 2}, True, True),
        ({"pushed_mm": 149.9}, True, True),
        ({"pushed_mm": 150.1}, True, False),
        ({"sags_mm": 30.1}, True, False),
        ({"loaded_mm": 30.1}, True, False),
        ({"settles_mm": 30.1}, False, False),
    ],
)
def test_a_form_is_kept_within_its_bound_and_stands_within_a_tenth(change, keeps, stands):
    form = replace(GOOD, **change)
    assert (form.keeps, form.stands) == (keeps, stands)
    verdict = judge([BROKEN], narrowest_mm=9.0, form=form)
    if stands:
        assert verdict.level == "with care"
    elif not form.settled:
        assert [one.rule for one in verdict.reasons] == ["form", "bend"]
    else:
        # What collapses is said first and without a number of its own, unless a former holds it.
        assert verdict.level == "not makeable"
        assert [one.rule for one in verdict.reasons] == ["collapse", "bend"]
        assert judge([], narrowest_mm=9.0, form=form, former=True).level == "with care"
        assert "30.1" not in form.text
        assert [form.record()[key] for key in change] == [None]
        assert form.record()["collapses"]
    # That its mesh was moved is told of what stands.
    moved = {"moved_mm": 3.0, "drawn_mm": 9.0, "drawn_mean_mm": 4.0, "drawn_where": "at the top"}
    told = replace(form, off_mm=form.settles_mm, **moved).record().keys()
    assert told & moved.keys() == (set() if form.collapse else moved.keys())


@pytest.mark.slow
def test_what_is_heavy_collapses_on_a_slender_stem(monkeypatch):
    """A tall tube of card stands by itself, and no longer when all weighs a hundred times more."""
    assert let_go("shape:tube?m=8&n=4", 300.0, RIVETED).collapse == ""
    monkeypatch.setattr("fabweave.form.woven_net.GRAVITY", 9.81 * 3000)
    form = let_go("shape:tube?m=8&n=4", 300.0, BARE)
    assert form.sags_mm > 30.0
    assert form.collapse


@pytest.fixture(scope="module")
def pair():
    """Two octahedra, one beside the other and 90 mm higher; and one alone."""
    solid = parse_shape("shape:octahedron")
    points, faces = 50.0 * solid.vertices / np.abs(solid.vertices).max(), solid.faces()
    one = PolyMesh.from_faces(points, faces)
    high = points + np.array([150.0, 0.0, 90.0])
    more = [[len(points) + at for at in face] for face in faces]
    two = PolyMesh.from_faces(np.concatenate([points, high]), [*faces, *more])

    def made(mesh):
        woven, settings, supplies = laid("pair.obj", mesh, up="z")
        some = body_of(woven, brief_of(settings, supplies))
        return settle(some, np.full(len(some.places), PINNED))

    return made(one), made(two)


def test_each_of_two_bodies_stands_as_it_does_alone(pair):
    alone, both = (one.form for one in pair)
    assert both.settled
    assert len(both.bodies) == 2
    for own in both.bodies:
        for name in ("settles_mm", "mean_mm", "sags_mm", "pushed_mm", "size_mm", "loose"):
            assert getattr(own, name) == pytest.approx(getattr(alone, name), abs=0.011), name
    assert both.settles_mm == max(one.settles_mm for one in both.bodies)
    state = pair[1].states["standing"].state
    assert np.linalg.norm(state.bodies.origin - pair[1].wished, axis=1).max() < 10.0


@pytest.mark.slow
def test_a_form_is_what_becomes_of_crossings():
    ribbons = fw.weave(fw.shape("tube?m=8&n=4", size="200mm")).ribbons()
    settled = ribbons.relax(pins=0.0)
    form, wished, rested, mode = settled.form, settled.wished, settled.rested, settled.mode
    away = np.linalg.norm(rested - wished, axis=1)
    assert form.settles_mm == pytest.approx(away.max(), abs=0.006)
    assert form.mean_mm == pytest.approx(np.sqrt((away**2).mean()), abs=0.006)
    assert wished == pytest.approx(ribbons.woven.ribbons.centre)
    assert np.linalg.norm(mode, axis=1).max() == pytest.approx(1.0)
    assert away.max() > np.linalg.norm(ribbons.relax(pins=1e5).rested - wished, axis=1).max()
