"""Pieces that are the same are of one kind, and no others are."""

from dataclasses import replace

import numpy as np
import pytest

from fabweave.app.pipeline import make_job
from fabweave.app.settings import Settings
from fabweave.flat.congruence import SAME_MM, piece_kinds, superpose
from fabweave.flat.outline import Frame


def moved(piece, angle=0.7, shift=(30.0, -4.0), mirrored=False):
    """Return a piece moved as a whole."""
    frame = Frame(angle, np.array(shift))
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


@pytest.fixture(scope="module")
def pieces():
    job = make_job(Settings("shape:torus?m=8&n=6", size_mm=400.0, effort="quick", fasten="all"))
    return job.piece_set.pieces


def test_moved_and_turned_pieces_are_of_one_kind(pieces):
    for piece in pieces[:4]:
        same = [piece, moved(piece), turned_round(piece), moved(turned_round(piece), 3.0)]
        assert piece_kinds(same).tolist() == [1, 1, 1, 1]


def test_mirrored_pieces_are_of_another_kind(pieces):
    # A wavy piece is not its own mirror image.
    piece = max(pieces, key=lambda one: np.ptp(one.outline[:, 1]))
    assert piece_kinds([piece, moved(piece, mirrored=True)]).tolist() == [1, 2]


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
    kinds = piece_kinds(pieces)
    firsts = [pieces[int(np.flatnonzero(kinds == kind)[0])] for kind in range(1, kinds.max() + 1)]
    for piece, kind in zip(pieces, kinds, strict=True):
        assert [superpose(piece, one) for one in firsts[:kind]] == [False] * (kind - 1) + [True]
    # The torus has so many symmetries that its pieces repeat.
    assert kinds.max() < len(pieces)
