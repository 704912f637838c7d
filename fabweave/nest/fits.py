"""Say which shapes fit on which sheets, each alone on an empty one."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray
from fabweave.nest.area import MAX_PIXELS, Area, clear_rectangle
from fabweave.nest.effort import Effort
from fabweave.nest.item_shape import Shape, fitting_angles
from fabweave.nest.place.search import Grid, SheetPixels, grid_of, kernels_of


def sheet_grid(area: Area, gap_mm: float, effort: Effort, near_mm: float) -> Grid:
    """Return the grid of a usable area, with larger pixels if it is very large."""
    wide, high = area.size_mm
    pixel_mm = max(effort.pixel_mm, math.sqrt(wide * high / MAX_PIXELS))
    return grid_of(area, gap_mm, pixel_mm, near_mm)


def fits_rectangle(shape: Shape, area: Area) -> bool:
    """Return whether a shape fits into a usable area at some angle, if nothing there is barred."""
    # The answer is the same for every number of rotations; four are tried fastest.
    return len(fitting_angles(shape, area.size_mm, 4, area.turns)) > 0


def fits_on(
    shapes: Sequence[Shape], areas: Sequence[Area], gap_mm: float, effort: Effort
) -> BoolArray:
    """Return which shape fits on which empty sheet at some angle, (shapes, sheets).

    Where something is barred, a place is searched for as nesting does at this effort.
    """
    result = np.zeros((len(shapes), len(areas)), dtype=np.bool_)
    for number, area in enumerate(areas):
        result[:, number] = [fits_rectangle(shape, area) for shape in shapes]
        if area.barred is None:
            continue
        clear = Area(clear_rectangle(area, gap_mm), None, area.turns)
        grid = sheet_grid(area, gap_mm, effort, gap_mm)
        # Nothing is put down, and no failure speaks for another shape.
        pixels = SheetPixels(grid, replace(effort, same_size=math.inf), workers=1)
        for row in np.flatnonzero(result[:, number]).tolist():
            shape = shapes[row]
            if fits_rectangle(shape, clear):
                continue
            size = np.array([shape.length_mm, shape.width_mm])
            kernels = kernels_of(shape, grid, effort.rotations)
            result[row, number] = pixels.place(kernels, size) is not None
    return result
