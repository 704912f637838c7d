"""Find pieces that are congruent, make them equal, and cut some of each kind once more."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arc_path import Path
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.core.errors import InputError
from fabweave.mesh.topology import label_links
from fabweave.piece.piece import Piece, Slot

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
    kinds, turned = np.zeros(len(pieces), dtype=np.int64), np.zeros(len(pieces), dtype=np.bool_)
    off = np.zeros(len(pieces))
    known = np.array([_invariants(piece) for piece in pieces]).reshape(-1, 6)
    known = np.column_stack((np.zeros(len(pieces)) if stuff is None else stuff, known))
    # What is counted is the same in all of one kind; lengths differ by less than the last two.
    apart_by = np.array([0.0] * 5 + [4.0 * same_mm] * 2)
    first_of: list[int] = []
    leaders = np.empty_like(known)
    for index, piece in enumerate(pieces):
        near = np.all(np.abs(leaders[: len(first_of)] - known[index]) <= apart_by, axis=1)
        for kind, backwards in product(np.flatnonzero(near).tolist(), (False, True)):
            apart = apart_mm(piece, pieces[first_of[kind]], backwards=backwards)
            if apart <= same_mm:
                kinds[index], turned[index], off[index] = kind + 1, backwards, apart
                break
        else:
            leaders[len(first_of)] = known[index]
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


def _invariants(piece: Piece) -> tuple[float, ...]:
    """Return four counts and two lengths that no motion changes."""
    points = piece.points
    ring = shapely.LinearRing(piece.outline)
    reach = float(shapely.Point(points.mean(axis=0)).hausdorff_distance(ring))
    counts = len(points), int(piece.over.sum()), len(piece.more_holes), len(piece.slots)
    return *counts, float(np.hypot(*(points[-1] - points[0]))), reach


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


#: The least play of a fastener in its hole is 0.1 mm: a screw with a hole of the fine series
#: (ISO 273). Two pieces that meet there may each be off by this, with something to spare.
FIT_MM = 0.04
#: The files have so many decimals; what is equal before is equal there, turned about or not.
DECIMALS = 6


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
    return _placed(piece, lambda points: np.round(points, DECIMALS))


def _turned(piece: Piece) -> Piece:
    """Return a piece turned by half about its middle, and walked from the other end."""
    corner = piece.outline.max(axis=0) + piece.outline.min(axis=0)
    # Both terms have few decimals: rounding leaves what the difference really is.
    return _placed(piece, lambda points: np.round(corner - points, DECIMALS), way=-1)


def _placed(piece: Piece, place: Callable[[FloatArray], FloatArray], *, way: int = 1) -> Piece:
    """Return a piece with its places moved; with ``way`` -1 its stations come the last first."""
    last = len(piece.points) - 1 if way < 0 else 0
    holes = piece.more_holes.copy()
    holes[:, 0], holes[:, 1:3] = last + way * holes[:, 0], place(holes[:, 1:3])
    return replace(
        piece,
        path=Path(place(piece.path.points), piece.path.bulges),
        outline=place(piece.outline),
        points=place(piece.points)[::way],
        directions=piece.directions[::way],  # turned by half, and walked back
        rails=place(piece.rails)[::way, ::way],
        more_holes=holes,
        slots=tuple(
            Slot(last + way * slot.station, Path(place(slot.path.points), slot.path.bulges))
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


#: More of a kind than this are no spares, but a slip.
_MOST = 100


def parse_spares(text: str) -> tuple[float, int]:
    """Return how many spares there are of a kind: a share of its pieces, rounded up, and a number.

    Parameters
    ----------
    text : str
        ``"5%"``, a share of the pieces of each kind; or ``"2"``, so many of each kind.

    Returns
    -------
    (float, int)
        Of the two, one is 0.

    Raises
    ------
    InputError
        If it is neither.

    Examples
    --------
    >>> parse_spares("5%"), parse_spares("2")
    ((0.05, 0), (0.0, 2))
    """
    plain = text.strip()
    share = plain.endswith("%")
    try:
        value = float(plain.removesuffix("%"))
    except ValueError:
        value = math.nan
    if share and 0.0 < value <= 100.0:
        return value / 100.0, 0
    if not share and 0.0 < value <= _MOST and value.is_integer():
        return 0.0, int(value)
    raise InputError(
        f"spares are a share of each kind, such as 5%, or 1 to {_MOST} of each, not {text!r}"
    )


def usual_spares(text: str) -> str:
    """Return a text for spares in its usual form.

    Examples
    --------
    >>> usual_spares(" 5.0 %"), usual_spares("2.0")
    ('5%', '2')
    """
    share, number = parse_spares(text)
    return f"{100.0 * share:.10g}%" if share else str(number)


def spared(kinds: IntArray, spares: str | None) -> IntArray:
    """Return which pieces are cut once more, by their numbers; kind by kind.

    It is the first piece of each kind, as often as spares of that kind are wanted: no kind is
    left without any.

    Parameters
    ----------
    kinds : (N,) int array
        The kind of each piece, from 1 in the order of their first piece.
    spares : str, optional
        As :func:`parse_spares` reads it; none by default.

    Returns
    -------
    (S,) int array

    Examples
    --------
    Of 21 pieces of the first kind, a twentieth is a little more than one.

    >>> kinds = np.array([1] * 20 + [2, 1])
    >>> spared(kinds, "5%").tolist(), spared(kinds, "1").tolist(), spared(kinds, None).tolist()
    ([0, 0, 20], [0, 20], [])
    """
    if spares is None:
        return np.zeros(0, dtype=np.int64)
    share, number = parse_spares(spares)
    _, first, counts = np.unique(kinds, return_index=True, return_counts=True)
    # A twentieth of 20 pieces is one, whatever the last bit of the product.
    times = np.ceil(np.round(share * counts, 9)).astype(np.int64) + number
    return np.repeat(first, times)


def spare_pieces(pieces: Sequence[Piece], origins: IntArray) -> tuple[Piece, ...]:
    """Return the spares of some pieces: the same but for their ids, such as ``A3S1``.

    Parameters
    ----------
    pieces : sequence of Piece
    origins : (S,) int array
        Which piece each spare is a copy of, ascending.
    """
    number = np.arange(len(origins)) - np.searchsorted(origins, origins) + 1
    return tuple(
        replace(pieces[origin], id=f"{pieces[origin].id}S{count}")
        for origin, count in zip(origins.tolist(), number.tolist(), strict=True)
    )
