"""Check that the tables for people say what the crossing map says."""

import math
from collections.abc import Mapping

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.read.job_files import Job, Rows, required
from fabweave.verify.statement import Place, Tally, cell_number

#: Tables may round lengths to a thousandth; distances in the table of stations to a tenth.
SAME_MM, _ROUGHLY_MM = 6e-4, 0.0501


def check_tables(job: Job, tally: Tally) -> None:
    """Check crossing_map.csv, pieces.csv and stations.csv against crossing_map.json."""
    plan = required(job.map)
    for name, rows, check in (
        ("crossing_map.csv", job.crossing_rows, _check_crossings),
        ("pieces.csv", job.piece_rows, _check_pieces),
        ("stations.csv", job.station_rows, _check_stations),
    ):
        check(plan, required(rows), tally.at(name).against("crossing_map.json"))


def _check_cells(
    row: dict[str, str],
    names: Mapping[str, object],
    numbers: Mapping[str, float | None],
    within: float,
    place: Place,
) -> None:
    """Check the cells of a row that are names, empty for none, and those that are numbers."""
    for column, name in names.items():
        place.equal(column, row[column], "" if name is None else str(name))
    for column, value in numbers.items():
        place.number(column, cell_number(row[column]), value, within=within)


def _check_crossings(plan: CrossingMap, rows: Rows, place: Place) -> None:
    """Check crossing_map.csv."""
    known = {str(crossing.id): crossing for crossing in plan.crossings}
    place.each_once("crossings", [row["crossing"] for row in rows], known)
    joints: dict[int, list[str]] = {}
    for joint in plan.joints:
        joints.setdefault(joint.crossing, []).append(str(joint.id))
    for row in rows:
        crossing = known.get(row["crossing"])
        if crossing is None:
            continue
        here = place.at(f"crossing {crossing.id}")
        over, under = crossing.over, crossing.under
        names = {
            "over_piece": over.piece,
            "over_station": over.station,
            "under_piece": under.piece,
            "under_station": under.station,
        }
        here.expect(
            row["joint"] in joints.get(crossing.id, [""]),
            f"joint is {row['joint']!r}, the map has {joints.get(crossing.id, [])}",
        )
        hole = plan.piece[under.piece].stations[under.station].hole_mm
        numbers = {"hole_mm": hole, **dict(zip("xyz", crossing.position, strict=True))}
        _check_cells(row, names, numbers, SAME_MM, here)


def _check_pieces(plan: CrossingMap, rows: Rows, place: Place) -> None:
    """Check the identifying columns of pieces.csv."""
    place.each_once("pieces", [row["id"] for row in rows], plan.cut_piece)
    for row in rows:
        piece = plan.cut_piece.get(row["id"])
        if piece is None:
            continue
        here, thread = place.at(f"piece {piece.id}"), plan.thread[piece.thread]
        here.expect(
            row["thread"] in (str(thread.id), thread.label),
            f"thread is {row['thread']!r}, but should be {thread.label!r}",
        )
        holes = len(plan.holes[piece.id]) + len(piece.slots)
        names = {"sheet": piece.sheet, "kind": piece.kind, "holes": holes}
        here.equal("spare_of", row.get("spare_of", ""), plan.spare_of.get(piece.id, ""))
        _check_cells(row, names, {}, 0.0, here)


def _check_stations(plan: CrossingMap, rows: Rows, place: Place) -> None:
    """Check stations.csv, which a maker reads while placing a piece."""
    wanted = {(piece.id, str(at)) for piece in plan.pieces for at in range(len(piece.stations))}
    place.each_once("stations", [(row["piece"], row["station"]) for row in rows], wanted)
    steps = {key: step.step for step in plan.steps for key in step.crossings}
    along = {piece.id: _distances(piece) for piece in plan.pieces}
    for row in rows:
        if (row["piece"], row["station"]) not in wanted:
            continue
        piece, at = plan.piece[row["piece"]], int(row["station"])
        station = piece.stations[at]
        names = {**_names(plan, piece, at), "step": str(steps.get(station.crossing))}
        numbers = {"distance_mm": along[piece.id][at], "hole_mm": station.hole_mm}
        here = place.at(f"piece {piece.id}", f"station {at}")
        _check_cells(row, names, numbers, _ROUGHLY_MM, here)


def _names(plan: CrossingMap, piece: Piece, at: int) -> dict[str, object]:
    """Return the cells of a station that are names."""
    station = piece.stations[at]
    crossing = plan.crossing[station.crossing]
    other = crossing.under if station.over else crossing.over
    mate = None
    if station.joint is not None:
        # Of the two pieces that are joined, the other one; a ring of one piece has no other.
        joined = plan.joint[station.joint].pieces
        mate = next((name for name in joined if name != piece.id), piece.id)
    return {
        "crossing": station.crossing,
        "lies": "over" if station.over else "under",
        "partner": station.partner,
        "partner_station": other.station,
        "joint": station.joint,
        "mate": mate,
    }


def _distances(piece: Piece) -> list[float]:
    """Return how far each station is from the first, from station to station."""
    result, last = [], None
    total = 0.0
    for station in piece.stations:
        here = (station.x, station.y)
        total += math.dist(last or here, here)
        last = here
        result.append(total)
    return result
