"""Check the tables that people work by: of pieces, of their stations, and of crossings."""

from collections.abc import Callable, Iterable, Mapping
from typing import TypeAlias

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats, chords_of, ring_area, ring_points
from fabweave.verify.read.job_files import CROSSINGS, PIECES, STATIONS, Job, required
from fabweave.verify.report import Place, Tally

#: What a cell should be: text, a number, or nothing.
_Cell: TypeAlias = str | int | float | None
_Row: TypeAlias = Mapping[str, _Cell]
#: Lengths along pieces are told to a tenth, and numbers of pieces to a thousandth, of outlines that
#: the map has as polygons near what is cut.
_ALONG_MM, _SIZE_MM = 0.051, 0.011


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
        due = list(rows())
        if place.equal("the number of its rows", len(stated), len(due)):
            for at, (row, cells) in enumerate(zip(stated, due, strict=True), start=1):
                check_row(row, cells, place.at(f"row {at}"))


def check_row(row: Mapping[str, str | None], cells: _Row, place: Place) -> None:
    """Hold the cells of a row to what they should be: numbers as they are rounded there."""
    for key, wanted in cells.items():
        stated = row.get(key)
        if not isinstance(wanted, float) or not stated:
            place.equal(key, stated, "" if wanted is None else str(wanted))
            continue
        digits = len(stated.partition(".")[2])
        within = _ALONG_MM if key == "distance_mm" else max(10.0**-digits, _SIZE_MM)
        within = max(within, 1e-3 * abs(wanted)) if "_mm2" in key else within
        place.number(key, _number(stated), wanted, within=within)


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
