"""An object that its crossings brace keeps its form; one that they do not settles."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import laid

import fabweave as fw
from fabweave.form import settle as module
from fabweave.form.screw import exponential
from fabweave.form.settle import (
    BARE,
    PINNED,
    RIVETED,
    Form,
    elastic,
    fitted,
    pin_stiffness,
    settle,
)
from fabweave.stock.material import material_library, material_named

GOOD = Form(settles_mm=1.0, mean_mm=0.5, where="top", bound_mm=3.0, sags_mm=0.1, loose=0,
            settled=True)  # fmt: skip


def let_go(shape, size_mm, pin, **options):
    woven, _, supplies = laid(shape, size_mm=size_mm, **options)
    threads = woven.weave.threads
    own = [elastic(supplies.only, grain=False)] * threads.n_threads
    pins = np.full(threads.n_crossings, pin)
    thickness = supplies.thickness_mm(woven.bunches)
    return settle(woven.mesh, woven.ribbons, woven.weave, thickness, own, pins).form


@pytest.fixture(scope="module")
def shade():
    """A lampshade of plain weave: open, and of quads that are a mechanism."""
    return {pin: let_go("shape:tube?m=16&n=8", 300.0, pin) for pin in (BARE, PINNED, RIVETED)}


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


def test_what_has_no_weight_sags_by_nothing(monkeypatch):
    monkeypatch.setattr("fabweave.form.woven_net.GRAVITY", 0.0)
    form = let_go("shape:torus?m=8&n=4", 200.0, PINNED)
    assert form.sags_mm == 0.0
    assert form.loose == 0


@given(st.integers(0, 99))
def test_the_best_rigid_motion_is_found(seed):
    random = np.random.default_rng(seed)
    places = 100.0 * random.normal(size=(9, 3))
    motion = exponential(random.normal(size=(1, 6)))
    moved = places @ motion.axes[0].T + motion.origin
    assert fitted(moved, places) == pytest.approx(places, abs=1e-9)
    mirrored = places * (1.0, 1.0, -1.0)
    assert np.linalg.norm(fitted(mirrored, places) - places) > 1.0


def test_every_material_of_the_library_is_known_well_enough():
    for material in material_library():
        along, across = material.young_mpa
        assert along >= across > 0
        assert material.young_source
        assert elastic(material, grain=True).young_mpa == along
        assert elastic(replace(material, laid_across=True), grain=True).young_mpa == across
        assert across <= elastic(material, grain=False).young_mpa <= along
    assert elastic(replace(material_named("card"), young_mpa=None), grain=True) is None


def test_what_is_not_known_is_not_said(monkeypatch):
    woven, _, supplies = laid("shape:octahedron", size_mm=200.0)
    threads = woven.weave.threads
    given_ = woven.mesh, woven.ribbons, woven.weave, supplies.thickness_mm(woven.bunches)
    pins = np.full(threads.n_crossings, PINNED)
    assert settle(*given_, [None] * threads.n_threads, pins) is None
    monkeypatch.setattr(module, "MOST_CROSSINGS", threads.n_crossings - 1)
    assert settle(*given_, [elastic(supplies.only, grain=True)] * threads.n_threads, pins) is None


def test_crossings_resist_as_they_are_fastened():
    fastened = np.array([False, True, True, False])
    assert pin_stiffness(fastened, [2]).tolist() == [BARE, PINNED, RIVETED, BARE]


@pytest.mark.parametrize(
    ("change", "keeps"),
    [({}, True), ({"settles_mm": 3.1}, False), ({"settled": False}, False), ({"loose": 2}, True)],
)
def test_a_form_is_kept_within_its_bound(change, keeps):
    assert replace(GOOD, **change).keeps == keeps


def test_a_form_is_what_becomes_of_crossings():
    ribbons = fw.weave(fw.shape("tube?m=8&n=4", size="200mm")).ribbons()
    form, wished, rested = ribbons.relax(pins=0.0)
    away = np.linalg.norm(rested - wished, axis=1)
    assert form.settles_mm == pytest.approx(away.max(), abs=0.006)
    assert form.mean_mm == pytest.approx(np.sqrt((away**2).mean()), abs=0.006)
    assert wished == pytest.approx(ribbons.woven.ribbons.centre)
    assert away.max() > np.linalg.norm(ribbons.relax(pins=1e5).rested - wished, axis=1).max()


def test_the_same_bytes_again():
    one, other = (let_go("shape:torus?m=12&n=6", 300.0, BARE) for _ in range(2))
    assert one == other
