"""Change where threads are cut, one cut at a time, so that straight strips fill rows."""

from collections.abc import Callable, Iterator, Mapping
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray

#: What area of rows straight strips waste, of the lengths of each thread's pieces.
Rests: TypeAlias = Callable[[Mapping[int, FloatArray]], float]
#: What a way to cut a thread costs; anything else that is no less than a limit.
Worth: TypeAlias = Callable[[IntArray, float], float]

#: What costs less by no more than this only looks so by rounding.
_SAME_MM2 = 1e-3


def climb(cut: IntArray, sites: int, worth: Worth, *, closed: bool) -> IntArray:
    """Return a way to cut a thread that costs no more, after trying changes at every site.

    Parameters
    ----------
    cut : (K,) int array
        The sites where pieces begin, ascending; the first one of an open thread stays.
    sites : int
        How many there are.
    worth : callable
    closed : bool
        Whether the thread is a ring.

    Examples
    --------
    >>> climb(np.array([0, 1]), 9, lambda cut, limit: len(cut) + abs(cut[-1] - 4), closed=False)
    array([0, 4])
    """
    least = worth(cut, np.inf)
    for site in range(sites if closed else sites - 1):
        for other in [*_changes(cut, site)]:
            if closed or not other[0]:
                cost = worth(other, least)
                if cost < least - _SAME_MM2:
                    cut, least = other, cost
    return cut


def _changes(cut: IntArray, site: int) -> Iterator[IntArray]:
    """Yield ways to cut at a site, or no longer: a cut is added, moved there, or left out."""
    place = int(np.searchsorted(cut, site))
    if site in cut:
        if len(cut) > 1:
            yield np.delete(cut, place)
        return
    yield np.insert(cut, place, site)
    for near in (place - 1, place % len(cut)):
        moved = cut.copy()
        moved[near] = site
        yield np.sort(moved)
