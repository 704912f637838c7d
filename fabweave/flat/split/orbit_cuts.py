"""Cut the threads that repeat one another alike, so that few different pieces are needed."""

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.flat.split.repeats import Repeats
from fabweave.flat.split.shortest_path import (
    cheapest_mirrored,
    cheapest_repeats,
    cheapest_ring,
    cheapest_row,
)
from fabweave.flat.split.sites import Sites
from fabweave.flat.split.stagger import Joints

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
            site = np.full(joints.n_crossings, -1)
            site[crossings] = np.arange(count)
            around = joints.around(crossings[0])
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
                yield 1, lambda cost: cheapest_mirrored(cost, count - 1, ring=False)
            return
        most = count // self.period
        if most > 1:
            yield 1, lambda cost: cheapest_repeats(cost, self.period)
        for times in range(1, most + 1):
            if most % times:
                continue
            yield times, cheapest_ring
            if self.turn is not None:
                for turn in {self.turn % self.period, self.turn % self.period + self.period}:
                    yield times, _mirrored(turn % (count // times))


def _mirrored(turn: int) -> Solve:
    return lambda cost: cheapest_mirrored(cost, turn, ring=True)


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
