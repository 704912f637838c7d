"""An arched roof spreads and falls when it is let go; tied to a base at its feet, it stands."""

import numpy as np
import pytest
from jobs import laid

from fabweave.core.errors import InputError
from fabweave.design.tried import try_design
from fabweave.form.body import BARE, PINNED, body_of
from fabweave.form.hold import Foresight
from fabweave.form.settle import let_go, settle
from fabweave.job.ask import brief_of
from fabweave.job.stations import Stations
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import settings_from_options
from fabweave.piece.joint.fastening import foot_crossings
from fabweave.ribbon.rules.remedy import Depth

SHADE = ("shape:tube?m=12&n=6", 300.0)
ROOF = {"effort": "quick", "size": "300mm", "up": "z"}


def roof(along: int = 10, across: int = 6) -> PolyMesh:
    """Return half of a tube that lies on the ground, of quads."""
    turn, y = np.linspace(0.0, np.pi, along + 1), np.linspace(0.0, 200.0, across + 1)
    arch = np.column_stack([150.0 * np.cos(turn), 100.0 * np.sin(turn)])
    points = np.array([[x, depth, z] for x, z in arch for depth in y])
    row = across + 1
    first = (row * np.arange(along)[:, None] + np.arange(across)).ravel()
    faces = np.stack([first, first + row, first + row + 1, first + 1], axis=1)
    return PolyMesh(points, 4 * np.arange(len(faces) + 1), faces.ravel())


def woven(mesh: PolyMesh, **options: str):
    job = Stations(settings_from_options("roof.obj", **ROOF, **options), mesh)
    return job.ribbons, job.brief


@pytest.fixture(scope="module")
def based():
    return body_of(*woven(roof(), base="on"))


def test_feet_are_the_lowest_crossings_beside_a_rim():
    laid_roof, _ = woven(roof(10, 12))
    feet = foot_crossings(laid_roof.weave.threads, laid_roof.halfedges, laid_roof.wished)
    # Along both sides that stand on the ground: the edges that go up from their inner vertices.
    assert feet.sum() == 2 * 11
    height = laid_roof.ribbons.centre[:, 2]
    assert height[feet].max() < height[~feet].min()


def test_what_has_no_rim_or_reaches_below_it_has_no_feet():
    for options, why in (({}, "has none"), ({"leave_out": "top:80mm"}, "below its rim")):
        ball, *_ = laid("shape:sphere?n=3", size_mm=200.0, **options)
        with pytest.raises(InputError, match=why):
            foot_crossings(ball.weave.threads, ball.halfedges, ball.wished)
    with pytest.raises(InputError, match="hang"):
        settings_from_options("roof.obj", base="on", hang="top", **ROOF)


def test_feet_stay_and_all_else_goes_less_far(based):
    free = body_of(*woven(roof()))
    pins = np.full(len(based.places), PINNED)
    loose, tied = settle(free, pins), settle(based, pins)
    assert loose.form.collapse
    assert tied.form.stands
    assert not tied.form.collapse
    assert tied.form.off_mm < 0.3 * loose.form.off_mm
    for state in tied.states.values():
        off = np.linalg.norm(state.state.bodies.origin - based.target, axis=1)
        assert off[based.hung].max() < 0.1
        # Nothing is turned to fit: what is told is how far it is off on its board.
        assert off.max() <= max(tied.form.settles_mm + tied.form.sags_mm, tied.form.off_mm) + 0.01
    np.testing.assert_array_equal(tied.held, based.hung)


def test_a_first_step_foretells_the_last_on_a_base():
    shade, settings, supplies = laid(SHADE[0], size_mm=SHADE[1], base="on")
    some = body_of(shade, brief_of(settings, supplies))
    for pin in (BARE, PINNED):
        pins = np.full(len(some.places), pin)
        foretold, rests = Foresight(some)(pins, 3.0), let_go(some, pins)
        assert foretold.settles_mm == pytest.approx(rests.away_mm.max(), rel=0.2, abs=0.05)
        assert foretold.sags_mm == pytest.approx(rests.sags_mm, rel=0.5, abs=0.03)


@pytest.mark.parametrize(("asked", "found"), [(None, "on"), ("off", "off")])
def test_a_roof_that_falls_is_tried_on_a_base_unless_that_is_ruled_out(asked, found):
    design = settings_from_options("roof.obj", **ROOF, base=asked)
    tried = try_design(design, "roof", roof(), opens=True)
    assert tried.design.pieces.base == found
    assert tried.makeable == (found == "on")
    assert tried.soft == (found == "off")
    if found == "on":
        assert tried.figures.form_mm < 0.1 * 300.0
        assert "on a base" in tried.brief
        # Where nothing is left to fabweave, nothing is added.
        assert try_design(design, "roof", roof()).soft


def vault(bow: float) -> PolyMesh:
    """Return a roof that is lower at its ends: the more so, the better it stands by itself."""
    x, y, z = roof().vertices.T
    return roof().with_vertices(np.column_stack([x, y, z * (1.0 - bow * (y / 100.0 - 1.0) ** 2)]))


@pytest.mark.parametrize(("bow", "base"), [(0.3, "on"), (0.5, None)])
def test_a_roof_that_stands_is_based_only_where_it_goes_far_without(bow, base):
    free, tied, found = (
        try_design(settings_from_options("a.obj", **ROOF, base=one), "", vault(bow), opens=True)
        for one in ("off", "on", None)
    )
    assert free.makeable
    assert tied.figures.form_mm < free.figures.form_mm
    gain = free.figures.points_lost - tied.figures.points_lost
    assert (gain >= 1.0) == (base == "on")
    assert found.design.pieces.base == base
    assert found.figures == (tied if base else free).figures


def test_what_goes_far_is_foretold_to_be_left_off_by_about_what_is_left():
    """A first step alone foretells a quarter of that: the rest goes with its square."""
    settings = settings_from_options("a.obj", **ROOF, base="off")
    foretold = Stations(settings, vault(0.4), depth=Depth.NEAR).foretold
    left = Stations(settings, vault(0.4)).joined.woven.aim.left_mm.max()
    assert foretold.settles_mm > 0.03 * 300.0
    assert 0.5 * left < foretold.left_mm < 2.0 * left
