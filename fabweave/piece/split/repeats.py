"""Tell which stretches of threads repeat others, where rotations map a woven object onto itself."""

from math import gcd

import numpy as np

from fabweave.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, frozen_value
from fabweave.piece.development import Runs
from fabweave.piece.split.candidates import Sites, WholeStrips, Windows, station_of_site
from fabweave.weave.symmetry import WeaveSymmetry


@frozen_value
class Repeats:
    """Where rotations of a woven object take each thread.

    Threads that are carried onto one another have the same *leader*, the first of them. The pass
    at position ``p`` of the leader is carried to position ``offset + sign * p`` of the thread,
    counted around a ring.

    Parameters
    ----------
    leader : (T,) int array
    offset, sign : (T,) int arrays
        Those of one rotation that takes the leader there; the sign is -1 where it runs back.
    period : (T,) int array
        The least shift along a ring, in passes, that some rotation carries it onto itself by; its
        length if there is none.
    turn : (T,) int array
        Some rotation carries position ``p`` of the leader to ``turn - p`` of the leader; -1 if
        none does.
    lengths : (T,) int array
        Number of passes of each thread.
    """

    leader: IntArray
    offset: IntArray
    sign: IntArray
    period: IntArray
    turn: IntArray
    lengths: IntArray

    @property
    def repeat(self) -> bool:
        """Whether any stretch repeats another."""
        alone = self.leader == np.arange(len(self.leader))
        return bool((~alone).any() or (self.period < self.lengths).any() or (self.turn >= 0).any())

    def image(self, positions: IntArray, source: int, target: int) -> IntArray:
        """Return where positions of one thread are carried to on another of the same leader."""
        count = max(int(self.lengths[source]), 1)
        led = self.sign[source] * (positions - self.offset[source])
        return np.asarray((self.offset[target] + self.sign[target] * led) % count)

    def classes(self, runs: Runs) -> IntArray:
        """Return the class of each run, (N, 3): runs of one class are congruent.

        The leader, the first position on it that a run of this class begins at, and the number of
        steps to its last one.

        Examples
        --------
        Two rings of six passes repeat every two, and may be turned about. A piece that begins
        where its thread goes over is not one that begins and ends where it goes under.

        >>> both = np.array([0, 0])
        >>> repeats = Repeats(both, both, np.array([1, -1]), both + 2, both, both + 6)
        >>> runs = Runs(np.array([0, 0, 1, 0]), np.array([0, 4, 4, 1]), np.array([2, 6, 6, 3]))
        >>> repeats.classes(runs).tolist()
        [[0, 0, 2], [0, 0, 2], [0, 0, 2], [0, 1, 2]]
        """
        straight, turned = self._begins(runs)
        first = np.where(turned >= 0, np.minimum(straight, turned), straight)
        return np.stack((self.leader[runs.thread], first, runs.last - runs.first), axis=1)

    def _begins(self, runs: Runs) -> tuple[IntArray, IntArray]:
        """Return where on its leader each run begins, (N,) each: as it is, and turned about.

        Counted in the leader's first period; -1 where it may not be turned about.
        """
        thread, steps = runs.thread, runs.last - runs.first
        count, period = np.maximum(self.lengths[thread], 1), np.maximum(self.period[thread], 1)
        begin = np.where(self.sign[thread] < 0, runs.last, runs.first)
        begin = self.sign[thread] * (begin - self.offset[thread]) % count
        turned = (self.turn[thread] - begin - steps) % count % period
        turned = np.where(self.turn[thread] >= 0, turned, -1)
        return np.asarray(begin % period), np.asarray(turned)

    def turn_of(self, thread: int) -> int | None:
        """Return which position of a thread its first may be turned to; None if it may not."""
        if self.turn[thread] < 0:
            return None
        turn = 2 * self.offset[thread] + self.sign[thread] * self.turn[thread]
        return int(turn % self.lengths[thread])

    def spread(self, runs: Runs) -> Runs:
        """Return the images of some runs under all rotations."""
        wanted = {tuple(row) for row in self.classes(runs).tolist()}
        rows: list[tuple[int, int, int]] = []
        for leader, begin, steps in sorted(wanted):
            count, period = int(self.lengths[leader]), max(int(self.period[leader]), 1)
            starts = np.arange(begin, count, period) if count > period else np.array([begin])
            if self.turn[leader] >= 0:
                starts = np.unique(np.append(starts, (self.turn[leader] - starts - steps) % count))
            for follower in np.flatnonzero(self.leader == leader).tolist():
                at = starts if self.sign[follower] > 0 else starts + steps
                at = (self.offset[follower] + self.sign[follower] * at) % max(count, 1)
                rows += [(follower, begin, begin + steps) for begin in at.tolist()]
        return Runs.of(rows)


def find_repeats(symmetry: WeaveSymmetry, supply: IntArray | None = None) -> Repeats:
    """Tell where the rotations of a weave take each thread.

    Parameters
    ----------
    symmetry : WeaveSymmetry
        Of which only what keeps the surface's outside and is a rotation counts: a piece that is
        turned over is another piece.
    supply : (T,) int array, optional
        What each thread is cut from: rotations that take one to a thread of another supply do not
        count.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.symmetry import find_weave_symmetry
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = octahedron()
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> repeats = find_repeats(find_weave_symmetry(mesh, halfedges, weave))
    >>> repeats.leader.tolist(), repeats.period.tolist(), bool(np.all(repeats.turn >= 0))
    ([0, 0, 0, 0], [2, 2, 2, 2], True)
    """
    threads, group = symmetry.weave.threads, symmetry.group
    every = np.arange(threads.n_threads)
    images = symmetry.thread_images(every)
    usable = group.proper & ~group.reverses
    if supply is not None:
        usable &= (supply[images] == supply).all(axis=1)
    images = images[usable]
    lengths = threads.lengths
    leader = images.min(axis=0, initial=threads.n_threads)
    offset, sign = np.zeros_like(every), np.ones_like(every)
    period, turn = lengths.copy(), np.full_like(every, -1)
    for lead in np.flatnonzero((leader == every) & (lengths > 0)).tolist():
        begin, count = int(threads.offsets[lead]), int(lengths[lead])
        there = symmetry.pass_images(np.array([begin]))[usable, 0]
        thread = threads.thread_of_pass[there]
        first = there - threads.offsets[thread]
        # A walk runs on where its image comes from the same side of the edge as the thread there.
        side = group.images(threads.halfedge[begin : begin + 1])[usable, 0]
        way = np.where(side == threads.halfedge[there], 1, -1)
        mates, chosen = np.unique(thread, return_index=True)
        offset[mates], sign[mates] = first[chosen], way[chosen]
        own = thread == lead
        period[mates] = gcd(count, *first[own & (way > 0)].tolist())
        turn[mates] = first[own & (way < 0)].min() if (own & (way < 0)).any() else -1
    return Repeats(leader, offset, sign, period, turn, lengths)


#: Numbers of congruent stretches differ by less: a part of what pieces of a kind may differ by.
_SAME_MM = 0.02
#: Where there are more kinds than this share of all windows, threads do not repeat themselves.
_MOST_SHARE = 0.5
#: Directions count as the end of a lever of this length.
_LEVER_MM = 100.0


def window_kinds(course: WholeStrips, sites: Sites, windows: Windows, over: BoolArray) -> IntArray:
    """Return the kind of each window, (N, D), counted from 0; -1 where there is none.

    Windows are of one kind if they are congruent, turned end for end or not, with over and under.

    Parameters
    ----------
    course : WholeStrips
    sites : Sites
    windows : Windows
        Of these.
    over : (P,) bool array
        Whether each pass of all threads goes over.
    """
    row, ahead = np.nonzero(windows.passes)
    passes = windows.passes[row, ahead]
    first = station_of_site(course, sites)[row]
    begin, end = course.begin[first], course.end[first + passes - 1]
    points = ((course.strips.right + course.strips.left) / 2) @ np.array([1.0, 1.0j])
    sums = np.concatenate((np.zeros(1), np.cumsum(points)))
    chord = points[end] - points[begin]
    way = _unit(chord)
    rungs = end - begin + 1
    middle = (sums[end + 1] - sums[begin]) / rungs - (points[end] + points[begin]) / 2
    aside = middle / way
    leave = (points[begin + 1] - points[begin]) / way
    arrive = (points[end] - points[end - 1]) / way
    both_ways = np.stack((aside, _LEVER_MM * _unit(leave), _LEVER_MM * _unit(arrive)))
    rhythm = _rhythms(course, sites, over, first, passes)
    forth = _parts(both_ways, rhythm[0])
    back = _parts(np.stack((-both_ways[0], both_ways[2], both_ways[1])), rhythm[1])
    same = np.stack(
        [
            windows.length_mm[row, ahead],
            windows.area_mm2[row, ahead] / windows.length_mm[row, ahead],
            windows.rim_mm[row, ahead],
            np.abs(chord),
        ]
    )
    key = _mixed(np.concatenate((_rounded(same), passes[None], rungs[None])))
    ends = np.stack((_mixed(forth), _mixed(back)))
    key = _mixed(np.concatenate((key[None], np.sort(ends, axis=0))))
    kinds = np.full(windows.passes.shape, -1, dtype=np.int64)
    kinds[row, ahead] = np.unique(key, return_inverse=True)[1]
    return kinds


def repeating(kinds: IntArray) -> bool:
    """Tell whether windows repeat so often that threads are to be cut by that.

    Examples
    --------
    >>> import numpy as np
    >>> repeating(np.array([[0, 1], [0, 1], [0, -1]])), repeating(np.array([[0, 1], [2, -1]]))
    (True, False)
    """
    return bool(kinds.max(initial=-1) + 1 < _MOST_SHARE * np.count_nonzero(kinds >= 0))


def _rhythms(
    course: WholeStrips, sites: Sites, over: BoolArray, first: IntArray, passes: IntArray
) -> IntArray:
    """Return numbers for over and under of windows, from their first pass on and from their last.

    Returns
    -------
    (2, W) int array
    """
    count = np.diff(course.offsets)
    thread = np.repeat(np.arange(len(count)), count)
    place = (np.arange(len(thread)) - course.offsets[thread]) % sites.lengths[thread]
    high = over[np.cumsum(np.append(0, sites.lengths))[thread] + place].astype(np.int64)
    at = np.arange(len(high))
    ones, moments = (np.append(0, np.cumsum(each)) for each in (high, high * at))
    number = ones[first + passes] - ones[first]
    moment = moments[first + passes] - moments[first] - number * first
    return np.stack((moment, number * (passes - 1) - moment))


def _unit(vectors: ComplexArray) -> ComplexArray:
    """Return vectors of length 1; for those without a length, along x."""
    size = np.abs(vectors)
    return np.asarray(np.where(size > 0.0, vectors, 1.0) / np.where(size > 0.0, size, 1.0))


def _parts(vectors: ComplexArray, rhythm: IntArray) -> IntArray:
    """Return whole numbers for complex ones, with the rhythm."""
    return np.concatenate((_rounded(vectors.real), _rounded(vectors.imag), rhythm[None]))


def _rounded(values: FloatArray) -> IntArray:
    return np.rint(values / _SAME_MM).astype(np.int64)


def _mixed(rows: IntArray) -> IntArray:
    """Return one number for each column of (K, W) whole numbers; equal columns have the same."""
    mixed = np.zeros(rows.shape[1], dtype=np.uint64)
    for row in rows.astype(np.uint64):
        mixed = (mixed ^ row) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed.astype(np.int64)


class KindPrices:
    """Count the pieces of each kind while threads are cut one after another.

    The state of a search, not a value.
    """

    def __init__(self, kinds: IntArray, price_mm2: float) -> None:
        """Begin without any piece."""
        self._kinds = kinds
        there = kinds >= 0
        ahead = np.broadcast_to(np.arange(1, kinds.shape[1] + 1), kinds.shape)
        # So many pieces of the kind may lie behind one another.
        shares = np.bincount(kinds[there], 1.0 / ahead[there])
        self._fresh_mm2 = np.append(price_mm2 / np.maximum(shares, 1.0), 0.0)
        self._count = np.zeros(len(shares) + 1, dtype=np.int64)

    def add(self, row: IntArray, ahead: IntArray, times: int = 1) -> None:
        """Add pieces; or take them away with ``times=-1``."""
        np.add.at(self._count, self._kinds[row, ahead], times)

    def costs(self, rows: IntArray) -> FloatArray:
        """Return what each candidate of some rows costs more for the kind that it is of, (n, D).

        Nothing, if there are pieces of its kind; else its part of what the kind costs, if all of
        it became pieces.
        """
        kinds = self._kinds[rows]
        return np.asarray(np.where(self._count[kinds] > 0, 0.0, self._fresh_mm2[kinds]))
