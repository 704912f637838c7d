"""Make pieces that are the same equal to the last digit, so that one file serves them all."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arc_path import Path
from fabweave.core.arrays import FloatArray, IntArray
from fabweave.flat.congruence import Kinds, motion_onto, moved_by
from fabweave.flat.piece import Piece, Slot

#: The least play of a fastener in its hole is 0.1 mm: a screw with a hole of the fine series
#: (ISO 273). Two pieces that meet there may each be off by this, with something to spare.
FIT_MM = 0.04
#: The files have so many decimals; what is equal before is equal there, turned about or not.
_DECIMALS = 6


def equal_pieces(pieces: Sequence[Piece], kinds: Kinds, most_mm: float) -> tuple[Piece, ...]:
    """Give all pieces of a kind the shape of the first one.

    Outline, stations, edges, holes and slots are the same numbers in all of them, or, in those
    that are turned, these numbers turned by half about the middle of the piece. A thread still
    begins at the left end of each.

    Parameters
    ----------
    pieces : sequence of Piece
    kinds : Kinds
        Of these pieces.
    most_mm : float
        Pieces that are farther from the first of their kind stay as they are.

    Returns
    -------
    tuple of Piece
    """
    several = np.bincount(kinds.number)[kinds.number] > 1
    fit = several & (kinds.off_mm <= most_mm)
    first = kinds.first.tolist()
    leaders = {int(kinds.number[at]): _rounded(pieces[at]) for at in first if several[at]}
    result = []
    for at, piece in enumerate(pieces):
        if not fit[at]:
            result.append(piece)
            continue
        leader = leaders[int(kinds.number[at])]
        if at == first[int(kinds.number[at]) - 1]:
            result.append(leader)
            continue
        turned = bool(kinds.turned[at])
        turn, shift = motion_onto(piece, leader, backwards=turned)
        if turned:
            leader = _turned(leader)
            corner = leader.outline.max(axis=0) + leader.outline.min(axis=0)
            turn, shift = -turn, complex(*corner) - shift
        result.append(_like(piece, leader, turn, shift))
    return tuple(result)


def _rounded(piece: Piece) -> Piece:
    """Return a piece whose places have no more decimals than files do."""

    def short(points: FloatArray) -> FloatArray:
        return np.round(points, _DECIMALS)

    holes = piece.more_holes.copy()
    holes[:, 1:3] = short(holes[:, 1:3])
    return replace(
        piece,
        path=Path(short(piece.path.points), piece.path.bulges),
        outline=short(piece.outline),
        points=short(piece.points),
        rails=short(piece.rails),
        more_holes=holes,
        slots=tuple(
            Slot(slot.station, Path(short(slot.path.points), slot.path.bulges))
            for slot in piece.slots
        ),
    )


def _turned(piece: Piece) -> Piece:
    """Return a piece turned by half about its middle, and walked from the other end."""
    corner = piece.outline.max(axis=0) + piece.outline.min(axis=0)

    def half(points: FloatArray) -> FloatArray:
        # Both terms have few decimals: rounding leaves what the difference really is.
        return np.round(corner - points, _DECIMALS)

    last = len(piece.points) - 1
    holes = piece.more_holes.copy()
    holes[:, 0], holes[:, 1:3] = last - holes[:, 0], half(holes[:, 1:3])
    return replace(
        piece,
        path=Path(half(piece.path.points), piece.path.bulges),
        outline=half(piece.outline),
        points=half(piece.points)[::-1],
        directions=piece.directions[::-1],  # turned by half, and walked back
        rails=half(piece.rails)[::-1, ::-1],
        more_holes=holes,
        slots=tuple(
            Slot(last - slot.station, Path(half(slot.path.points), slot.path.bulges))
            for slot in piece.slots
        ),
    )


def _like(piece: Piece, leader: Piece, turn: complex, shift: complex) -> Piece:
    """Return a piece with the shape of another; a motion takes it there.

    Its holes and slots keep their order, by which those of joined pieces are paired.
    """
    holes = piece.more_holes.copy()
    if len(holes):
        nearest = _nearest(moved_by(holes[:, 1:3], turn, shift), leader.more_holes[:, 1:3])
        holes[:, 1:3] = leader.more_holes[nearest, 1:3]
    slots = piece.slots
    if slots:
        ours, theirs = (
            np.array([slot.path.points.mean(axis=0) for slot in one.slots])
            for one in (piece, leader)
        )
        nearest = _nearest(moved_by(ours, turn, shift), theirs)
        slots = tuple(
            Slot(slot.station, leader.slots[at].path)
            for slot, at in zip(slots, nearest.tolist(), strict=True)
        )
    return replace(
        piece,
        path=leader.path,
        outline=leader.outline,
        points=leader.points,
        directions=leader.directions,
        rails=leader.rails,
        more_holes=holes,
        slots=slots,
        guides=tuple(moved_by(guide, turn, shift) for guide in piece.guides),
        covers=tuple(moved_by(part, turn, shift) for part in piece.covers),
    )


def _nearest(points: FloatArray, others: FloatArray) -> IntArray:
    """Return the nearest of some places to each of others."""
    return np.argmin(np.hypot(*(points[:, None] - others[None]).transpose(2, 0, 1)), axis=1)
