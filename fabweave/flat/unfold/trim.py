"""Cut unfolded strips off at places between their rungs."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, offsets_of
from fabweave.flat.unfold.development import Strips


def trim_strips(strips: Strips, begin: FloatArray, end: FloatArray) -> Strips:
    """Return strips that begin and end at given places.

    A place is a rung's number in its strip, counted from 0; between two rungs it shares both
    rails alike, which are straight there.

    Parameters
    ----------
    strips : Strips
    begin, end : (S,) float arrays
        ``0 <= begin < end <= count - 1``.

    Returns
    -------
    Strips
        With the rungs strictly between, and one at either end.

    Examples
    --------
    >>> rungs = np.arange(4)
    >>> rails = np.column_stack((rungs * 2.0, np.zeros(4)))
    >>> strip = Strips(np.array([0, 4]), rungs, rails, rails + (0.0, 1.0))
    >>> trim_strips(strip, np.array([0.5]), np.array([3.0])).left[:, 0].tolist()
    [1.0, 2.0, 4.0, 6.0]
    """
    counts = np.diff(strips.offsets)
    place = np.arange(len(strips.rung)) - np.repeat(strips.offsets[:-1], counts)
    inside = (place > np.repeat(begin, counts)) & (place < np.repeat(end, counts))
    strip = np.repeat(np.arange(len(counts)), counts)
    kept = np.flatnonzero(inside)
    offsets = offsets_of(np.bincount(strip[kept], minlength=len(counts)) + 2)
    order = np.empty(offsets[-1], dtype=np.int64)
    ends = np.zeros(offsets[-1], dtype=bool)
    ends[offsets[:-1]] = ends[offsets[1:] - 1] = True
    order[~ends] = kept
    rails = []
    for rail in (strips.right, strips.left):
        trimmed = np.empty((offsets[-1], 2))
        trimmed[~ends] = rail[kept]
        trimmed[offsets[:-1]] = rail_at(rail, strips.offsets[:-1], begin)
        trimmed[offsets[1:] - 1] = rail_at(rail, strips.offsets[:-1], end)
        rails.append(trimmed)
    order[offsets[:-1]] = strips.offsets[:-1] + np.floor(begin).astype(np.int64)
    order[offsets[1:] - 1] = strips.offsets[:-1] + np.ceil(end).astype(np.int64)
    return Strips(offsets, strips.rung[order], *rails)


def rail_at(rail: FloatArray, first: IntArray, place: FloatArray) -> FloatArray:
    """Return points of a rail at places counted from the rungs ``first``, (N, 2)."""
    low = np.floor(place).astype(np.int64)
    share = (place - low)[:, None]
    near, far = rail[first + low], rail[first + np.ceil(place).astype(np.int64)]
    return np.asarray(near + share * (far - near))
