"""Grow a first assembly order from a seed, and measure any order."""

import heapq
from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.plan.order.contacts import Contacts
from fabweave.plan.order.effort import THREAD, piece_effort, reach


@frozen_value
class MeasuredOrder:
    """An order and what it costs.

    Parameters
    ----------
    order : (N,) int array
        Pieces as they are placed.
    effort : (N,) float array
        The effort of each piece of the order, in that order.
    """

    order: IntArray
    effort: FloatArray

    @property
    def total(self) -> float:
        """The effort of the whole."""
        return float(self.effort.sum())


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
    rank = {piece: at for at, piece in enumerate(order)}
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
    return MeasuredOrder(np.array(order, dtype=np.int64), np.array(effort))


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
