"""Draw what a sheet of stock is like, for people: its outline, its defects, and what is left."""

from collections.abc import Sequence

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.cut.drawing import Entity, Layer, Polyline, SheetDrawing
from fabweave.cut.labels.lettering import place_text
from fabweave.nest.offcut import Offcut
from fabweave.stock.sheet_size import SheetSize

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
    kept = _thinned(np.asarray(ring, dtype=np.float64))
    while len(kept) > 3 and np.hypot(*(kept[-1] - kept[0])) < _SHORT_MM:
        kept.pop()
    return Polyline(Layer.NOTES, np.array(kept), closed=True)


def _thinned(points: FloatArray) -> list[FloatArray]:
    """Return the points of a run that are far enough from the one before."""
    kept = [points[0]]
    for point in points[1:]:
        if np.hypot(*(point - kept[-1])) >= _SHORT_MM:
            kept.append(point)
    return kept


def stock_notes(sheet: SheetSize, offcut: Offcut | None = None) -> tuple[Entity, ...]:
    """Return the notes on a sheet that show its defects, hatched, and its offcut, dashed and named.

    Examples
    --------
    >>> knot = ((10.0, 10.0), (30.0, 10.0), (30.0, 30.0), (10.0, 30.0))
    >>> notes = stock_notes(SheetSize(100.0, 60.0, defects=(knot,)))
    >>> notes[0].closed, {note.closed for note in notes[1:]}
    (True, {False})
    """
    notes: list[Entity] = []
    for ring in sheet.defects:
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
        _thinned(np.concatenate([ends[0][k : k + 1], ring[first[k] : last[k]], ends[1][k : k + 1]]))
        for k in range(count)
    ]
    return [np.array(dash) for dash in dashes if len(dash) > 1]
