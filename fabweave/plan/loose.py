"""Say which pieces of a half-built object lie loose, and from when on each is held."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.piece.piece import Piece

#: What may hold an end: crossings that take a fastener, and pieces that it goes over and under.
End: TypeAlias = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]


@frozen_value
class Holds:
    """What may hold the ends of pieces.

    An end is that half of a piece's stations, two at least. It is held once a fastener is set
    there; or once it is trapped, over a strand that is in place and under another. A piece with an
    end that is not held lies loose.

    Parameters
    ----------
    ends : tuple of pairs of End
        Of each piece, at its start and at its end.
    layers : dict
        The pieces at each crossing that takes a fastener: it is set when all are in place.
    fastened : tuple of tuples of int
        The crossings of each piece that take a fastener.
    around : tuple of tuples of int
        Each piece, and those whose ends it may hold.
    """

    ends: tuple[tuple[End, End], ...]
    layers: dict[int, tuple[int, ...]]
    fastened: tuple[tuple[int, ...], ...]
    around: tuple[tuple[int, ...], ...]

    def held_from(self, piece: int, place: Sequence[float], never: float) -> float:
        """Return the place in the order from which on a piece is held, at last ``never``."""
        last = place[piece]
        for ties, over, under in self.ends[piece]:
            held = never
            if over and under:
                held = max(min([place[at] for at in over]), min([place[at] for at in under]))
            for crossing in ties:
                held = min(held, max([place[at] for at in self.layers[crossing]]))
            last = max(last, held)
        return last

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
    carriers: dict[tuple[int, bool], list[int]] = {}
    for number, piece in enumerate(pieces):
        for strand in zip(piece.crossings.tolist(), piece.over.tolist(), strict=True):
            carriers.setdefault(strand, []).append(number)
    ends, around = [], []
    for number, piece in enumerate(pieces):
        stations = list(zip(piece.crossings.tolist(), piece.over.tolist(), strict=True))
        half = max((len(stations) + 1) // 2, 2)
        both = [
            _end(number, some, carriers, fastened) for some in (stations[:half], stations[-half:])
        ]
        ends.append((both[0], both[1]))
        near = {
            other
            for crossing, _ in stations
            for over in (True, False)
            for other in carriers.get((crossing, over), ())
        }
        around.append(tuple(sorted(near)))
    tied = [
        tuple(dict.fromkeys(key for key in piece.crossings.tolist() if fastened[key]))
        for piece in pieces
    ]
    layers = {
        key: tuple(
            dict.fromkeys(at for over in (False, True) for at in carriers.get((key, over), ()))
        )
        for keys in tied
        for key in keys
    }
    return Holds(tuple(ends), layers, tuple(tied), tuple(around))


def _end(
    number: int,
    stations: Sequence[tuple[int, bool]],
    carriers: dict[tuple[int, bool], list[int]],
    fastened: BoolArray,
) -> End:
    met: dict[bool, dict[int, None]] = {True: {}, False: {}}
    for crossing, over in stations:
        others = carriers.get((crossing, not over), ())
        met[over].update(dict.fromkeys(other for other in others if other != number))
    ties = dict.fromkeys(crossing for crossing, _ in stations if fastened[crossing])
    return tuple(ties), tuple(met[True]), tuple(met[False])


def count_loose(holds: Holds, order: Sequence[int]) -> IntArray:
    """Return how many pieces lie loose after each that is placed, (N,).

    Parameters
    ----------
    holds : Holds
    order : sequence of int
        Every piece once.
    """
    count = len(order)
    rank = [0] * count
    for at, piece in enumerate(order):
        rank[piece] = at
    change = np.ones(count + 1, dtype=np.int64)
    held = [holds.held_from(piece, rank, count) for piece in range(count)]
    np.add.at(change, np.array(held, dtype=np.int64), -1)
    return np.cumsum(change)[:count]
