"""Find pieces that cross themselves as they are to be cut, and where in their threads.

Where threads are cut is planned on ribbons as wide as asked. Then ribbons get narrower where they
are too near to others, laps take their place, and what is cut unfolds a little differently.
"""

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.flat.outline import simple, strip_outlines
from fabweave.flat.split.candidate_costs import MOST_PASSES
from fabweave.flat.split.candidates import lay_course
from fabweave.flat.split.runs import Runs, unfold_runs
from fabweave.flat.split.self_clearance import last_clear
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave


@frozen_value
class SelfCrossing:
    """Stretches of threads that cross themselves when they are unfolded.

    Parameters
    ----------
    loops : Runs
        Those that are apart when the thread is cut at one of the crossings within: no piece may
        carry such a stretch.
    kinks : Runs
        Those that no cut mends, as the thread nowhere goes under within. Only a narrower ribbon
        may.
    """

    loops: Runs
    kinks: Runs

    def __bool__(self) -> bool:
        return bool(len(self.loops.thread) or len(self.kinks.thread))


def find_self_crossing(
    ribbons: Ribbons, weave: Weave, runs: Runs, outlines: Sequence[FloatArray]
) -> SelfCrossing:
    """Find what makes pieces cross themselves.

    Where any piece of a thread does, whatever else in that thread would not keep clear of itself
    in one piece is found, too: so that other cuts do not lead to the next such piece.

    Parameters
    ----------
    ribbons, weave
        The ribbons as they are cut, and who goes under where.
    runs : Runs
        Which passes each piece carries.
    outlines : sequence of (K, 2) float arrays
        The pieces as they are cut.
    """
    crossed = np.flatnonzero(~simple(outlines))
    if not len(crossed):
        return SelfCrossing(some_runs(runs, crossed), some_runs(runs, crossed))
    shortest = _shortest(ribbons, some_runs(runs, crossed))
    inside = np.array(
        [
            _goes_under(weave, *stretch)
            for stretch in zip(
                shortest.thread.tolist(),
                shortest.first.tolist(),
                shortest.last.tolist(),
                strict=True,
            )
        ]
    )
    loops = joined_runs(some_runs(shortest, inside), _loops(ribbons, np.unique(shortest.thread)))
    return SelfCrossing(loops, some_runs(shortest, ~inside))


def joined_runs(*parts: Runs) -> Runs:
    """Return runs one after another, each once."""
    rows = np.unique(
        np.concatenate([np.column_stack((p.thread, p.first, p.last)) for p in parts]), axis=0
    )
    return Runs(*rows.T)


def some_runs(runs: Runs, chosen: IntArray | BoolArray) -> Runs:
    """Return some of the runs."""
    return Runs(runs.thread[chosen], runs.first[chosen], runs.last[chosen])


def _shortest(ribbons: Ribbons, runs: Runs) -> Runs:
    """Return of each run the shortest stretch that crosses itself, the first to be closed.

    All of it where only the shape of the ends is to blame.
    """
    rows = [
        _shortest_within(ribbons, *run)
        for run in zip(runs.thread.tolist(), runs.first.tolist(), runs.last.tolist(), strict=True)
    ]
    return Runs(*np.array(rows, dtype=np.int64).reshape(-1, 3).T)


def _shortest_within(ribbons: Ribbons, thread: int, first: int, last: int) -> tuple[int, int, int]:
    def crosses(low: int, high: int) -> bool:
        run = Runs(*(np.array([value]) for value in (thread, low, high)))
        return not simple(strip_outlines(unfold_runs(ribbons, run)))[0]

    if not crosses(first, last):
        return thread, first, last
    # What contains a stretch that crosses itself does so, too.
    ends = range(first, last)
    high = first + bisect_left(ends, True, key=lambda end: crosses(first, end))
    starts = range(high, first, -1)
    return thread, high - bisect_left(starts, True, key=lambda low: crosses(low, high)), high


def _goes_under(weave: Weave, thread: int, first: int, last: int) -> bool:
    """Say whether a thread goes under strictly between two of its passes."""
    count = int(weave.threads.lengths[thread])
    within = weave.threads.offsets[thread] + np.arange(first + 1, last) % count
    return not weave.over[within].all()


def _loops(ribbons: Ribbons, threads: IntArray) -> Runs:
    """Return the stretches of some threads that come too near to themselves."""
    course = lay_course(ribbons, MOST_PASSES)
    behind = last_clear(course, MOST_PASSES)
    before = np.append(-1, behind[:-1])
    before[course.offsets[:-1][np.diff(course.offsets) > 0]] = -1
    rows = []
    for thread in threads.tolist():
        start = int(course.offsets[thread])
        own = start + np.flatnonzero((behind > before)[start : int(course.offsets[thread + 1])])
        rows += [(thread, int(behind[at]) - start, at - start) for at in own.tolist()]
    return Runs(*np.array(rows, dtype=np.int64).reshape(-1, 3).T)
