"""Recognise pieces that are the same, so that they are cut and named as several of one kind."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.flat.piece import Piece
from fabweave.mesh.topology import label_links

#: Pieces of one kind differ by no more than this when they are superposed.
SAME_MM = 0.02
#: Pieces whose stations are farther apart are not looked at any closer.
_FAR_MM = 0.2


@frozen_value
class Kinds:
    """Which pieces are the same.

    Parameters
    ----------
    number : (N,) int array
        The kind of each, from 1 in the order of their first piece.
    turned : (N,) bool array
        Whether it must be turned end for end to cover the first piece of its kind. Of those that
        cover it either way, none.
    off_mm : (N,) float array
        How far it is from the first piece of its kind when it is laid on it.
    """

    number: IntArray
    turned: BoolArray
    off_mm: FloatArray

    @property
    def count(self) -> int:
        """How many kinds there are."""
        return int(self.number.max(initial=0))

    @property
    def first(self) -> IntArray:
        """The first piece of each kind, (K,)."""
        return np.unique(self.number, return_index=True)[1]


def compare_pieces(
    pieces: Sequence[Piece], stuff: Sequence[int] | None = None, *, same_mm: float = SAME_MM
) -> Kinds:
    """Tell which pieces are the same.

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
    same_mm : float
        By how much pieces of one kind may differ.
    """
    first_of: list[int] = []
    buckets: dict[tuple[int, ...], list[int]] = {}
    kinds, turned = np.zeros(len(pieces), dtype=np.int64), np.zeros(len(pieces), dtype=np.bool_)
    off = np.zeros(len(pieces))
    for index, piece in enumerate(pieces):
        key = np.append(0 if stuff is None else stuff[index], _invariants(piece, same_mm))
        near = (one for cell in _cells(key) for one in buckets.get(cell, ()))
        for kind, backwards in product(near, (False, True)):
            apart = apart_mm(piece, pieces[first_of[kind]], backwards=backwards)
            if apart <= same_mm:
                kinds[index], turned[index], off[index] = kind + 1, backwards, apart
                break
        else:
            buckets.setdefault(tuple(np.floor(key).astype(int).tolist()), []).append(len(first_of))
            first_of.append(index)
            kinds[index] = len(first_of)
    return Kinds(kinds, turned, off)


def alike_crossings(
    pieces: Sequence[Piece], kinds: Kinds, n_crossings: int, *, same_mm: float = SAME_MM
) -> IntArray:
    """Return numbers of crossings, (X,), which those share that are alike.

    Two crossings are alike if they are the same station of two pieces of one kind, laid on one
    another; and so are all that such pairs lead to, by either strand. Pieces of one kind stay so
    where alike crossings have alike holes.

    Parameters
    ----------
    pieces : sequence of Piece
    kinds : Kinds
        Of these pieces.
    n_crossings : int
    same_mm : float
        By how much pieces of one kind may differ: those that cover themselves when they are
        turned end for end are the same seen from either end.
    """
    lengths = np.array([len(piece.crossings) for piece in pieces], dtype=np.int64)
    both_ways = np.array(
        [
            apart_mm(pieces[at], pieces[at], backwards=True) <= same_mm
            for at in kinds.first.tolist()
        ],
        dtype=np.bool_,
    )
    if not len(pieces):
        return np.arange(n_crossings)
    piece = np.repeat(np.arange(len(pieces)), lengths)
    station = np.arange(len(piece)) - offsets_of(lengths)[piece]
    mirrored = lengths[piece] - 1 - station
    crossing = np.concatenate([one.crossings for one in pieces])
    kind = kinds.number[piece] - 1
    first = n_crossings + offsets_of(lengths[kinds.first])
    place = first[kind] + np.where(kinds.turned[piece], mirrored, station)
    either = both_ways[kind]
    opposite = first[kind] + np.where(kinds.turned[piece], station, mirrored)
    _, label = label_links(
        np.concatenate((crossing, crossing[either])),
        np.concatenate((place, opposite[either])),
        int(first[-1]),
    )
    return np.asarray(np.unique(label[:n_crossings], return_inverse=True)[1])


def _invariants(piece: Piece, same_mm: float) -> npt.NDArray[np.float64]:
    """Return numbers that no motion changes; those of one kind differ by less than one."""
    points = piece.points
    span = float(np.hypot(*(points[-1] - points[0])))
    ring = shapely.LinearRing(piece.outline)
    reach = float(shapely.Point(points.mean(axis=0)).hausdorff_distance(ring))
    counts = (len(points), int(piece.over.sum()), len(piece.more_holes), len(piece.slots))
    return np.array([*counts, span / (4 * same_mm), reach / (4 * same_mm)])


def _cells(key: npt.NDArray[np.float64]) -> list[tuple[int, ...]]:
    """Return the cells in which something of the same kind may have been put."""
    counts = tuple(key[:-2].astype(int).tolist())
    low, high = np.floor(key[-2:] - 0.5).astype(int), np.floor(key[-2:] + 0.5).astype(int)
    return [
        (*counts, int(a), int(b))
        for a in dict.fromkeys((low[0], high[0]))
        for b in dict.fromkeys((low[1], high[1]))
    ]


def motion_onto(piece: Piece, other: Piece, *, backwards: bool) -> tuple[complex, complex]:
    """Return the turn and the shift that take a piece nearest to another, as complex numbers.

    Station goes to station, or, if it is turned end for end, the first to the last.
    """
    z, w = (marks.ravel() for marks in _facing(piece, other, backwards=backwards))
    turn = np.vdot(z - z.mean(), w - w.mean())
    turn /= abs(turn) if turn else 1.0
    return complex(turn), complex(w.mean() - turn * z.mean())


def apart_mm(piece: Piece, other: Piece, *, backwards: bool) -> float:
    """Return how far a piece is from another when it is laid on it; infinite if it cannot be.

    Station lies on station, or, if it is turned end for end, the first on the last. Pieces with
    other holes, or another over and under, cannot be laid on one another.
    """
    way = slice(None, None, -1 if backwards else 1)
    if len(piece.points) != len(other.points) or not np.array_equal(piece.over[way], other.over):
        return np.inf
    if not np.array_equal(np.round(piece.hole_mm[way], 3), np.round(other.hole_mm, 3), True):
        return np.inf
    if len(piece.more_holes) != len(other.more_holes) or len(piece.slots) != len(other.slots):
        return np.inf
    # The stations and their rails decide the motion.
    turn, shift = motion_onto(piece, other, backwards=backwards)
    source, target = _facing(piece, other, backwards=backwards)
    worst = float(np.abs(turn * source + shift - target).max())
    if worst > _FAR_MM:
        return np.inf

    def moved(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return moved_by(points, turn, shift)

    worst = max(
        worst,
        _holes_apart(moved(piece.more_holes[:, 1:3]), piece, other),
        _apart(moved(piece.outline), other.outline),
    )
    ours, theirs = ([slot.path.flattened(SAME_MM / 2) for slot in p.slots] for p in (piece, other))
    return max([worst, *(min(_apart(moved(slot), twin) for twin in theirs) for slot in ours)])


def moved_by(points: FloatArray, turn: complex, shift: complex) -> FloatArray:
    """Return points, (..., 2), after a turn and a shift that are complex numbers."""
    placed = turn * (points[..., 0] + 1j * points[..., 1]) + shift
    return np.stack((placed.real, placed.imag), axis=-1)


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


def _holes_apart(places: npt.NDArray[np.float64], piece: Piece, other: Piece) -> float:
    """Return how far holes away from the stations are from those of another piece, by size, too."""
    if not len(places):
        return 0.0
    off = np.hypot(*(places[:, None] - other.more_holes[None, :, 1:3]).transpose(2, 0, 1))
    wide = np.abs(piece.more_holes[:, None, 3] - other.more_holes[None, :, 3])
    return float(np.where(wide <= 1e-3, off, np.inf).min(axis=1).max())


def _apart(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> float:
    """Return the greatest distance of a point of one outline to the other, both ways."""
    return float(shapely.LinearRing(one).hausdorff_distance(shapely.LinearRing(other)))
