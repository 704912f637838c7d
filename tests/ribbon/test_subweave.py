"""A part of the ribbons is laid and measured as the whole is, and so is what changed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.app.request import complete_settings
from fabweave.app.settings import Settings
from fabweave.app.woven_object import lay_ribbons, weave_object
from fabweave.ribbon.facets import cut_facets
from fabweave.ribbon.project import following_rung
from fabweave.ribbon.rules.clearance import folded_pairs, near_pairs, run_straight
from fabweave.ribbon.rules.clearance_update import measure_changed, measure_pairs
from fabweave.ribbon.rules.rules import measure_clearance
from fabweave.ribbon.stretches import cut_stretches, ends_of_stretches, neighbours, passes_along
from fabweave.ribbon.subweave import take_part
from fabweave.stock.ribbon_limits import ribbon_limits

#: Closed and open threads, turns, long and short rings, several components.
MODELS = (
    ("torus?m=6&n=4", {}),
    ("tetrahedron", {"smooth": 0, "course": "projection"}),
    ("hypar?m=3&n=4", {"boundary": "end"}),
    ("hypar?m=3&n=4", {"boundary": "turn"}),
    ("cube", {"smooth": 5}),
)


def woven(shape: str, options: dict, clearance_mm: float = 12.0):
    """Weave a shape with more air wanted than there is, so that very much is too near."""
    settings, supplies = complete_settings(
        Settings(mesh=f"shape:{shape}", size_mm=200.0, **options)
    )
    woven_object = weave_object(settings, supplies)
    thickness = supplies.thickness_mm(woven_object.bunches)

    def lay(factor=None, part=None):
        return lay_ribbons(
            woven_object.source, woven_object.weave, settings, thickness, None, factor, part
        )

    return woven_object.weave, lay, ribbon_limits(supplies.only, clearance_mm)


WOVEN = [woven(shape, options) for shape, options in MODELS]


@given(st.integers(0, len(MODELS) - 1), st.integers(0, 10**6), st.integers(1, 9))
def test_a_part_is_laid_as_the_whole(which, seed, count) -> None:
    weave, lay, _ = WOVEN[which]
    rng = np.random.default_rng(seed)
    n_passes = len(weave.threads.crossing)
    factor = rng.uniform(0.5, 1.0, n_passes)
    asked = rng.integers(0, n_passes, count)
    beyond = tuple(rng.integers(0, 3, 2).tolist())
    part = take_part(weave, asked, beyond=beyond)
    following = following_rung(weave.threads.offsets, weave.threads.closed)
    # What was asked for, what comes before that and then what follows, and nothing else.
    taken = set(asked.tolist())
    for _ in range(beyond[0]):
        taken |= set(np.flatnonzero(np.isin(following, list(taken))).tolist())
    for _ in range(beyond[1]):
        taken |= set(following[list(taken)].tolist()) - {-1}
    assert sorted(part.passes.tolist()) == sorted(taken)
    assert np.array_equal(part.pass_numbers(part.passes), np.arange(len(part.passes)))
    whole, own = lay(factor), lay(factor, part)
    threads = part.weave.threads
    assert np.array_equal(
        weave.threads.thread_of_pass[part.passes], part.thread[threads.thread_of_pass]
    )
    ahead = following_rung(threads.offsets, threads.closed)
    there = np.flatnonzero(ahead >= 0)
    assert np.array_equal(following[part.passes[there]], part.passes[ahead[there]])
    # Passes that follow each other stand in one thread: there is no cut between them.
    cut = np.flatnonzero(ahead < 0)
    assert not np.isin(following[part.passes[cut]], part.passes).any()
    all_rungs = following_rung(whole.offsets, whole.closed)
    own_rungs = following_rung(own.offsets, own.closed)
    for number, at in enumerate(part.passes.tolist()):
        here, mine = int(whole.entry[at]), int(own.entry[number])
        end = int(own.entry[ahead[number]]) + 1 if ahead[number] >= 0 else mine + 1
        while True:
            for name in ("right", "left"):
                assert np.array_equal(getattr(whole, name)[here], getattr(own, name)[mine])
            if mine == end:
                break
            assert whole.from_right[here] == own.from_right[mine]
            here, mine = int(all_rungs[here]), int(own_rungs[mine])


@given(st.integers(0, len(MODELS) - 1), st.integers(0, 10**6))
def test_pairs_measure_in_a_part_as_in_the_whole(which, seed) -> None:
    weave, lay, limits = WOVEN[which]
    rng = np.random.default_rng(seed)
    _, near = measure_clearance(lay(), weave, limits)
    assert len(near.pairs)
    rows = np.unique(rng.integers(0, len(near.pairs), 5))
    passes = ends_of_stretches(weave.threads.offsets, weave.threads.closed, near.pairs[rows])
    part = take_part(weave, passes.ravel())
    margin, found = measure_pairs(lay(None, part), part, limits, near.pairs[rows])
    assert np.array_equal(found.pairs, near.pairs[rows])
    assert found.distance_mm == pytest.approx(near.distance_mm[rows], abs=1e-12)
    assert margin <= (found.distance_mm / limits.thickness_mm).min() + 1e-8
    numbers = np.unique(found.pairs)
    assert np.array_equal(part.whole_stretches(part.stretch_numbers(numbers)), numbers)


@given(st.integers(0, len(MODELS) - 1), st.integers(0, 10**6), st.integers(1, 4))
def test_measuring_what_changed_finds_what_measuring_all_finds(which, seed, count) -> None:
    weave, lay, limits = WOVEN[which]
    rng = np.random.default_rng(seed)
    factor = np.ones(len(weave.threads.crossing))
    _, before = measure_clearance(lay(factor), weave, limits)
    passes = np.unique(rng.integers(0, len(factor), count))
    factor[passes] = 0.4
    ribbons = lay(factor)
    expected, near = measure_clearance(ribbons, weave, limits)
    measured, found = measure_changed(ribbons, weave, limits, before, passes)
    assert np.array_equal(found.pairs, near.pairs)
    assert np.array_equal(found.distance_mm, near.distance_mm)
    assert np.array_equal(measured.passes, expected.passes)


def test_what_is_not_said_to_have_changed_is_not_measured() -> None:
    weave, lay, limits = WOVEN[1]
    factor = np.ones(len(weave.threads.crossing))
    _, before = measure_clearance(lay(factor), weave, limits)
    factor[:6] = 0.4
    ribbons = lay(factor)
    _, near = measure_clearance(ribbons, weave, limits)
    _, part = measure_changed(ribbons, weave, limits, before, np.arange(1))
    assert not np.array_equal(near.pairs, before.pairs)
    assert not np.array_equal(part.pairs, near.pairs)


@pytest.mark.parametrize("shift", [0.0, 4.0, 12.0])
@pytest.mark.parametrize("which", range(len(MODELS)))
def test_what_runs_straight_does_not_run_through_itself(which, shift) -> None:
    weave, lay, _ = WOVEN[which]
    ribbons = lay()
    # Cross-lines are moved to and fro: the ribbon folds over where they overtake each other.
    rng = np.random.default_rng(which)
    moved = rng.normal(0.0, 1.0, (2, *ribbons.right.shape)) * shift
    ribbons = type(ribbons)(
        **{
            name: getattr(ribbons, name)
            for name in ribbons.__dataclass_fields__
            if name not in ("right", "left")
        },
        right=ribbons.right + moved[0],
        left=ribbons.left + moved[1],
    )
    stretches = cut_stretches(ribbons)
    facets = cut_facets(ribbons, stretches.triangle[::2] // 2)
    pairs = neighbours(stretches)
    folded, _, _ = folded_pairs(stretches, facets, pairs)
    straight = run_straight(ribbons, stretches)
    along = passes_along(stretches, folded)
    assert not straight[along[along >= 0]].any()
    assert len(folded) or shift < 12.0
    # And leaves nothing out: what is folded is found, whatever was sorted out before.
    near = near_pairs(ribbons, weave.threads.crossing, 0.0)
    found = set(map(tuple, near.pairs.tolist()))
    assert set(map(tuple, folded.tolist())) <= found


def test_of_fine_ribbons_most_are_seen_to_run_straight() -> None:
    _, lay, _ = woven("sphere?n=6", {})
    ribbons = lay()
    assert run_straight(ribbons, cut_stretches(ribbons)).mean() > 0.95
