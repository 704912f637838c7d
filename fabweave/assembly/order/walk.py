"""Go through an order from neighbour to neighbour, and turn the object seldom on the way."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from fabweave.assembly.order.contacts import Contacts
from fabweave.core.arrays import BoolArray, FloatArray

#: How much nearness to the first piece counts against nearness to the piece before.
_HOMEWARD = 0.5
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

    As long as a side of the object serves, pieces are taken that are placed from there; then it is
    turned to the side from which most can be placed one after the other.

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
    side = 0
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
            last = int(here[np.argmin(np.round(far, 6))])
            walk.take(last)
    return walk.taken


class _Walk:
    """Pieces as they are taken: those are ready that wait for no other."""

    def __init__(self, contacts: Contacts, order: Sequence[int]) -> None:
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order))
        ranks = rank.tolist()
        self._later = [
            [other for other, _, _ in met if ranks[other] > ranks[piece]]
            for piece, met in enumerate(contacts.meets)
        ]
        self._waiting = [
            sum(ranks[other] < ranks[piece] for other, _, _ in met)
            for piece, met in enumerate(contacts.meets)
        ]
        self.ready: list[int] = []
        self.taken: list[int] = []

    def take(self, piece: int) -> None:
        """Take a piece."""
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
