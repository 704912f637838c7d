"""Tell which stretches of threads would be the same piece, whether a rotation carries them or not.

A handle, a tube, a block of equal squares repeats itself although the object does not. Unfolding is
rigid, so that a stretch is known by numbers that no motion of the plane changes. Those are equal in
congruent stretches; in others hardly ever, and what is taken for a repeat and is none only misses
what it was chosen for.
"""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.flat.split.candidates import ComplexArray, Course, Windows, station_of_site
from fabweave.flat.split.sites import Sites

#: Numbers of congruent stretches differ by less: a part of what pieces of a kind may differ by.
_SAME_MM = 0.02
#: Where there are more kinds than this share of all windows, threads do not repeat themselves.
_MOST_SHARE = 0.5
#: Directions count as the end of a lever of this length.
_LEVER_MM = 100.0


def window_kinds(course: Course, sites: Sites, windows: Windows, over: BoolArray) -> IntArray:
    """Return the kind of each window, (N, D), counted from 0; -1 where there is none.

    Windows are of one kind if they are congruent, turned end for end or not, with over and under.

    Parameters
    ----------
    course : Course
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
    course: Course, sites: Sites, over: BoolArray, first: IntArray, passes: IntArray
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
