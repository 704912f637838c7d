"""Recognise pieces that are the same, so that they are cut and named as several of one kind."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.flat.piece import Piece

#: Pieces of one kind differ by no more than this when they are superposed.
SAME_MM = 0.02


def piece_kinds(pieces: Sequence[Piece], stuff: Sequence[int] | None = None) -> IntArray:
    """Give each piece the number of its kind, from 1 in the order of their first piece.

    Two pieces are of one kind if a motion of the plane takes the outline, the stations with their
    holes and their over and under, all other holes and the slots of one to those of the other;
    the piece may be turned end for end, but never over. Then one can be put in place of the other
    wherever labels do not matter.

    Parameters
    ----------
    pieces : sequence of Piece
    stuff : sequence of int, optional
        What each is cut from: pieces of different stuff are of different kinds. By default all
        are of one.

    Returns
    -------
    (N,) int array
    """
    first_of: list[int] = []
    buckets: dict[tuple[int, ...], list[int]] = {}
    kinds = np.zeros(len(pieces), dtype=np.int64)
    for index, piece in enumerate(pieces):
        key = np.append(0 if stuff is None else stuff[index], _invariants(piece))
        for nearby in _cells(key):
            same = next(
                (n for n in buckets.get(nearby, ()) if superpose(piece, pieces[first_of[n]])), None
            )
            if same is not None:
                kinds[index] = same + 1
                break
        else:
            buckets.setdefault(tuple(np.floor(key).astype(int).tolist()), []).append(len(first_of))
            first_of.append(index)
            kinds[index] = len(first_of)
    return kinds


def _invariants(piece: Piece) -> npt.NDArray[np.float64]:
    """Return numbers that no motion changes; those of one kind differ by less than one."""
    points = piece.points
    span = float(np.hypot(*(points[-1] - points[0])))
    ring = shapely.LinearRing(piece.outline)
    reach = float(shapely.Point(points.mean(axis=0)).hausdorff_distance(ring))
    counts = (len(points), int(piece.over.sum()), len(piece.more_holes), len(piece.slots))
    return np.array([*counts, span / (4 * SAME_MM), reach / (4 * SAME_MM)])


def _cells(key: npt.NDArray[np.float64]) -> list[tuple[int, ...]]:
    """Return the cells in which something of the same kind may have been put."""
    counts = tuple(key[:-2].astype(int).tolist())
    low, high = np.floor(key[-2:] - 0.5).astype(int), np.floor(key[-2:] + 0.5).astype(int)
    return [
        (*counts, int(a), int(b))
        for a in dict.fromkeys((low[0], high[0]))
        for b in dict.fromkeys((low[1], high[1]))
    ]


def superpose(piece: Piece, other: Piece) -> bool:
    """Say whether a piece is of the same kind as another."""
    return any(_agrees(piece, other, backwards=way) for way in (False, True))


def turned_pieces(pieces: Sequence[Piece], kinds: IntArray) -> BoolArray:
    """Say which pieces must be turned end for end to cover the first one of their kind, (N,).

    Of those that cover it either way, none.

    Parameters
    ----------
    pieces : sequence of Piece
    kinds : (N,) int array
        The kind of each, from 1 in the order of their first piece.
    """
    _, first = np.unique(kinds, return_index=True)
    return np.array(
        [
            at != first[kind - 1] and not _agrees(piece, pieces[first[kind - 1]], backwards=False)
            for at, (piece, kind) in enumerate(zip(pieces, kinds.tolist(), strict=True))
        ],
        dtype=np.bool_,
    )


def motion_onto(piece: Piece, other: Piece, *, backwards: bool) -> tuple[complex, complex]:
    """Return the turn and the shift that take a piece nearest to another, as complex numbers.

    Station goes to station, or, if it is turned end for end, the first to the last.
    """
    z, w = (marks.ravel() for marks in _facing(piece, other, backwards=backwards))
    turn = np.vdot(z - z.mean(), w - w.mean())
    turn /= abs(turn) if turn else 1.0
    return complex(turn), complex(w.mean() - turn * z.mean())


def _agrees(piece: Piece, other: Piece, *, backwards: bool) -> bool:
    """Say whether a piece covers another, station by station from one end or from the other."""
    way = slice(None, None, -1 if backwards else 1)
    if not np.array_equal(piece.over[way], other.over):
        return False
    if not np.array_equal(np.round(piece.hole_mm[way], 3), np.round(other.hole_mm, 3), True):
        return False
    # The stations and their rails decide the motion.
    turn, shift = motion_onto(piece, other, backwards=backwards)
    source, target = _facing(piece, other, backwards=backwards)
    if np.abs(turn * source + shift - target).max() > SAME_MM:
        return False

    def moved(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        placed = turn * (points[:, 0] + 1j * points[:, 1]) + shift
        return np.column_stack((placed.real, placed.imag))

    if not _same_holes(moved(piece.more_holes[:, 1:3]), piece, other):
        return False
    if _apart(moved(piece.outline), other.outline) > SAME_MM:
        return False
    ours, theirs = ([slot.path.flattened(SAME_MM / 2) for slot in p.slots] for p in (piece, other))
    return all(min(_apart(moved(slot), twin) for twin in theirs) <= SAME_MM for slot in ours)


def _facing(
    piece: Piece, other: Piece, *, backwards: bool
) -> tuple[npt.NDArray[np.complex128], npt.NDArray[np.complex128]]:
    """Return the marks of two pieces in the order in which they are to meet, (S, 3) each."""
    source = _marks(piece)
    if backwards:
        source = source[::-1, [0, 2, 1]]  # what was right along the thread is left against it
    return source, _marks(other)


def _marks(piece: Piece) -> npt.NDArray[np.complex128]:
    """Return each station with the points of both rails abreast of it, (S, 3)."""
    marks = np.concatenate((piece.points[:, None], piece.rails), axis=1)
    return np.asarray(marks[..., 0] + 1j * marks[..., 1])


def _same_holes(places: npt.NDArray[np.float64], piece: Piece, other: Piece) -> bool:
    """Say whether holes away from the stations coincide, in size as well."""
    if not len(places):
        return True
    off = np.hypot(*(places[:, None] - other.more_holes[None, :, 1:3]).transpose(2, 0, 1))
    wide = np.abs(piece.more_holes[:, None, 3] - other.more_holes[None, :, 3])
    return bool(np.all(((off <= SAME_MM) & (wide <= 1e-3)).any(axis=1)))


def _apart(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> float:
    """Return the greatest distance of a point of one outline to the other, both ways."""
    return float(shapely.LinearRing(one).hausdorff_distance(shapely.LinearRing(other)))
