"""Find the largest rectangle along the axes that keeps clear of what is barred."""

import math

import numpy as np
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, frozen
from fabweave.nest.place.raster import filled_pixels, region_sides

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
