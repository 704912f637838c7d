"""Print a sheet at full size, to cut by hand or to lay on stock: one page, or tiles of paper."""

import io
from itertools import combinations
from typing import NamedTuple

import numpy as np
import shapely
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.sheet.drawing import Circle, Entity, Layer, SheetDrawing
from fabweave.sheet.write.full_size import FullSizeCanvas

#: Paper to tile on: width and height in millimetres, upright.
PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
#: Printers leave so much of the paper white; the foot holds a line of text, too.
BORDER_MM, FOOT_MM = 5.0, 9.0
#: So much on either side of a cut through a piece is on both pages.
LAP_MM = 10.0
# Around a piece so much is shown, too.
_AROUND_MM = 1.0
# Pieces that no page holds are parted into cells so large, or larger where they would be too many.
_CELL_MM, _MOST_CELLS = 10.0, 4000
_FLAT_MM, _SAME_MM = 0.1, 1e-6
# Pieces are kept whole if that takes no more than so many times the pages.
_WHOLE_WORTH = 1.5
# A box that is a piece, and no part of one.
_WHOLE = -1
#: From which side a sweep comes: which coordinates of boxes are compared, and then which.
_WAYS = ((1, 0), (0, 1), (3, 0), (2, 1), (1, 2), (0, 3), (3, 2), (2, 3))
#: What a box is worth: this power of its area.
_POWERS = (1.0, 0.5, 0.0)


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
    """Return the pages of a paper, upright or on their side, that show all pieces of a sheet.

    A piece that fits on a page is whole on one, unless that takes far more pages. Others are
    parted: what is within 5 mm of a place of such a piece is on one page with it.

    Parameters
    ----------
    drawing : SheetDrawing
    paper : str
        One of ``PAPERS_MM``.

    Notes
    -----
    To cover boxes by as few rectangles of two sizes as can be is a set cover. Each sweep takes the
    page that shows most of what is left beside the outermost box; pages that show nothing alone
    are left out in the end. Of sweeps from all sides the fewest pages win.
    """
    sizes = window_sizes(paper)
    whole = _cover(_boxes(drawing, sizes, keep=True), sizes)
    least = np.ceil(_area_mm2(drawing) / max(wide * high for wide, high in sizes))
    if len(whole.windows) <= _WHOLE_WORTH * least:
        return whole  # no pages show more than their area
    parted = _cover(_boxes(drawing, sizes, keep=False), sizes)
    return whole if len(whole.windows) <= _WHOLE_WORTH * len(parted.windows) else parted


def _cover(boxes: "_Boxes", sizes: tuple[tuple[float, float], ...]) -> Tiles:
    """Return pages that show all boxes."""
    if not len(boxes.corners):
        return Tiles((Window(0.0, 0.0, *sizes[0]),), ())
    candidates = [_Candidates(boxes.corners, size) for size in sizes]
    found = (
        _pruned(boxes.corners, _sweep(boxes.corners, candidates, way, power))
        for way in _WAYS
        for power in _POWERS
    )
    apart = _apart(boxes.corners, min(found, key=len))
    windows = tuple(sorted(apart, key=lambda one: (round(one.low, 3), one.left)))
    shown = _shown(boxes.corners, windows)
    parts = [set(boxes.piece[row].tolist()) - {_WHOLE} for row in shown]
    pairs = tuple(
        (first, second)
        for first, second in combinations(range(len(windows)), 2)
        if parts[first] & parts[second] and _laps(windows[first], windows[second])
    )
    return Tiles(windows, pairs)


def overlap(first: Window, second: Window) -> FloatArray:
    """Return the rectangle that two pages both show: left, low, right, top."""
    one, other = first.corners, second.corners
    return np.concatenate((np.maximum(one[:2], other[:2]), np.minimum(one[2:], other[2:])))


def _laps(first: Window, second: Window) -> bool:
    """Say whether two pages lap enough to be laid together."""
    left, low, right, top = overlap(first, second).tolist()
    return bool(min(right - left, top - low) >= LAP_MM - _SAME_MM)


@frozen_value
class _Boxes:
    """What is to be on a page as a whole: corners (B, 4), and the parted piece of each, (B,)."""

    corners: FloatArray
    piece: IntArray


def _boxes(drawing: SheetDrawing, sizes: tuple[tuple[float, float], ...], *, keep: bool) -> _Boxes:
    """Return the boxes around pieces that fit and are kept whole, and those of parts of others."""
    cell = max(_CELL_MM, float(np.sqrt(drawing.width_mm * drawing.height_mm / _MOST_CELLS)))
    corners, owner = [np.zeros((0, 4))], [np.zeros(0, dtype=np.int64)]
    for number, piece in enumerate(drawing.pieces):
        outline = piece.outlines(_FLAT_MM)[0]
        low, high = outline.min(axis=0) - _AROUND_MM, outline.max(axis=0) + _AROUND_MM
        if keep and any(np.all(high - low <= size) for size in sizes):
            corners.append(np.concatenate((low, high))[None])
            owner.append(np.array([_WHOLE]))
            continue
        x, y = (
            np.arange(first, last) * cell
            for first, last in np.column_stack((np.floor(low / cell), np.ceil(high / cell)))
        )
        corner = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        squares = shapely.box(*corner.T, *(corner + cell).T)
        shape = shapely.Polygon(outline)
        shapely.prepare(shape)
        touched = corner[shapely.intersects(shape, squares)]
        grown = (
            np.maximum(touched - LAP_MM / 2.0, low),
            np.minimum(touched + cell + LAP_MM / 2.0, high),
        )
        corners.append(np.concatenate(grown, axis=1))
        owner.append(np.full(len(touched), number))
    return _Boxes(np.concatenate(corners), np.concatenate(owner))


class _Candidates:
    """Pages of one size whose left and lower edges are those of boxes, and what each shows.

    Others need not be tried: a page may be moved to the right and up until it is such a one.
    """

    def __init__(self, boxes: FloatArray, size: tuple[float, float]) -> None:
        self.size = size
        self.starts, self._shows = [], []
        for axis in (0, 1):
            low, high = boxes[:, axis].round(6), boxes[:, axis + 2]
            start = np.unique(low)
            self.starts.append(start)
            ends = start[:, None] + size[axis] + _SAME_MM
            self._shows.append((start[:, None] <= low) & (high <= ends))

    def best(self, worth: FloatArray, left: IntArray, must: int) -> tuple[float, Window]:
        """Return the page that shows most of what is left, and a certain box; and how much."""
        places = [np.flatnonzero(shows[:, must]) for shows in self._shows]
        across, up = (
            shows[np.ix_(at, left)].astype(np.float64)
            for shows, at in zip(self._shows, places, strict=True)
        )
        if not across.size or not up.size:
            return 0.0, Window(0.0, 0.0, *self.size)
        value = ((across * worth) @ up.T).round(6)
        at, over = np.unravel_index(int(np.argmax(value)), value.shape)
        x, y = self.starts[0][places[0][at]], self.starts[1][places[1][over]]
        return float(value[at, over]), Window(float(x), float(y), *self.size)


def _sweep(
    boxes: FloatArray, candidates: list[_Candidates], way: tuple[int, int], power: float
) -> list[Window]:
    """Take pages until all boxes are shown, always one with the outermost box of those left."""
    area = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    first, second = (boxes[:, side] * (-1.0 if side > 1 else 1.0) for side in way)
    left = np.lexsort((second, first))
    windows: list[Window] = []
    while len(left):
        worth = area[left] ** power
        found = (one.best(worth, left, int(left[0])) for one in candidates)
        windows.append(max(found, key=lambda pair: pair[0])[1])
        left = left[~_shown(boxes[left], windows[-1:])[0]]
    return windows


def _pruned(boxes: FloatArray, windows: list[Window]) -> list[Window]:
    """Leave out pages all of whose boxes others show, those that show least first."""
    shown = _shown(boxes, windows)
    kept = np.ones(len(windows), dtype=bool)
    for at in np.argsort(shown.sum(axis=1), kind="stable").tolist():
        others = kept.copy()
        others[at] = False
        if shown[others].any(axis=0).all():
            kept = others
    return [window for window, stays in zip(windows, kept.tolist(), strict=True) if stays]


def _apart(boxes: FloatArray, windows: list[Window]) -> list[Window]:
    """Move pages that show alone what others do not, so that they show little twice."""
    windows = list(windows)
    for at, (_, _, *size) in enumerate(windows):
        others = windows[:at] + windows[at + 1 :]
        own = boxes[~_shown(boxes, others).any(axis=0)]
        ends = np.array([own[:, 2:].max(axis=0) - size, own[:, :2].min(axis=0)]).tolist()
        places = [windows[at], *(Window(x, y, *size) for (x, y) in _corners(ends))]
        twice = [sum(_area(overlap(place, other)) for other in others) for place in places]
        windows[at] = places[int(np.argmin(np.round(twice, 3)))]
    return windows


def _corners(ends: list[list[float]]) -> list[tuple[float, float]]:
    """Return the four places between which a page may be moved."""
    return [(x, y) for x in (ends[0][0], ends[1][0]) for y in (ends[0][1], ends[1][1])]


def _area(box: FloatArray) -> float:
    """Return the area of a rectangle: left, low, right, top; nothing if it is none."""
    return float(np.prod(np.maximum(box[2:] - box[:2], 0.0)))


def _shown(boxes: FloatArray, windows: tuple[Window, ...] | list[Window]) -> BoolArray:
    """Return which boxes each page shows as a whole, (P, B)."""
    corners = np.array([window.corners for window in windows]).reshape(-1, 4)[:, None]
    return np.asarray(
        (corners[..., :2] <= boxes[:, :2] + _SAME_MM).all(axis=-1)
        & (boxes[:, 2:] - _SAME_MM <= corners[..., 2:]).all(axis=-1)
    )


def _area_mm2(drawing: SheetDrawing) -> float:
    """Return the area of all pieces, which pages have to show at least."""
    return sum(float(shapely.Polygon(piece.outlines(_FLAT_MM)[0]).area) for piece in drawing.pieces)


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
    path.moveTo(*points[0])
    goals = points[1:] + points[:1] * entity.closed
    bulges = np.zeros(len(points)) if entity.bulges is None else entity.bulges
    for start, goal, bulge in zip(points, goals, bulges.tolist(), strict=False):
        _side(path, start, goal, bulge)
    if entity.closed:
        path.close()


def _side(path: PDFPathObject, start: list[float], goal: list[float], bulge: float) -> None:
    """Draw a straight side, or an arc as a cubic, which is as good as one up to a third of a turn.

    Its control points stand at (4/3) tan(sweep/4) times the radius along the tangents; the tangent
    of a quarter of the sweep is the bulge.
    """
    if bulge == 0.0:
        path.lineTo(*goal)
        return
    begin, end = complex(*start), complex(*goal)
    half = 2.0 * np.arctan(bulge)
    chord = end - begin
    reach = 2.0 / 3.0 * bulge / np.sin(half)
    first = begin + reach * chord * np.exp(-1j * half)
    second = end - reach * chord * np.exp(1j * half)
    path.curveTo(first.real, first.imag, second.real, second.imag, end.real, end.imag)
