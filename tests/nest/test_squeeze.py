"""An engine's proposals are proved before they are taken, whatever it proposes."""

import numpy as np
import pytest

from fabweave.nest.area import area_of
from fabweave.nest.engine import squeeze
from fabweave.nest.item_shape import shape_of
from fabweave.nest.place.coarse_search import Finder
from fabweave.nest.separate.arrangement import NOWHERE, Arrangement
from fabweave.nest.separate.clearance_proof import missing_mm
from fabweave.nest.separate.emptying import Ground
from fabweave.nest.separate.item_field import body_of
from fabweave.nest.separate.obstacle import barrier_of
from fabweave.stock.rotations import FREE
from fabweave.stock.sheet_size import SheetSize

GAP = 2.0
ASK = {"tries": 3, "seconds": 1, "seed": 4}


def bar(length, width):
    return np.array([[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])


@pytest.fixture
def ground():
    """Return two sheets of 100 × 46.5 mm, and five bars of 90 × 10 mm."""
    area = area_of(SheetSize(100.0, 46.5), 0.0, GAP, FREE)
    bodies = [body_of(shape_of(bar(90.0, 10.0))[0], GAP)] * 5
    return Ground(bodies, [area] * 2, [barrier_of(area, GAP)] * 2, GAP, Finder())


def shelves(count):
    return np.array([[45.0, 5.0 + 12.0 * number, 0.0] for number in range(count)])


@pytest.fixture
def start():
    """Return three bars on the second sheet, far apart, and two that stand nowhere."""
    where = np.array([1, 1, 1, NOWHERE, NOWHERE])
    poses = np.zeros((5, 3))
    poses[:3] = [[55.0, 5.0, 0.0], [50.0, 23.0, 0.0], [45.0, 41.0, 0.0]]
    return Arrangement(where, poses)


def answers(monkeypatch, poses_of):
    """Put something in the engine's place; return what it was asked."""
    asked = []

    def packed(bodies, size_mm, gap_mm, *, seconds, seed, turns):
        asked.append((len(bodies), size_mm, gap_mm, seconds, seed, turns))
        return poses_of(len(bodies))

    monkeypatch.setattr(squeeze, "packed", packed)
    return asked


def keeps_every_rule(ground, state):
    for sheet in (0, 1):
        pieces = state.on(sheet)
        if pieces:
            bodies = [ground.bodies[piece] for piece in pieces]
            size = ground.areas[sheet].size_mm
            assert missing_mm(bodies, state.poses[pieces], size, GAP) <= 1e-9


def test_a_piece_that_an_engine_finds_room_for_is_placed_and_no_more_are(
    monkeypatch, ground, start
):
    asked = answers(monkeypatch, shelves)
    found = squeeze.squeezed(ground, start, 0, **ASK)
    # Four bars are 46 mm high; with the fifth there is no way.
    assert found.where.tolist() == [1, 1, 1, 1, NOWHERE]
    assert [one[0] for one in asked] == [4, 5]
    keeps_every_rule(ground, found)
    assert start.where.tolist() == [1, 1, 1, NOWHERE, NOWHERE]


def test_sheets_are_compressed_and_keep_their_pieces(monkeypatch, ground, start):
    asked = answers(monkeypatch, shelves)
    found = squeeze.compressed(ground, start, 0, **ASK)
    np.testing.assert_array_equal(found.where, start.where)
    assert asked == [(3, (100.0, 46.5), GAP, 1, 4, FREE)]
    np.testing.assert_allclose(found.poses[:3], shelves(3), atol=0.2)
    keeps_every_rule(ground, found)


@pytest.mark.parametrize(
    "poses_of",
    [
        lambda _count: None,
        lambda count: np.zeros((count, 3)),  # all at one corner
        lambda count: shelves(count) + np.array([500.0, 0.0, 0.0]),  # off the sheet
    ],
)
def test_bad_proposals_change_nothing_or_are_mended(monkeypatch, ground, start, poses_of):
    answers(monkeypatch, poses_of)
    for how in (squeeze.squeezed, squeeze.compressed):
        keeps_every_rule(ground, how(ground, start, 0, **ASK))


def test_no_more_is_asked_than_may_be(monkeypatch, ground, start):
    asked = answers(monkeypatch, lambda _count: None)
    squeeze.squeezed(ground, start, 0, tries=1, seconds=1, seed=0)
    assert len(asked) == 1
    squeeze.compressed(ground, start, 0, tries=0, seconds=1, seed=0)
    assert len(asked) == 1
