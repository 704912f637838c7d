"""Write the crossing map as tables, for people and spreadsheets: crossings, stations, marks."""

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields

from fabweave.core.units import unit_mm
from fabweave.plan.crossing_map import CrossingMap
from fabweave.plan.sticks import nearest_inches, story_sticks


@dataclass(frozen=True)
class StationRow:
    """One station of one piece.

    Parameters
    ----------
    piece : str
        The piece.
    station : int
        Its station, from 0, as in the crossing map.
    crossing : int
        The crossing there.
    distance_mm : float
        From the first station of the piece, along the straight lines from station to station.
    lies : str
        ``over`` or ``under`` the partner.
    partner, partner_station : str, int
        The piece that it crosses there, and the station of that piece.
    joint, mate : int or None, str or None
        The joint there, and the piece that is joined.
    hole_mm : float or None
        Diameter of the fastener hole.
    step : int
        The assembly step in which the crossing is made.
    """

    piece: str
    station: int
    crossing: int
    distance_mm: float
    lies: str
    partner: str
    partner_station: int
    joint: int | None
    mate: str | None
    hole_mm: float | None
    step: int


def piece_stations(crossing_map: CrossingMap) -> dict[str, list[StationRow]]:
    """Return the stations of every piece, in the order of the crossing map.

    Returns
    -------
    dict
        A list of rows for each piece id: the printable table of that piece.
    """
    crossings = {crossing.id: crossing for crossing in crossing_map.crossings}
    joints = {joint.id: joint for joint in crossing_map.joints}
    step_of = {key: step.step for step in crossing_map.steps for key in step.crossings}
    tables = {}
    for piece in crossing_map.pieces:
        rows: list[StationRow] = []
        along, last = 0.0, None
        for number, station in enumerate(piece.stations):
            here = station.x, station.y
            along += math.dist(last or here, here)
            last = here
            crossing = crossings[station.crossing]
            partner = crossing.under if station.over else crossing.over
            joint = None if station.joint is None else joints[station.joint]
            rows.append(
                StationRow(
                    piece.id,
                    number,
                    station.crossing,
                    round(along, 1),
                    "over" if station.over else "under",
                    station.partner,
                    partner.station,
                    station.joint,
                    None if joint is None else joint.mate(piece.id),
                    station.hole_mm,
                    step_of[station.crossing],
                )
            )
        tables[piece.id] = rows
    return tables


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
                *crossing.position,
            )
        )
    return _csv(_CROSSING_COLUMNS, rows)


def station_table(crossing_map: CrossingMap) -> str:
    """Return the stations of all pieces as CSV, one row each."""
    tables = piece_stations(crossing_map).values()
    return _csv([f.name for f in fields(StationRow)], (astuple(row) for t in tables for row in t))


_STICK_COLUMNS = (
    "kind", "pieces", "turned", "length_mm", "width_mm", "mark", "station", "distance_mm",
    "distance_in", "nearest_in", "across_mm", "lies", "hole_mm",
)  # fmt: skip
_LIES = {None: None, True: "over", False: "under"}


def stick_table(crossing_map: CrossingMap) -> str:
    """Return what to mark on straight strips as CSV, kind by kind, one row for each mark.

    Distances count from the start of the first piece; ``turned`` are those pieces that begin at
    the other end.
    """
    rows = [
        (
            stick.kind,
            " ".join((*(piece.id for piece in stick.pieces), *stick.spares)),
            " ".join(piece.id for piece in stick.pieces if piece.turned),
            f"{stick.length_mm:.2f}",
            f"{stick.width_mm:.2f}",
            mark.what,
            mark.station,
            f"{mark.along_mm:.2f}",
            f"{mark.along_mm / unit_mm('in'):.3f}",
            nearest_inches(mark.along_mm),
            f"{mark.across_mm:.2f}",
            _LIES[mark.over],
            mark.hole_mm,
        )
        for stick in story_sticks(crossing_map)
        for mark in stick.marks
    ]
    return _csv(_STICK_COLUMNS, rows)


def _csv(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table as CSV; None is an empty cell."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    table.writerows(["" if value is None else value for value in row] for row in rows)
    return text.getvalue()
