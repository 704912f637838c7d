"""Find the order in which pieces are put together, and compare it with naive ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.piece.piece import Piece
from fabweave.plan.order.annealed import improve_order, sides_of_pieces, walk_order
from fabweave.plan.order.contacts import Contacts, find_contacts
from fabweave.plan.order.greedy import MeasuredOrder, grow_order, measure_order

#: Of orders whose effort is at most so many times the least, that with the easiest end is taken.
_NEARLY = 1.02


@frozen_value
class Order(MeasuredOrder):
    """An order of assembly, with what it costs and what naive orders would.

    Parameters
    ----------
    order : (N,) int array
        Pieces as they are placed.
    effort : (N,) float array
        The effort of each piece of the order, in that order, in units of ``effort.LAY``.
    by_thread : float
        The effort of the order of the pieces list: one thread after another, along each thread.
    by_number : float
        The effort of the first pieces of all threads, then their second ones, and so on.
    """

    by_thread: float
    by_number: float

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
    roots : int
        At most so many first pieces are tried.
    moves : int
        So many moves are shared among them, in whole sweeps over all pieces ...
    least, most : int
        ... of which each has so many.
    """

    roots: int
    moves: int
    least: int
    most: int


def plan_order(
    pieces: Sequence[Piece],
    centres: FloatArray,
    normals: FloatArray,
    *,
    enclosed: bool,
    effort: str,
    seed: int,
) -> Order:
    """Find an order in which every piece holds on others and slides below few.

    The effort of an order depends on nothing but which of two pieces that meet comes first (and,
    on a closed surface, on how late pieces slide below others). So an order is grown from a flat
    place and improved by annealing; of all orders that cost the same, that one is taken which
    goes from neighbour to neighbour and turns the object seldom. Of several such searches that end
    nearly alike, that one counts whose last tenth of the pieces is the easiest.

    Parameters
    ----------
    pieces : sequence of Piece
        All pieces of a job, thread after thread.
    centres : (X, 3) float array
        Where each crossing is in space.
    normals : (X, 3) float array
        Outwards at each crossing.
    enclosed : bool
        Whether the surface is closed.
    effort : str
        ``quick``, ``normal`` or ``best``.
    seed : int
        Same seed, same order.

    Raises
    ------
    InputError
        If there is no such effort.
    """
    efforts = {
        "quick": _Effort(3, 3_000, 6, 20),
        "normal": _Effort(6, 20_000, 6, 30),
        "best": _Effort(12, 120_000, 12, 60),
    }
    if effort not in efforts:
        raise InputError(f"no effort is called {effort!r}: choose one of {', '.join(efforts)}")
    hard = efforts[effort]
    contacts = find_contacts(pieces)
    middle = np.array([centres[piece.crossings].mean(axis=0) for piece in pieces])
    tries = int(np.clip(hard.moves // (hard.least * len(pieces)), 1, hard.roots))
    sweeps = int(np.clip(hard.moves // (tries * len(pieces)), hard.least, hard.most))
    served = sides_of_pieces([normals[piece.crossings] for piece in pieces])
    tried = []
    for number, roots in enumerate(_flat_roots(pieces, contacts, centres, middle, tries)):
        order = improve_order(
            contacts,
            grow_order(contacts, roots),
            roots,
            enclosed=enclosed,
            sweeps=sweeps,
            seed=seed + number,
        )
        walked = walk_order(contacts, order, roots, middle, served)
        tried.append(measure_order(contacts, walked, enclosed=enclosed))
    best = _easy_end(tried)
    naive = [
        measure_order(contacts, order.tolist(), enclosed=enclosed).total
        for order in (np.arange(len(pieces)), order_by_number(pieces))
    ]
    return Order(best.order, best.effort, *naive)


def _easy_end(tried: Sequence[MeasuredOrder]) -> MeasuredOrder:
    """Return the order whose last pieces are the easiest, of those that cost nearly the least."""
    if not tried:
        return MeasuredOrder(np.zeros(0, dtype=np.int64), np.zeros(0))
    least = min(order.total for order in tried)
    return min(
        (order for order in tried if order.total <= _NEARLY * least),
        key=lambda order: float(order.effort[-_tenth(len(order.effort)) :].sum()),
    )


def _tenth(count: int) -> int:
    """Return a tenth of a number of pieces, one at least."""
    return max(1, count // 10)


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
