"""Cut a row or a ring of sites into pieces of least total cost, exactly."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.piece.split.candidates import Sites
from fabweave.piece.split.preferences import AVOIDED_MM2
from fabweave.piece.split.repeats import Repeats
from fabweave.weave.threads import Threads


def neighbours(threads: Threads) -> IntArray:
    """Return the crossings within two steps along strands of each crossing, (X, 20).

    The four next crossings along the two strands, and the four next to each of these. Where there
    are fewer, the crossing itself fills the row.
    """
    beside = _beside(threads)
    return np.concatenate((beside, beside[beside].reshape(len(beside), -1)), axis=1)


def _beside(threads: Threads) -> IntArray:
    """Return the next crossings along both strands, (X, 4)."""
    count = len(threads.crossing)
    thread = threads.thread_of_pass
    first, after_last = threads.offsets[:-1][thread], threads.offsets[1:][thread]
    following, before = np.arange(1, count + 1), np.arange(-1, count - 1)
    # Rings go on; open threads stop where they are.
    final, begin = following == after_last, before < first
    following[final] = np.where(threads.closed[thread], first, following - 1)[final]
    before[begin] = np.where(threads.closed[thread], after_last - 1, before + 1)[begin]
    order = np.argsort(threads.crossing, kind="stable").reshape(-1, 2)
    steps = np.stack((following[order], before[order]), axis=2).reshape(len(order), 4)
    return np.asarray(threads.crossing[steps])


class Joints:
    """Count the joints at each crossing and around it while threads are cut one after another."""

    def __init__(
        self,
        threads: Threads,
        near_mm2: float,
        usable: BoolArray | None,
        around: IntArray | None = None,
    ) -> None:
        """Begin without any joint."""
        #: The crossings beside each, and itself: those within two steps, (X, 20), if not given.
        self.around = neighbours(threads) if around is None else around
        #: What a joint costs more for each other one beside it.
        self.near_mm2 = near_mm2
        self._at = np.zeros(threads.n_crossings, dtype=np.int64)
        self._near = np.zeros(threads.n_crossings, dtype=np.int64)
        self._narrow = np.where(self._at < 0 if usable is None else ~usable, AVOIDED_MM2, 0.0)

    def add(self, crossings: IntArray, times: int = 1) -> None:
        """Add joints; or take them away with ``times=-1``."""
        np.add.at(self._at, crossings, times)
        np.add.at(self._near, self.around[crossings], times)

    def costs(self, crossings: IntArray) -> FloatArray:
        """Return what it costs, apart from the joint itself, to put a joint at each crossing."""
        taken = np.where(self._at[crossings] > 0, AVOIDED_MM2, 0.0)
        return np.asarray(taken + self._narrow[crossings] + self.near_mm2 * self._near[crossings])


def cheapest_row(cost: FloatArray) -> tuple[float, IntArray]:
    """Cut a row of sites from its first to its last at least cost.

    Parameters
    ----------
    cost : (N, D) float array
        ``cost[i, d]`` is that of the piece from site ``i`` to site ``i + 1 + d``; infinite where
        there can be none. What lies past the last site is ignored.

    Returns
    -------
    total : float
        The least sum, infinite if the row cannot be cut.
    cuts : (K,) int array
        The sites where pieces begin, from 0 on; empty if the row cannot be cut. Of equally cheap
        pieces the shortest is taken.

    Examples
    --------
    >>> inf = np.inf
    >>> total, cuts = cheapest_row(np.array([[5.0, 7.0], [1.0, 9.0], [3.0, 1.0], [inf, inf]]))
    >>> total, cuts.tolist()
    (9.0, [0, 1, 2])
    """
    if not np.isfinite(cost).any():
        return np.inf, np.zeros(0, dtype=np.int64)
    totals, before = _relax(cost, np.zeros(1, dtype=np.int64))
    return float(totals[-1, 0]), _trace(before[:, 0], 0)


def cheapest_ring(cost: FloatArray) -> tuple[float, IntArray]:
    """Cut a ring of sites into pieces of least total cost, opened at the best site.

    Some piece holds the first site, or begins there. So every way to cut the ring begins a piece
    at one of the sites from which a piece reaches the first one, and each of those openings is
    solved as a row, all at once. Of all sites, the one that the fewest pieces hold is taken as
    the first.

    Parameters
    ----------
    cost : (N, D) float array
        ``cost[i, d]`` is that of the piece from site ``i`` to site ``i + 1 + d``, counted around
        the ring; infinite where there can be none. With ``d = N - 1`` the piece is the whole ring.

    Returns
    -------
    total : float
        The least sum, infinite if the ring cannot be cut.
    cuts : (K,) int array
        The sites where pieces begin, ascending; empty if the ring cannot be cut.

    Examples
    --------
    >>> inf = np.inf
    >>> total, cuts = cheapest_ring(np.array([[5.0, 2.0], [1.0, 9.0], [3.0, 1.0], [8.0, 4.0]]))
    >>> total, cuts.tolist()
    (3.0, [0, 2])
    """
    count, width = cost.shape
    width = min(width, count)
    feasible = np.isfinite(cost[:, :width])
    if not feasible.any():
        return np.inf, np.zeros(0, dtype=np.int64)
    # Each site is held by the pieces that begin at it or end behind it.
    reach = np.where(feasible, np.arange(1, width + 1), 0).max(axis=1)
    change = np.zeros(2 * count + 1, dtype=np.int64)
    np.add.at(change, np.arange(count), 1)
    np.add.at(change, np.arange(count) + np.maximum(reach, 1), -1)
    held = np.cumsum(change)[: 2 * count].reshape(2, count).sum(axis=0)
    first = int(np.argmin(held))
    back = np.arange(width)
    openings = back[reach[(first - back) % count] > back]
    if not len(openings):
        return np.inf, np.zeros(0, dtype=np.int64)
    # A row that goes around from the earliest opening to the latest one, one lap later.
    early = int(openings[-1])
    begin = first - early
    row = cost[(begin + np.arange(count + early + 1)) % count, :width]
    starts = early - openings
    totals, before = _relax(row, starts)
    laps = totals[starts + count, np.arange(len(starts))]
    best = int(np.argmin(laps))
    if not np.isfinite(laps[best]):
        return np.inf, np.zeros(0, dtype=np.int64)
    start = int(starts[best])
    cuts = _trace(before[: start + count + 1, best], start)
    return float(laps[best]), np.sort((cuts + begin) % count)


def cheapest_repeats(cost: FloatArray, period: int) -> tuple[float, IntArray]:
    """Cut a ring into pieces of two lengths at most, of whole periods each, at least cost.

    All pieces begin at the same site of a period, so that they are of two kinds at most where the
    ring repeats itself.

    Parameters
    ----------
    cost : (N, D) float array
        As of :func:`cheapest_ring`. Where costs differ from period to period, the greatest counts.
    period : int
        After so many sites the ring repeats itself, a divisor of their number.

    Returns
    -------
    total, cuts
        As of :func:`cheapest_ring`.

    Examples
    --------
    Three periods of two sites: two pieces of four and of two are cheaper than three of two.

    >>> cost = np.tile([[9.0, 4.0, 9.0, 6.0], [9.0, 5.0, 9.0, 2.0]], (3, 1))
    >>> total, cuts = cheapest_repeats(cost, 2)
    >>> total, cuts.tolist()
    (7.0, [1, 3])
    """
    most = len(cost) // period
    # The greatest of all periods: row by row the site of a period, column by column the length.
    each = cost.reshape(most, period, -1)[:, :, period - 1 :: period].max(axis=0)[:, :most]
    if not np.isfinite(each).any():
        return np.inf, np.zeros(0, dtype=np.int64)
    length, times, other, more = _two_lengths(most, each.shape[1])
    # What is not there costs nothing, even where it could not be.
    rest = np.where(more > 0, each[:, other - 1], 0.0) * more
    totals = np.round(each[:, length - 1] * times + rest, 3)
    site, way = np.unravel_index(np.argmin(totals), totals.shape)
    total = float(totals[site, way])
    if not np.isfinite(total):
        return np.inf, np.zeros(0, dtype=np.int64)
    pieces = np.repeat((length[way], other[way]), (times[way], more[way]))
    return total, np.asarray(site + period * (np.cumsum(pieces) - pieces))


def _two_lengths(whole: int, longest: int) -> IntArray:
    """Return the ways to divide a whole into parts of two lengths, (4, W).

    The first length and how many of it, the second and how many of that; of parts that are all
    equal there is none of the second.
    """
    ways = []
    for length in range(1, min(whole, longest) + 1):
        times = np.arange(1, whole // length + 1)
        other = np.arange(1, longest + 1)
        rest = (whole - length * times)[:, None]
        some, fits = np.nonzero(rest % other == 0)
        more = rest[some, 0] // other[fits]
        ways.append(np.stack((np.full(len(some), length), times[some], other[fits], more)))
    return np.concatenate(ways, axis=1)


def cheapest_mirrored(cost: FloatArray, turn: int, *, ring: bool) -> tuple[float, IntArray]:
    """Cut a row or a ring of sites so that the cuts are their own mirror image, at least cost.

    Site ``i`` is mirrored to ``turn - i``, in a row to its other end. Some piece lies across each
    axis of the mirror image, or there is a cut; between them every piece has a twin, which is
    priced with it.

    Parameters
    ----------
    cost : (N, D) float array
        As of :func:`cheapest_row` or :func:`cheapest_ring`.
    turn : int
        Where the first site is mirrored to.
    ring : bool

    Returns
    -------
    total, cuts
        As of those.

    Examples
    --------
    >>> inf = np.inf
    >>> ring = np.array([[5.0, 2.0], [1.0, 9.0], [3.0, 1.0], [8.0, 4.0]])
    >>> [(total, cuts.tolist()) for total, cuts in (
    ...     cheapest_mirrored(ring, turn, ring=True) for turn in (0, 1))]
    [(3.0, [0, 2]), (17.0, [0, 1, 2, 3])]
    """
    count, width = cost.shape
    width = min(width, count)
    if not np.isfinite(cost[:, :width]).any():
        return np.inf, np.zeros(0, dtype=np.int64)

    def piece(first: IntArray, ahead: IntArray) -> FloatArray:
        known = (ahead > 0) & (ahead <= width)
        priced = cost[first % count, np.clip(ahead, 1, width) - 1]
        return np.asarray(np.where(known, priced, np.where(ahead == 0, 0.0, np.inf)))

    around = turn + count if ring else 2 * (count - 1)
    site = np.arange(-(-turn // 2), around // 2 + 1)
    total = piece(turn - site, 2 * site - turn)
    before = np.full(len(site), -1)
    for j in range(1, len(site)):
        back = np.arange(max(0, j - width), j)
        ahead = site[j] - site[back]
        twins = piece(site[back], ahead) + piece(np.full(len(back), turn - site[j]), ahead)
        ways = total[back] + twins
        best = int(np.argmin(ways))
        if ways[best] < total[j]:
            total[j], before[j] = ways[best], back[best]
    last = around - 2 * site
    total = total + (piece(site, last) if ring else np.where(last == 0, 0.0, np.inf))
    at = int(np.argmin(total))
    if not np.isfinite(total[at]):
        return np.inf, np.zeros(0, dtype=np.int64)
    least, half = float(total[at]), []
    while at >= 0:
        half.append(int(site[at]))
        at = int(before[at])
    cuts = np.unique(np.concatenate((half, turn - np.array(half))) % count)
    return least, cuts if ring else cuts[:-1]


def _relax(cost: FloatArray, starts: IntArray) -> tuple[FloatArray, IntArray]:
    """Return the least cost to each site from each start, and how far the last piece reaches back.

    Returns
    -------
    totals : (N, S) float array
    before : (N, S) int array
        Number of sites of the last piece, 0 at the start and where nothing leads.
    """
    count, width = cost.shape
    which = np.arange(len(starts))
    # Column d of row j: the piece of d + 1 sites that ends at j.
    ending = np.full((count, width), np.inf)
    for d in range(min(width, count - 1)):
        ending[d + 1 :, d] = cost[: count - d - 1, d]
    # Before the first site lie as many rows as a piece may reach back, none of them reached.
    totals = np.full((width + count, len(starts)), np.inf)
    totals[width + starts, which] = 0.0
    before = np.zeros((count, len(starts)), dtype=np.int64)
    begins = {start: column for column, start in enumerate(starts.tolist())}
    for j in range(1, count):
        ways = totals[j : j + width][::-1] + ending[j][:, None]
        best = ways.argmin(axis=0)
        totals[width + j] = ways[best, which]
        before[j] = best + 1
        if j in begins:
            # Nothing leads to a row's own start: it was taken for out of reach.
            totals[width + j, begins[j]] = 0.0
    before[~np.isfinite(totals[width:])] = 0
    before[starts, which] = 0
    return totals[width:], before


def _trace(before: IntArray, start: int) -> IntArray:
    """Return where the pieces begin, by going back from the last site to the start."""
    cuts = []
    at = len(before) - 1
    while at > start:
        if before[at] == 0:
            return np.zeros(0, dtype=np.int64)
        at -= int(before[at])
        cuts.append(at)
    return np.array(cuts[::-1], dtype=np.int64)


#: Cuts a row or a ring at least cost, given (N, D) costs: as in ``shortest_path``.
Solve: TypeAlias = Callable[[FloatArray], tuple[float, IntArray]]


@frozen_value
class Orbit:
    """Threads that rotations carry onto one another, and where they take the sites of the first.

    Parameters
    ----------
    threads : (K,) int array
    there : (K, N) int array
        Where each site of the first thread is carried to on each, counted in that thread.
    period : int
        Rotations shift a ring by so many sites; by all if by none.
    turn : int or None
        Some rotation turns the first thread about and takes its first site to this one.
    closed : bool
        Whether they are rings.
    """

    threads: IntArray
    there: IntArray
    period: int
    turn: int | None
    closed: bool

    def beside(self, crossings: IntArray, joints: Joints) -> FloatArray:
        """Return what a joint costs more at each site, in the mean of all that it stands for, (N,).

        Parameters
        ----------
        crossings : (K, N) int array
            The crossing of every site of every thread, in the order of the first thread's.
        joints : Joints
        """
        count = crossings.shape[1]
        beside = np.mean([joints.costs(each) for each in crossings], axis=0)
        if len(crossings) > 1 and self.period == count:
            # Beside a joint may be its own images.
            site = np.full(len(joints.around), -1)
            site[crossings] = np.arange(count)
            around = joints.around[crossings[0]]
            near = (site[around] == np.arange(count)[:, None]) & (around != crossings[:1].T)
            beside = beside + joints.near_mm2 * near.sum(axis=1)
        if self.turn is not None:
            beside = (beside + beside[(self.turn - np.arange(count)) % count]) / 2
        if self.period < count:
            beside = np.tile(beside.reshape(-1, self.period).mean(axis=0), count // self.period)
        return np.asarray(beside)

    def kinds(self, cuts: IntArray) -> int:
        """Return how many different pieces come of beginning pieces at some sites of the first."""
        count = self.there.shape[1]
        after = np.append(cuts[1:], cuts[0] + count if self.closed else count - 1)
        ahead, first = after - cuts, cuts % self.period
        if self.turn is not None:
            first = np.minimum(first, (self.turn - after) % self.period)
        return len(np.unique(ahead * count + first))

    def ways(self, cuts: IntArray, number: int) -> IntArray:
        """Return the ways to cut one of the threads as the first is, (W, C).

        Parameters
        ----------
        cuts : (C,) int array
            The sites of the first thread at which pieces begin.
        number : int
            Which of the threads.
        """
        count = self.there.shape[1]
        if count == 1:
            return np.zeros((1, 1), dtype=np.int64)
        # In a row, its last site is a cut as well: on a thread that runs back pieces begin there.
        every = cuts if self.closed else np.append(cuts, count - 1)
        ways = every[None, :]
        if self.turn is not None:
            ways = np.stack((every, self.turn - every))
        if self.closed:
            shifts = np.arange(0, count, self.period)
            ways = (ways[:, None, :] + shifts[:, None]).reshape(-1, len(every)) % count
        there = np.unique(np.sort(self.there[number][ways], axis=1), axis=0)
        return there if self.closed else there[:, :-1]

    def plans(self) -> Iterator[tuple[int, Solve]]:
        """Yield ways to cut the first thread: how often it repeats, and how one repeat is cut."""
        count = self.there.shape[1]
        if not self.closed:
            yield 1, cheapest_row
            if self.turn is not None:
                yield 1, partial(cheapest_mirrored, turn=count - 1, ring=False)
            return
        most = count // self.period
        if most > 1:
            yield 1, partial(cheapest_repeats, period=self.period)
        for times in range(1, most + 1):
            if most % times:
                continue
            yield times, cheapest_ring
            if self.turn is not None:
                for turn in {self.turn % self.period, self.turn % self.period + self.period}:
                    yield times, partial(cheapest_mirrored, turn=turn % (count // times), ring=True)


def list_orbits(sites: Sites, threads: IntArray, repeats: Repeats | None) -> Iterator[Orbit]:
    """Yield the orbits of some threads, in the order of the first of each; each alone by default.

    Parameters
    ----------
    sites : Sites
    threads : (K,) int array
        Ascending.
    repeats : Repeats, optional
    """
    leader = threads if repeats is None else repeats.leader[threads]
    _, begins = np.unique(leader, return_index=True)
    for begin in np.sort(begins).tolist():
        mates, first = threads[leader == leader[begin]], int(threads[begin])
        rows = slice(sites.offsets[first], sites.offsets[first + 1])
        position = sites.position[rows]
        count = len(position)
        if repeats is None:
            yield Orbit(mates, np.arange(count)[None], count, None, bool(sites.closed[first]))
            continue

        def numbered(thread: int, places: IntArray) -> IntArray:
            own = slice(sites.offsets[thread], sites.offsets[thread + 1])
            return np.searchsorted(sites.position[own], places)

        there = np.array(
            [numbered(mate, repeats.image(position, first, mate)) for mate in mates.tolist()]
        )
        period, length = int(repeats.period[first]), int(sites.lengths[first])
        about = repeats.turn_of(first)
        turn = None
        if about is not None:
            turn = int(numbered(first, (about - position[:1]) % length)[0])
        yield Orbit(mates, there, count * period // length, turn, bool(sites.closed[first]))
