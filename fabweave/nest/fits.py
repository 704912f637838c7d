"""Say which shapes fit on which sheets, each alone on an empty one."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.nest.container import MAX_PIXELS, Container, clear_rectangle, container_of
from fabweave.nest.item_shape import ItemShape, fitting_angles, shapes_of
from fabweave.nest.layout import Effort, effort_named
from fabweave.nest.place.spectral_packing import Grid, SheetPixels, grid_of, kernels_of
from fabweave.stock.rotations import Rotations
from fabweave.stock.sheet_size import SheetSize

#: Angles that are tried: whether any fits is the same for every multiple of four.
_ANGLES = 4


def sheet_grid(container: Container, gap_mm: float, effort: Effort, near_mm: float) -> Grid:
    """Return the grid of a usable area, with larger pixels if it is very large."""
    width, height = container.size_mm
    pixel_mm = max(effort.pixel_mm, math.sqrt(width * height / MAX_PIXELS))
    return grid_of(container, gap_mm, pixel_mm, near_mm)


def fits_rectangle(shape: ItemShape, container: Container) -> bool:
    """Return whether a shape fits into a usable area at some angle, if nothing there is barred."""
    return len(fitting_angles(shape, container.size_mm, _ANGLES, container.rotations)) > 0


def fits_on(
    shapes: Sequence[ItemShape], containers: Sequence[Container], gap_mm: float, effort: Effort
) -> BoolArray:
    """Return which shape fits on which empty sheet at some angle, (shapes, sheets).

    Where something is barred, a place is searched for as nesting does at this effort.
    """
    result = np.zeros((len(shapes), len(containers)), dtype=np.bool_)
    for number, container in enumerate(containers):
        result[:, number] = [fits_rectangle(shape, container) for shape in shapes]
        if container.barred is None:
            continue
        clear = Container(clear_rectangle(container, gap_mm), None, container.rotations)
        grid = sheet_grid(container, gap_mm, effort, gap_mm)
        # Nothing is put down, and no failure speaks for another shape.
        pixels = SheetPixels(grid, replace(effort, same_size=math.inf), workers=1)
        for row in np.flatnonzero(result[:, number]).tolist():
            shape = shapes[row]
            if fits_rectangle(shape, clear):
                continue
            size = np.array([shape.length_mm, shape.width_mm])
            kernels = kernels_of(shape, grid, effort.angles)
            result[row, number] = pixels.place(kernels, size) is not None
    return result


def fits_stock(
    outlines: Sequence[FloatArray],
    sheets: Sequence[SheetSize],
    *,
    margin_mm: float,
    gap_mm: float,
    effort: str,
    rotations: Rotations,
) -> BoolArray:
    """Return which outlines nesting will find a place for, each alone on an empty sheet, (N,).

    Parameters
    ----------
    outlines : sequence of (K, 2) float arrays
        Simple polygons.
    sheets, margin_mm, gap_mm, effort, rotations
        As for :func:`fabweave.nest.nesting.nest`.
    """
    shapes, poses = shapes_of(outlines, upright=rotations.step_deg is not None)
    containers = [container_of(sheet, margin_mm, gap_mm, rotations) for sheet in sheets]
    fits = np.any(fits_on(shapes, containers, gap_mm, effort_named(effort)), axis=1)
    return np.array([fits[pose.shape] for pose in poses], dtype=np.bool_)
