"""Draw in the manual what a sheet is like: its edge, its margin, its defects, and what is kept."""

from collections.abc import Callable
from typing import Any

import numpy as np
import shapely

from fabweave.assembly.manual.book import SMALL, Book
from fabweave.core.arrays import FloatArray
from fabweave.cut.notes.stock_notes import hatch
from fabweave.flat.crossing_map import SheetRecord

_MARGIN_DASH, _REST_DASH = (1.0, 2.0), (6.0, 3.0)


def draw_stock(
    book: Book,
    sheet: SheetRecord,
    margin_mm: float,
    at: Callable[[FloatArray], FloatArray],
    window: tuple[FloatArray, FloatArray],
) -> None:
    """Draw the part of a sheet that is shown.

    Parameters
    ----------
    book : Book
    sheet : SheetRecord
    margin_mm : float
        Dotted.
    at : callable
        Takes points of the sheet, (N, 2), to the page.
    window : two (2,) arrays
        Least and greatest corner of the part.
    """
    shown = shapely.box(*window[0], *window[1])
    whole = shapely.Polygon(sheet.outline)
    for ring in _rings(shapely.intersection(whole, shown)):
        book.line(at(ring), width=1.0, closed=True)
    inner = shapely.buffer(whole, -margin_mm)
    for line in _lines(shapely.intersection(shapely.boundary(inner), shown)):
        book.line(at(line), width=0.4, grey=0.5, dash=_MARGIN_DASH)
    for defect in sheet.defects:
        spoilt = shapely.make_valid(shapely.Polygon(defect))
        for part in shapely.get_parts(shapely.intersection(spoilt, shown)):
            for ring in _rings(part):
                book.line(at(ring), width=0.4, grey=0.3, closed=True)
                for line in hatch(ring):
                    book.line(at(line), width=0.3, grey=0.5)
    if sheet.rest is not None:
        border = shapely.LinearRing(sheet.rest.outline)
        for line in _lines(shapely.intersection(border, shown)):
            book.line(at(line), width=0.6, grey=0.45, dash=_REST_DASH)


def stock_words(sheet: SheetRecord) -> str:
    """Say what the stock is called, and what its drawing shows besides the pieces."""
    sentences = []
    if sheet.stock:
        sentences.append(f"From the stock: {sheet.stock}{' (an offcut)' * sheet.offcut}.")
    sentences.append("Dotted: the margin.")
    if sheet.defects:
        sentences.append("Hatched: defects.")
    if sheet.rest is not None:
        sentences.append(f"Dashed: {sheet.rest.name}, to be kept.")
    return " ".join(sentences)


def write_stock(book: Book, sheet: SheetRecord) -> None:
    """Write these words below a drawing."""
    book.y = book.block(book.left, book.y, stock_words(sheet), book.right - book.left, size=SMALL)


def _rings(shape: Any) -> list[FloatArray]:
    """Return the outlines of polygons, without their last points, which are their first."""
    return [
        shapely.get_coordinates(part.exterior)[:-1]
        for part in shapely.get_parts(shape)
        if part.geom_type == "Polygon" and not part.is_empty
    ]


def _lines(shape: Any) -> list[FloatArray]:
    """Return the runs of points of lines."""
    merged = shapely.line_merge(shape)
    return [
        np.asarray(shapely.get_coordinates(part))
        for part in shapely.get_parts(merged)
        if part.geom_type in ("LineString", "LinearRing") and not part.is_empty
    ]
