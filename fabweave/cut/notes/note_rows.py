"""Find where notes may stand on a sheet: rows in its margin, on the material."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray

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
    defects: Sequence[Sequence[tuple[float, float]]],
    *,
    inset_mm: float,
    letter_mm: float,
) -> list[Row]:
    """Return rows on the material of a sheet of any outline, the best first.

    They run along its straight edges, half the inset from them, off defects; level ones are
    preferred to others, and long ones to short ones. A sheet without a straight edge has one level
    row, where it is widest.

    Parameters
    ----------
    outline : (K, 2) points
    defects : sequence of rings
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
    spoilt = [shapely.make_valid(shapely.Polygon(ring)) for ring in defects]
    room = shapely.buffer(shapely.difference(whole, shapely.union_all(spoilt)), -band)
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
        parts = [part for part in parts if part.geom_type == "LineString"]
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
