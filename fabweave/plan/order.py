"""Find the order in which pieces are put together: greedily first, then by annealing."""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from random import Random

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.errors import InputError
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
UNREST = 1.5


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


#: Annealing begins and ends at these differences of effort; it begins with less heat where what
#: lies loose counts, and then looks at so many other places of a piece.
_HOT, _WARM, _COLD = 10.0, 3.0, 0.3
_LOOKED = 2


class _OrderSearch:
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

    def unrest(self, piece: int) -> float:
        """Return what it costs that pieces around one lie loose."""
        place, holds = self.place, self.contacts.holds
        loose = sum(
            [holds.held_from(other, place, 1.0) - place[other] for other in holds.around[piece]]
        )
        return UNREST * loose * self.size[self.component[piece]]

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

    def move(self, piece: int, dice: Random, heat: float, *, calm: bool = False) -> None:
        """Move a piece to a place among those that it meets, by the heat-bath rule.

        Every place is as likely as exp(-effort / heat); none is taken at which a piece would meet
        nothing that is there before it. If ``calm``, what lies loose counts, too, and only a few
        places are looked at.
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
        if calm:
            there = [before > place[contact[0]] for _, contact in met].count(True) - 1
            looked = {there, *dice.sample(range(len(ways)), min(_LOOKED, len(ways)))}
            ways, worth = [ways[k] for k in sorted(looked)], [worth[k] for k in sorted(looked)]
            for k, (_, target, _) in enumerate(ways):
                place[piece] = target
                worth[k] += self.unrest(piece)
            place[piece] = before
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
    calm: bool = False,
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
    calm : bool
        Whether what lies loose counts, too, and not the effort alone.

    Returns
    -------
    list of int
        An order of the same kind.
    """
    dice = Random(seed)  # noqa: S311 - no secret
    search = _OrderSearch(contacts, order, roots, enclosed=enclosed)
    pieces = sorted(set(order) - set(roots))
    hot = _WARM if calm else _HOT
    for sweep in range(sweeps):
        heat = hot * (_COLD / hot) ** (sweep / max(sweeps - 1, 1))
        dice.shuffle(pieces)
        for piece in pieces:
            search.move(piece, dice, heat, calm=calm)
        search.spread(search.order())
    return search.order()


#: Of orders whose cost is at most so many times the least, that with the easiest end is taken.
_NEARLY = 1.02
#: So many orders are annealed again, so that less lies loose: more, the fewer pieces there are.
_AGAIN, _AGAIN_PIECES = 2, 200


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
    fastened: BoolArray,
    *,
    enclosed: bool,
    effort: str,
    seed: int,
) -> Order:
    """Find an order in which every piece is held soon, holds on others and slides below few.

    The effort of an order depends on nothing but which of two pieces that meet comes first (and,
    on a closed surface, on how late pieces slide below others). So an order is grown from a flat
    place and improved by annealing; another one is grown from the ground up. The best of these are
    annealed again, and now it counts, too, how long pieces lie loose. Of all orders that cost the
    same, that one is taken which goes from neighbour to neighbour and turns the object seldom; and
    of several searches that end nearly alike, that one whose last tenth of the pieces is the
    easiest.

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
    contacts = find_contacts(pieces, fastened)
    middle = np.array([centres[piece.crossings].mean(axis=0) for piece in pieces])
    tries = int(np.clip(hard.moves // (hard.least * len(pieces)), 1, hard.roots))
    sweeps = int(np.clip(hard.moves // (tries * len(pieces)), hard.least, hard.most))
    served = sides_of_pieces([normals[piece.crossings] for piece in pieces])

    def measured(order: Sequence[int]) -> MeasuredOrder:
        return measure_order(contacts, order, enclosed=enclosed)

    starts = []
    for number, roots in enumerate(_flat_roots(pieces, contacts, centres, middle, tries)):
        grown = grow_order(contacts, roots)
        order = improve_order(
            contacts, grown, roots, enclosed=enclosed, sweeps=sweeps, seed=seed + number
        )
        starts.append((order, roots))
    starts.sort(key=lambda start: measured(start[0]).cost)
    del starts[max(_AGAIN, _AGAIN_PIECES // len(pieces)) :]
    starts.append(_grown_up(contacts, middle[:, 2]))
    tried = []
    for number, (start, roots) in enumerate(starts):
        order = improve_order(
            contacts,
            start,
            roots,
            enclosed=enclosed,
            sweeps=sweeps,
            seed=seed + number,
            calm=True,
        )
        tried.append(measured(walk_order(contacts, order, roots, middle, served)))
    best = _easy_end(tried)
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
