"""Print a sheet at full size, to cut by hand or to lay on stock: one page, or tiles of paper."""

import io
from collections.abc import Callable

import numpy as np
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from fabweave.cut.drawing import Circle, Entity, Layer, Polyline, SheetDrawing

#: Paper to tile on: width and height in millimetres, upright.
PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
#: Printers leave so much of the paper white, and tiles lap by it, millimetres.
_BORDER_MM = 10.0
_POINTS = 72.0 / 25.4
_FORM = "sheet"
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
        ``"sheet"`` for one page as large as the sheet, or one of ``PAPERS_MM``: pages that show
        the sheet row by row from its lower left corner, each lapping its neighbours by 10 mm,
        with crosses at the corners of what it shows to lay them together by.

    Examples
    --------
    >>> tiles("a4", 600.0, 400.0)
    (4, 2)
    """
    file = io.BytesIO()
    size = (drawing.width_mm, drawing.height_mm) if paper == "sheet" else PAPERS_MM[paper]
    canvas = Canvas(file, pagesize=tuple(_POINTS * side for side in size), invariant=1)
    canvas.setTitle(f"{drawing.name}, full size")
    canvas.setCreator("fabweave")
    canvas.beginForm(_FORM, 0, 0, drawing.width_mm * _POINTS, drawing.height_mm * _POINTS)
    _draw(canvas, drawing)
    canvas.endForm()
    if paper == "sheet":
        canvas.doForm(_FORM)
        canvas.showPage()
    else:
        columns, rows = tiles(paper, drawing.width_mm, drawing.height_mm)
        for row in range(rows):
            for column in range(columns):
                _tile(canvas, drawing, paper, (column, row), (columns, rows))
    canvas.save()
    return file.getvalue()


def tiles(paper: str, width_mm: float, height_mm: float) -> tuple[int, int]:
    """Return how many columns and rows of a paper a sheet takes."""
    wide, high = (side - 2.0 * _BORDER_MM for side in PAPERS_MM[paper])
    # All but the first show so much that the one before does not.
    columns, rows = (
        1 + max(0, int(np.ceil((whole - shown) / (shown - _BORDER_MM) - 1e-9)))
        for whole, shown in ((width_mm, wide), (height_mm, high))
    )
    return columns, rows


def _tile(
    canvas: Canvas,
    drawing: SheetDrawing,
    paper: str,
    at: tuple[int, int],
    counts: tuple[int, int],
) -> None:
    """Draw the part of the sheet that one page shows."""
    wide, high = (side - 2.0 * _BORDER_MM for side in PAPERS_MM[paper])
    left, low = (
        place * (shown - _BORDER_MM) for place, shown in zip(at, (wide, high), strict=True)
    )
    canvas.saveState()
    window = canvas.beginPath()
    window.rect(*(_POINTS * side for side in (_BORDER_MM, _BORDER_MM, wide, high)))
    canvas.clipPath(window, stroke=0)
    canvas.translate(_POINTS * (_BORDER_MM - left), _POINTS * (_BORDER_MM - low))
    canvas.doForm(_FORM)
    canvas.restoreState()
    arm, mid = 4.0 * _POINTS, _POINTS * _BORDER_MM
    canvas.setLineWidth(0.2 * _POINTS)
    # Half the lap inside what is shown: on the page beside, the same place has a cross, too.
    inset = mid + mid / 2.0
    for x in (inset, mid + wide * _POINTS - mid / 2.0):
        for y in (inset, mid + high * _POINTS - mid / 2.0):
            canvas.line(x - arm, y, x + arm, y)
            canvas.line(x, y - arm, x, y + arm)
    canvas.setFont("Helvetica", 9)
    canvas.drawString(
        mid,
        mid / 2.0 - 3.0,
        f"{drawing.name}: column {at[0] + 1} of {counts[0]}, row {at[1] + 1} of {counts[1]} from "
        "the bottom. Print at 100 %; check the bar of 100 mm; lay cross on cross.",
    )
    canvas.showPage()


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
