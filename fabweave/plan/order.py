"""Find the order in which pieces are put together: grow it, anneal it, and walk it."""

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy import sparse

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.piece.piece import Piece
from fabweave.plan.anneal import anneal
from fabweave.plan.effort import (
    THREAD,
    Contacts,
    MeasuredOrder,
    find_contacts,
    measure_order,
    piece_effort,
)
from fabweave.plan.loose import ranks


def grow_order(contacts: Contacts, roots: Sequence[int]) -> list[int]:
    """Grow an order from one piece of each component, so that every new piece meets an old one.

    That piece at the rim comes next which costs least for each thing that it meets, counting what
    it will cost to slide strands below it later.

    Parameters
    ----------
    contacts : Contacts
        What the pieces meet.
    roots : sequence of int
        The first piece of each component.

    Returns
    -------
    list of int
        Every piece once.
    """
    over_bits = [((1 << 2 * n) - 1) << 2 * n for n in contacts.n_stations]
    later = [
        sum((here & over_bits[piece]).bit_count() for _, here, _ in met)
        for piece, met in enumerate(contacts.meets)
    ]
    state = list(contacts.alone)
    done = [False] * len(state)
    score = [0.0] * len(state)
    order = []
    for root in roots:
        heap = [(0.0, root)]
        while heap:
            worth, piece = heapq.heappop(heap)
            if done[piece] or worth != score[piece]:
                continue
            done[piece] = True
            order.append(piece)
            for other, _, there in contacts.meets[piece]:
                if done[other]:
                    continue
                state[other] ^= there
                later[other] -= (there & over_bits[other]).bit_count()
                now = sum(piece_effort(contacts.n_stations[other], state[other]))
                score[other] = (now + THREAD * later[other]) / state[other].bit_count()
                heapq.heappush(heap, (score[other], other))
    return order


#: How much nearness to the first piece counts against nearness to the piece before; and for one
#: piece less that lies loose, a step goes so much farther, as a share of the object's extent.
_HOMEWARD, _HELD = 0.5, 0.3
#: A piece is placed from a side that shows so much of what the best side shows of it: with more,
#: the pieces that are ready seldom let a side be kept.
_SHOWS = 0.55
#: Of so many pieces it is looked ahead whether a side serves them.
_AHEAD = 200


def sides_of_pieces(normals: Sequence[FloatArray]) -> BoolArray:
    """Return from which of 26 sides each piece may be placed, (26, N).

    The sides are those of a cube, its edges and corners. A side serves a piece if it shows
    much of what the best side shows of it, as its crossings face; what stands in the way is not
    looked at.

    Parameters
    ----------
    normals : sequence of (K, 3) float arrays
        For each piece the outward normals at its crossings.

    Examples
    --------
    >>> served = sides_of_pieces([np.array([[0.0, 0.0, 1.0]])])
    >>> int(served.sum()), bool(served.any())
    (9, True)
    """
    ways = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    shown = np.array([np.maximum(own @ ways.T, 0.0).mean(axis=0) for own in normals]).T
    return np.asarray(shown >= _SHOWS * shown.max(axis=0, initial=0.0))


def walk_order(
    contacts: Contacts,
    order: Sequence[int],
    roots: Sequence[int],
    middle: FloatArray,
    served: BoolArray,
) -> list[int]:
    """Return an order in which neighbours keep their order, and each step goes to a near piece.

    Of pieces that are about as near, the one comes that leaves the fewest loose. As long as a side
    of the object serves, pieces are taken that are placed from there; then it is turned to the side
    from which most can be placed one after the other.

    Parameters
    ----------
    contacts : Contacts
    order : sequence of int
        An order: of two pieces that meet, the first one stays the first.
    roots : sequence of int
        The first piece of each component.
    middle : (N, 3) float array
        Where each piece is.
    served : (S, N) bool array
        From which sides each piece may be placed.
    """
    walk = _Walk(contacts, order)
    side, extent = 0, float(np.linalg.norm(np.ptp(middle, axis=0))) if len(middle) else 0.0
    for root in roots:
        home = np.linalg.norm(middle - middle[root], axis=1) * _HOMEWARD
        walk.ready = [root]
        last = root
        while walk.ready:
            here = np.array(walk.ready)
            if not served[side, here].any():
                side = max(range(len(served)), key=lambda way: walk.serves(served[way]))
            here = here[served[side, here]]
            far = np.linalg.norm(middle[here] - middle[last], axis=1) + home[here]
            far += _HELD * extent * np.array([walk.more_loose(piece) for piece in here.tolist()])
            last = int(here[np.argmin(np.round(far, 6))])
            walk.take(last)
    return walk.taken


class _Walk:
    """Pieces as they are taken: those are ready that wait for no other."""

    def __init__(self, contacts: Contacts, order: Sequence[int]) -> None:
        rank = ranks(order)
        self._later = [
            [other for other, _, _ in met if rank[other] > rank[piece]]
            for piece, met in enumerate(contacts.meets)
        ]
        self._waiting = [
            sum(rank[other] < rank[piece] for other, _, _ in met)
            for piece, met in enumerate(contacts.meets)
        ]
        self.ready: list[int] = []
        self.taken: list[int] = []
        self._holds = contacts.holds
        self._place = [len(order)] * len(order)
        self._loose: set[int] = set()

    def _left_loose(self, piece: int) -> tuple[set[int], set[int]]:
        """Return which pieces around one lie loose before it comes, and which after that."""
        here, place = len(self.taken), self._place
        before = self._loose.intersection(self._holds.around[piece])
        place[piece] = here
        after = {
            one for one in before | {piece} if self._holds.held_from(one, place, len(place)) > here
        }
        place[piece] = len(place)
        return before, after

    def more_loose(self, piece: int) -> int:
        """Return how many pieces more lie loose if one is taken."""
        before, after = self._left_loose(piece)
        return len(after) - len(before)

    def take(self, piece: int) -> None:
        """Take a piece."""
        before, after = self._left_loose(piece)
        self._loose = self._loose - before | after
        self._place[piece] = len(self.taken)
        self.ready.remove(piece)
        self.taken.append(piece)
        for other in self._later[piece]:
            self._waiting[other] -= 1
            if self._waiting[other] == 0:
                self.ready.append(other)

    def serves(self, served: BoolArray) -> int:
        """Count the pieces that can be taken one after the other from a side."""
        less: dict[int, int] = {}
        front = [piece for piece in self.ready if served[piece]]
        count = 0
        while front and count < _AHEAD:
            count += 1
            for other in self._later[front.pop()]:
                less[other] = less.get(other, 0) + 1
                if less[other] == self._waiting[other] and served[other]:
                    front.append(other)
        return count


#: Of orders whose cost is at most so many times the least, that with the easiest end is taken.
_NEARLY = 1.02
#: One sweep is made for so many pieces.
_PIECES_A_SWEEP = 20
#: Of annealed orders, so many are walked.
_WALKED = 3


@frozen_value
class Order(MeasuredOrder):
    """An order of assembly, with what it costs and what naive orders would.

    Parameters
    ----------
    order : (N,) int array
        Pieces as they are placed.
    effort : (N,) float array
        The effort of each piece of the order, in that order, in units of ``LAY``.
    loose : (N,) int array
        How many pieces lie loose after each.
    by_thread : float
        The effort of the order of the pieces list: one thread after another, along each thread.
    by_number : float
        The effort of the first pieces of all threads, then their second ones, and so on.
    enclosed : bool
        Whether the surface is closed.
    """

    by_thread: float
    by_number: float
    enclosed: bool

    @property
    def saved(self) -> float:
        """The share of the better naive order's effort that is saved."""
        naive = min(self.by_thread, self.by_number)
        return 1.0 - self.total / naive if naive else 0.0


@dataclass(frozen=True)
class _Effort:
    """How hard to search, in counts.

    Parameters
    ----------
    sweeps : (int, int)
        How often every piece is moved: from few pieces to many, where there is farther to go.
    copies : (int, int)
        How many orders are annealed at once, the fewest and the most: so many, that ...
    moves : int
        ... this is how many pieces are moved in all.
    roots : int
        At most so many first pieces are tried.
    """

    sweeps: tuple[int, int]
    copies: tuple[int, int]
    moves: int
    roots: int


def plan_order(
    pieces: Sequence[Piece],
    centres: FloatArray,
    normals: FloatArray,
    fastened: BoolArray,
    *,
    enclosed: bool,
    effort: str,
    seed: int,
    begin: FloatArray | None = None,
) -> Order:
    """Find an order in which every piece is held soon, holds on others and slides below few.

    The effort of an order depends on nothing but which of two pieces that meet comes first (and,
    on a closed surface, on how late pieces slide below others). So orders are grown from flat
    places, and another one from the ground up; copies of them are improved by annealing, where it
    counts, too, how long pieces lie loose. Of all orders that cost the same, that one is taken
    which goes from neighbour to neighbour and turns the object seldom; and of several that end
    nearly alike, that one whose last tenth of the pieces is the easiest.

    Parameters
    ----------
    pieces : sequence of Piece
        All pieces of a job, thread after thread.
    centres : (X, 3) float array
        Where each crossing is in space.
    normals : (X, 3) float array
        Outwards at each crossing.
    fastened : (X,) bool array
        Which crossings take a fastener.
    enclosed : bool
        Whether the surface is closed.
    effort : str
        ``quick``, ``normal`` or ``best``.
    seed : int
        Same seed, same order.
    begin : (3,) float array, optional
        Weave outward from there, and search no further, as basket makers do from a gap.

    Raises
    ------
    InputError
        If there is no such effort.
    """
    efforts = {
        "quick": _Effort((6, 12), (4, 64), 15_000, 3),
        "normal": _Effort((10, 20), (4, 64), 30_000, 6),
        "best": _Effort((40, 40), (16, 64), 300_000, 12),
    }
    if effort not in efforts:
        raise InputError(f"no effort is called {effort!r}: choose one of {', '.join(efforts)}")
    hard = efforts[effort]
    contacts = find_contacts(pieces, fastened)
    middle = np.array([centres[piece.crossings].mean(axis=0) for piece in pieces])
    sweeps = int(np.clip(len(pieces) // _PIECES_A_SWEEP, *hard.sweeps))
    copies = int(np.clip(hard.moves // (sweeps * len(pieces)), *hard.copies))
    served = sides_of_pieces([normals[piece.crossings] for piece in pieces])

    def measured(order: Sequence[int]) -> MeasuredOrder:
        return measure_order(contacts, order, enclosed=enclosed)

    if begin is not None:
        away = [np.linalg.norm(centres[piece.crossings] - begin, axis=1).min() for piece in pieces]
        outward = measured(_grown_up(contacts, np.array(away))[0])
        return _beside_naive(outward, measured, pieces, enclosed=enclosed)
    flat = _flat_roots(pieces, contacts, centres, middle, min(hard.roots, copies - 1))
    starts = [(grow_order(contacts, roots), roots) for roots in flat]
    starts.append(_grown_up(contacts, middle[:, 2]))
    annealed = anneal(
        contacts,
        [starts[copy % len(starts)] for copy in range(copies)],
        enclosed=enclosed,
        sweeps=sweeps,
        seed=seed,
    )
    tried = [
        measured(walk_order(contacts, order, roots, middle, served))
        for order, roots in annealed[:_WALKED]
    ]
    return _beside_naive(_easy_end(tried), measured, pieces, enclosed=enclosed)


def _beside_naive(
    best: MeasuredOrder,
    measured: Callable[[Sequence[int]], MeasuredOrder],
    pieces: Sequence[Piece],
    *,
    enclosed: bool,
) -> Order:
    """Return an order with what naive ones cost."""
    by_thread, by_number = (
        measured(order).total
        for order in (list(range(len(pieces))), order_by_number(pieces).tolist())
    )
    return Order(best.order, best.effort, best.loose, by_thread, by_number, enclosed)


def _grown_up(contacts: Contacts, height: FloatArray) -> tuple[list[int], list[int]]:
    """Return an order from the ground up, in which every new piece meets an old one; its roots."""
    order, roots = [], []
    reached = np.zeros(len(height), dtype=np.bool_)
    for component in range(int(contacts.component.max(initial=-1)) + 1):
        members = np.flatnonzero(contacts.component == component)
        roots.append(int(members[np.argmin(np.round(height[members], 6))]))
        heap = [(0.0, roots[-1])]
        reached[roots[-1]] = True
        while heap:
            piece = heapq.heappop(heap)[1]
            order.append(piece)
            for other, _, _ in contacts.meets[piece]:
                if not reached[other]:
                    reached[other] = True
                    heapq.heappush(heap, (round(float(height[other]), 6), other))
    return order, roots


def _easy_end(tried: Sequence[MeasuredOrder]) -> MeasuredOrder:
    """Return the order whose last pieces are the easiest, of those that cost nearly the least."""
    if not tried:
        none = np.zeros(0, dtype=np.int64)
        return MeasuredOrder(none, np.zeros(0), none)
    least = min(order.cost for order in tried)
    return min(
        (order for order in tried if order.cost <= _NEARLY * least),
        key=lambda order: float(order.effort[-max(1, len(order.effort) // 10) :].sum()),
    )


def order_by_number(pieces: Sequence[Piece]) -> IntArray:
    """Return the naive order of the first pieces of all threads, then the second, and so on."""
    thread = np.array([piece.thread for piece in pieces], dtype=np.int64)
    first = np.searchsorted(thread, thread)
    return np.argsort(np.arange(len(pieces)) - first, kind="stable")


def _flat_roots(
    pieces: Sequence[Piece],
    contacts: Contacts,
    centres: FloatArray,
    middle: FloatArray,
    count: int,
) -> list[list[int]]:
    """Return lists of first pieces, one a component, where the object is flattest.

    Flat is where the crossings of a piece and of those that it meets keep near one plane: by the
    least eigenvalue of their covariance against the others. The first list has the flattest
    pieces; further ones keep far from those before.
    """
    number = len(pieces)
    sizes = np.array([len(piece.crossings) for piece in pieces])
    owner = np.repeat(np.arange(number), sizes)
    points = centres[np.concatenate([piece.crossings for piece in pieces])]
    moments = np.column_stack(
        (
            np.ones(len(points)),
            points,
            (points[:, :, None] * points[:, None, :]).reshape(-1, 9),
        )
    )
    sums = np.zeros((number, 13))
    np.add.at(sums, owner, moments)
    rows = np.repeat(np.arange(number), [len(met) for met in contacts.meets])
    columns = np.array([other for met in contacts.meets for other, _, _ in met], dtype=np.int64)
    graph = sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(number, number))
    around = sums + graph.tocsr() @ sums
    mean = around[:, 1:4] / around[:, :1]
    spread = (around[:, 4:] / around[:, :1]).reshape(-1, 3, 3)
    spread -= mean[:, :, None] * mean[:, None, :]
    least = np.abs(np.linalg.eigvalsh(spread))
    bulge = np.round(least[:, 0] / np.maximum(least.sum(axis=1), 1e-12), 6)

    roots: list[list[int]] = [[] for _ in range(count)]
    for component in range(int(contacts.component.max(initial=-1)) + 1):
        members = np.flatnonzero(contacts.component == component)
        flat = members[np.argsort(bulge[members], kind="stable")]
        flat = flat[: max(count, len(flat) // 4)]
        apart = np.full(len(flat), np.inf)
        for chosen in roots:
            at = int(np.argmax(apart)) if chosen is not roots[0] else 0
            chosen.append(int(flat[at]))
            apart = np.minimum(apart, np.linalg.norm(middle[flat] - middle[flat[at]], axis=1))
    return roots
