"""Print a sheet at full size, to cut by hand or to lay on stock: one page, or tiles of paper."""

import io
from collections.abc import Callable

import numpy as np
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from fabweave.core.arrays import FloatArray
from fabweave.cut.drawing import Circle, Entity, Layer, Polyline, SheetDrawing
from fabweave.cut.write.tiles import BORDER_MM, FOOT_MM, Tiles, Window, overlap, page_tiles

_POINTS = 72.0 / 25.4
_FORM = "sheet"
#: Size of texts in points, how far they stand above the edge of the paper, and the bar to measure.
_TEXT, _TEXT_UP_MM, _BAR_MM = 9.5, 5.2, 50.0
#: Crosses: half their size, and the width of their lines.
_CROSS_MM = (4.0, 0.2)
#: How each layer is drawn: grey from 0 (black), and the width of the line in millimetres.
_INK = {
    Layer.ENGRAVE_LABEL: (0.25, 0.18),
    Layer.ENGRAVE_MARK: (0.25, 0.18),
    Layer.CUT_INNER: (0.0, 0.2),
    Layer.CUT_OUTER: (0.0, 0.2),
    Layer.NOTES: (0.55, 0.15),
}


def template_pdf(drawing: SheetDrawing, paper: str = "sheet") -> bytes:
    """Return a sheet at full size as the content of a PDF file.

    Parameters
    ----------
    drawing : SheetDrawing
    paper : str
        ``"sheet"`` for one page as large as the sheet, or one of ``PAPERS_MM``: as few pages of it
        as show all pieces, upright or on their side, with the pieces that fit whole. Pages that
        show parts of one piece have crosses with the same number, to be laid on one another.

    Examples
    --------
    >>> sheet = SheetDrawing("sheet_01", 600.0, 400.0, (), ())
    >>> template_pdf(sheet, "a4")[:5]
    b'%PDF-'
    """
    file = io.BytesIO()
    whole = (drawing.width_mm, drawing.height_mm)
    canvas = Canvas(file, pagesize=tuple(_POINTS * side for side in whole), invariant=1)
    canvas.setTitle(f"{drawing.name}, full size")
    canvas.setCreator("fabweave")
    canvas.beginForm(_FORM, 0, 0, drawing.width_mm * _POINTS, drawing.height_mm * _POINTS)
    _draw(canvas, drawing)
    canvas.endForm()
    if paper == "sheet":
        canvas.doForm(_FORM)
        canvas.showPage()
    else:
        tiles = page_tiles(drawing, paper)
        for number in range(len(tiles.windows)):
            _tile(canvas, drawing.name, tiles, number)
    canvas.save()
    return file.getvalue()


def _tile(canvas: Canvas, name: str, tiles: Tiles, number: int) -> None:
    """Draw the part of the sheet that one page shows, and how to lay it to others."""
    window, count = tiles.windows[number], len(tiles.windows)
    canvas.setPageSize(
        (
            _POINTS * (window.wide + 2.0 * BORDER_MM),
            _POINTS * (window.high + BORDER_MM + FOOT_MM),
        )
    )
    canvas.saveState()
    seen = canvas.beginPath()
    seen.rect(*(_POINTS * side for side in (BORDER_MM, FOOT_MM, window.wide, window.high)))
    canvas.clipPath(seen, stroke=0)
    shift = BORDER_MM - window.left, FOOT_MM - window.low
    canvas.translate(*(_POINTS * side for side in shift))
    canvas.doForm(_FORM)
    canvas.restoreState()
    canvas.setFont("Helvetica", _TEXT)
    canvas.setLineWidth(_CROSS_MM[1] * _POINTS)
    for at, pair in enumerate(tiles.pairs, start=1):
        if number in pair:
            for place in _crosses(*(tiles.windows[page] for page in pair)):
                _cross(canvas, str(at), place[0] + shift[0], place[1] + shift[1])
    foot, arm = _POINTS * _TEXT_UP_MM, _POINTS
    told = f"{name}, page {number + 1} of {count}, to print at 100 %"
    canvas.drawString(_POINTS * BORDER_MM, foot, told)
    start = _POINTS * BORDER_MM + stringWidth(told, "Helvetica", _TEXT) + 3.0 * arm
    end = start + _POINTS * _BAR_MM
    canvas.line(start, foot + arm, end, foot + arm)
    for x in (start, end):
        canvas.line(x, foot, x, foot + 2.0 * arm)
    laid = "; lay cross on cross of one number" if tiles.pairs else ""
    canvas.drawString(end + 2.0 * arm, foot, f"{_BAR_MM:g} mm{laid}")
    canvas.showPage()


def _crosses(first: Window, second: Window) -> FloatArray:
    """Return where two pages have crosses: near opposite corners of what both show."""
    left, low, right, top = overlap(first, second).tolist()
    inset = _CROSS_MM[0] + 0.5
    if right - left < top - low:
        x = (left + right) / 2.0
        return np.array([[x, low + inset], [x, top - inset]])
    y = (low + top) / 2.0
    return np.array([[left + inset, y], [right - inset, y]])


def _cross(canvas: Canvas, name: str, x_mm: float, y_mm: float) -> None:
    """Draw a cross on a page, with its number beside it."""
    x, y, arm = _POINTS * x_mm, _POINTS * y_mm, _POINTS * _CROSS_MM[0]
    canvas.line(x - arm, y, x + arm, y)
    canvas.line(x, y - arm, x, y + arm)
    canvas.drawString(x + 2.0, y + 2.0, name)


def _draw(canvas: Canvas, drawing: SheetDrawing) -> None:
    """Draw all that is on a sheet, one stroke for each layer."""
    entities = [entity for piece in drawing.pieces for entity in piece.entities]
    entities.extend(drawing.notes)
    canvas.setLineJoin(1)
    canvas.setLineCap(1)
    for layer, (grey, width_mm) in _INK.items():
        path = canvas.beginPath()
        for entity in entities:
            if entity.layer is layer and _shown_width(entity) is None:
                _trace(path, entity)
        canvas.setStrokeGray(grey)
        canvas.setLineWidth(width_mm * _POINTS)
        canvas.drawPath(path, stroke=1, fill=0)
    canvas.setLineCap(0)
    canvas.setStrokeGray(0.0)
    for entity in entities:
        if (shown_mm := _shown_width(entity)) is not None:
            canvas.setLineWidth(shown_mm * _POINTS)
            path = canvas.beginPath()
            _trace(path, entity)
            canvas.drawPath(path, stroke=1, fill=0)


def _shown_width(entity: Entity) -> float | None:
    """Return how wide an entity is to be shown, where it says so."""
    return entity.width_mm if isinstance(entity, Polyline) else None


def _trace(path: PDFPathObject, entity: Entity) -> None:
    """Add a run or a circle to a path."""
    if isinstance(entity, Circle):
        path.circle(entity.x * _POINTS, entity.y * _POINTS, entity.radius * _POINTS)
        return
    points = (entity.points * _POINTS).tolist()
    path.moveTo(*points[0])
    goals = points[1:] + points[:1] * entity.closed
    if entity.bulges is None:
        for goal in goals:
            path.lineTo(*goal)
    else:
        for start, goal, bulge in zip(points, goals, entity.bulges.tolist(), strict=False):
            _side(path.lineTo, path.curveTo, start, goal, bulge)
    if entity.closed:
        path.close()


def _side(
    line: Callable[[float, float], None],
    curve: Callable[[float, float, float, float, float, float], None],
    start: list[float],
    goal: list[float],
    bulge: float,
) -> None:
    """Draw a straight side, or an arc as a cubic, which is as good as one up to a third of a turn.

    Its control points stand at (4/3) tan(sweep/4) times the radius along the tangents; the tangent
    of a quarter of the sweep is the bulge.
    """
    if bulge == 0.0:
        line(*goal)
        return
    begin, end = complex(*start), complex(*goal)
    half = 2.0 * np.arctan(bulge)
    chord = end - begin
    reach = 2.0 / 3.0 * bulge / np.sin(half)
    first_control = begin + reach * chord * np.exp(-1j * half)
    second_control = end - reach * chord * np.exp(1j * half)
    curve(
        first_control.real,
        first_control.imag,
        second_control.real,
        second_control.imag,
        end.real,
        end.imag,
    )
