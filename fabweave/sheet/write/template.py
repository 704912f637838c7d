"""Print a sheet at full size, to cut by hand or to lay on stock: one page, or tiles of paper."""

import cmath
import io
import math
from itertools import combinations
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.sheet.drawing import Circle, Entity, Layer, SheetDrawing
from fabweave.sheet.write.full_size import FullSizeCanvas

#: Paper to tile on: width and height in millimetres, upright.
PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
#: Printers leave so much of the paper white; the foot holds a line of text, too.
BORDER_MM, FOOT_MM = 5.0, 9.0
#: So much of the sheet is on both of two neighbouring pages.
LAP_MM = 10.0
# Around the pieces so much is shown, too.
_AROUND_MM = 1.0
_FLAT_MM, _SAME_MM = 0.1, 1e-6


class Window(NamedTuple):
    """What one page shows of a sheet: its lower left corner and its size, millimetres."""

    left: float
    low: float
    wide: float
    high: float

    @property
    def corners(self) -> FloatArray:
        """Least and greatest x and y: left, low, right, top."""
        return np.array([self.left, self.low, self.left + self.wide, self.low + self.high])


@frozen_value
class Tiles:
    """The pages of a sheet.

    Parameters
    ----------
    windows : tuple of Window
        What each shows, from the foot of the sheet upwards, and from the left.
    pairs : tuple of (int, int)
        The pages that show parts of one piece, and so are laid together.
    """

    windows: tuple[Window, ...]
    pairs: tuple[tuple[int, int], ...]


def window_sizes(paper: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return what a paper shows, width and height in millimetres: upright, and on its side.

    Examples
    --------
    >>> window_sizes("a4")
    ((200.0, 283.0), (287.0, 196.0))
    """
    short, long = PAPERS_MM[paper]
    across, along = 2.0 * BORDER_MM, BORDER_MM + FOOT_MM
    return (short - across, long - along), (long - across, short - along)


def page_tiles(drawing: SheetDrawing, paper: str) -> Tiles:
    """Return a grid of pages that shows all pieces of a sheet, without pages on which none lies.

    Pages are upright or on their side, whichever are fewer. What is within 5 mm of a place of a
    piece is on one page with it.

    Parameters
    ----------
    drawing : SheetDrawing
    paper : str
        One of ``PAPERS_MM``.
    """
    shapes = [shapely.Polygon(piece.outlines(_FLAT_MM)[0]) for piece in drawing.pieces]
    grids = (_grid(np.array(shapes), size) for size in window_sizes(paper))
    return min(grids, key=lambda tiles: len(tiles.windows))


def _grid(shapes: NDArray[np.object_], size: tuple[float, float]) -> Tiles:
    """Return the pages of one size that show shapes."""
    if not len(shapes):
        return Tiles((Window(0.0, 0.0, *size),), ())
    low, high = shapely.total_bounds(shapes).reshape(2, 2)
    (left, x), (foot, y) = map(_row, low - _AROUND_MM, high + _AROUND_MM, size)
    cells = shapely.box(x[:-1], y[:-1, None], x[1:], y[1:, None])
    shown = shapely.intersects(cells[..., None], shapes)
    places = np.argwhere(shown.any(axis=2)).tolist()
    pairs = (
        (first, second)
        for (first, one), (second, other) in combinations(enumerate(places), 2)
        if abs(one[0] - other[0]) + abs(one[1] - other[1]) == 1
        and np.any(shown[*one] & shown[*other])
    )
    windows = (Window(float(left[column]), float(foot[row]), *size) for row, column in places)
    return Tiles(tuple(windows), tuple(pairs))


def _row(low: float, high: float, side: float) -> tuple[FloatArray, FloatArray]:
    """Return where pages that lap begin, and the ends of what each is for: up to amid its laps."""
    step = side - LAP_MM
    count = max(int(np.ceil((high - low - LAP_MM - _SAME_MM) / step)), 1)
    starts = low + step * np.arange(count, dtype=np.float64)
    return starts, np.concatenate(([low], starts[1:] + LAP_MM / 2.0, [high]))


def overlap(first: Window, second: Window) -> FloatArray:
    """Return the rectangle that two pages both show: left, low, right, top."""
    one, other = first.corners, second.corners
    return np.concatenate((np.maximum(one[:2], other[:2]), np.minimum(one[2:], other[2:])))


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
        ``"sheet"`` for one page as large as the sheet, or one of ``PAPERS_MM``: a grid of pages
        that shows all pieces. Neighbours that show parts of one piece have crosses with the same
        number, to be laid on one another.

    Examples
    --------
    >>> sheet = SheetDrawing("sheet_01", 600.0, 400.0, (), ())
    >>> template_pdf(sheet, "a4")[:5]
    b'%PDF-'
    """
    file = io.BytesIO()
    whole = (drawing.width_mm, drawing.height_mm)
    canvas = FullSizeCanvas(file, pagesize=tuple(_POINTS * side for side in whole), invariant=1)
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
    """Return where two pages have crosses: amid what both show, a quarter of it from its ends."""
    corners = overlap(first, second).reshape(2, 2)
    share = np.full((2, 2), 0.5)
    share[:, np.argmax(corners[1] - corners[0])] = 0.25, 0.75
    return corners[0] + share * (corners[1] - corners[0])


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
            if entity.layer is layer:
                _trace(path, entity)
        canvas.setStrokeGray(grey)
        canvas.setLineWidth(width_mm * _POINTS)
        canvas.drawPath(path, stroke=1, fill=0)


def _trace(path: PDFPathObject, entity: Entity) -> None:
    """Add a run or a circle to a path."""
    if isinstance(entity, Circle):
        path.circle(entity.x * _POINTS, entity.y * _POINTS, entity.radius * _POINTS)
        return
    points = (entity.points * _POINTS).tolist()
    goals = points[1:] + points[:1] * entity.closed
    # A path writes one number at a time, which took most of a template's time.
    steps = ["{:.3f} {:.3f} m".format(*points[0])]
    steps += [
        "{:.3f} {:.3f} l".format(*goal) if bulge == 0.0 else _arc(start, goal, bulge)
        for start, goal, bulge in zip(points, goals, entity.bends.tolist(), strict=False)
    ]
    path._code.append(" ".join([*steps, "h"] if entity.closed else steps))


def _arc(start: list[float], goal: list[float], bulge: float) -> str:
    """Return an arc as a cubic, which is as good as one up to a third of a turn.

    Its control points stand at (4/3) tan(sweep/4) times the radius along the tangents; the tangent
    of a quarter of the sweep is the bulge.
    """
    begin, end = complex(*start), complex(*goal)
    half = 2.0 * math.atan(bulge)
    chord = end - begin
    reach = 2.0 / 3.0 * bulge / math.sin(half)
    first = begin + reach * chord * cmath.exp(-1j * half)
    second = end - reach * chord * cmath.exp(1j * half)
    return " ".join(f"{one.real:.3f} {one.imag:.3f}" for one in (first, second, end)) + " c"
