"""Say which pieces of a half-built object lie loose, and from when on each is held."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.piece.piece import Piece

#: What may hold an end: crossings that take a fastener, and pieces that it goes over and under.
End: TypeAlias = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]


@frozen_value
class Holds:
    """What may hold the ends of pieces.

    An end is that half of a piece's stations, two at least. It is held once a fastener is set or
    a lap is made there. Where there will be neither, it is held once it is trapped, over a strand
    that is in place and under another: card slides on card, so that counts for no other end. A
    piece with an end that is not held lies loose.

    Parameters
    ----------
    ends : tuple of pairs of End
        Of each piece, at its start and at its end.
    layers : dict
        The pieces at each crossing that takes a fastener: it is set when all are in place. So are
        laps without a fastener made, each under minus the number of its joint.
    around : tuple of tuples of int
        Each piece, and those whose ends it may hold.
    """

    ends: tuple[tuple[End, End], ...]
    layers: dict[int, tuple[int, ...]]
    around: tuple[tuple[int, ...], ...]

    def held_from(self, piece: int, place: Sequence[float], never: float) -> float:
        """Return the place in the order from which on a piece is held, at last ``never``."""
        start, end = self.ends[piece]
        return max(
            place[piece], self.end_from(start, place, never), self.end_from(end, place, never)
        )

    def end_from(self, end: End, place: Sequence[float], never: float) -> float:
        """Return the place in the order from which on one end is held, at last ``never``."""
        ties, over, under = end
        held = never
        if over and under:
            held = max(min([place[at] for at in over]), min([place[at] for at in under]))
        for crossing in ties:
            held = min(held, self.set_at(crossing, place))
        return held

    def set_at(self, crossing: int, place: Sequence[float]) -> float:
        """Return the place in the order at which a fastener is set."""
        return max([place[at] for at in self.layers[crossing]])


def find_holds(pieces: Sequence[Piece], fastened: BoolArray) -> Holds:
    """Find what may hold the ends of pieces.

    Parameters
    ----------
    pieces : sequence of Piece
    fastened : (X,) bool array
        Which crossings take a fastener.
    """
    carriers = strands_of(pieces)
    ends, around = [], []
    laps: dict[int, set[int]] = {}
    for number, piece in enumerate(pieces):
        stations = list(zip(piece.crossings.tolist(), piece.over.tolist(), strict=True))
        half = _half(stations)
        both = []
        for some, joint, tip in (
            (stations[:half], piece.start_joint, 0),
            (stations[-half:], piece.end_joint, -1),
        ):
            bare = () if joint is None or fastened[stations[tip][0]] else (-joint,)
            for lap in bare:
                laps.setdefault(lap, set()).add(number)
            both.append(_end(number, some, carriers, fastened, bare))
        ends.append((both[0], both[1]))
        near = {
            other
            for crossing, _ in stations
            for over in (True, False)
            for other in carriers.get((crossing, over), ())
        }
        around.append(tuple(sorted(near)))
    layers = laps
    for (crossing, _), own in carriers.items():
        if fastened[crossing]:
            layers.setdefault(crossing, set()).update(own)
    return Holds(
        tuple(ends), {key: tuple(sorted(own)) for key, own in layers.items()}, tuple(around)
    )


def strands_of(pieces: Sequence[Piece]) -> dict[tuple[int, bool], list[int]]:
    """Return the pieces of each strand, a crossing and whether above: two at a lap, in order."""
    carriers: dict[tuple[int, bool], list[int]] = {}
    for number, piece in enumerate(pieces):
        for strand in zip(piece.crossings.tolist(), piece.over.tolist(), strict=True):
            carriers.setdefault(strand, []).append(number)
    return carriers


def _half(stations: Sequence[tuple[int, bool]]) -> int:
    """Return how many stations make an end."""
    return max((len(stations) + 1) // 2, 2)


def _end(
    number: int,
    stations: Sequence[tuple[int, bool]],
    carriers: dict[tuple[int, bool], list[int]],
    fastened: BoolArray,
    laps: tuple[int, ...],
) -> End:
    ties = (*dict.fromkeys(key for key, _ in stations if fastened[key]), *laps)
    if ties:
        return ties, (), ()
    met: dict[bool, dict[int, None]] = {True: {}, False: {}}
    for crossing, over in stations:
        others = carriers.get((crossing, not over), ())
        met[over].update(dict.fromkeys(other for other in others if other != number))
    return (), tuple(met[True]), tuple(met[False])


@dataclass(frozen=True)
class Clip:
    """A clip at a crossing, which holds ends of the two pieces there for a while.

    Parameters
    ----------
    crossing : int
    pieces : (int, int)
        Twice the same where a ring laps itself.
    since, until : int
        The places in the order after which it is put on, and after which it is not needed.
    """

    crossing: int
    pieces: tuple[int, int]
    since: int
    until: int


def find_clips(
    pieces: Sequence[Piece], holds: Holds, order: Sequence[int], *, to_the_end: bool = True
) -> list[Clip]:
    """Return the clips that hold loose ends, each put on as soon as there is a strand to clip to.

    Of the crossings of a loose end, its lap is taken, until that is fastened, or that where a clip
    holds most ends, and of these the nearest to its tip; the middle of its piece only if there is
    no other.

    Parameters
    ----------
    pieces : sequence of Piece
    holds : Holds
    order : sequence of int
        Every piece once.
    to_the_end : bool
        Whether what no piece of the order comes to hold is clipped, too.
    """
    last = len(order) if to_the_end else len(order) - 1
    rank, carriers = ranks(order), strands_of(pieces)
    waiting: dict[tuple[int, bool], int] = {}
    at: dict[tuple[int, bool], list[tuple[int, bool]]] = {}
    clips = []
    for now, piece in enumerate(order):
        stations = list(zip(pieces[piece].crossings.tolist(), pieces[piece].over.tolist(),
                            strict=True))  # fmt: skip
        half = _half(stations)
        for end, way in ((False, stations[:half]), (True, stations[::-1][:half])):
            at[piece, end] = way
            until = int(holds.end_from(holds.ends[piece][end], rank, len(order)))
            if now < until <= last:
                waiting[piece, end] = until
        waiting = {key: until for key, until in waiting.items() if until > now}
        for own in list(waiting):
            if own not in waiting:  # a clip that has just been put on holds it, too
                continue
            spots = [
                (crossing, other, way is over)
                for crossing, over in at[own[0], own[1]]
                # What it crosses there, or else the mate that it laps, maybe its own other end.
                for way in (not over, over)
                for other in carriers.get((crossing, way), ())
                if rank[other] <= now
                and (other != own[0] or carriers[crossing, way].count(other) > 1)
            ]
            if not spots:
                continue
            # Of an odd number of stations the middle one is in both halves: a strip that hangs on
            # one clip there turns about it. A lap that waits for its fastener is held first.
            first, second = at[own[0], False][-1], at[own[0], True][-1]
            middle = first[0] if first == second else -1
            crossing, other, lap = max(
                spots,
                key=lambda spot: (
                    spot[0] != middle,
                    spot[2],
                    sum(_passes(at[key], spot[0]) for key in waiting),
                ),
            )
            both = [key for key in waiting if _passes(at[key], crossing)]
            until = max(waiting.pop(key) for key in both)
            if lap and crossing in holds.layers:
                until = int(holds.set_at(crossing, rank))
            clips.append(Clip(crossing, (own[0], other), now, until))
    return clips


def _passes(stations: Sequence[tuple[int, bool]], crossing: int) -> bool:
    return any(one == crossing for one, _ in stations)


def ranks(order: Sequence[int]) -> list[int]:
    """Return the place of each piece in an order."""
    rank = [0] * len(order)
    for at, piece in enumerate(order):
        rank[piece] = at
    return rank


def count_loose(holds: Holds, order: Sequence[int]) -> IntArray:
    """Return how many pieces lie loose after each that is placed, (N,).

    Parameters
    ----------
    holds : Holds
    order : sequence of int
        Every piece once.
    """
    count, rank = len(order), ranks(order)
    change = np.ones(count + 1, dtype=np.int64)
    held = [holds.held_from(piece, rank, count) for piece in range(count)]
    np.add.at(change, np.array(held, dtype=np.int64), -1)
    return np.cumsum(change)[:count]
