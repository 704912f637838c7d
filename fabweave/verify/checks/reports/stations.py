"""Check the table of stations, which a maker reads while placing a piece."""

import math

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.read.job_files import Rows
from fabweave.verify.report import Tally

_NAME = "stations.csv"
#: Distances in the table are rounded to a tenth.
_SAME_MM = 0.0501


def check_station_rows(plan: CrossingMap, rows: Rows, tally: Tally) -> None:
    """Check stations.csv against the map: every station once, and every cell."""
    wanted = [(piece.id, str(at)) for piece in plan.pieces for at in range(len(piece.stations))]
    listed = [(row["piece"], row["station"]) for row in rows]
    missing, extra = set(wanted) - set(listed), set(listed) - set(wanted)
    tally.expect(not missing, f"{_NAME} lacks {len(missing)} stations: {sorted(missing)[:4]}")
    tally.expect(not extra, f"{_NAME} has {len(extra)} strange stations: {sorted(extra)[:4]}")
    tally.expect(len(listed) == len(set(listed)), f"{_NAME} has a station twice")
    made = {key: str(step.step) for step in plan.steps for key in step.crossings}
    along = {piece.id: _distances(piece) for piece in plan.pieces}
    for row in rows:
        if (row["piece"], row["station"]) in extra:
            continue
        piece, at = plan.piece[row["piece"]], int(row["station"])
        where = f"{_NAME}, piece {piece.id}, station {at}"
        for column, name in _cells(plan, piece, at).items():
            tally.expect(
                row[column] == name, f"{where}: {column} is {row[column]!r}, the map has {name!r}"
            )
        step = made.get(piece.stations[at].crossing)
        tally.expect(row["step"] == step, f"{where}: step is {row['step']!r}, the map has {step!r}")
        hole = piece.stations[at].hole_mm
        for column, value in (("distance_mm", along[piece.id][at]), ("hole_mm", hole)):
            tally.expect(
                _same(row[column], value), f"{where}: {column} is {row[column]!r}, not {value}"
            )


def _cells(plan: CrossingMap, piece: Piece, at: int) -> dict[str, str]:
    """Return the cells that are names."""
    station = piece.stations[at]
    crossing = plan.crossing[station.crossing]
    other = crossing.under if station.over else crossing.over
    mate = ""
    if station.joint is not None:
        # Of the two pieces that are joined, the other one; a ring of one piece has no other.
        mate = next(
            (name for name in plan.joint[station.joint].pieces if name != piece.id), piece.id
        )
    return {
        "crossing": str(station.crossing),
        "lies": "over" if station.over else "under",
        "partner": station.partner,
        "partner_station": str(other.station),
        "joint": "" if station.joint is None else str(station.joint),
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


def _same(text: str, value: float | None) -> bool:
    """Say whether a cell has a number, or is empty where there is none."""
    if value is None or text == "":
        return value is None and text == ""
    try:
        return abs(float(text) - value) <= _SAME_MM
    except ValueError:
        return False
