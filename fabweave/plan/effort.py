"""Say what an order of assembly costs: the effort of each piece, and what lies loose."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.piece.piece import Piece
from fabweave.plan.loose import Holds, count_loose, find_holds, ranks, strands_of


@frozen_value
class Contacts:
    """Which pieces cross or join which, in terms of ``StationBits``.

    Parameters
    ----------
    n_stations : tuple of int
        Stations of each piece.
    alone : tuple of int
        The state in which each piece finds itself before any other is in place: it may cross
        itself, or join its own end.
    meets : tuple of tuples (other, here, there)
        For each piece every other that it meets, the bits of its own state that the other sets
        when it is in place first, and the bits of the other's state that it sets itself.
    component : (N,) int array
        Pieces that hang together have the same number, from 0 in order of their first pieces.
    holds : Holds
        What may hold the ends of pieces.
    """

    n_stations: tuple[int, ...]
    alone: tuple[int, ...]
    meets: tuple[tuple[tuple[int, int, int], ...], ...]
    component: IntArray
    holds: Holds


def find_contacts(pieces: Sequence[Piece], fastened: BoolArray) -> Contacts:
    """Find what every piece meets, at its crossings and at its ends.

    Parameters
    ----------
    pieces : sequence of Piece
        All pieces of a job.
    fastened : (X,) bool array
        Which crossings take a fastener.

    Returns
    -------
    Contacts
        In time and memory proportional to the number of stations.
    """
    carriers = strands_of(pieces)
    begins = {piece.start_joint: number for number, piece in enumerate(pieces)}
    ends = {piece.end_joint: number for number, piece in enumerate(pieces)}
    alone, contacts = [], []
    for number, piece in enumerate(pieces):
        bits = StationBits(len(piece.crossings))
        met: dict[int, int] = {}
        for station, (crossing, over) in enumerate(
            zip(piece.crossings.tolist(), piece.over.tolist(), strict=True)
        ):
            for second, other in enumerate(carriers.get((crossing, not over), ())):
                bit = bits.strand(station, over=over, second=bool(second))
                met[other] = met.get(other, 0) | bit
        for joint, others, end in (
            (piece.start_joint, ends, False),
            (piece.end_joint, begins, True),
        ):
            if joint is not None:
                met[others[joint]] = met.get(others[joint], 0) | bits.mate(end=end)
        alone.append(met.pop(number, 0))
        contacts.append(met)
    meets = tuple(
        tuple((other, here, contacts[other][number]) for other, here in sorted(met.items()))
        for number, met in enumerate(contacts)
    )
    return Contacts(
        tuple(len(piece.crossings) for piece in pieces),
        tuple(alone),
        meets,
        _components(meets),
        find_holds(pieces, fastened),
    )


def _components(meets: Sequence[Sequence[tuple[int, int, int]]]) -> IntArray:
    """Give pieces that hang together the same number."""
    rows = np.repeat(np.arange(len(meets)), [len(met) for met in meets])
    columns = np.array([other for met in meets for other, _, _ in met], dtype=np.int64)
    graph = sparse.coo_array(
        (np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(len(meets), len(meets))
    )
    return np.asarray(csgraph.connected_components(graph, directed=False)[1], dtype=np.int64)


#: Lay the piece over a strand that is in place.
LAY = 1.0
#: Slide the tip of the piece, at its first or last station, below a strand that is in place.
TUCK = 2.0
#: Slide the piece below a strand in place anywhere else: lift the strand, find the tip again.
THREAD = 6.0
#: Draw the piece on by one more station: added for each between the strand and the piece's tip.
PULL = 0.25
#: Draw the piece on below one more strand that holds it: added for each between there and the tip.
DRAG = 1.0
#: Lap an end on its mate and fasten it.
JOIN = 1.0
#: Both ends have their mates in place: the piece must be bowed in, and fit.
CLOSE = 3.0
#: Hold a piece in place that touches nothing, or one, two or three things; four hold it well.
LOOSE = (8.0, 6.0, 3.0, 1.0)
#: At the last piece of a closed surface no hand comes to the inside: sliding below and joining cost
#: this much more, from nothing when half of the pieces are in place.
REACH = 1.0
#: A piece lies loose while one more is placed: somebody has to hold it.
UNREST = 2.25


@dataclass(frozen=True)
class StationBits:
    """What is in place where a piece is to go, as bits of one integer.

    Each thing has a bit of its own, so things come and go by exclusive or. A strand has two bits,
    because two pieces may carry it, lapped at a joint.

    Parameters
    ----------
    n_stations : int
        How many stations the piece has.
    """

    n_stations: int

    def strand(self, station: int, *, over: bool, second: bool) -> int:
        """Return the bit of a strand at a station; ``over``: the piece goes over that strand."""
        return 1 << (station + self.n_stations * (2 * over + second))

    def mate(self, *, end: bool) -> int:
        """Return the bit of the mate at the piece's beginning or end."""
        return 1 << (4 * self.n_stations + end)

    def read(self, state: int) -> list[tuple[str, int]]:
        """Say what bits stand for: ``under`` or ``over`` at a station, or a ``mate`` at an end."""
        found, mates = [], 4 * self.n_stations
        while state:
            bit = (state & -state).bit_length() - 1
            row, station = divmod(bit, self.n_stations)
            at_end = bit >= mates
            found.append(
                ("mate", bit - mates) if at_end else ("over" if row >= 2 else "under", station)
            )
            state &= state - 1
        return found


def piece_effort(n_stations: int, state: int) -> tuple[float, float]:
    """Return the effort to place a piece, and the part of it that reaching adds to.

    Parameters
    ----------
    n_stations : int
        How many stations the piece has.
    state : int
        What is in place, see ``StationBits``.

    Returns
    -------
    plain : float
        Laying over, closing, holding.
    behind : float
        What a hand on the inside helps: joining, and sliding below strands, each of which costs
        more the farther it is from the nearer end, and the more strands hold the piece on the way.

    Examples
    --------
    >>> bits = StationBits(5)
    >>> alone = piece_effort(5, 0)
    >>> laid = piece_effort(5, sum(bits.strand(k, over=True, second=False) for k in range(5)))
    >>> tips = piece_effort(5, sum(bits.strand(k, over=False, second=False) for k in (0, 4)))
    >>> middle = piece_effort(5, bits.strand(2, over=False, second=False))
    >>> alone, laid, tips, middle
    ((8.0, 0.0), (5.0, 0.0), (3.0, 4.0), (6.0, 6.5))
    """
    all_stations = (1 << n_stations) - 1
    under = (state | state >> n_stations) & all_stations
    over = (state >> 2 * n_stations | state >> 3 * n_stations) & all_stations
    joined = (state >> 4 * n_stations).bit_count()
    met = over.bit_count() + under.bit_count() + joined
    plain = over.bit_count() * LAY
    plain += CLOSE * (joined == 2) + (LOOSE[met] if met < len(LOOSE) else 0.0)
    behind = joined * JOIN
    half = (n_stations + 1) // 2
    for stations, from_end in ((under & (1 << half) - 1, False), (under >> half, True)):
        held, left = 0, stations
        while left:
            bit = left.bit_length() - 1 if from_end else (left & -left).bit_length() - 1
            left ^= 1 << bit
            away = n_stations - 1 - half - bit if from_end else bit
            behind += (THREAD + PULL * away if away else TUCK) + DRAG * held
            held += 1
    return plain, behind


def reach(place: float) -> float:
    """Return the factor of work behind strands when a share ``place`` of a closed surface is there.

    Examples
    --------
    >>> reach(0.3), reach(0.75), reach(1.0)
    (1.0, 1.5, 2.0)
    """
    return 1.0 + REACH * max(0.0, 2.0 * place - 1.0)


@frozen_value
class MeasuredOrder:
    """An order and what it costs.

    Parameters
    ----------
    order : (N,) int array
        Pieces as they are placed.
    effort : (N,) float array
        The effort of each piece of the order, in that order.
    loose : (N,) int array
        How many pieces lie loose after each.
    """

    order: IntArray
    effort: FloatArray
    loose: IntArray

    @property
    def total(self) -> float:
        """The effort of the whole."""
        return float(self.effort.sum())

    @property
    def cost(self) -> float:
        """The effort, and what it costs that pieces lie loose."""
        return self.total + UNREST * float(self.loose.sum())


def measure_order(contacts: Contacts, order: Sequence[int], *, enclosed: bool) -> MeasuredOrder:
    """Measure the effort of an order.

    Parameters
    ----------
    contacts : Contacts
        What the pieces meet.
    order : sequence of int
        Every piece once.
    enclosed : bool
        Whether the surface is closed, so that hands come to its inside ever less.
    """
    rank = ranks(order)
    component = contacts.component.tolist()
    size = np.bincount(contacts.component).tolist()
    placed = [0] * len(size)
    effort = []
    for at, piece in enumerate(order):
        state = contacts.alone[piece]
        for other, here, _ in contacts.meets[piece]:
            if rank[other] < at:
                state ^= here
        plain, behind = piece_effort(contacts.n_stations[piece], state)
        whole = component[piece]
        placed[whole] += 1
        effort.append(plain + behind * (reach(placed[whole] / size[whole]) if enclosed else 1.0))
    return MeasuredOrder(
        np.array(order, dtype=np.int64), np.array(effort), count_loose(contacts.holds, order)
    )
