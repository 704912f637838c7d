"""Check the tables that people work by: pieces, stations, crossings, marks and cuts of strips."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Piece, Sheet
from fabweave.verify.drawing import Floats, chords_of, ring_area, ring_points
from fabweave.verify.read.job_files import CROSSINGS, CUTS, PIECES, STATIONS, STICKS, Job, required
from fabweave.verify.report import Place, Tally

#: What a cell should be: text, a number, or nothing.
_Cell: TypeAlias = str | int | float | None
_Row: TypeAlias = Mapping[str, _Cell]
#: Lengths along pieces are told to a tenth, and numbers of pieces to a thousandth, of outlines that
#: the map has as polygons near what is cut.
_ALONG_MM, _SIZE_MM = 0.051, 0.011
#: What rounding does to places of marks and cuts, to those in thousandths of an inch, and to those
#: in thirty-seconds; a hole that is no farther from its crossing is at it.
_MARK_MM, _INCHES_MM, _PART_MM, _AT_MM = 0.0051, 0.0179, 25.4 / 64.0 + 0.0051, 1e-3
#: The columns that tell a length in inches, by what rounding does to it.
_IN_INCHES = {
    "distance_in": _INCHES_MM, "length_in": _INCHES_MM,
    "nearest_in": _PART_MM, "length_32nds": _PART_MM,
}  # fmt: skip
_INCH_MM = 25.4
_OF_A_RULE = re.compile(r"\d+|(?:\d+ )?\d+/[1-9]\d*")
#: Strips lie in a row, side by side, to this; what is less is no rest.
_ROW_MM = 2e-3


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


def check_cut_list(job: Job, tally: Tally) -> None:
    """Hold the list by which straight strips are cut by hand to where they lie, if in rows."""
    plan, place = required(job.map), tally.at(CUTS)
    cuts = [_cuts(plan, sheet) for sheet in plan.sheets]
    due = job.options.get("strips") == "straight" and None not in cuts
    if place.equal("whether there is one", job.cuts is not None, due) and job.cuts is not None:
        _check_rows(job.cuts, [row for rows in cuts for row in rows or ()], place, within=_MARK_MM)


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
        if key in _IN_INCHES:
            inches = _INCH_MM * _number(stated)
            place.number(f"{key}, in mm,", inches, wanted, within=_IN_INCHES[key])
            continue
        digits = len(stated.partition(".")[2])
        slack = _ALONG_MM if key == "distance_mm" else max(10.0**-digits, _SIZE_MM)
        slack = max(slack, 1e-3 * abs(wanted)) if "_mm2" in key else slack
        place.number(key, _number(stated), wanted, within=slack if within is None else within)


def _number(text: str) -> float:
    """Return a number, in decimals or as a rule has inches; what is none is no number."""
    if _OF_A_RULE.fullmatch(text):
        return float(sum(map(Fraction, text.split())))
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
            place = dict.fromkeys(("distance_mm", "distance_in", "nearest_in"), float(along))
            size = {"length_mm": float(length), "width_mm": float(width)}
            yield {**common, **size, **cells, **place, "across_mm": float(across)}


def _cuts(plan: CrossingMap, sheet: Sheet) -> list[_Row] | None:
    """Return what the list has of a sheet; None if its strips lie in no rows the gap apart.

    Cuts along rows come first, between two rows in the middle. Then comes each row, strip by strip
    from end to end, and its rest. A roll has one row, whose rest goes to the end of the roll.
    """
    pieces, sides = plan.on_sheet(sheet.number), (sheet.width_mm, sheet.height_mm)
    if not pieces:
        return None
    corners = [piece.placed(piece.outline) for piece in pieces]
    boxes = np.array([(points.min(axis=0), points.max(axis=0)) for points in corners])
    along = int(np.argmax(np.ptp(corners[0], axis=0)))
    low, high = boxes[:, :, 1 - along].T
    wide, order = high - low, np.argsort(low, kind="stable")
    first = order[np.diff(low[order], prepend=-np.inf) > _ROW_MM]
    apart = np.diff(low[first]) - wide.max() - plan.layout.gap_mm
    if max(np.ptp(wide), np.abs(apart).max(initial=0.0)) > _ROW_MM:
        return None
    middles = (low[first[1:]] + high[first[:-1]]) / 2.0
    edges = enumerate([low[first[0]], *middles, high[first[-1]]])
    inside = [(number, at) for number, at in edges if _ROW_MM < at < sides[1 - along] - _ROW_MM]
    rows = [_cut(sheet, "rip", number, None, None, at) for number, at in inside]
    row_of = np.searchsorted(low[first], low + _ROW_MM, side="right")
    for number in range(1, len(first) + 1):
        own, end = np.flatnonzero(row_of == number), 0.0
        for at in own[np.argsort(boxes[own, 0, along])].tolist():
            begin, end = boxes[at, :, along].tolist()
            rows.append(_cut(sheet, "piece", number, pieces[at].id, begin, end))
        whole = sheet.roll_mm or sides[along]
        if whole - end > _ROW_MM:
            rows.append(_cut(sheet, "rest", number, None, end, whole))
    return rows


def _cut(
    sheet: Sheet, cut: str, row: int, piece: str | None, begin_mm: float | None, end_mm: float
) -> _Row:
    """Return a row of the list; a cut along rows has no length."""
    length = None if begin_mm is None else end_mm - begin_mm
    return {
        "sheet": sheet.name, "cut": cut, "row": row, "piece": piece, "from_mm": begin_mm,
        "to_mm": end_mm, **dict.fromkeys(("length_mm", "length_in", "length_32nds"), length),
    }  # fmt: skip
