"""Write the crossing map as tables, for people and spreadsheets: crossings, and stations."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import astuple, fields

from fabweave.assembly.stations import StationRow, piece_stations
from fabweave.flat.crossing_map import CrossingMap

_CROSSING_COLUMNS = (
    "crossing", "over_piece", "over_station", "under_piece", "under_station", "joint", "hole_mm",
    "x", "y", "z",
)  # fmt: skip


def crossing_table(crossing_map: CrossingMap) -> str:
    """Return the crossings as CSV, one row each."""
    stations = {piece.id: piece.stations for piece in crossing_map.pieces}
    rows = []
    for crossing in crossing_map.crossings:
        over, under = crossing.over, crossing.under
        upper, lower = stations[over.piece][over.station], stations[under.piece][under.station]
        rows.append(
            (
                crossing.id,
                over.piece,
                over.station,
                under.piece,
                under.station,
                upper.joint if lower.joint is None else lower.joint,
                lower.hole_mm,
                *crossing.position_mm,
            )
        )
    return _csv(_CROSSING_COLUMNS, rows)


def station_table(crossing_map: CrossingMap) -> str:
    """Return the stations of all pieces as CSV, one row each."""
    tables = piece_stations(crossing_map).values()
    return _csv([f.name for f in fields(StationRow)], (astuple(row) for t in tables for row in t))


def _csv(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table as CSV; None is an empty cell."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    table.writerows(["" if value is None else value for value in row] for row in rows)
    return text.getvalue()
