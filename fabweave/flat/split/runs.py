"""Say which passes each piece carries, and unfold the pieces."""

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.flat.unfold.development import Strips, run_rungs, unfold
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.threads import Threads


@frozen_value
class Runs:
    """Which passes of its thread each piece carries, in order of threads.

    Parameters
    ----------
    thread : (N,) int array
    first, last : (N,) int arrays
        Positions in the thread, both included. On a ring ``last`` may go past the end; the pass
        at ``last`` is then the one at ``last - n``.
    """

    thread: IntArray
    first: IntArray
    last: IntArray

    def joint_passes(self, threads: Threads) -> IntArray:
        """Return the pass at which each joint lies, (J,), in the order of runs that end there."""
        count = threads.lengths[self.thread]
        goes_on = threads.closed[self.thread] | (self.last < count - 1)
        at = threads.offsets[self.thread] + self.last % np.maximum(count, 1)
        return np.asarray(at[goes_on])

    def laps(self, threads: Threads) -> IntArray:
        """Return the crossings at which one run ends and the next one begins."""
        return threads.crossing[self.joint_passes(threads)]


def unfold_runs(ribbons: Ribbons, runs: Runs) -> Strips:
    """Unfold every piece: from where it enters its first panel to where it leaves its last."""
    first, last = first_and_last_rung(ribbons, runs)
    offsets, rung = run_rungs(ribbons, runs.thread, first, last)
    return unfold(ribbons, offsets, rung)


def first_and_last_rung(ribbons: Ribbons, runs: Runs) -> tuple[IntArray, IntArray]:
    """Return first and last local rung of each run; ends of open threads keep their tails."""
    first = local_entry(ribbons, runs.thread, runs.first)
    last = local_entry(ribbons, runs.thread, runs.last) + 1
    open_run = ~ribbons.closed[runs.thread]
    final = np.diff(ribbons.pass_offsets)[runs.thread] - 1
    size = np.diff(ribbons.offsets)[runs.thread]
    return (
        np.where(open_run & (runs.first == 0), 0, first),
        np.where(open_run & (runs.last == final), size - 1, last),
    )
