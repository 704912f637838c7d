"""Draw what stands on a sheet for people and is never cut: frame, reference bar, texts."""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.cut.drawing import Entity, Layer, Polyline
from fabweave.cut.labels.lettering import place_text, text_box
from fabweave.cut.notes.note_rows import Row, rows_within
from fabweave.cut.notes.stock_notes import outline_note

#: Lengths that a reference bar may have, the wanted one first.
_BAR_LENGTHS_MM = (100.0, 50.0, 20.0, 10.0)
_TEXT_MM, _SMALLEST_TEXT_MM = 2.5, 1.0
#: The arrow of the grain is so long at most, and goes so many letters from the middle of its row.
_ARROW_MM, _ARROW_RISE = 20.0, 0.8
_ELLIPSIS = ".."


def sheet_notes(
    width_mm: float,
    height_mm: float,
    text_lines: Sequence[str],
    *,
    margin_mm: float = 5.0,
    grain_deg: float | None = None,
    outline: Sequence[tuple[float, float]] = (),
    defects: Sequence[Sequence[tuple[float, float]]] = (),
) -> tuple[Entity, ...]:
    """Return the notes of a sheet: its frame, a reference bar of 100 mm, and texts.

    Whoever opens the file measures the bar before cutting: programs are known to mistake units.
    The bar and the first text stand in the lower margin, further texts in the upper one. On a sheet
    that is no rectangle, or has defects, they stand along its edges, on good material. A text that
    is too long is lettered smaller, then cut off with two dots.

    Parameters
    ----------
    width_mm, height_mm : float
        Size of the sheet.
    text_lines : sequence of str
        What to letter, such as ``["JOB SHEET 1/4"]``; lower case becomes capitals.
    margin_mm : float
        Width of the margin in which no piece stands; letters are 2.5 mm high, or less where it is
        narrow, but at least 1 mm.
    grain_deg : float or None
        The direction of the grain, which an arrow at the end of the second row shows.
    outline : sequence of points
        Of a sheet that is no rectangle.
    defects : sequence of rings

    Returns
    -------
    tuple of Entity
        Polylines on the layer NOTES, within the sheet. The frame comes first, then the bar. On a
        sheet too narrow for 100 mm the bar is 50, 20 or 10 mm long, and lettered so.

    Raises
    ------
    InputError
        If the sheet is smaller than 10 mm, or a text has a character that the font lacks.

    Examples
    --------
    >>> frame, bar, *letters = sheet_notes(600.0, 400.0, ["vase sheet 1/2"])
    >>> frame.points.tolist(), frame.closed
    ([[0.0, 0.0], [600.0, 0.0], [600.0, 400.0], [0.0, 400.0]], True)
    >>> float(np.ptp(bar.points[:, 0]))
    100.0
    """
    if not (width_mm >= 10.0 and height_mm >= 10.0):
        raise InputError(
            f"a sheet of {width_mm} x {height_mm} mm has no room for notes; both sides must "
            "be at least 10 mm"
        )
    letter = max(min(_TEXT_MM, 0.5 * margin_mm), _SMALLEST_TEXT_MM)
    inset = max(margin_mm, 2.0 * letter)
    ring = outline or [(0.0, 0.0), (width_mm, 0.0), (width_mm, height_mm), (0.0, height_mm)]
    entities: list[Entity] = [outline_note(ring)]
    if outline or defects:
        rows = rows_within(ring, defects, inset_mm=inset, letter_mm=letter)
    else:
        rows = _margins(width_mm, height_mm, inset, letter)
    if not rows:
        return tuple(entities)
    first = rows[0]
    length = next((bar for bar in _BAR_LENGTHS_MM if bar <= first.length), min(_BAR_LENGTHS_MM))
    entities.append(Polyline(Layer.NOTES, first.place(_bar(length, letter))))
    end = _letter(entities, f"{length:g} MM", letter, length + 2.0 * letter, first) + 4.0 * letter
    if text_lines:
        _letter(entities, text_lines[0], letter, end, first)
    if len(rows) > 1:
        _second_row(entities, text_lines[1:], letter, rows[1], grain_deg)
    return tuple(entities)


def _margins(width_mm: float, height_mm: float, inset: float, letter: float) -> list[Row]:
    """Return the rows of a rectangle: in the lower margin, and in the upper one if it is high."""
    # The middle of the capitals stands in the middle of the margin; underlines go below it.
    middle, room = inset / 2.0, width_mm - 2.0 * inset
    # A bar of the least length stands in the middle of a sheet that is hardly wider.
    least = min(_BAR_LENGTHS_MM)
    left = inset if least <= room else (width_mm - least) / 2.0
    length = width_mm - inset - left
    rows = [Row(left, y, 0.0, length) for y in (middle, height_mm - middle)]
    # On a sheet hardly higher than its margins there is no upper row beside the lower one.
    return rows if height_mm - 2.0 * middle >= 2.0 * letter else rows[:1]


def _second_row(
    entities: list[Entity], texts: Sequence[str], letter: float, row: Row, grain_deg: float | None
) -> None:
    """Letter further texts, and show the grain at the end of their row."""
    if grain_deg is not None:
        row = _grain(entities, grain_deg, letter, row)
    end = 0.0
    for text in texts:
        end = _letter(entities, text, letter, end, row) + 4.0 * letter


def _grain(entities: list[Entity], grain_deg: float, letter: float, row: Row) -> Row:
    """Draw an arrow with two heads along the grain; return the row before it and its text."""
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
        return row
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


def _letter(entities: list[Entity], text: str, letter: float, begin: float, row: Row) -> float:
    """Letter a text in a row from ``begin``, not beyond its end; return where it ends."""
    room = row.length - begin
    wide = text_box(text, letter).width  # objects to a missing character before any is cut off
    if not text or room <= 0.0:
        return begin
    height = max(_SMALLEST_TEXT_MM, letter * min(1.0, room / wide)) if wide else letter
    shown = _shortened(text, height, room)
    if not shown:
        return begin
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
