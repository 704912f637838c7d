"""Turn polygons into pixels: squares of side s, owned by a polygon if their centres lie in it.

Every point is within s / √2 of a pixel's centre: so polygons that are inflated by as much, and own
no pixel in common, do not meet.
"""

import math
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar

import numpy as np
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, frozen, places_in_groups


class _Sized(Protocol):
    """What knows how much memory it takes."""

    @property
    def nbytes(self) -> int:
        """Memory, in bytes."""


_Key = TypeVar("_Key", bound=Hashable)
_Value = TypeVar("_Value", bound=_Sized)


class Cache(Generic[_Key, _Value]):
    """The values used last, up to so many bytes together, but always one.

    Examples
    --------
    >>> import numpy as np
    >>> cache = Cache(100)
    >>> [cache.get(key, lambda: np.zeros(6, np.int8)).size for key in (1, 2, 1)]
    [6, 6, 6]
    """

    def __init__(self, most_bytes: int) -> None:
        """Start empty."""
        self._most_bytes = most_bytes
        self._values: OrderedDict[_Key, _Value] = OrderedDict()
        self._bytes = 0

    def get(self, key: _Key, make: Callable[[], _Value]) -> _Value:
        """Return the value that is kept under a key, or make and keep it."""
        if key in self._values:
            self._values.move_to_end(key)
            return self._values[key]
        value = make()
        self._values[key] = value
        self._bytes += value.nbytes
        while self._bytes > self._most_bytes and len(self._values) > 1:
            self._bytes -= self._values.popitem(last=False)[1].nbytes
        return value


#: Chords in a quarter circle of a buffered corner.
_ARC_STEPS = 16


def closed_sides(outline: FloatArray) -> FloatArray:
    """Return the sides of a closed outline (K, 2) by their ends, (K, 2, 2).

    Examples
    --------
    >>> import numpy as np
    >>> closed_sides(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]))[2].tolist()
    [[0.0, 1.0], [0.0, 0.0]]
    """
    return np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)


def region_sides(region: shapely.Geometry, radius_mm: float) -> FloatArray:
    """Return the sides of polygons that contain everything within a radius of some polygons.

    Returns
    -------
    (E, 2, 2) float array
        First and second end of every side, of the outer rings and of any holes.

    Examples
    --------
    >>> region_sides(shapely.box(0.0, 0.0, 1.0, 1.0), 2.0).max().round(1)
    np.float64(3.0)
    """
    # The corners of a buffer are chords of arcs, and GEOS rounds their number, so that a chord
    # may span up to one and a half steps; the factor puts every chord outside its arc.
    reach = radius_mm / math.cos(1.5 * math.pi / (4.0 * _ARC_STEPS))
    return ring_sides(shapely.buffer(region, reach, quad_segs=_ARC_STEPS))


def ring_sides(region: shapely.Geometry) -> FloatArray:
    """Return the sides of all rings of polygons, (E, 2, 2).

    Examples
    --------
    >>> ring_sides(shapely.box(0.0, 0.0, 1.0, 1.0)).shape
    (4, 2, 2)
    """
    ends = [shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(region))]
    return np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in ends])


def filled_pixels(sides: FloatArray, shape: tuple[int, int], pixel_mm: float) -> BoolArray:
    """Return which pixel centres lie inside polygons, by the even-odd rule along each row.

    Parameters
    ----------
    sides : (R, E, 2, 2) float array
        The closed sides of R polygons (the same one at R rotations, say), millimetres; pixel
        (row j, column i) has its centre at ((i + ½) s, (j + ½) s).
    shape : (int, int)
        Rows H and columns W.
    pixel_mm : float
        The side s of a pixel.

    Returns
    -------
    (R, H, W) bool array
        True where the centre is inside.

    Examples
    --------
    >>> import numpy as np
    >>> ring = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    >>> filled_pixels(closed_sides(ring)[None], (2, 3), 1.0).astype(int).tolist()
    [[[1, 1, 0], [0, 0, 0]]]
    """
    count, height, width = len(sides), *shape
    x0, y0 = sides[..., 0, 0].ravel(), sides[..., 0, 1].ravel()
    x1, y1 = sides[..., 1, 0].ravel(), sides[..., 1, 1].ravel()
    owner = np.repeat(np.arange(count), sides.shape[1])
    first = np.ceil(np.minimum(y0, y1) / pixel_mm - 0.5).astype(np.int64).clip(0, height)
    last = np.ceil(np.maximum(y0, y1) / pixel_mm - 0.5).astype(np.int64).clip(0, height)
    rows = last - first  # half-open, so that a vertex on a row counts once
    side = np.repeat(np.arange(len(rows)), rows)
    row = places_in_groups(rows) + first[side]
    share = ((row + 0.5) * pixel_mm - y0[side]) / (y1[side] - y0[side])
    x = x0[side] + share * (x1[side] - x0[side])
    column = np.ceil(x / pixel_mm - 0.5).astype(np.int64).clip(0, width)
    cell = (owner[side] * height + row) * (width + 1) + column
    crossings = np.bincount(cell, minlength=count * height * (width + 1))
    parity = np.cumsum(crossings.reshape(count, height, width + 1), axis=2, dtype=np.uint8)
    return (parity[:, :, :width] & 1).astype(np.bool_)


#: Pixels of the larger rectangle, about.
_MOST_CELLS = 40_000
#: What touches a side by less, millimetres, does not bar it.
_INSET_MM = 1e-5


def largest_rectangle(
    size_mm: tuple[float, float], barred: shapely.Geometry | None
) -> FloatArray | None:
    """Return the largest rectangle in a larger one, with nothing barred inside it.

    It is found among rectangles of pixels, and then grown until each side meets something: so it
    is free, proved, and nothing that contains it is; a larger one elsewhere may be missed by the
    width of a pixel.

    Parameters
    ----------
    size_mm : (float, float)
        Width and height of the larger rectangle, whose corner is the origin.
    barred : polygons or None

    Returns
    -------
    (2, 2) float array or None
        Its least and its greatest corner; None if there is no room for a pixel.

    Examples
    --------
    >>> largest_rectangle((100.0, 60.0), shapely.box(70.0, 10.0, 80.0, 20.0)).tolist()
    [[0.0, 0.0], [70.0, 60.0]]
    """
    bounds = np.array([[0.0, 0.0], size_mm])
    if barred is None or barred.is_empty:
        return frozen(bounds)
    pixel = math.sqrt(size_mm[0] * size_mm[1] / _MOST_CELLS)
    columns, rows = (int(side / pixel) for side in size_mm)
    # A pixel whose centre is this far from all that is barred, is free.
    sides = region_sides(barred, pixel * math.sqrt(0.5))
    taken = filled_pixels(sides[None], (rows, columns), pixel)[0]
    cells = _largest_block(~taken)
    if cells is None:
        return None
    return frozen(_grown(pixel * cells, bounds, barred))


def _largest_block(free: BoolArray) -> FloatArray | None:
    """Return the corners of the largest block of free cells, as (x, y); None if all are taken.

    Row by row, the free cells above each one are bars of a histogram; the largest rectangle under
    it is found with a stack of rising bars.
    """
    best, corners = 0, None
    height = np.zeros(free.shape[1], dtype=np.int64)
    for row, cells in enumerate(free):
        height = np.where(cells, height + 1, 0)
        stack: list[tuple[int, int]] = []
        for column, tall in enumerate([*height.tolist(), 0]):
            start = column
            while stack and stack[-1][1] >= tall:
                start, low = stack.pop()
                if low * (column - start) > best:
                    best = low * (column - start)
                    corners = [[start, row + 1 - low], [column, row + 1]]
            stack.append((start, tall))
    return None if corners is None else np.array(corners, dtype=np.float64)


def _grown(corners: FloatArray, whole: FloatArray, barred: shapely.Geometry) -> FloatArray:
    """Return a free rectangle with each side moved outwards until it meets something."""
    result = corners.copy()
    for axis in (0, 1):
        for end in (0, 1):
            reach = result.copy()
            # The strip beside this side, but for what only touches its ends.
            reach[1 - end, axis], reach[end, axis] = result[end, axis], whole[end, axis]
            reach[0, 1 - axis] += _INSET_MM
            reach[1, 1 - axis] -= _INSET_MM
            met = shapely.intersection(barred, shapely.box(*reach.ravel()))
            result[end, axis] = whole[end, axis]
            if not met.is_empty:
                low, high = np.reshape(met.bounds, (2, 2))[:, axis]
                result[end, axis] = high if end == 0 else low
    if shapely.intersection(barred, shapely.box(*result.ravel())).area > 0.0:
        # Something touches a side by less than the inset.
        result += np.where(result == whole, 0.0, np.array([[_INSET_MM], [-_INSET_MM]]))
    return result
