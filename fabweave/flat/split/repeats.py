"""Tell which stretches of threads repeat others, where rotations map a woven object onto itself."""

from math import gcd

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.flat.split.runs import Runs
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
        thread, first, last = [], [], []
        for leader, begin, steps in sorted(wanted):
            count, period = int(self.lengths[leader]), max(int(self.period[leader]), 1)
            starts = np.arange(begin, count, period) if count > period else np.array([begin])
            if self.turn[leader] >= 0:
                starts = np.unique(np.append(starts, (self.turn[leader] - starts - steps) % count))
            for follower in np.flatnonzero(self.leader == leader).tolist():
                at = starts if self.sign[follower] > 0 else starts + steps
                at = (self.offset[follower] + self.sign[follower] * at) % max(count, 1)
                thread.append(np.full(len(at), follower))
                first.append(at)
                last.append(at + steps)
        if not thread:
            return runs
        return Runs(np.concatenate(thread), np.concatenate(first), np.concatenate(last))


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
