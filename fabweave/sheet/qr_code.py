"""Draw a QR code on a sheet, where nothing else is: it tells how the sheet was made."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import segno
import shapely
from PIL import Image, ImageDraw

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.messages import agree, few_of
from fabweave.sheet.drawing import Circle, Entity, Layer, Polyline, SheetDrawing

#: The picture of the code in a job's folder.
CODE_FILE = "qr_code.png"
#: Pixels of a dot in that picture: sharp at the size of a stamp.
_DOT_PIXELS = 8
#: Sizes of a code's dots that are tried, millimetres, the preferred first: a phone reads the
#: smallest from a print of the sheet, and a program from its picture.
DOTS_MM = (1.0, 0.8, 0.6)
#: A code wants a border as wide as so many of its dots to be free.
QUIET_DOTS = 4
#: And this much more between its border and everything else, millimetres.
_CLEAR_MM = 1.0
# Room is sought on a grid so fine, or coarser on large sheets.
_CELL_MM, _MOST_CELLS = 1.0, 2000
_FLAT_MM = 0.2


@dataclass(frozen=True)
class Code:
    """A QR code on a sheet: the lower left corner of its dots, and their size, millimetres."""

    x_mm: float
    y_mm: float
    dot_mm: float


def draw_code(text: str, code: Code) -> tuple[Polyline, ...]:
    """Return the lines of a QR code: one for each run of dark dots in a row, as wide as a dot.

    Parameters
    ----------
    text : str
        What the code says, at most 2,953 bytes.
    code : Code
        Where it stands.

    Returns
    -------
    tuple of Polyline
        On NOTES, row by row from above; those of one row do not touch, so no line is there twice.

    Examples
    --------
    >>> lines = draw_code("HELLO", Code(10.0, 20.0, 1.0))
    >>> lines[0].points.tolist(), lines[0].width_mm
    ([[10.0, 40.5], [17.0, 40.5]], 1.0)
    """
    dark = code_dots(text)
    row, left, right = dark_runs(dark)
    x = code.x_mm + code.dot_mm * np.column_stack([left, right])
    y = code.y_mm + code.dot_mm * (len(dark) - 0.5 - np.column_stack([row, row]))
    return tuple(
        Polyline(Layer.NOTES, points, width_mm=code.dot_mm) for points in np.stack([x, y], axis=2)
    )


def code_png(text: str) -> bytes:
    """Return a QR code with its quiet border as a picture, black on white.

    Examples
    --------
    >>> Image.open(io.BytesIO(code_png("HELLO"))).size
    (232, 232)
    """
    light = ~np.pad(code_dots(text), QUIET_DOTS)
    pixels = np.kron(light, np.ones((_DOT_PIXELS, _DOT_PIXELS), dtype=np.bool_))
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", optimize=True)
    return file.getvalue()


def dark_runs(dots: BoolArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return row, first column and the column after the last one of each run of dark dots.

    Examples
    --------
    >>> [part.tolist() for part in dark_runs(np.array([[1, 1, 0, 1]], dtype=bool))]
    [[0, 0], [0, 3], [2, 4]]
    """
    # From light to dark and back again, row by row.
    row, column = np.nonzero(np.diff(np.pad(dots, ((0, 0), (1, 1))).astype(np.int8), axis=1))
    return row[::2], column[::2], column[1::2]


def code_dots(text: str) -> BoolArray:
    """Return the dots of a code, True for dark, the uppermost row first.

    Examples
    --------
    >>> code_dots("HELLO").shape
    (21, 21)
    """
    # Readers guess the alphabet of what is no ASCII, unless they are told.
    plain = text.isascii()
    symbol = segno.make(
        text,
        error="l",
        mode="byte",
        encoding=None if plain else "utf-8",
        eci=not plain,
        micro=False,
        boost_error=False,
    )
    return np.array([list(row) for row in symbol.matrix], dtype=np.bool_)


def with_code(drawing: SheetDrawing, text: str) -> SheetDrawing:
    """Return a sheet with a code on it, as large as there is room for, or as it is.

    A text of nothing has no code. The code stands as low as possible, and there as far to the
    right, on material that is left or in the margin. Around its quiet border, a millimetre is free.
    """
    if not text:
        return drawing
    size = len(code_dots(text)) + 2 * QUIET_DOTS
    border, obstacles = _border(drawing), _obstacles(drawing)
    full = _full_cells(drawing, border, obstacles)
    for dot in DOTS_MM:
        corner = _find_room(drawing, border, obstacles, full, size * dot)
        if corner is not None:
            x, y = (value + QUIET_DOTS * dot for value in corner)
            lines = draw_code(text, Code(x, y, dot))
            return replace(drawing, notes=(*drawing.notes, *lines))
    return drawing


def code_of(drawing: SheetDrawing) -> Code | None:
    """Return where a sheet has its code; None if it has none.

    Examples
    --------
    >>> sheet = with_code(SheetDrawing("sheet 1", 60.0, 40.0, (), ()), "HELLO")
    >>> code_of(sheet)
    Code(x_mm=32.0, y_mm=7.0, dot_mm=1.0)
    """
    lines = [note for note in drawing.notes if isinstance(note, Polyline) and note.width_mm]
    if not lines:
        return None
    dot = float(lines[0].width_mm or 0.0)
    x, y = np.concatenate([line.points for line in lines]).min(axis=0).tolist()
    return Code(x, round(y - dot / 2.0, 9), dot)


def code_notes(drawings: Sequence[SheetDrawing]) -> tuple[str, ...]:
    """Return a note on sheets that have no room for a code."""
    bare = [drawing.name for drawing in drawings if code_of(drawing) is None]
    if not bare:
        return ()
    named = few_of(bare)
    return (
        agree(len(bare), "code: {n} sheet[ has|s have] no room for the QR code that says how ")
        + f"the job was made ({named}); a wider --margin makes room",
    )


def _obstacles(drawing: SheetDrawing) -> list[FloatArray]:
    """Return rings and runs of points of everything that a code may not stand on."""
    pieces = [ring for piece in drawing.pieces for ring in piece.outlines(_FLAT_MM)]
    return pieces + list(map(_points, drawing.notes[1:]))


def _border(drawing: SheetDrawing) -> FloatArray:
    """Return the ring around all that is there of a sheet: its first note, if it has any."""
    return _points(drawing.notes[0]) if drawing.notes else drawing.edge


def _points(entity: Entity) -> FloatArray:
    if isinstance(entity, Circle):
        r = entity.radius
        return np.array([[entity.x - r, entity.y - r], [entity.x + r, entity.y + r]])
    return entity.flattened(_FLAT_MM)


def _cell_mm(drawing: SheetDrawing) -> float:
    return max(_CELL_MM, max(drawing.width_mm, drawing.height_mm) / _MOST_CELLS)


def _full_cells(drawing: SheetDrawing, border: FloatArray, obstacles: Sequence[FloatArray]) -> Any:
    """Return how many cells left of and below each corner of the grid are near anything."""
    cell = _cell_mm(drawing)
    wide, high = int(drawing.width_mm / cell), int(drawing.height_mm / cell)
    image = Image.new("1", (wide, high), 1)
    draw = ImageDraw.Draw(image)
    draw.polygon([tuple(place) for place in (border / cell - 0.5).tolist()], fill=0)
    for points in (border, *obstacles):
        places = [tuple(place) for place in (points / cell - 0.5).tolist()]
        if len(places) > 2 and points is not border:
            draw.polygon(places, fill=1)
        draw.line([*places, places[0]], fill=1)
    full = np.zeros((high + 1, wide + 1), dtype=np.int64)
    full[1:, 1:] = np.asarray(image).cumsum(axis=0).cumsum(axis=1)
    return full


def _find_room(
    drawing: SheetDrawing,
    border: FloatArray,
    obstacles: Sequence[FloatArray],
    full: Any,
    side_mm: float,
) -> tuple[float, float] | None:
    """Return the lower left corner of a free square, the lowest and there the rightmost one."""
    cell = _cell_mm(drawing)
    # Free cells around it keep what is rounded, and a millimetre, away.
    rim = int(np.ceil(_CLEAR_MM / cell)) + 1
    size = int(np.ceil(side_mm / cell)) + 2 * rim
    high, wide = full.shape
    low, left = np.arange(high - size)[:, None], np.arange(wide - size)[None]
    inside = (
        full[low + size, left + size] - full[low, left + size] - full[low + size, left]
        + full[low, left]
    )  # fmt: skip
    free = np.argwhere(inside[:, ::-1] == 0)
    if not len(free):
        return None
    row, back = free[0].tolist()
    x, y = cell * float(wide - size - 1 - back + rim), cell * float(row + rim)
    # Cells are coarse; what is drawn is asked last.
    square = shapely.box(x, y, x + side_mm, y + side_mm).buffer(_CLEAR_MM / 2.0)
    shapes = [
        shapely.Polygon(points) if len(points) > 2 else shapely.LineString(points)
        for points in obstacles
    ]
    inside_border = shapely.make_valid(shapely.Polygon(border)).covers(square)
    return (x, y) if inside_border and not np.any(shapely.intersects(shapes, square)) else None
