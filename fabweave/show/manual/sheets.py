"""Draw the sheets of the manual, with the names of their pieces and boxes to tick."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value, unit
from fabweave.plan.crossing_map import CrossingMap, Point, SheetRecord
from fabweave.sheet.drawing import Circle, Layer, Polyline, SheetDrawing
from fabweave.sheet.labels.texts import Title, place_titles
from fabweave.sheet.sheet_notes import hatch
from fabweave.show.manual.book import PLATE, SMALL, TEXT, Book, text_width

SHEETS, ROLLS = "Sheets", "Rolls"
#: A sheet is drawn in at most so many parts, if titles of most pieces would be smaller than this.
_MOST_TILES, _READABLE = 4, 8.0
#: The largest titles, in points, and how many rows of ids are a short list.
_LARGEST, _SHORT_LIST = 14.0, 8
_TITLE_MM = 14.0
_FLAT_MM = 0.1
#: Names are tried at so many places along a piece, the middle first.
_PLACES = 15
_TITLE = "Pieces of {}, to tick off as you take them out:"
_ROLL_TITLE = "Strips of {}, to cut off the roll in this order:"
_MARGIN_DASH, _REST_DASH = (1.0, 2.0), (6.0, 3.0)


@frozen_value
class DrawnPiece:
    """A piece as it is drawn on its sheet.

    Parameters
    ----------
    lines : tuple of (kind, points)
        Runs of points in millimetres on the sheet; the outline is closed.
    holes : (H, 3) float array
        x, y, radius.
    outline : (N, 2) float array
        Corners.
    """

    lines: tuple[tuple[Layer, FloatArray], ...]
    holes: FloatArray
    outline: FloatArray

    @property
    def middle(self) -> FloatArray:
        """The middle of its bounding box."""
        return (self.outline.min(axis=0) + self.outline.max(axis=0)) / 2.0


def drawn_pieces(*drawings: SheetDrawing) -> dict[str, DrawnPiece]:
    """Return the pieces of sheets, by their ids."""
    drawn = {}
    for piece in (piece for drawing in drawings for piece in drawing.pieces):
        lines, holes, outline = [], [], np.zeros((0, 2))
        for entity in piece.entities:
            if isinstance(entity, Circle):
                holes.append((entity.x, entity.y, entity.radius))
                continue
            points = entity.flattened(_FLAT_MM)
            if entity.layer is Layer.CUT_OUTER:
                outline = points
            else:
                closed = isinstance(entity, Polyline) and entity.closed
                lines.append((entity.layer, np.vstack((points, points[:1])) if closed else points))
        drawn[piece.piece_id] = DrawnPiece(tuple(lines), np.array(holes).reshape(-1, 3), outline)
    return drawn


def levelling(outline: FloatArray) -> FloatArray:
    """Return the turn, to the right of points, that lays the longest direction of one level.

    Examples
    --------
    >>> outline = np.array([[0, 0], [1, 1], [5, 5.0], [4, 4]])
    >>> (outline @ levelling(outline)).round(6)[:, 1].tolist()
    [0.0, 0.0, 0.0, 0.0]
    """
    _, _, axes = np.linalg.svd(outline - outline.mean(axis=0), full_matrices=False)
    x, y = axes[0] * (1.0 if axes[0, 0] >= 0.0 else -1.0)
    return np.array([[x, -y], [y, x]])


def write_sheets(book: Book, crossing_map: CrossingMap, drawings: Sequence[SheetDrawing]) -> None:
    """Draw every sheet with the names of its pieces, and list them to be ticked off."""
    margin_mm = crossing_map.layout.margin_mm
    several = len({(sheet.material, sheet.thickness_mm) for sheet in crossing_map.sheets}) > 1
    lines = {
        piece.id: crossing_map.on_sheet(
            piece, np.array([(station.x, station.y) for station in piece.stations])
        )
        for piece in crossing_map.to_cut
    }
    for sheet, drawing in zip(crossing_map.sheets, drawings, strict=True):
        titles = place_titles(drawing.pieces, largest_mm=_TITLE_MM)
        drawn = drawn_pieces(drawing)
        names = {piece.piece_id: piece.title for piece in drawing.pieces}
        if sheet.roll_mm is not None:
            book.page(ROLLS)
            name = f"roll {sheet.sheet}"
            book.entry(name, level=1)
            write_ticks(book, name, _strip_texts(drawn, names), _ROLL_TITLE)
            continue
        keys = _tick_texts(names)
        rows = -(-len(keys) // _tick_columns(book, keys))
        # A short list of pieces stands below its sheet, a long one on pages of its own.
        reserved = 60.0 + 15.0 * (rows if rows <= _SHORT_LIST else 0)
        tiles = _tiles(book, drawing, drawn, titles, sheet.outline, reserved)
        for number, tile in enumerate(tiles, start=1):
            book.page(SHEETS)
            if number == 1:
                book.entry(sheet.name, level=1)
            frame = _SheetWindow(book, tile.low, tile.size, reserved)
            book.y -= 14.0
            part = f", part {number} of {len(tiles)}" if len(tiles) > 1 else ""
            if not part and tuple(tile.size) != (drawing.width_mm, drawing.height_mm):
                part = ", the part with pieces"
            mirrored = ", mirrored, as it is cut" if sheet.mirrored else ""
            material = f", {sheet.material} {sheet.thickness_mm:g} mm" if several else ""
            turned = ", left edge at the bottom" if frame.quarter else ""
            book.text(
                book.left,
                book.y,
                f"{sheet.name}{part}: {drawing.width_mm:g} x {drawing.height_mm:g} mm{material}"
                f"{mirrored}{turned}, scale 1 : {72.0 / 25.4 / frame.scale:.1f}",
                bold=True,
            )
            with frame.window():
                draw_stock(book, sheet, margin_mm, frame.at)
            for key in tile.pieces:
                book.line(frame.at(drawn[key].outline), width=0.5, closed=True, fill=0.92)
            _write_titles(book, frame, tile.pieces, titles, names, lines)
            low, wide = frame.bottom - 4.0, book.right - book.left
            book.y = book.block(book.left, low, stock_words(sheet), wide, size=SMALL)
        if rows > _SHORT_LIST:
            book.page(SHEETS)
        write_ticks(book, sheet.name, keys)


@frozen_value
class _Tile:
    """A part of a sheet that is drawn on one page: its corner, its size, and its pieces."""

    low: FloatArray
    size: FloatArray
    pieces: list[str]


def _tiles(
    book: Book,
    drawing: SheetDrawing,
    drawn: dict[str, DrawnPiece],
    titles: dict[str, Title],
    outline: Sequence[Point],
    reserved: float,
) -> list[_Tile]:
    """Cut a sheet along its longer side into parts so large that most titles can be read."""
    size = np.array([drawing.width_mm, drawing.height_mm])
    heights = sorted(title.height_mm for title in titles.values()) or [_TITLE_MM]
    axis = int(np.argmax(size))
    for count in range(1, _MOST_TILES + 1):
        part = size / np.where(np.arange(2) == axis, count, 1)
        if fitting_scale(book, part, reserved) * heights[len(heights) // 2] >= _READABLE:
            break
    if count == 1:
        return [_Tile(np.zeros(2), size, list(drawn))]
    tiles = []
    for number in range(count):
        keys = [
            key for key, piece in drawn.items()
            if min(int(piece.middle[axis] / part[axis]), count - 1) == number
        ]  # fmt: skip
        if keys:
            corners = np.concatenate([drawn[key].outline for key in keys])
            low, high = np.zeros(2), size.copy()
            low[axis], high[axis] = corners[:, axis].min() - 2.0, corners[:, axis].max() + 2.0
            # A ragged sheet may be narrower here than elsewhere: what is not there takes no room.
            seen = shapely.intersection(shapely.Polygon(outline), shapely.box(*low, *high))
            low, high = np.reshape(seen.bounds, (2, 2))
            tiles.append(_Tile(low, high - low, keys))
    return tiles


def _write_titles(
    book: Book,
    frame: "_SheetWindow",
    keys: Sequence[str],
    titles: dict[str, Title],
    names: Mapping[str, str],
    lines: Mapping[str, FloatArray],
) -> None:
    """Write each piece's name, never on its head: inside it, or across it where it is narrow."""
    narrow: dict[str, FloatArray] = {}
    for key in keys:
        title = titles.get(key) or Title(0.0, 0.0, height_mm=0.0)
        size = min(title.height_mm * frame.scale, _LARGEST)
        if size < _READABLE:
            narrow[key] = frame.at(lines[key])
            continue
        angle = upright(title.angle_deg + (90.0 if frame.quarter else 0.0))
        ((x, y),) = frame.at(np.array([[title.x, title.y]])).tolist()
        book.text(x, y, names[key], size=size, bold=True, align=0.5, angle_deg=angle, middle=True)
    for key, (x, y, angle) in place_across(narrow).items():
        book.plate(x, y, names[key], angle_deg=angle)


def fitting_scale(book: Book, size: FloatArray, reserved: float) -> float:
    """Return how many points a millimetre has if an area fills a page, its longer side upright.

    So many points of the page's height are reserved for texts.
    """
    room = book.right - book.left, book.top - book.foot - 22.0 - reserved
    return min(room[0] / float(size.min()), room[1] / float(size.max()))


class _SheetWindow:
    """An area of a sheet on the page, turned by a quarter if it is wide."""

    def __init__(self, book: Book, low: FloatArray, size: FloatArray, reserved: float) -> None:
        self._book, self._low = book, low
        self.scale = fitting_scale(book, size, reserved)
        self.quarter = bool(size[0] > size[1])
        wide, high = (size[::-1] if self.quarter else size) * self.scale
        self._wide, self._high = float(wide), float(high)
        self.bottom = book.y - 22.0 - self._high

    def window(self) -> AbstractContextManager[None]:
        """Draw only what is inside the area, and the lines along its border."""
        corner = self._book.left - 1.0, self.bottom - 1.0
        return self._book.clipped(*corner, self._wide + 2.0, self._high + 2.0)

    def at(self, points: FloatArray) -> FloatArray:
        """Return where points of the sheet stand on the page."""
        x, y = ((points - self._low) * self.scale).T
        if self.quarter:
            x, y = self._wide - y, x
        return np.column_stack((x + self._book.left, y + self.bottom))


def _tick_texts(names: Mapping[str, str]) -> list[str]:
    """Return what is ticked off of a sheet: each piece, or each kind with its number.

    Examples
    --------
    >>> _tick_texts({"A10": "A10", "A2": "A2"}), _tick_texts({"A1": "K1", "B1": "K2", "A2": "K1"})
    (['A2', 'A10'], ['K1 x 2', 'K2 x 1'])
    """
    by_kind = any(key != name for key, name in names.items())
    counts = Counter(names.values())
    return [
        f"{name} x {counts[name]}" if by_kind else name for name in sorted(counts, key=_natural)
    ]


def _strip_texts(drawn: Mapping[str, DrawnPiece], names: Mapping[str, str]) -> list[str]:
    """Return what is cut of a roll: each strip with its length, in the order of cutting."""
    order = sorted(drawn, key=lambda key: float(drawn[key].outline[:, 0].min()))
    return [f"{names[key]}  {np.ptp(drawn[key].outline[:, 0]):.1f} mm" for key in order]


def write_ticks(book: Book, name: str, keys: Sequence[str], title: str = _TITLE) -> None:
    """Write the list of a sheet's pieces, each with a box to tick."""
    book.y -= 14.0
    book.text(book.left, book.y, title.format(name), bold=True)
    book.y -= 16.0
    columns = _tick_columns(book, keys)
    for number, key in enumerate(keys):
        column = number % columns
        if number and not column:
            book.y -= 15.0
            if book.y < book.foot:
                book.page(SHEETS)
                book.y -= 14.0
        x = book.left + column * (book.right - book.left) / columns
        book.tick_box(x, book.y - 1.0, 9.0)
        book.text(x + 13.0, book.y, key)


def _tick_columns(book: Book, keys: Sequence[str]) -> int:
    """Return how many ids with their boxes stand in a row."""
    widest = max((text_width(key, TEXT) for key in keys), default=1.0)
    return int((book.right - book.left) / (widest + 22.0))


def _natural(key: str) -> tuple[str, int]:
    """Sort A2 before A10."""
    letters = key.rstrip("0123456789")
    return letters, int(key[len(letters) :] or 0)


def draw_stock(
    book: Book,
    sheet: SheetRecord,
    margin_mm: float,
    at: Callable[[FloatArray], FloatArray],
) -> None:
    """Draw a sheet without its pieces.

    Parameters
    ----------
    book : Book
    sheet : SheetRecord
    margin_mm : float
        Dotted.
    at : callable
        Takes points of the sheet, (N, 2), to the page.
    """
    whole = shapely.Polygon(sheet.outline)
    book.line(at(np.array(sheet.outline)), width=1.0, closed=True)
    for ring in _rings(shapely.buffer(whole, -margin_mm)):
        book.line(at(ring), width=0.4, grey=0.5, closed=True, dash=_MARGIN_DASH)
    for defect in sheet.defects:
        spoilt = shapely.make_valid(shapely.Polygon(defect))
        for ring in _rings(shapely.intersection(spoilt, whole)):
            book.line(at(ring), width=0.4, grey=0.3, closed=True)
            for line in hatch(ring):
                book.line(at(line), width=0.3, grey=0.5)
    if sheet.rest is not None:
        border = np.array(sheet.rest.outline)
        book.line(at(border), width=0.6, grey=0.45, closed=True, dash=_REST_DASH)


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


def _rings(shape: Any) -> list[FloatArray]:
    """Return the outlines of polygons, without their last points, which are their first."""
    return [
        shapely.get_coordinates(part.exterior)[:-1]
        for part in shapely.get_parts(shape)
        if part.geom_type == "Polygon" and not part.is_empty
    ]


def upright(angle_deg: float) -> float:
    """Return the direction of a text that is not on its head, between -90 and 90 degrees.

    Examples
    --------
    >>> upright(135.0), upright(-90.0), upright(90.0)
    (-45.0, 90.0, 90.0)
    """
    return float(90.0 - (90.0 - angle_deg) % 180.0)


def place_across(lines: Mapping[str, FloatArray]) -> dict[str, tuple[float, float, float]]:
    """Find a place for the name of each piece, along it, clear of the names before if it can be.

    Parameters
    ----------
    lines : mapping from piece id to (N, 2) float array
        Along the middle of each piece on the page, in points.

    Returns
    -------
    dict from piece id to (x, y, angle)
        Middle of the name, and its direction in degrees. A name that is clear nowhere stands where
        it is farthest from others.

    Examples
    --------
    >>> [round(float(value), 1) for value in place_across({"A1": np.eye(2) * 100.0})["A1"]]
    [50.0, 50.0, -45.0]
    """
    places: dict[str, tuple[float, float, float]] = {}
    taken = np.full((1, 2), np.inf)
    for key, line in lines.items():
        reach = text_width(key, PLATE, bold=True) / 2
        best = -np.inf
        for middle, way in _candidates(line):
            # A name is clear if the middles of its letters are.
            spots = middle + way * np.linspace(-reach, reach, 5)[:, None]
            gaps = np.linalg.norm(spots[:, None] - taken, axis=2)
            clear = min(float(gaps.min()), PLATE)
            if clear > best:
                best, chosen = clear, spots
                angle = upright(float(np.degrees(np.arctan2(way[1], way[0]))))
                places[key] = float(middle[0]), float(middle[1]), angle
            if clear >= PLATE:
                break
        taken = np.concatenate((taken, chosen))
    return places


def _candidates(line: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield places along a line with the direction there, from the middle outwards."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
    steps = np.linspace(0.0, 1.0, _PLACES)
    steps = steps[np.argsort(np.abs(steps - 0.5), kind="stable")]
    before, here, after = (
        np.column_stack([np.interp(shares * along[-1], along, axis) for axis in line.T])
        for shares in (steps - 0.05, steps, steps + 0.05)
    )
    ways = after - before if len(line) > 1 else np.array([[1.0, 0.0]] * _PLACES)
    yield from zip(here, unit(ways), strict=True)
