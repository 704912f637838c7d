"""Improve orders of assembly by annealing, many copies at once.

In a copy, each piece has a place between 0 and 1 in its component. What a piece costs depends on
nothing but its place, which of the pieces that it meets come before it, and when they hold it: so
pieces that meet no common piece are moved at the same time, in all copies. Arrays have a column for
each of these pieces, and for each copy: (..., K, C).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.colouring import colour
from fabweave.plan.effort import (
    CLOSE,
    DRAG,
    JOIN,
    LAY,
    LOOSE,
    PULL,
    REACH,
    THREAD,
    TUCK,
    UNREST,
    Contacts,
    StationBits,
)
from fabweave.plan.loose import ranks

#: Annealing begins and ends at these differences of cost.
_HOT, _COLD = 5.0, 0.3
#: After so many sweeps, cheap copies displace dear ones.
_DISPLACED = 2
#: So many columns at most are worked on at once: their arrays stay in the cache of a processor.
_COLUMNS = 512
#: What the effort of a piece is made of, summed over all that is in place before it: laying over
#: and closing; joining and sliding below; strands above its first and its last half; things met.
_PLAIN, _BEHIND, _FIRST, _LAST, _MET = range(5)
_LOOSE = np.array([*LOOSE, 0.0])
#: Places after and before all others.
_LAST_PLACE, _FIRST_PLACE = 2.0, -1.0


class _Rows:
    """Lists of numbers, and an empty one at the end."""

    def __init__(self, rows: Iterable[Sequence[int]]) -> None:
        kept = [*rows, ()]
        self._length = np.array([len(row) for row in kept], dtype=np.int64)
        self._start = np.cumsum(self._length) - self._length
        self._values = np.array([value for row in kept for value in row], dtype=np.int64)

    def of(self, numbers: IntArray, fill: int) -> IntArray:
        """Return the rows of numbers (...) as an array (W, ...); numbers past the end have none."""
        numbers = np.minimum(numbers, len(self._length) - 1)
        length, start = self._length[numbers], self._start[numbers]
        at = np.arange(max(1, int(length.max(initial=0)))).reshape(-1, *[1] * length.ndim)
        table = np.full((len(at), *length.shape), fill, dtype=np.int64)
        there = at < length
        table[there] = self._values[(start + at)[there]]
        return table

    def matrix(self, width: int) -> sparse.csr_array:
        """Return which row has which number, (rows, width)."""
        ones = np.ones(len(self._values), dtype=np.int32)
        shape = len(self._start) - 1, width
        return sparse.csr_array((ones, self._values, self._start), shape=shape)


@frozen_value
class Things:
    """What pieces slide below, lie over or join: each is there once one of its pieces is.

    Parameters
    ----------
    owner : (T,) int array
        The piece that slides below it, lies over it or joins it.
    first, second : (T,) int arrays
        The pieces that it is of: N for none, N + 1 for what is there from the start.
    weight : (T, 5) float array
        What it adds to the cost of its owner, see ``thing_cost``.
    """

    owner: IntArray
    first: IntArray
    second: IntArray
    weight: FloatArray


def find_things(contacts: Contacts) -> Things:
    """Find what each piece meets, thing by thing.

    A piece pays ``CLOSE`` if both its mates are there: for either one, less that for any.
    """
    never, always = len(contacts.n_stations), len(contacts.n_stations) + 1
    rows: list[tuple[int, int, int, tuple[float, ...]]] = []
    for owner, (count, alone) in enumerate(zip(contacts.n_stations, contacts.alone, strict=True)):
        bits = StationBits(count)
        carriers: dict[tuple[str, int], list[int]] = {}
        states = [(always, alone), *((at, here) for at, here, _ in contacts.meets[owner])]
        for other, state in states:
            for thing in bits.read(state):
                of = carriers.setdefault(thing, [])
                if other not in of:
                    of.append(other)
        for thing, of in carriers.items():
            rows.append((owner, of[0], of[1] if len(of) > 1 else never, _weight(count, *thing)))
        mates = [of[0] for (kind, _), of in carriers.items() if kind == "mate"]
        if len(mates) == 2:
            closing = (CLOSE, 0.0, 0.0, 0.0, 0.0)
            rows += [(owner, mate, never, closing) for mate in mates]
            other = mates[1] if mates[1] != mates[0] else never
            rows.append((owner, mates[0], other, tuple(-part for part in closing)))
    table = np.array([row[:3] for row in rows], dtype=np.int64).reshape(-1, 3)
    weight = np.array([row[3] for row in rows], dtype=np.float64).reshape(-1, 5)
    return Things(table[:, 0], table[:, 1], table[:, 2], weight)


def _weight(n_stations: int, kind: str, station: int) -> tuple[float, ...]:
    if kind == "over":
        return LAY, 0.0, 0.0, 0.0, 1.0
    if kind == "mate":
        return 0.0, JOIN, 0.0, 0.0, 1.0
    last = station >= (n_stations + 1) // 2
    away = n_stations - 1 - station if last else station
    # Of k strands, the j-th one is dragged below j: k * k / 2 in all, less a half for each.
    below = (THREAD + PULL * away if away else TUCK) - DRAG / 2
    return 0.0, below, float(not last), float(last), 1.0


def thing_cost(sums: FloatArray, factor: FloatArray | float) -> FloatArray:
    """Return the effort of pieces, as ``piece_effort`` has it, from what things add to it.

    Parameters
    ----------
    sums : (5, ...) float array
        The weights of all things that are there.
    factor : (...) float array or float
        What reaching multiplies sliding below and joining by.
    """
    behind = sums[_FIRST] * sums[_FIRST]
    behind += sums[_LAST] * sums[_LAST]
    behind *= DRAG / 2
    behind += sums[_BEHIND]
    behind *= factor
    behind += sums[_PLAIN]
    behind += _LOOSE.take(sums[_MET].astype(np.int64), mode="clip")
    return behind


class _Tables:
    """What all classes are arranged from."""

    def __init__(self, contacts: Contacts) -> None:
        things = find_things(contacts)
        count = len(contacts.n_stations)
        self.count, self.never, self.always, self.things = count, count, count + 1, things
        self.weight = np.vstack((things.weight, np.zeros(5)))
        self.met = _Rows([other for other, _, _ in met] for met in contacts.meets)
        pair = {
            key: number
            for number, key in enumerate(
                (piece, other) for piece, met in enumerate(contacts.meets) for other, _, _ in met
            )
        }
        brought: list[list[int]] = [[] for _ in pair]
        beside: list[list[int]] = [[] for _ in pair]
        ways = zip(
            things.owner.tolist(), things.first.tolist(), things.second.tolist(), strict=True
        )
        for thing, (owner, first, second) in enumerate(ways):
            for carrier, other in ((first, second), (second, first)):
                if carrier < count:
                    brought[pair[carrier, owner]].append(thing)
                    beside[pair[carrier, owner]].append(other)
        self.pair = _Rows([pair[piece, other] for other, _, _ in met]
                          for piece, met in enumerate(contacts.meets))  # fmt: skip
        self.back = np.array([pair[other, piece] for piece, other in pair] + [len(pair)])
        self.brought, self.beside = _Rows(brought), _Rows(beside)
        # What is there from the start counts always.
        self.alone = np.zeros((count, 5))
        from_start = things.first == self.always
        np.add.at(self.alone, things.owner[from_start], things.weight[from_start])

        holds = contacts.holds
        self.around = _Rows((piece, *(other for other in around if other != piece))
                            for piece, around in enumerate(holds.around))  # fmt: skip
        ends = [end for both in holds.ends for end in both]
        self.trapped = _Rows(
            side
            for _, over, under in ends
            for side in ((over, under) if over and under else ((), ()))
        )
        number = {crossing: at for at, crossing in enumerate(holds.layers)}
        self.ties = _Rows([number[crossing] for crossing in ties] for ties, _, _ in ends)
        self.layers, self.untied = _Rows(holds.layers.values()), len(number)
        self.component = contacts.component
        self.size = np.bincount(contacts.component)

    def apart(self) -> IntArray:
        """Return a class for each piece: two of a class meet no common piece."""
        near = self.met.matrix(self.count) + self.around.matrix(self.count)
        return colour((near @ near).tocsr())


class _Held:
    """From which place on pieces are held, as ``Holds.held_from`` has it.

    Parameters
    ----------
    tables : _Tables
    pieces : (..., K) int array
        N for none.
    moved : (K,) int array, optional
        A piece each, which is put first, and then last: places have one more axis at the front.
    """

    def __init__(self, tables: _Tables, pieces: IntArray, moved: IntArray | None = None) -> None:
        ends = np.stack((2 * pieces, 2 * pieces + 1))
        trapped = tables.trapped.of(np.stack((2 * ends, 2 * ends + 1)), tables.never)
        ties = tables.ties.of(ends, tables.untied)
        tied = tables.layers.of(ties, tables.always)
        tied[:, ties == tables.untied] = tables.never
        self._ends = 0
        if moved is not None:
            self._ends = 1
            trapped, tied = (
                np.stack(
                    [np.where(of == moved, end, of) for end in (tables.always, tables.never)], 2
                )
                for of in (trapped, tied)
            )
        self._trapped, self._tied = trapped, tied

    def __call__(self, place: FloatArray) -> FloatArray:
        """Return the places from which on pieces are held but for their own, (..., K, C)."""
        ends = place.take(self._trapped, axis=0).min(axis=0).max(axis=0)
        ties = place.take(self._tied, axis=0).max(axis=0).min(axis=0)
        held: FloatArray = np.minimum(ends, ties, out=ends).max(axis=self._ends)
        return held


class _Class:
    """Pieces that are moved at the same time, K, and what they meet: D pieces, or as many.

    ``met`` are the pieces (D, K). To each, a piece brings M things, of ``weight`` (M, 5, D, K, 1);
    ``beside`` (M, D, K) are the other pieces that they are of. What they bring to the piece is
    ``taken`` and ``taken_beside``.
    """

    def __init__(self, tables: _Tables, pieces: IntArray) -> None:
        self.pieces = pieces
        self.met = tables.met.of(pieces, tables.never)
        pairs = tables.pair.of(pieces, len(tables.back) - 1)
        back = tables.back[pairs]
        self.beside = tables.beside.of(pairs, tables.never)
        self.taken_beside = tables.beside.of(back, tables.never)
        self.weight, self.taken = (
            np.ascontiguousarray(np.moveaxis(tables.weight[tables.brought.of(one, -1)], -1, 1))[
                ..., None
            ]
            for one in (pairs, back)
        )
        self.alone = tables.alone[pieces].T[:, None, :, None]
        self.around = tables.around.of(pieces, tables.never)
        self.held, self.held_now = _Held(tables, self.around, pieces), _Held(tables, pieces)
        self.missing = self.around == tables.never
        self.unrest = UNREST * tables.size[tables.component[pieces]][:, None]


@dataclass(eq=False)
class Copies:
    """Copies of an order under change.

    Parameters
    ----------
    place : (N + 2, C) float array
        Where each piece is; then a place after, and one before all others.
    sums : (5, N + 2, C) float array
        The weights of all things that are there when each piece comes.
    needed : (N + 2, C) float array
        How many things must be more than there before each piece; less than any for roots.
    root : (N, C) bool array
        Which pieces stay where they are.
    """

    place: FloatArray
    sums: FloatArray
    needed: FloatArray
    root: BoolArray

    def take(self, copies: IntArray) -> None:
        """Keep some copies, and some more than once."""
        for name, array in vars(self).items():
            setattr(self, name, np.ascontiguousarray(array[..., copies]))


class OrderSearch:
    """Copies of orders, and what moving their pieces costs.

    Parameters
    ----------
    contacts : Contacts
        What the pieces meet.
    orders : sequence of sequences of int
        An order for each copy, in which every piece but the roots meets one before it.
    roots : sequence of sequences of int
        For each copy, the first piece of each component, which stays the first.
    enclosed : bool
        Whether the surface is closed.
    """

    def __init__(
        self,
        contacts: Contacts,
        orders: Sequence[Sequence[int]],
        roots: Sequence[Sequence[int]],
        *,
        enclosed: bool,
    ) -> None:
        self.tables = tables = _Tables(contacts)
        self._enclosed = enclosed
        count, width = tables.count, len(orders)
        apart, some = tables.apart(), max(1, _COLUMNS // width)
        classes = [np.flatnonzero(apart == number) for number in range(int(apart.max()) + 1)]
        self.classes = [
            _Class(tables, own[at : at + some])
            for own in classes
            for at in range(0, len(own), some)
        ]
        place = np.full((count + 2, width), _LAST_PLACE)
        place[tables.always] = _FIRST_PLACE
        place[:count] = np.array([ranks(order) for order in orders]).T
        needed = np.repeat(np.append(tables.alone[:, _MET], (0.0, 0.0))[:, None], width, axis=1)
        root = np.zeros((count, width), dtype=np.bool_)
        for copy, own in enumerate(roots):
            needed[own, copy], root[own, copy] = -1.0, True
        self.copies = Copies(place, np.zeros((5, count + 2, width)), needed, root)
        self.spread()
        self.copies.sums = self.sums()

    def sums(self) -> FloatArray:
        """Work out afresh the weights of all things that are there when each piece comes."""
        place, things = self.copies.place, self.tables.things
        there = np.minimum(place[things.first], place[things.second]) < place[things.owner]
        result = np.zeros((5, *place.shape))
        for weight, own in zip(things.weight.T, result, strict=True):
            np.add.at(own, things.owner, weight[:, None] * there)
        return result

    def costs(self) -> FloatArray:
        """Return what the order of each copy costs, (C,), with places for counts of pieces."""
        count, place = self.tables.count, self.copies.place
        cost = thing_cost(self.copies.sums[:, :count], self._factor(place[:count])).sum(axis=0)
        for own in self.classes:
            here = place[own.pieces]
            held = np.clip(own.held_now(place), here, 1.0)
            cost += (own.unrest * (held - here)).sum(axis=0)
        return np.asarray(cost)

    def orders(self) -> IntArray:
        """Return the pieces in order, component after component, (N, C)."""
        place = self.copies.place[: self.tables.count]
        component = np.broadcast_to(self.tables.component[:, None], place.shape)
        return np.lexsort((place, component), axis=0)

    def spread(self) -> None:
        """Give the pieces of each component evenly spread places, without changing their order."""
        size = self.tables.size
        even = np.concatenate([np.arange(1, own + 1) / (own + 1) for own in size.tolist()] or [[]])
        place = self.copies.place[: self.tables.count]
        np.put_along_axis(place, self.orders(), np.repeat(even[:, None], place.shape[1], 1), axis=0)

    def _factor(self, place: FloatArray) -> FloatArray | float:
        return 1.0 + REACH * np.maximum(0.0, 2.0 * place - 1.0) if self._enclosed else 1.0

    def ways(self, of: _Class, share: FloatArray) -> "Ways":
        """Return to what places pieces could go, after each piece that they meet, and the cost.

        Parameters
        ----------
        of : _Class
            The pieces.
        share : (K, C) float array
            Of the room to the next piece, so much is left before a piece.
        """
        place, sums = self.copies.place, self.copies.sums
        there, here = place.take(of.met, axis=0), place.take(of.pieces, axis=0)
        before = here < there
        # Where another piece brings a thing as well, and sooner, nothing depends on this one.
        brings = _weigh(of.weight, place.take(of.beside, axis=0) >= there)
        without = sums.take(of.met, axis=1) - brings * before
        factor = self._factor(there)
        spared = thing_cost(without + brings, factor) - thing_cost(without, factor)
        takes = _weigh(of.taken, place.take(of.taken_beside, axis=0) >= there)

        # First the piece comes after one of those that it meets, then after one more each time.
        columns = np.arange(here.size).reshape(here.shape)
        by = np.argsort(there, axis=0) * here.size + columns
        after = there.ravel().take(by)
        own = np.cumsum(takes.reshape(5, -1).take(by, axis=1), axis=1) + of.alone
        room = np.minimum(np.append(after[1:], np.ones_like(after[:1]), axis=0), 1.0) - after
        target = after + room * share
        cost = thing_cost(own, self._factor(target))
        cost -= np.cumsum(spared.ravel().take(by), axis=0)
        cost += of.unrest * self._loose(of, target)
        alone = (without[_MET] <= self.copies.needed.take(of.met, axis=0)) & before
        cost[after >= np.where(alone, there, 1.0).min(axis=0)] = np.inf
        return Ways(there, before, brings, target, own, cost)

    def _loose(self, of: _Class, target: FloatArray) -> FloatArray:
        """Return for how long pieces around lie loose, less what does not depend on the target.

        A place from which on a piece is held is made of least and greatest places of others, so as
        a function of any one place it is that place, kept between two bounds.
        """
        least = self.copies.place.take(of.around, axis=0)
        least[0] = _FIRST_PLACE
        low, high = np.clip(of.held(self.copies.place), least, 1.0)
        high[0] = 1.0
        low[of.missing] = high[of.missing] = 0.0
        held = np.maximum(target, low[:, None])
        return np.minimum(held, high[:, None], out=held).sum(axis=0) - target

    def move(self, of: _Class, heat: float, rng: np.random.Generator) -> None:
        """Move pieces to places among those that they meet, by the heat-bath rule.

        Every place is as likely as exp(-cost / heat); none is taken at which a piece would meet
        nothing that is there before it.
        """
        shape = len(of.pieces), self.copies.place.shape[1]
        ways = self.ways(of, 0.25 + rng.random(shape) / 2)  # two pieces never have one place
        luck = np.log(rng.standard_exponential(ways.cost.shape))
        self.go(of, ways, np.argmin(ways.cost / heat + luck, axis=0))

    def go(self, of: _Class, ways: "Ways", chosen: IntArray) -> None:
        """Move pieces each to one of its ways, (K, C); roots, and what has no way, stay."""
        columns = np.arange(chosen.size).reshape(chosen.shape)
        at = chosen * chosen.size + columns
        stay = self.copies.root[of.pieces] | np.isinf(ways.cost.ravel().take(at))
        place, sums = self.copies.place, self.copies.sums
        target = np.where(stay, place[of.pieces], ways.target.ravel().take(at))
        change = (target < ways.there).astype(np.int8) - ways.before
        # Only what stands for no piece is met twice here, and its sums do not count.
        sums[:, of.met] += ways.brings * change
        own = ways.own.reshape(5, -1).take(at, axis=1)
        sums[:, of.pieces] = np.where(stay, sums[:, of.pieces], own)
        place[of.pieces] = target

    def displace(self, before: float, after: float, rng: np.random.Generator) -> None:
        """Let cheap copies displace dear ones, as cooling from one heat to another would have it.

        Each copy is taken as often as its chance grows, rounded up or down at random.
        """
        costs = self.costs()
        share = np.exp((costs.min() - costs) * (1 / after - 1 / before))
        drawn = (np.arange(len(costs)) + rng.random()) / len(costs)
        taken = np.searchsorted(np.cumsum(share / share.sum()), drawn)
        self.copies.take(np.minimum(taken, len(costs) - 1))


@dataclass(frozen=True, eq=False)
class Ways:
    """Where pieces can go: after each of the pieces that they meet, in order of these.

    Parameters
    ----------
    there, before : (D, K, C) float and bool arrays
        Where the pieces are that are met, and which come after the pieces that meet them.
    brings : (5, D, K, C) float array
        What a piece adds to the sums of those that it meets, if it comes first.
    target : (D, K, C) float array
        The places, in order.
    own : (5, D, K, C) float array
        The sums of the pieces there.
    cost : (D, K, C) float array
        What they cost, up to a constant; without end where one of them would meet nothing.
    """

    there: FloatArray
    before: BoolArray
    brings: FloatArray
    target: FloatArray
    own: FloatArray
    cost: FloatArray


def _weigh(weight: FloatArray, counts: BoolArray) -> FloatArray:
    """Return the sum of the weights (M, 5, D, K, 1) of what counts (M, D, K, C)."""
    result: FloatArray = weight[0] * counts[0]
    for one, there in zip(weight[1:], counts[1:], strict=True):
        result += one * there
    return result


def anneal(
    contacts: Contacts,
    starts: Sequence[tuple[Sequence[int], Sequence[int]]],
    *,
    enclosed: bool,
    sweeps: int,
    seed: int,
) -> list[tuple[list[int], list[int]]]:
    """Improve orders by annealing; the first piece of each component stays the first.

    Parameters
    ----------
    contacts : Contacts
        What the pieces meet.
    starts : sequence of pairs of sequences of int
        For each copy an order in which every piece but the roots meets one before it; and the
        roots, the first piece of each component.
    enclosed : bool
        Whether the surface is closed.
    sweeps : int
        How often every piece is moved.
    seed : int
        Same seed, same orders.

    Returns
    -------
    list of pairs of lists of int
        As many of the same kind, from the cheapest on.
    """
    rng = np.random.default_rng(seed)
    search = OrderSearch(
        contacts, [order for order, _ in starts], [roots for _, roots in starts], enclosed=enclosed
    )
    heats = np.geomspace(_HOT, _COLD, sweeps).tolist()
    for sweep, heat in enumerate(heats):
        for number in rng.permutation(len(search.classes)).tolist():
            search.move(search.classes[number], heat, rng)
        search.spread()
        if sweep % _DISPLACED == _DISPLACED - 1 and sweep + 1 < sweeps:
            search.displace(heat, heats[min(sweep + _DISPLACED, sweeps - 1)], rng)
    orders, root = search.orders().T, search.copies.root.T
    return [
        (orders[copy].tolist(), orders[copy][root[copy][orders[copy]]].tolist())
        for copy in np.argsort(search.costs(), kind="stable").tolist()
    ]
