"""Find what to mark on straight strips: one story stick for each kind of piece."""

from fractions import Fraction
from itertools import groupby
from operator import attrgetter
from typing import Literal

import numpy as np

from fabweave.core.arrays import frozen_value
from fabweave.core.units import unit_mm
from fabweave.plan.crossing_map import CrossingMap, PieceRecord

#: A hole that is no farther from its station is drilled there.
_SAME_MM = 1e-3
#: Rules of people who count in inches have so many parts to an inch.
_PARTS = 32


@frozen_value
class StickMark:
    """Something to mark on a strip.

    Parameters
    ----------
    what : {"cut", "crossing", "joint", "hole", "slot"}
        A hole or a slot is one that is not in the middle of a crossing.
    station : int or None
        In the first piece of the kind; None where the strip is cut off.
    along_mm, across_mm : float
        From the start of the strip, and from its right edge.
    over : bool or None
        How the strip crosses others there.
    hole_mm : float or None
    """

    what: Literal["cut", "crossing", "joint", "hole", "slot"]
    station: int | None
    along_mm: float
    across_mm: float
    over: bool | None = None
    hole_mm: float | None = None


@frozen_value
class Stick:
    """What all strips of a kind have in common.

    Parameters
    ----------
    kind : int
    pieces : tuple of PieceRecord
    spares : tuple of str
        What is cut besides, each like the first piece.
    length_mm, width_mm : float
    marks : tuple of StickMark
        From the start of the first to its end.
    """

    kind: int
    pieces: tuple[PieceRecord, ...]
    spares: tuple[str, ...]
    length_mm: float
    width_mm: float
    marks: tuple[StickMark, ...]


def story_sticks(crossing_map: CrossingMap) -> tuple[Stick, ...]:
    """Return what to mark on the strips of a map whose pieces are straight, kind by kind."""
    kind, spares = attrgetter("kind"), crossing_map.spares or ()
    sticks = []
    for number, group in groupby(sorted(crossing_map.pieces, key=kind), kind):
        pieces = tuple(group)
        names = {piece.id for piece in pieces}
        own = tuple(spare.id for spare in spares if spare.of in names)
        sticks.append(_stick(number, pieces, own))
    return tuple(sticks)


def station_of(piece: PieceRecord, station: int) -> int:
    """Return which station of a piece lies on one of the first of its kind."""
    return len(piece.stations) - 1 - station if piece.turned else station


def _stick(kind: int, pieces: tuple[PieceRecord, ...], spares: tuple[str, ...]) -> Stick:
    """Return the stick of pieces of a kind."""
    piece = pieces[0]
    outline = np.array(piece.outline)
    (left, low), (length, width) = outline.min(axis=0), np.ptp(outline, axis=0).tolist()
    marks = [StickMark("cut", None, along, width / 2.0) for along in (0.0, length)]
    slotted = {cutout.station for cutout in piece.cutouts if cutout.hole is None}
    for at, station in enumerate(piece.stations):
        joined = any(one.stations[station_of(one, at)].joint is not None for one in pieces)
        what: Literal["joint", "crossing"] = "joint" if joined else "crossing"
        place = station.x - left, station.y - low
        hole_mm = None if at in slotted else station.hole_mm
        marks.append(StickMark(what, at, *place, station.over, hole_mm))
    for cutout in piece.cutouts:
        station = piece.stations[cutout.station]
        if cutout.hole is None:
            path = np.array(cutout.path)[:, :2]
            x, y = ((path.min(axis=0) + path.max(axis=0)) / 2.0).tolist()
            marks.append(StickMark("slot", cutout.station, x - left, y - low))
            continue
        x, y, diameter = cutout.hole
        if np.hypot(x - station.x, y - station.y) > _SAME_MM:
            marks.append(StickMark("hole", cutout.station, x - left, y - low, None, diameter))
    marks.sort(key=attrgetter("along_mm"))
    return Stick(kind, pieces, spares, length, width, tuple(marks))


def nearest_inches(length_mm: float) -> str:
    """Return a length to the nearest thirty-second of an inch, as rules have it.

    Examples
    --------
    >>> nearest_inches(80.2), nearest_inches(12.7), nearest_inches(51.0), nearest_inches(0.1)
    ('3 5/32', '1/2', '2', '0')
    """
    whole, parts = divmod(round(length_mm / unit_mm("in") * _PARTS), _PARTS)
    words = [str(whole)] * (whole != 0 or not parts) + [str(Fraction(parts, _PARTS))] * (parts > 0)
    return " ".join(words)
