"""Pieces of known size, and whether one fits on some sheet, as nesting does."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.nest.container import Container
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.item_shape import shape_of
from fabweave.stock.sheet_size import SheetSize, usable_size


def bar(length: float, width: float) -> FloatArray:
    """Return the outline of a rectangle that lies along x."""
    return np.array([[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])


def fits_some_sheet(outline: FloatArray, sheets: Sequence[SheetSize], margin_mm: float) -> bool:
    """Return whether a piece alone fits on one of these sheets, at some multiple of half a degree.

    Whatever this accepts, `nest` can put on an empty sheet of that size, at every effort, if it
    may turn freely and nothing is barred there.
    """
    shape = shape_of(outline)[0]
    return any(fits_rectangle(shape, Container(usable_size(sheet, margin_mm))) for sheet in sheets)
