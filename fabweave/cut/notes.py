"""Draw what stands on a sheet for people and is never cut: frame, reference bar, texts."""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from fabweave.arrays import FloatArray
from fabweave.cut.drawing import Entity, Layer, Polyline
from fabweave.cut.lettering import place_text, text_box, text_width
from fabweave.errors import InputError

#: Lengths that a reference bar may have, the wanted one first.
_BAR_LENGTHS_MM = (100.0, 50.0, 20.0, 10.0)
_SMALLEST_TEXT_MM = 1.0
_ARROW_MM = 20.0
_ELLIPSIS = ".."


def sheet_notes(
    width_mm: float,
    height_mm: float,
    text_lines: Sequence[str],
    *,
    margin_mm: float = 5.0,
    text_height_mm: float = 2.5,
    grain_deg: float | None = None,
) -> tuple[Entity, ...]:
    """Return the notes of a sheet: its frame, a reference bar of 100 mm, and texts.

    Whoever opens the file measures the bar before cutting: programs are known to mistake units.
    The bar and the first text stand in the lower margin, further texts in the upper one. A text
    that is too long is lettered smaller, then cut off with two dots.

    Parameters
    ----------
    width_mm, height_mm : float
        Size of the sheet.
    text_lines : sequence of str
        What to letter, such as ``["JOB SHEET 1/4"]``; lower case becomes capitals.
    margin_mm : float
        Width of the margin in which no piece stands.
    text_height_mm : float
        Height of the letters, less where the margin is narrow, at least 1 mm.
    grain_deg : float or None
        The direction of the grain, which an arrow at the right of the upper margin shows.

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
            f"a sheet of {width_mm} x {height_mm} mm has no room for notes; take at least 10 mm"
        )
    letter = max(min(text_height_mm, 0.5 * margin_mm), _SMALLEST_TEXT_MM)
    inset = max(margin_mm, 2.0 * letter)
    frame = np.array([[0, 0], [width_mm, 0], [width_mm, height_mm], [0, height_mm]], dtype=float)
    room = width_mm - 2.0 * inset
    length = next((bar for bar in _BAR_LENGTHS_MM if bar <= room), min(_BAR_LENGTHS_MM))
    left = inset if length <= room else (width_mm - length) / 2.0
    # The middle of the capitals stands in the middle of the margin; underlines go below it.
    middle = inset / 2.0
    entities: list[Entity] = [
        Polyline(Layer.NOTES, frame, closed=True),
        Polyline(Layer.NOTES, _bar(left, middle, length, letter)),
    ]
    right = width_mm - inset
    bar_name = f"{length:g} MM"
    end = left + length + 2.0 * letter
    end = _letter(entities, bar_name, letter, end, right=right, middle=middle) + 4.0 * letter
    if text_lines:
        _letter(entities, text_lines[0], letter, end, right=right, middle=middle)
    end, top = left, height_mm - middle
    if grain_deg is not None and top - middle >= 2.0 * letter:
        right = _grain(entities, grain_deg, letter, left=left, right=right, middle=top)
    # On a sheet hardly higher than its margins there is no upper row beside the lower one.
    for text in text_lines[1:] if top - middle >= 2.0 * letter else ():
        end = _letter(entities, text, letter, end, right=right, middle=top) + 4.0 * letter
    return tuple(entities)


def _grain(
    entities: list[Entity], grain_deg: float, letter: float, *, left: float, right: float,
    middle: float,
) -> float:  # fmt: skip
    """Draw an arrow with two heads along the grain; return where it begins, with its text."""
    way = np.array([np.cos(np.deg2rad(grain_deg)), np.sin(np.deg2rad(grain_deg))])
    # As long as the row allows, which is little for a grain across it.
    length = min(_ARROW_MM, 1.6 * letter / max(abs(way[1]), 1e-9), (right - left) / 3.0)
    half = length / 2.0 * way
    centre = np.array([right - abs(half[0]) - letter, middle])
    back = min(letter, 0.4 * length) * way
    side = 0.5 * back[::-1] * np.array([-1.0, 1.0])
    entities.append(Polyline(Layer.NOTES, np.array([centre - half, centre + half])))
    for tip, inward in ((centre + half, -back), (centre - half, back)):
        head = np.array([tip + inward + side, tip, tip + inward - side])
        entities.append(Polyline(Layer.NOTES, head))
    begin = centre[0] - abs(half[0]) - 2.0 * letter - text_width("GRAIN", letter)
    if begin <= left:
        return right
    _letter(entities, "GRAIN", letter, begin, right=right, middle=middle)
    return float(begin) - 2.0 * letter


def _bar(left: float, y: float, length: float, letter: float) -> FloatArray:
    """Return a bar with a tick at each end, drawn in one stroke; its x extent is its length."""
    tick = letter / 2.0
    right = left + length
    return np.array(
        [[left, y + tick], [left, y - tick], [right, y - tick], [right, y + tick]],
    )


def _letter(
    entities: list[Entity], text: str, letter: float, left: float, *, right: float, middle: float
) -> float:
    """Letter a text from ``left``, not beyond ``right``; return where it ends."""
    room = right - left
    wide = text_width(text, letter)  # objects to a missing character before any is cut off
    if not text or room <= 0.0:
        return left
    height = max(_SMALLEST_TEXT_MM, letter * min(1.0, room / wide)) if wide else letter
    shown = _shortened(text, height, room)
    if not shown:
        return left
    box = text_box(shown, height)
    centre = (left + box.width / 2.0, middle + box.bottom / 2.0)
    strokes = place_text(shown, height, centre, 0.0)
    entities.extend(Polyline(Layer.NOTES, stroke) for stroke in strokes)
    return left + box.width


def _shortened(text: str, height: float, room: float) -> str:
    """Return a text as it is if it fits, or its longest beginning that fits with two dots."""
    limit = room * (1.0 + 1e-9)
    if text_width(text, height) <= limit:
        return text
    fitting = bisect_right(
        range(len(text)), limit, key=lambda count: text_width(text[:count] + _ELLIPSIS, height)
    )
    return text[: fitting - 1] + _ELLIPSIS if fitting > 1 else ""
