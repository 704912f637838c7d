"""Fasteners that keep a form: few, no more than are needed, and foretold as it comes."""

from dataclasses import replace

import numpy as np
import pytest
from jobs import laid

from fabweave.form.body import BARE, PINNED, RIVETED, body_of
from fabweave.form.hold import Foresight, FormHold
from fabweave.form.settle import let_go
from fabweave.job.ask import brief_of

NO_RIVETS = np.zeros(0, dtype=np.int64)
SHADE = ("shape:tube?m=12&n=6", 300.0)


def body(shape, size_mm, **options):
    woven, settings, supplies = laid(shape, size_mm=size_mm, **options)
    return body_of(woven, brief_of(settings, supplies))


@pytest.fixture(scope="module")
def shade():
    """A lampshade of plain weave: open, and of quads that are a mechanism."""
    return body(*SHADE, boundary="end")


def none_of(some):
    return np.zeros(len(some.places), dtype=bool)


def chosen(some, bound_mm, **changes):
    asked = {"alike": np.arange(len(some.places)), "roomy": ~none_of(some), **changes}
    return FormHold(some, NO_RIVETS, bound_mm)(none_of(some), **asked)


@pytest.mark.parametrize("pin", [PINNED, RIVETED])
@pytest.mark.parametrize("shape", ["tube?m=16&n=8", "torus?m=16&n=8", "sphere?n=3"])
def test_a_first_step_foretells_the_last(shape, pin):
    some = body(f"shape:{shape}", 300.0)
    pins = np.full(len(some.places), pin)
    foretold, rests = Foresight(some)(pins, 3.0), let_go(some, pins)
    assert foretold.settles_mm == pytest.approx(rests.away_mm.max(), rel=0.15, abs=0.03)
    assert foretold.sags_mm == pytest.approx(rests.sags_mm, rel=0.5, abs=0.03)


def test_gains_are_how_distances_fall(shade):
    """Against differences of the mean of powers of which they are gains."""
    foresee, pins = Foresight(shade), np.full(len(shade.places), PINNED)
    random = np.random.default_rng(3)

    def whole(pins):
        return foresee(pins, 3.0).whole

    gains = foresee(pins, 3.0).gains
    for _ in range(3):
        some = random.normal(size=len(pins))
        step = 1e-4 * some
        slope = (whole(pins + step) - whole(pins - step)) / 2e-4
        assert -(gains @ some) == pytest.approx(slope, rel=1e-3)


@pytest.mark.slow
def test_few_fasteners_keep_a_shade_and_none_of_them_is_idle(shade):
    bound_mm = 0.01 * shade.size_mm
    found = chosen(shade, bound_mm)
    assert 0 < found.sum() < 0.25 * len(found)
    kept = let_go(shade, shade.pins(found, NO_RIVETS)).most_mm
    assert kept <= bound_mm
    # A third of them, those at the start, does not do.
    fewer = found.copy()
    fewer[np.flatnonzero(found)[: 2 * found.sum() // 3]] = False
    assert let_go(shade, shade.pins(fewer, NO_RIVETS)).most_mm > bound_mm
    # As many anywhere do no better.
    random = np.random.default_rng(1)
    others = none_of(shade)
    others[random.choice(len(others), found.sum(), replace=False)] = True
    assert let_go(shade, shade.pins(others, NO_RIVETS)).most_mm > kept


def test_what_holds_itself_gets_none():
    ball = body("shape:icosahedron", 300.0, pattern="kagome", refine="loop:1")
    assert not chosen(ball, 0.01 * ball.size_mm).any()


@pytest.mark.slow
def test_a_tighter_bound_takes_no_fewer_and_each_one_is_kept(shade):
    counts = []
    for bound_mm in (5.0, 2.5, 1.5):
        found = chosen(shade, bound_mm)
        assert let_go(shade, shade.pins(found, NO_RIVETS)).most_mm <= bound_mm
        counts.append(int(found.sum()))
    assert counts == sorted(counts)


def test_alike_crossings_are_fastened_together_and_only_where_there_is_room(shade):
    height = shade.places[:, 2].round(3)
    alike = np.unique(height, return_inverse=True)[1]
    roomy = height > np.median(height)
    found = chosen(shade, 4.0, alike=alike, roomy=roomy)
    assert found.any()
    assert not found[~roomy].any()
    for group in range(alike.max() + 1):
        some = found[alike == group]
        assert some.all() or not some.any()


def test_what_is_fastened_stays_so_and_counts(shade):
    held = none_of(shade)
    held[::3] = True
    found = FormHold(shade, NO_RIVETS, 3.0)(held, np.arange(len(held)), ~none_of(shade))
    assert np.array_equal(found, held)


@pytest.mark.slow
def test_where_all_of_them_do_not_reach_the_bound_few_do_most_of_it(shade):
    found = chosen(shade, 0.1)
    most, least = (let_go(shade, np.full(len(shade.places), pin)).most_mm for pin in (BARE, PINNED))
    reached = let_go(shade, shade.pins(found, NO_RIVETS)).most_mm
    assert found.sum() < 0.5 * len(found)
    assert most - reached > 0.6 * (most - least)


@pytest.mark.slow
def test_what_fasteners_cannot_hold_gets_none():
    """A glued ball sags no less: its weight bends strips, and turns no crossing."""
    ball = body("shape:sphere?n=3", 300.0)
    heavy = replace(ball, net=replace(ball.net, weight=40.0 * ball.net.weight))
    all_of_them = let_go(heavy, np.full(len(ball.places), PINNED)).most_mm
    assert all_of_them > 3.0
    assert chosen(heavy, 0.95 * all_of_them).sum() < 0.2 * len(ball.places)
