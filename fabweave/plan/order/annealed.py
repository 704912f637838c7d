"""Improve an assembly order by annealing: pieces move, one at a time, to other places in it."""

import math
from collections.abc import Sequence
from itertools import product
from random import Random

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.plan.order.contacts import Contacts
from fabweave.plan.order.effort import piece_effort, reach

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


#: Annealing begins and ends at these differences of effort.
_HOT, _COLD = 10.0, 0.3


class _Search:
    """An order under change: each piece has a place between 0 and 1 in its component.

    What a piece costs depends on nothing but its place and which of the pieces that it meets come
    before it, so a move changes the costs of the piece and of those that it meets only.
    """

    def __init__(
        self, contacts: Contacts, order: Sequence[int], roots: Sequence[int], *, enclosed: bool
    ) -> None:
        self.contacts = contacts
        self.enclosed = enclosed
        self.component = contacts.component.tolist()
        self.size = [0] * (max(self.component, default=-1) + 1)
        for number in self.component:
            self.size[number] += 1
        self.place = [0.0] * len(order)
        self.factor = [1.0] * len(order)
        self.spread(order)
        # Efforts that were worked out once, for each number of stations.
        known: dict[int, dict[int, tuple[float, float]]] = {n: {} for n in contacts.n_stations}
        self.known = [known[n] for n in contacts.n_stations]
        self.state = list(contacts.alone)
        self.before = [0] * len(order)
        for piece, met in enumerate(contacts.meets):
            for other, here, _ in met:
                if self.place[other] < self.place[piece]:
                    self.state[piece] ^= here
                    self.before[piece] += 1
        for root in roots:
            self.before[root] = len(order)  # it needs nothing before it

    def order(self) -> list[int]:
        """Return the pieces in order, component after component."""
        return sorted(
            range(len(self.place)), key=lambda piece: (self.component[piece], self.place[piece])
        )

    def spread(self, order: Sequence[int]) -> None:
        """Give the pieces of each component evenly spread places, without changing their order."""
        done = [0] * len(self.size)
        for piece in order:
            number = self.component[piece]
            done[number] += 1
            self.put(piece, done[number] / (self.size[number] + 1))

    def put(self, piece: int, place: float) -> None:
        """Give a piece a place."""
        self.place[piece] = place
        if self.enclosed:
            self.factor[piece] = reach(place)

    def effort(self, piece: int, state: int) -> tuple[float, float]:
        """Work an effort out, and keep it."""
        effort = self.known[piece][state] = piece_effort(self.contacts.n_stations[piece], state)
        return effort

    def move(self, piece: int, dice: Random, heat: float) -> None:
        """Move a piece to a place among those that it meets, by the heat-bath rule.

        Every place is as likely as exp(-effort / heat); none is taken at which a piece would meet
        nothing that is there before it.
        """
        place, state, known, factor = self.place, self.state, self.known, self.factor
        met = sorted([(place[contact[0]], contact) for contact in self.contacts.meets[piece]])
        before, last = place[piece], len(met)
        # First the piece comes before all that it meets, then after one of them more each time.
        total, steps, bare = 0.0, [0.0], []
        for at, (where, (other, _, there)) in enumerate(met):
            after = before < where
            if self.before[other] == after:  # nothing else is there before it
                last = min(last, at)
            without = state[other] ^ there if after else state[other]
            bare.append(without)
            efforts = known[other]
            a = efforts.get(without) or self.effort(other, without)
            b = efforts.get(without ^ there) or self.effort(other, without ^ there)
            total += a[0] - b[0] + factor[other] * (a[1] - b[1])
            steps.append(total)
        share = 0.25 + dice.random() / 2  # two pieces never have one place
        mine, efforts = self.contacts.alone[piece], known[piece]
        ways, worth = [], []
        for at in range(1, last + 1):
            low, (_, here, _) = met[at - 1]
            mine ^= here
            target = low + ((met[at][0] if at < len(met) else 1.0) - low) * share
            a = efforts.get(mine) or self.effort(piece, mine)
            ways.append((at, target, mine))
            worth.append(steps[at] + a[0] + (reach(target) if self.enclosed else 1.0) * a[1])
        best = min(worth)
        chosen, target, mine = dice.choices(ways, [math.exp((best - x) / heat) for x in worth])[0]
        for at, (where, (other, _, there)) in enumerate(met):
            self.before[other] += (at >= chosen) - (before < where)
            state[other] = bare[at] ^ there if at >= chosen else bare[at]
        self.before[piece] = chosen
        state[piece] = mine
        self.put(piece, target)


def improve_order(
    contacts: Contacts,
    order: Sequence[int],
    roots: Sequence[int],
    *,
    enclosed: bool,
    sweeps: int,
    seed: int,
) -> list[int]:
    """Improve an order by annealing; the first piece of each component stays the first.

    Parameters
    ----------
    contacts : Contacts
        What the pieces meet.
    order : sequence of int
        An order in which every piece but the roots meets one before it.
    roots : sequence of int
        The first piece of each component.
    enclosed : bool
        Whether the surface is closed.
    sweeps : int
        How often every piece is moved.
    seed : int
        Same seed, same order.

    Returns
    -------
    list of int
        An order of the same kind.
    """
    dice = Random(seed)  # noqa: S311 - no secret
    search = _Search(contacts, order, roots, enclosed=enclosed)
    pieces = sorted(set(order) - set(roots))
    for sweep in range(sweeps):
        heat = _HOT * (_COLD / _HOT) ** (sweep / max(sweeps - 1, 1))
        dice.shuffle(pieces)
        for piece in pieces:
            search.move(piece, dice, heat)
        search.spread(search.order())
    return search.order()
