"""Find straight lines that lie on one another for a part of their length."""

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, IntArray

#: Lines are on one another where they are no farther apart than this, millimetres,
_APART_MM = 1e-3
#: along at least so much.
_ALONG_MM = 0.05


def overlapping(starts: FloatArray, ends: FloatArray) -> IntArray:
    """Return the segments that lie on an earlier one for a part of their length.

    Of a pair, both ends of the shorter one lie on the line through the longer one, and along it
    they have more than a twentieth of a millimetre in common. Segments that are collinear and
    only meet at their ends, as in a run, are none.

    Parameters
    ----------
    starts, ends : (S, 2) float arrays
        Millimetres.

    Returns
    -------
    (K,) int array
        Ascending.

    Examples
    --------
    >>> starts = np.array([[0.0, 0.0], [5.0, 0.0], [9.0, 0.0], [0.0, 0.0]])
    >>> ends = np.array([[6.0, 0.0], [9.0, 0.0], [12.0, 0.0], [6.0, 1.0]])
    >>> overlapping(starts, ends).tolist()
    [1]
    """
    # Two that overlap are near each other's boxes; a tree finds those without comparing all.
    boxes = shapely.box(
        *(np.minimum(starts, ends) - _APART_MM).T, *(np.maximum(starts, ends) + _APART_MM).T
    )
    first, second = shapely.STRtree(boxes).query(boxes)
    first, second = first[first < second], second[first < second]
    way = ends - starts
    length = np.hypot(*way.T)
    swap = length[first] < length[second]
    long, short = np.where(swap, second, first), np.where(swap, first, second)
    along = way[long] / np.maximum(length[long], _APART_MM)[:, None]
    reach = np.stack([starts[short], ends[short]], axis=1) - starts[long][:, None]
    aside = np.abs(reach[:, :, 1] * along[:, None, 0] - reach[:, :, 0] * along[:, None, 1])
    place = np.einsum("pkd,pd->pk", reach, along)
    common = np.minimum(place.max(axis=1), length[long]) - np.maximum(place.min(axis=1), 0.0)
    overlap = (aside.max(axis=1) <= _APART_MM) & (common > _ALONG_MM)
    return np.unique(second[overlap])
