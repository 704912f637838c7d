"""Check that the tables for people say what the crossing map says."""

from fabweave.verify.checks.reports.stations import check_station_rows
from fabweave.verify.crossing_map import Crossing, CrossingMap
from fabweave.verify.read.job_files import Job, Rows
from fabweave.verify.report import Tally

#: Tables may round lengths to a thousandth.
SAME_MM = 6e-4


def check_tables(job: Job, tally: Tally) -> None:
    """Check crossing_map.csv, pieces.csv and stations.csv against crossing_map.json."""
    plan = job.map
    if (
        plan is None
        or job.crossing_rows is None
        or job.piece_rows is None
        or job.station_rows is None
    ):
        return
    _check_crossings(plan, job.crossing_rows, tally)
    _check_pieces(plan, job.piece_rows, tally)
    check_station_rows(plan, job.station_rows, tally)


def _check_rows(name: str, key: str, rows: Rows, wanted: list[str], tally: Tally) -> None:
    """Check that a table has one row for each id and no other."""
    ids = [row[key] for row in rows]
    missing, extra = sorted(set(wanted) - set(ids)), sorted(set(ids) - set(wanted))
    tally.expect(not missing, f"{name} lacks {len(missing)} rows: {missing[:4]}")
    tally.expect(not extra, f"{name} has {len(extra)} rows that the map has not: {extra[:4]}")
    tally.expect(len(set(ids)) == len(ids), f"{name} has {len(ids) - len(set(ids))} rows twice")


def _check_crossings(plan: CrossingMap, rows: Rows, tally: Tally) -> None:
    """Check crossing_map.csv."""
    name = "crossing_map.csv"
    _check_rows(name, "crossing", rows, [str(crossing.id) for crossing in plan.crossings], tally)
    known = {str(crossing.id): crossing for crossing in plan.crossings}
    joints: dict[int, list[str]] = {}
    for joint in plan.joints:
        joints.setdefault(joint.crossing, []).append(str(joint.id))
    for row in rows:
        crossing = known.get(row["crossing"])
        if crossing is None:
            continue
        where = f"{name}, crossing {crossing.id}"
        for column, name_there in _strand_cells(crossing):
            tally.expect(
                row[column] == name_there,
                f"{where}: {column} is {row[column]!r}, the map has {name_there!r}",
            )
        there = joints.get(crossing.id, [])
        tally.expect(
            row["joint"] in there if there else row["joint"] == "",
            f"{where}: joint is {row['joint']!r}, the map has {there}",
        )
        station = plan.piece[crossing.under.piece].stations[crossing.under.station]
        _check_number(where, row, "hole_mm", station.hole_mm, tally)
        for column, value in zip("xyz", crossing.position, strict=True):
            _check_number(where, row, column, value, tally)


def _strand_cells(crossing: Crossing) -> list[tuple[str, str]]:
    """Return the cells that name both strands."""
    return [
        ("over_piece", crossing.over.piece),
        ("over_station", str(crossing.over.station)),
        ("under_piece", crossing.under.piece),
        ("under_station", str(crossing.under.station)),
    ]


def _check_number(
    where: str, row: dict[str, str], column: str, value: float | None, tally: Tally
) -> None:
    """Check a number in a table; an empty cell means none."""
    text = row[column]
    try:
        good = (value is None) if text == "" else abs(float(text) - (value or 0.0)) <= SAME_MM
    except ValueError:
        good = False
    if value is None:
        good = text == ""
    tally.expect(good, f"{where}: {column} is {text!r}, the map has {value}")


def _check_pieces(plan: CrossingMap, rows: Rows, tally: Tally) -> None:
    """Check the identifying columns of pieces.csv."""
    name = "pieces.csv"
    _check_rows(name, "id", rows, [piece.id for piece in plan.pieces], tally)
    for row in rows:
        piece = plan.piece.get(row["id"])
        if piece is None:
            continue
        thread = plan.thread[piece.thread]
        for column, values in (
            ("thread", (str(thread.id), thread.label)),
            ("sheet", (str(piece.sheet),)),
            ("kind", (str(piece.kind),)),
            ("holes", (str(len(plan.holes[piece.id]) + len(piece.slots)),)),
        ):
            tally.expect(
                row[column] in values,
                f"{name}, piece {piece.id}: {column} is {row[column]!r}, the map has {values[-1]}",
            )
