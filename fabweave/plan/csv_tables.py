"""Write the plan as tables for people and spreadsheets: crossings, stations, marks, cuts."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.files import csv_text
from fabweave.core.units import unit_mm
from fabweave.plan.crossing_map import CrossingMap, SheetRecord
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
    return csv_text(_CROSSING_COLUMNS, rows)


def station_table(crossing_map: CrossingMap) -> str:
    """Return the stations of all pieces as CSV, one row each."""
    rows = (astuple(row) for rows in piece_stations(crossing_map).values() for row in rows)
    return csv_text([field.name for field in fields(StationRow)], rows)


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
    return csv_text(_STICK_COLUMNS, rows)


#: Strips lie in a row, side by side, to this; what is less is no rest, millimetres.
_ROW_MM = 2e-3
_CUT_COLUMNS = (
    "sheet", "cut", "row", "piece", "from_mm", "to_mm", "length_mm", "length_in", "length_32nds",
)  # fmt: skip


def cut_list(crossing_map: CrossingMap) -> str | None:
    """Return the cuts of straight strips as CSV, in their order; None if they lie in no rows.

    Rows lie the gap apart, as on stock of an odd outline they may not.

    Of each sheet come the cuts along rows (``rip``), at their distance from the edge below, or from
    the left one if rows stand upright. Then come the pieces of each row, from one end to the other,
    and the rest of the row. A roll has one row, and its rest goes to the end of the roll.
    """
    rows: list[Sequence[object]] = []
    for sheet in crossing_map.sheets:
        boxes: dict[str, FloatArray] = {}
        for piece in crossing_map.to_cut:
            if piece.sheet == sheet.sheet:
                corners = crossing_map.on_sheet(piece, np.array(piece.outline))
                boxes[piece.id] = np.stack([corners.min(axis=0), corners.max(axis=0)])
        along = int(np.argmax(np.ptp(next(iter(boxes.values())), axis=0)))
        across = np.array([box[:, 1 - along] for box in boxes.values()])
        starts = across[np.argsort(across[:, 0], kind="stable")]
        starts = starts[np.diff(starts[:, 0], prepend=-np.inf) > _ROW_MM]
        wide = np.ptp(across, axis=1)
        apart = np.diff(starts[:, 0]) - wide.max() - crossing_map.layout.gap_mm
        if np.ptp(wide) > _ROW_MM or (np.abs(apart) > _ROW_MM).any():
            return None
        rows += _cuts(sheet, boxes, along, starts)
    return csv_text(_CUT_COLUMNS, rows)


def _cuts(
    sheet: SheetRecord, boxes: dict[str, FloatArray], along: int, across: FloatArray
) -> Iterable[Sequence[object]]:
    """Yield the cuts of a sheet whose rows run along an axis, each between two of ``across``."""
    sides = sheet.width_mm, sheet.height_mm
    # A cut goes through the middle of what is between two rows.
    rips = [across[0, 0], *(across[1:, 0] + across[:-1, 1]) / 2.0, across[-1, 1]]
    for number, at in enumerate(rips):
        if _ROW_MM < at < sides[1 - along] - _ROW_MM:
            yield sheet.name, "rip", number, None, None, f"{at:.2f}", None, None, None
    for number, (low, _) in enumerate(across, start=1):
        row = [key for key, box in boxes.items() if abs(box[0, 1 - along] - low) <= _ROW_MM]
        end = 0.0
        for key in sorted(row, key=lambda one: float(boxes[one][0, along])):
            begin, end = boxes[key][:, along].tolist()
            yield sheet.name, "piece", number, key, *_measured(begin, end)
        whole = sheet.roll_mm or sides[along]
        if whole - end > _ROW_MM:
            yield sheet.name, "rest", number, None, *_measured(end, whole)


def _measured(begin_mm: float, end_mm: float) -> tuple[str, ...]:
    """Return where something begins and ends, and its length: inches to 1/1000, and to 1/32.

    Examples
    --------
    >>> _measured(0.0, 587.4)
    ('0.00', '587.40', '587.40', '23.126', '23 1/8')
    >>> _measured(580.0, 600.6)
    ('580.00', '600.60', '20.60', '0.811', '13/16')
    """
    long = end_mm - begin_mm
    told = f"{begin_mm:.2f}", f"{end_mm:.2f}", f"{long:.2f}", f"{long / unit_mm('in'):.3f}"
    return (*told, nearest_inches(long))
