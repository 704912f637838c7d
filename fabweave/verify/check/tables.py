"""Check the tables that people work by: of pieces, stations, crossings, and marks of strips."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats, chords_of, ring_area, ring_points
from fabweave.verify.read.job_files import CROSSINGS, PIECES, STATIONS, STICKS, Job, required
from fabweave.verify.report import Place, Tally

#: What a cell should be: text, a number, or nothing.
_Cell: TypeAlias = str | int | float | None
_Row: TypeAlias = Mapping[str, _Cell]
#: Lengths along pieces are told to a tenth, and numbers of pieces to a thousandth, of outlines that
#: the map has as polygons near what is cut.
_ALONG_MM, _SIZE_MM = 0.051, 0.011
#: What rounding does to places of marks, to those in inches, and to thirty-seconds of an inch; a
#: hole that is no farther from its crossing is at it.
_MARK_MM, _INCHES_MM, _PART_MM, _AT_MM = 0.0051, 0.0128, 25.4 / 64.0 + 1e-6, 1e-3


def check_tables(job: Job, tally: Tally) -> None:
    """Hold every row of these tables to the plan, in the plan's order."""
    plan = required(job.map)
    wanted: dict[str, Callable[[], Iterable[_Row]]] = {
        PIECES: lambda: _pieces(job, plan),
        STATIONS: lambda: _stations(plan),
        CROSSINGS: lambda: _crossings(plan),
    }
    for name, rows in wanted.items():
        place, stated = tally.at(name), job.tables.get(name)
        if stated is None:
            place.fail("it is not checked, because it could not be read")
            continue
        _check_rows(stated, list(rows()), place)


def check_sticks(job: Job, tally: Tally) -> None:
    """Hold the marks of straight strips to the first piece of each kind, in the order of both."""
    plan, place, rows = required(job.map), tally.at(STICKS), job.sticks
    straight = job.options.get("strips") == "straight"
    if not place.equal("whether there is one", rows is not None, straight) or rows is None:
        return
    _check_rows(rows, list(_marks(plan)), place, within=_MARK_MM)
    for at, row in enumerate(rows, start=1):
        along, here = _number(row["distance_mm"]), place.at(f"row {at}")
        inches = 25.4 * _number(row["distance_in"])
        here.number("distance_in, in mm,", inches, along, within=_INCHES_MM + _MARK_MM)
        parts = 25.4 * float(sum(map(Fraction, row["nearest_in"].split())))
        here.number("nearest_in, in mm,", parts, along, within=_PART_MM + _MARK_MM)


def _check_rows(
    stated: Sequence[Mapping[str, str]],
    due: Sequence[_Row],
    place: Place,
    within: float | None = None,
) -> None:
    """Hold the rows of a table to those that it should have, in their order."""
    if place.equal("the number of its rows", len(stated), len(due)):
        for at, (row, cells) in enumerate(zip(stated, due, strict=True), start=1):
            check_row(row, cells, place.at(f"row {at}"), within)


def check_row(
    row: Mapping[str, str | None], cells: _Row, place: Place, within: float | None = None
) -> None:
    """Hold the cells of a row to what they should be: numbers as they are rounded there."""
    for key, wanted in cells.items():
        stated = row.get(key)
        if not isinstance(wanted, float) or not stated:
            place.equal(key, stated, "" if wanted is None else str(wanted))
            continue
        digits = len(stated.partition(".")[2])
        slack = _ALONG_MM if key == "distance_mm" else max(10.0**-digits, _SIZE_MM)
        slack = max(slack, 1e-3 * abs(wanted)) if "_mm2" in key else slack
        place.number(key, _number(stated), wanted, within=slack if within is None else within)


def _number(text: str) -> float:
    """Return a number; what is none is no number."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _pieces(job: Job, plan: CrossingMap) -> Iterable[_Row]:
    """Yield what the table has of each piece, and of each spare after them."""
    for piece in plan.to_cut:
        supply = job.supplies[piece.thread]
        length, width = np.ptp(piece.outline, axis=0).tolist()
        yield {
            "id": piece.id,
            "thread": plan.thread[piece.thread].label,
            "sheet": piece.sheet,
            "length_mm": length,
            "width_mm": width,
            "area_mm2": net_area(piece),
            "holes": len(piece.cutouts),
            "kind": piece.kind,
            "material": supply.material,
            "thickness_mm": supply.thickness_mm,
            **({"spare_of": plan.spare_of.get(piece.id)} if plan.spares else {}),
        }


def net_area(piece: Piece) -> float:
    """Return the area of a piece, without what is cut out of it."""
    holes = sum(np.pi * hole.diameter_mm**2 / 4.0 for hole in piece.holes)
    return ring_area(piece.path) - holes - sum(abs(ring_area(slot)) for slot in piece.slots)


def cut_length(piece: Piece) -> float:
    """Return how long everything is that is cut of a piece."""
    rings = [ring_points(ring) for ring in (piece.path, *piece.slots)]
    round_about = sum(np.pi * hole.diameter_mm for hole in piece.holes)
    return round_about + sum(_length(ring) for ring in rings)


def _length(points: Floats) -> float:
    return float(np.hypot(*chords_of(points)[:-1].T).sum())


def _stations(plan: CrossingMap) -> Iterable[_Row]:
    """Yield what the table has of each station of each piece."""
    step_of = {crossing: step.step for step in plan.steps for crossing in step.crossings}
    for piece in plan.pieces:
        apart = np.hypot(*np.diff(piece.points, axis=0, prepend=piece.points[:1]).T)
        along = np.cumsum(apart).tolist()
        for at, (station, distance) in enumerate(zip(piece.stations, along, strict=True)):
            crossing = plan.crossing[station.crossing]
            partner = crossing.under if station.over else crossing.over
            pair = () if station.joint is None else plan.joint[station.joint].pieces
            others = [name for name in pair if name != piece.id] or list(pair)
            yield {
                "piece": piece.id,
                "station": at,
                "crossing": station.crossing,
                "distance_mm": distance,
                "lies": "over" if station.over else "under",
                "partner": partner.piece,
                "partner_station": partner.station,
                "joint": station.joint,
                "mate": others[0] if others else None,
                "hole_mm": station.hole_mm,
                "step": step_of.get(station.crossing),
            }


def _crossings(plan: CrossingMap) -> Iterable[_Row]:
    """Yield what the table has of each crossing."""
    for crossing in plan.crossings:
        over, under = crossing.over, crossing.under
        upper, lower = (plan.piece[one.piece].stations[one.station] for one in (over, under))
        yield {
            "crossing": crossing.id,
            "over_piece": over.piece,
            "over_station": over.station,
            "under_piece": under.piece,
            "under_station": under.station,
            "joint": upper.joint if lower.joint is None else lower.joint,
            "hole_mm": lower.hole_mm,
            **dict(zip("xyz", crossing.position, strict=True)),
        }


def _marks(plan: CrossingMap) -> Iterable[_Row]:
    """Yield what is to be marked on the first piece of each kind, from its start to its end."""
    for kind in sorted({piece.kind for piece in plan.pieces}):
        pieces = [piece for piece in plan.pieces if piece.kind == kind]
        first = pieces[0]
        common: dict[str, _Cell] = {
            "kind": kind,
            "pieces": " ".join(piece.id for piece in plan.to_cut if piece.kind == kind),
            "turned": " ".join(piece.id for piece in pieces if piece.turned),
        }
        (left, low), (length, width) = first.outline.min(axis=0), np.ptp(first.outline, axis=0)
        marks: list[tuple[float, float, dict[str, _Cell]]] = [
            (at, width / 2.0, {"mark": "cut", "station": None, "lies": None, "hole_mm": None})
            for at in (0.0, length)
        ]
        joints = [one.stations[:: -1 if one.turned else 1] for one in pieces]
        slotted = {cutout.station for cutout in first.cutouts if cutout.path is not None}
        for at, station in enumerate(first.stations):
            joined = any(stations[at].joint is not None for stations in joints)
            cells: dict[str, _Cell] = {
                "mark": "joint" if joined else "crossing",
                "station": at,
                "lies": "over" if station.over else "under",
                "hole_mm": None if at in slotted else station.hole_mm,
            }
            marks.append((station.x - left, station.y - low, cells))
        for cutout in first.cutouts:
            (x, y), station = cutout.centre, first.stations[cutout.station]
            slot = cutout.path is not None
            if slot or np.hypot(x - station.x, y - station.y) > _AT_MM:
                cells = {
                    "mark": "slot" if slot else "hole",
                    "station": cutout.station,
                    "lies": None,
                    "hole_mm": None if slot else cutout.diameter_mm,
                }
                marks.append((x - left, y - low, cells))
        for along, across, cells in sorted(marks, key=lambda mark: mark[0]):
            place = {"distance_mm": float(along), "across_mm": float(across)}
            yield {**common, "length_mm": float(length), "width_mm": float(width), **cells, **place}
