"""List each piece station by station: what a maker reads while placing it."""

import csv
import io
import math
from dataclasses import astuple, dataclass, fields
from typing import Any


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


def piece_stations(plan: dict[str, Any]) -> dict[str, list[StationRow]]:
    """Return the stations of every piece, in the order of the crossing map.

    Parameters
    ----------
    plan : dict
        The crossing map.

    Returns
    -------
    dict
        A list of rows for each piece id: the printable table of that piece.
    """
    crossings = {crossing["id"]: crossing for crossing in plan["crossings"]}
    joints = {joint["id"]: joint["pieces"] for joint in plan["joints"]}
    made = {key: step["step"] for step in plan["steps"] for key in step["crossings"]}
    tables = {}
    for piece in plan["pieces"]:
        rows: list[StationRow] = []
        along, last = 0.0, None
        for number, station in enumerate(piece["stations"]):
            here = station["x"], station["y"]
            along += math.dist(last or here, here)
            last = here
            other = crossings[station["crossing"]]["under" if station["over"] else "over"]
            mate = None
            if station["joint"] is not None:
                # A joint names the piece that ends there before the piece that begins.
                ends, begins = joints[station["joint"]]
                at_end = number == len(piece["stations"]) - 1
                mate = begins if at_end and station["joint"] == piece["joints"][1] else ends
            rows.append(
                StationRow(
                    piece["id"],
                    number,
                    station["crossing"],
                    round(along, 1),
                    "over" if station["over"] else "under",
                    station["partner"],
                    other["station"],
                    station["joint"],
                    mate,
                    station["hole_mm"],
                    made[station["crossing"]],
                )
            )
        tables[piece["id"]] = rows
    return tables


def station_table(plan: dict[str, Any]) -> str:
    """Return the stations of all pieces as CSV, one row each."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(field.name for field in fields(StationRow))
    for rows in piece_stations(plan).values():
        table.writerows(["" if value is None else value for value in astuple(row)] for row in rows)
    return text.getvalue()
