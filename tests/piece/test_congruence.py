"""Pieces that are the same are of one kind, and no others are."""

from dataclasses import replace

import numpy as np
import pytest
from jobs import make_job

from fabweave.options.settings import Settings
from fabweave.piece.congruence import (
    SAME_MM,
    alike_crossings,
    apart_mm,
    compare_pieces,
    equal_pieces,
)
from fabweave.piece.outline import RigidMotion

pytestmark = pytest.mark.usefixtures("quick_jobs")


def moved(piece, angle=0.7, shift=(30.0, -4.0), mirrored=False):
    """Return a piece moved as a whole."""
    frame = RigidMotion(angle, np.array(shift))
    flip = np.array([-1.0, 1.0]) if mirrored else np.ones(2)
    return replace(
        piece,
        outline=frame.apply(piece.outline * flip),
        points=frame.apply(piece.points * flip),
        rails=frame.apply((piece.rails * flip).reshape(-1, 2)).reshape(-1, 2, 2),
    )


def turned_round(piece):
    """Return a piece walked from its other end."""
    return replace(
        piece,
        points=piece.points[::-1].copy(),
        rails=piece.rails[::-1, ::-1].copy(),
        over=piece.over[::-1].copy(),
        hole_mm=piece.hole_mm[::-1].copy(),
        directions=-piece.directions[::-1],
    )


def superpose(piece, other):
    """Say whether two pieces are of one kind."""
    return min(apart_mm(piece, other, backwards=way) for way in (False, True)) <= SAME_MM


@pytest.fixture(scope="module")
def pieces():
    job = make_job(Settings.of("shape:torus?m=8&n=6", size_mm=400.0, effort="quick", fasten="all"))
    return job.piece_set.pieces


def test_moved_and_turned_pieces_are_of_one_kind(pieces):
    for piece in pieces[:4]:
        same = [piece, moved(piece), turned_round(piece), moved(turned_round(piece), 3.0)]
        assert compare_pieces(same).number.tolist() == [1, 1, 1, 1]


def test_mirrored_pieces_are_of_another_kind(pieces):
    # A wavy piece is not its own mirror image.
    piece = max(pieces, key=lambda one: np.ptp(one.outline[:, 1]))
    assert compare_pieces([piece, moved(piece, mirrored=True)]).number.tolist() == [1, 2]


def test_another_hole_or_side_makes_another_kind(pieces):
    piece = pieces[0]
    hole = piece.hole_mm.copy()
    hole[1] += 0.5
    assert not superpose(replace(piece, hole_mm=hole), piece)
    assert not superpose(replace(piece, over=~piece.over), piece)
    outline = piece.outline.copy()
    outline[0] += 3 * SAME_MM
    assert not superpose(replace(piece, outline=outline), piece)


def test_kinds_are_those_that_comparing_every_pair_finds(pieces):
    kinds = compare_pieces(pieces).number
    firsts = [pieces[int(np.flatnonzero(kinds == kind)[0])] for kind in range(1, kinds.max() + 1)]
    for piece, kind in zip(pieces, kinds, strict=True):
        assert [superpose(piece, one) for one in firsts[:kind]] == [False] * (kind - 1) + [True]
    # The torus has so many symmetries that its pieces repeat.
    assert kinds.max() < len(pieces)


def test_pieces_of_a_kind_are_equal_to_the_last_digit():
    settings = Settings.of(
        "shape:octahedron", size_mm=200.0, refine="catmull-clark:1", effort="quick"
    )
    pieces = make_job(settings).piece_set.pieces
    kinds = compare_pieces(pieces)
    assert kinds.off_mm.max() < 2e-6  # as the pieces were built: files have six decimals
    assert kinds.turned.any()
    first = kinds.first[kinds.number - 1]
    for piece, leader, turned in zip(
        pieces, [pieces[at] for at in first], kinds.turned, strict=True
    ):
        corner = leader.outline.max(axis=0) + leader.outline.min(axis=0)
        for ours, theirs in (
            (piece.path.points, leader.path.points),
            (piece.outline, leader.outline),
            (piece.points[:: -1 if turned else 1], leader.points),
        ):
            # Turned about: the very numbers again, but for what binary fractions are.
            assert np.array_equal(ours, np.round(corner - theirs, 6) if turned else theirs)
        assert np.array_equal(piece.path.bulges, leader.path.bulges)
        # The thread runs from the left end to the right one, and its edges stay right and left.
        along = np.diff(piece.points, axis=0)
        assert np.all(np.einsum("ij,ij->i", along, piece.directions[:-1]) > 0)
        across = piece.rails[:, 1] - piece.rails[:, 0]
        assert np.all(piece.directions[:, 0] * across[:, 1] > piece.directions[:, 1] * across[:, 0])


def test_only_what_is_near_is_made_equal_and_stays_where_it_was(pieces):
    leader = pieces[0]
    noise = np.random.default_rng(3).uniform(-0.01, 0.01, leader.outline.shape)
    uneven = replace(moved(leader), outline=moved(leader).outline + noise)
    kinds = compare_pieces([leader, uneven, turned_round(uneven)], same_mm=0.04)
    assert kinds.number.tolist() == [1, 1, 1]
    assert 0.005 < kinds.off_mm[1] < 0.015
    for most, same in ((0.04, True), (0.001, False)):
        made = equal_pieces([leader, uneven, turned_round(uneven)], kinds, most)
        assert np.array_equal(made[1].outline, made[0].outline) is same
        # Whatever it is made equal to, it is laid on where it was.
        for piece, before in zip(made, (leader, uneven, turned_round(uneven)), strict=True):
            assert apart_mm(piece, before, backwards=False) <= 0.015


def test_crossings_are_alike_where_pieces_of_a_kind_lie_on_one_another(pieces):
    piece = max(pieces, key=lambda one: np.ptp(one.outline[:, 1]))
    count = len(piece.crossings)
    copies = [piece, moved(piece), turned_round(piece), moved(piece, mirrored=True)]
    several = [
        replace(copy, crossings=np.arange(at * count, (at + 1) * count))
        for at, copy in enumerate(copies)
    ]
    kinds = compare_pieces(several)
    assert kinds.number.tolist() == [1, 1, 1, 2]
    wanted = np.zeros(4 * count, dtype=bool)
    wanted[1] = True
    places = {1, count + 1, 3 * count - 2}
    if apart_mm(piece, piece, backwards=True) <= SAME_MM:
        places |= {count - 2, 2 * count - 2, 2 * count + 1}
    numbers = alike_crossings(several, kinds, len(wanted))
    assert set(np.flatnonzero(np.isin(numbers, numbers[wanted])).tolist()) == places
