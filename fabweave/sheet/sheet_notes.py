"""Draw what stands on a sheet for people and is never cut: frame, reference bar, texts."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.nest.offcut import Offcut, thinned
from fabweave.sheet.drawing import Entity, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.sheet.labels.lettering import place_text, text_box
from fabweave.stock.sheet_size import Ring, SheetSize

_HATCH_MM = 4.0  # between the lines in a defect
_DASH_MM, _PERIOD_MM = 6.0, 10.0
_SHORT_MM = 0.15  # shorter sides are not drawn
_LETTER_MM = 6.0


def outline_note(ring: Sequence[tuple[float, float]] | FloatArray) -> Polyline:
    """Return a closed line on NOTES, its corners at least 0.15 mm apart.

    Examples
    --------
    >>> len(outline_note([(0.0, 0.0), (9.0, 0.0), (9.0, 0.1), (0.0, 9.0)]).points)
    3
    """
    kept = thinned(np.asarray(ring, dtype=np.float64), _SHORT_MM)
    while len(kept) > 3 and np.hypot(*(kept[-1] - kept[0])) < _SHORT_MM:
        kept.pop()
    return Polyline(Layer.NOTES, np.array(kept), closed=True)


def stock_notes(sheet: SheetSize, offcut: Offcut | None = None) -> tuple[Entity, ...]:
    """Return the notes on a sheet that show its defects, hatched, and its offcut, dashed and named.

    Examples
    --------
    >>> knot = ((10.0, 10.0), (30.0, 10.0), (30.0, 30.0), (10.0, 30.0))
    >>> notes = stock_notes(SheetSize(100.0, 60.0, defects=(knot,)))
    >>> notes[0].closed, {note.closed for note in notes[1:]}
    (True, {False})
    >>> stock_notes(SheetSize(20.0, 60.0, defects=(knot,)))[0].points.max(axis=0).tolist()
    [20.0, 30.0]
    """
    notes: list[Entity] = []
    for ring in (part for defect in sheet.defects for part in _on_sheet(defect, sheet)):
        if np.ptp(np.array(ring), axis=0).min() >= 2.0 * _SHORT_MM:
            notes.append(outline_note(ring))
            notes.extend(Polyline(Layer.NOTES, line) for line in hatch(ring))
    if offcut is not None:
        notes.extend(Polyline(Layer.NOTES, line) for line in _dashes(offcut.outline))
        x, y = offcut.rectangle.mean(axis=0).tolist()
        height = min(_LETTER_MM, min(offcut.rectangle_mm) / 4.0)
        strokes = place_text(offcut.name.upper().replace("_", " "), height, (x, y), 0.0)
        notes.extend(Polyline(Layer.NOTES, stroke) for stroke in strokes)
    return tuple(notes)


def _on_sheet(ring: Ring, sheet: SheetSize) -> list[Sequence[tuple[float, float]] | FloatArray]:
    """Return the parts of a polygon that lie on a sheet; its edge may run through it."""
    whole, defect = (shapely.make_valid(shapely.Polygon(one)) for one in (sheet.ring, ring))
    if whole.covers(defect):
        return [ring]
    parts = shapely.get_parts(shapely.intersection(whole, defect))
    return [
        shapely.get_coordinates(part.exterior)[:-1] for part in parts if part.geom_type == "Polygon"
    ]


def draw_offcut(offcut: Offcut, sheet: SheetSize) -> SheetDrawing:
    """Return the drawing of an offcut alone, in the frame of its sheet; nothing in it is cut."""
    rings = (offcut.outline, *offcut.holes)
    lines = tuple(Polyline(Layer.NOTES, ring, closed=True) for ring in rings)
    return SheetDrawing(offcut.name, sheet.width_mm, sheet.height_mm, (), lines)


def hatch(ring: Sequence[tuple[float, float]] | FloatArray) -> list[FloatArray]:
    """Return lines at 45 degrees across a polygon, 4 mm from one another.

    Examples
    --------
    >>> lines = hatch([(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)])
    >>> len(lines), {round(float(np.ptp(line @ [1.0, -1.0])), 9) for line in lines}
    (7, {0.0})
    """
    polygon = shapely.make_valid(shapely.Polygon(ring))
    low_x, low_y, high_x, high_y = polygon.bounds
    # Each line has one value of y - x; they stand on multiples, so that neighbours line up.
    step = _HATCH_MM * np.sqrt(2.0)
    first, last = np.ceil((low_y - high_x) / step), np.floor((high_y - low_x) / step)
    rise = step * np.arange(first, last + 1.0)
    ends = np.array([[low_x, high_x]])
    lines = np.stack([np.broadcast_to(ends, (len(rise), 2)), ends + rise[:, None]], axis=2).reshape(
        -1, 2, 2
    )
    crossed = shapely.get_parts(shapely.intersection(shapely.linestrings(lines), polygon))
    hatching = [shapely.get_coordinates(part) for part in crossed]
    return [
        line for line in hatching if len(line) == 2 and np.hypot(*(line[1] - line[0])) > _SHORT_MM
    ]


def _dashes(outline: FloatArray) -> list[FloatArray]:
    """Return dashes along a closed line, with its corners."""
    ring = np.concatenate([outline, outline[:1]])
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(ring, axis=0).T)))
    count = max(int(way[-1] / _PERIOD_MM), 3)
    begin = np.arange(count) * (way[-1] / count)
    end = np.minimum(begin + _DASH_MM, way[-1])
    ends = [np.column_stack([np.interp(at, way, axis) for axis in ring.T]) for at in (begin, end)]
    first, last = np.searchsorted(way, begin, "right"), np.searchsorted(way, end, "left")
    dashes = [
        thinned(
            np.concatenate([ends[0][k : k + 1], ring[first[k] : last[k]], ends[1][k : k + 1]]),
            _SHORT_MM,
        )
        for k in range(count)
    ]
    return [np.array(dash) for dash in dashes if len(dash) > 1]


_Polygon: TypeAlias = Any  # shapely ships no types

#: A row shorter than this is of no use, millimetres.
SHORTEST_ROW_MM = 10.0
# Edges that deviate less than this from a straight line are one.
_STRAIGHT_MM = 0.2
# Letters go so many of their heights beyond the middle of their row.
_BAND = 0.85
# A level row is taken before another one that is not twice as long.
_LEVEL = 2.0
_LEVELS = 64


class Row(NamedTuple):
    """A stretch to letter on: where its middle line begins, which way it is read, its length."""

    x: float
    y: float
    angle_deg: float
    length: float

    def place(self, points: FloatArray) -> FloatArray:
        """Return points along the row, and above its middle line, where they are on the sheet.

        Examples
        --------
        >>> Row(10.0, 5.0, 90.0, 50.0).place(np.array([[20.0, 1.0]])).round(9).tolist()
        [[9.0, 25.0]]
        """
        angle = np.deg2rad(self.angle_deg)
        way = np.array([np.cos(angle), np.sin(angle)])
        return np.asarray(points @ np.array([way, [-way[1], way[0]]]) + (self.x, self.y))


def rows_within(
    outline: Sequence[tuple[float, float]] | FloatArray,
    taken: Sequence[Sequence[tuple[float, float]] | FloatArray],
    *,
    inset_mm: float,
    letter_mm: float,
) -> list[Row]:
    """Return rows on the free material of a sheet of any outline, the best first.

    They run along its straight edges, half the inset from them, off defects and pieces; level ones
    are preferred to others, and long ones to short ones. A sheet with no room at a straight edge
    has one level row, where there is most.

    Parameters
    ----------
    outline : (K, 2) points
    taken : sequence of rings
        Defects, and the outlines of pieces.
    inset_mm : float
        Twice the distance of a row from its edge.
    letter_mm : float
        How high letters are at the most.

    Examples
    --------
    >>> wedge = [(0.0, 0.0), (300.0, 0.0), (0.0, 200.0)]
    >>> [round(row.angle_deg) for row in rows_within(wedge, [], inset_mm=5.0, letter_mm=2.5)]
    [0, -34, 90]
    """
    band = _BAND * letter_mm
    whole = shapely.Polygon(outline)
    full = [shapely.make_valid(shapely.Polygon(ring)) for ring in taken]
    room = shapely.buffer(shapely.difference(whole, shapely.union_all(full)), -band)
    straight = shapely.simplify(whole, _STRAIGHT_MM).exterior
    ring = shapely.get_coordinates(straight if straight.is_ccw else shapely.reverse(straight))
    start, side = ring[:-1], np.diff(ring, axis=0)
    length = np.hypot(*side.T)
    long = length >= SHORTEST_ROW_MM
    inward = np.column_stack([-side[:, 1], side[:, 0]])[long] / length[long, None]
    first = start[long] + inset_mm / 2.0 * inward
    rows = _rows(np.stack([first, first + side[long]], axis=1), room, band)
    if not rows:
        low, high = whole.bounds[1], whole.bounds[3]
        level = np.linspace(low, high, _LEVELS + 2)[1:-1]
        ends = np.array([whole.bounds[0], whole.bounds[2]])
        lines = np.stack([np.tile(ends, (len(level), 1)), np.repeat(level, 2).reshape(-1, 2)], 2)
        rows = _rows(lines, room, band)[:1]
    return rows


def _rows(lines: FloatArray, room: _Polygon, band: float) -> list[Row]:
    """Return the longest stretch of each line that has room, as rows; the best first."""
    rows = []
    for line in lines:
        parts = shapely.get_parts(shapely.intersection(shapely.LineString(line), room))
        parts = [part for part in parts if part.geom_type == "LineString" and part.length]
        if not parts:
            continue
        ends = shapely.get_coordinates(max(parts, key=lambda part: round(part.length, 6)))[[0, -1]]
        way = ends[1] - ends[0]
        # Read from the left, or upwards.
        if way[0] < -1e-9 or (abs(way[0]) <= 1e-9 and way[1] < 0.0):
            ends, way = ends[::-1], -way
        length = float(np.hypot(*way)) - 2.0 * band
        if length >= SHORTEST_ROW_MM:
            x, y = (ends[0] + band / (length + 2.0 * band) * way).tolist()
            rows.append(Row(x, y, float(np.rad2deg(np.arctan2(way[1], way[0]))), length))
    return sorted(rows, key=lambda row: (-_worth(row), row))


def _worth(row: Row) -> float:
    return round(row.length * (_LEVEL if abs(row.angle_deg) < 1.0 else 1.0), 6)


#: Lengths that a reference bar may have, the wanted one first.
_BAR_LENGTHS_MM = (100.0, 50.0, 20.0, 10.0)
_TEXT_MM, _SMALLEST_TEXT_MM = 2.5, 1.0
#: The arrow of the grain is so long at most, and goes so many letters from the middle of its row.
_ARROW_MM, _ARROW_RISE = 20.0, 0.8
_ELLIPSIS = ".."
#: Letters are farther off pieces than chords from their arcs, millimetres.
_FLAT_MM = 0.02


class SheetNotes(NamedTuple):
    """The notes of a sheet, its frame first, and what was left out because it has no room."""

    drawn: tuple[Entity, ...]
    left_out: tuple[str, ...]


def sheet_notes(
    sheet: SheetSize,
    text_lines: Sequence[str],
    *,
    margin_mm: float = 5.0,
    pieces: Sequence[PieceDrawing] = (),
) -> SheetNotes:
    """Return the notes of a sheet: its frame, a reference bar of 100 mm, and texts.

    Whoever opens the file measures the bar before cutting: programs are known to mistake units.
    The bar and the first text stand in the lower margin, further texts in the upper one. On a sheet
    that is no rectangle, or has defects, or no margin to letter on, they stand along its edges, on
    good material that no piece takes. A text that is too long is lettered smaller, then cut off
    with two dots, then left out.

    Parameters
    ----------
    sheet : SheetSize
        An arrow at the end of the second row shows its grain, if it has one.
    text_lines : sequence of str
        What to letter, such as ``["JOB SHEET 1/4"]``; lower case becomes capitals.
    margin_mm : float
        Width of the margin in which no piece stands; letters are 2.5 mm high, or less where it is
        narrow, but at least 1 mm.
    pieces : sequence of PieceDrawing
        What is cut from it.

    Returns
    -------
    SheetNotes
        Polylines on the layer NOTES, within the sheet; none on a roll. The frame comes first, then
        the bar. On a sheet too narrow for 100 mm the bar is 50, 20 or 10 mm long, and lettered so.

    Raises
    ------
    InputError
        If a text has a character that the font lacks.

    Examples
    --------
    >>> frame, bar, *letters = sheet_notes(SheetSize(600.0, 400.0), ["vase sheet 1/2"]).drawn
    >>> frame.points.tolist(), frame.closed
    ([[0.0, 0.0], [600.0, 0.0], [600.0, 400.0], [0.0, 400.0]], True)
    >>> float(np.ptp(bar.points[:, 0]))
    100.0
    >>> sheet_notes(SheetSize(600.0, 8.0), ["vase"], margin_mm=0.0).left_out
    ()
    >>> sheet_notes(SheetSize(600.0, 1.0), ["vase"], margin_mm=0.0).left_out
    ('the reference bar', 'the title')
    """
    if sheet.is_roll:
        # Its strips leave no margin to letter on, and its edges are theirs.
        return SheetNotes((), ())
    letter = max(min(_TEXT_MM, 0.5 * margin_mm), _SMALLEST_TEXT_MM)
    inset = max(margin_mm, 2.0 * letter)
    entities: list[Entity] = [outline_note(sheet.ring)]
    if sheet.outline or sheet.defects or inset > margin_mm:
        cut = [ring for piece in pieces for ring in piece.outlines(_FLAT_MM)]
        rows = rows_within(sheet.ring, (*sheet.defects, *cut), inset_mm=inset, letter_mm=letter)
    else:
        rows = _margins(sheet.width_mm, sheet.height_mm, inset, letter)
    first, second = (*rows, None, None)[:2]
    begin, left_out = 0.0, ["the reference bar"] * (first is None)
    if first is not None:
        length = next((bar for bar in _BAR_LENGTHS_MM if bar <= first.length), _BAR_LENGTHS_MM[-1])
        entities.append(Polyline(Layer.NOTES, first.place(_bar(length, letter))))
        begin = length + 2.0 * letter
        end = _letter(entities, f"{length:g} MM", letter, begin, first)
        left_out += ["the length of the reference bar"] * (end is None)
        begin = (end or begin) + 4.0 * letter
    if text_lines and _letter(entities, text_lines[0], letter, begin, first) is None:
        left_out.append("the title")
    left_out += _second_row(entities, text_lines[1:], letter, second, sheet.grain_deg)
    return SheetNotes(tuple(entities), tuple(left_out))


def left_out_notes(drawings: Sequence[SheetDrawing]) -> list[Note]:
    """Return a note on what sheets have no room for, beside what is cut.

    Examples
    --------
    >>> left_out_notes([SheetDrawing("sheet_01", 20.0, 10.0, (), (), left_out=("the title",))])
    ['notes: 1 sheet has no room for the title (sheet_01); a larger --sheet or --margin may help']
    """
    bare = [drawing.name for drawing in drawings if drawing.left_out]
    if not bare:
        return []
    what = dict.fromkeys(text for drawing in drawings for text in drawing.left_out)
    told = agree(len(bare), "notes: {n} sheet[ has|s have] no room for ")
    told += f"{', '.join(what)} ({few_of(bare)}); a larger --sheet or --margin may help"
    return [Note("notes", told)]


def _margins(width_mm: float, height_mm: float, inset: float, letter: float) -> list[Row]:
    """Return the rows of a rectangle: in the lower margin, and in the upper one if it is high."""
    # The middle of the capitals stands in the middle of the margin; underlines go below it.
    middle, room = inset / 2.0, width_mm - 2.0 * inset
    # A bar of the least length stands in the middle of a sheet that is hardly wider.
    least = min(_BAR_LENGTHS_MM)
    if width_mm < least or height_mm < inset:
        return []
    left = inset if least <= room else (width_mm - least) / 2.0
    length = width_mm - inset - left
    rows = [Row(left, y, 0.0, length) for y in (middle, height_mm - middle)]
    # On a sheet hardly higher than its margins there is no upper row beside the lower one.
    return rows if height_mm - 2.0 * middle >= 2.0 * letter else rows[:1]


def _second_row(
    entities: list[Entity],
    texts: Sequence[str],
    letter: float,
    row: Row | None,
    grain_deg: float | None,
) -> list[str]:
    """Letter further texts, and show the grain at the end of their row; return what has no room."""
    left_out = []
    if grain_deg is not None:
        before = None if row is None else _grain(entities, grain_deg, letter, row)
        row = before or row
        left_out += ["the arrow of the grain"] * (before is None)
    begin = 0.0
    for text in texts:
        end = _letter(entities, text, letter, begin, row)
        left_out += [f"'{text}'"] * (end is None)
        begin = begin if end is None else end + 4.0 * letter
    return left_out


def _grain(entities: list[Entity], grain_deg: float, letter: float, row: Row) -> Row | None:
    """Draw an arrow with two heads along the grain; return the row before it and its text.

    None where there is no room for it.
    """
    angle = np.deg2rad(grain_deg - row.angle_deg)
    way = np.array([np.cos(angle), np.sin(angle)])
    # As long as the row allows, which is little for a grain across it.
    rise = _ARROW_RISE * letter
    length = min(_ARROW_MM, row.length / 3.0, 2.0 * rise / max(abs(way[1]), 1e-9))
    half, back = length / 2.0 * way, min(letter, 0.4 * length) * way
    side = 0.5 * back[::-1] * np.array([-1.0, 1.0])
    heads = [
        np.array([tip + inward + side, tip, tip + inward - side])
        for tip, inward in ((half, -back), (-half, back))
    ]
    arrow = np.stack([*heads, [-half, half, half]])
    # Its heads may reach farther than its ends.
    arrow *= min(1.0, rise / np.abs(arrow[:, :, 1]).max())
    wide = float(np.abs(arrow[:, :, 0]).max())
    if row.length < 2.0 * wide + letter:
        return None
    arrow[:, :, 0] += row.length - wide - letter
    for run in (arrow[2, :2], arrow[0], arrow[1]):
        entities.append(Polyline(Layer.NOTES, row.place(run)))
    begin = row.length - 2.0 * wide - 3.0 * letter - text_box("GRAIN", letter).width
    if begin <= 0.0:
        return row
    _letter(entities, "GRAIN", letter, begin, row)
    return row._replace(length=begin - 2.0 * letter)


def _bar(length: float, letter: float) -> FloatArray:
    """Return a bar with a tick at each end, drawn in one stroke; its x extent is its length."""
    tick = letter / 2.0
    return np.array([[0.0, tick], [0.0, -tick], [length, -tick], [length, tick]])


def _letter(
    entities: list[Entity], text: str, letter: float, begin: float, row: Row | None
) -> float | None:
    """Letter a text in a row from ``begin``, not beyond its end; return where it ends.

    None where there is no room for it.
    """
    wide = text_box(text, letter).width  # objects to a missing character before any is cut off
    room = row.length - begin if row is not None else 0.0
    if not text:
        return begin
    height = max(_SMALLEST_TEXT_MM, letter * min(1.0, room / wide)) if wide else letter
    shown = _shortened(text, height, room)
    if row is None or not shown:
        return None
    box = text_box(shown, height)
    ((x, y),) = row.place(np.array([[begin + box.width / 2.0, box.bottom / 2.0]])).tolist()
    strokes = place_text(shown, height, (x, y), row.angle_deg)
    entities.extend(Polyline(Layer.NOTES, stroke) for stroke in strokes)
    return begin + box.width


def _shortened(text: str, height: float, room: float) -> str:
    """Return a text as it is if it fits, or its longest beginning that fits with two dots."""
    limit = room * (1.0 + 1e-9)
    if text_box(text, height).width <= limit:
        return text
    fitting = bisect_right(
        range(len(text)), limit, key=lambda count: text_box(text[:count] + _ELLIPSIS, height).width
    )
    return text[: fitting - 1] + _ELLIPSIS if fitting > 1 else ""
