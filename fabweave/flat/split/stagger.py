"""Keep joints of neighbouring strands apart."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.flat.split.preferences import AVOIDED_MM2
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

    def __init__(self, threads: Threads, near_mm2: float, usable: BoolArray | None) -> None:
        """Begin without any joint."""
        self._around = neighbours(threads)
        self._near_mm2 = near_mm2
        self._at = np.zeros(threads.n_crossings, dtype=np.int64)
        self._near = np.zeros(threads.n_crossings, dtype=np.int64)
        narrow = np.zeros(threads.n_crossings, dtype=bool) if usable is None else ~usable
        self._narrow = np.where(narrow, AVOIDED_MM2, 0.0)

    @property
    def n_crossings(self) -> int:
        """Number of crossings."""
        return len(self._at)

    def around(self, crossings: IntArray) -> IntArray:
        """Return the crossings within two steps of some, (N, 20)."""
        return np.asarray(self._around[crossings])

    def add(self, crossings: IntArray, times: int = 1) -> None:
        """Add joints; or take them away with ``times=-1``."""
        np.add.at(self._at, crossings, times)
        np.add.at(self._near, self._around[crossings], times)

    @property
    def near_mm2(self) -> float:
        """What a joint costs more for each other one beside it."""
        return self._near_mm2

    def costs(self, crossings: IntArray) -> FloatArray:
        """Return what it costs, apart from the joint itself, to put a joint at each crossing."""
        taken = np.where(self._at[crossings] > 0, AVOIDED_MM2, 0.0)
        return np.asarray(taken + self._narrow[crossings] + self._near_mm2 * self._near[crossings])
