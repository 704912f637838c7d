"""Improve an assembly order by annealing: pieces move, one at a time, to other places in it."""

import math
from collections.abc import Sequence
from random import Random

from fabweave.assembly.order.contacts import Contacts
from fabweave.assembly.order.effort import piece_effort, reach

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
