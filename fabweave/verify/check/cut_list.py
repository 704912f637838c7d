"""Check the list by which straight strips are cut by hand."""

import itertools
import math
import re
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import Floats
from fabweave.verify.read.job_files import CUTS, Job, required
from fabweave.verify.report import Place, Tally

_Row: TypeAlias = dict[str, str]
#: Places are told to a hundredth of a millimetre, and strips lie in a row to that.
_SAME_MM = 0.011
#: Strips that are off by no more than this lie in a row beyond doubt.
_IN_A_ROW_MM = 1e-3
_FINE = re.compile(r"\d+|(?:\d+ )?\d+/[1-9]\d*")
_INCH_MM = 25.4


def check_cut_list(job: Job, tally: Tally) -> None:
    """Check every row of the list, which straight strips have that lie in rows, and no others."""
    plan, place = required(job.map), tally.at(CUTS)
    straight = job.options.get("strips") == "straight"
    if job.cuts is None:
        lying = [_lie_in_rows(plan, sheet) for sheet in plan.sheets]
        place.expect(not (straight and all(lying)), "it is missing")
        return
    place.expect(straight, "there is such a list, and strips are not straight")
    place.same(
        "the pieces",
        (row["piece"] for row in job.cuts if row["cut"] == "piece"),
        (piece.id for piece in plan.to_cut),
    )
    place.same(
        "kinds of rows",
        {row["cut"] for row in job.cuts} - {"rip", "piece", "rest"},
        (),
    )
    place.same(
        "the sheets", {row["sheet"] for row in job.cuts}, {sheet.name for sheet in plan.sheets}
    )
    for sheet in plan.sheets:
        rows = [row for row in job.cuts if row["sheet"] == sheet.name]
        _check_sheet(plan, sheet, rows, place.at(sheet.name))


def _boxes(plan: CrossingMap, sheet: Sheet) -> tuple[dict[str, Floats], int]:
    """Return the least and the greatest corner of each piece of a sheet, and the way they lie."""
    boxes = {}
    for piece in plan.on_sheet(sheet.number):
        corners = piece.placed(piece.outline)
        boxes[piece.id] = np.stack([corners.min(axis=0), corners.max(axis=0)])
    first = next(iter(boxes.values()), np.zeros((2, 2)))
    return boxes, int(np.argmax(np.ptp(first, axis=0)))


def _lie_in_rows(plan: CrossingMap, sheet: Sheet) -> bool:
    """Return whether strips, all of one width, lie in rows the gap apart, beyond doubt."""
    boxes, along = _boxes(plan, sheet)
    if not boxes:
        return False
    low, high = np.array(sorted(tuple(box[:, 1 - along]) for box in boxes.values())).T
    step, wide = np.diff(low), high - low
    apart = step - wide.max() - plan.layout.gap_mm
    side_by_side = (step <= _IN_A_ROW_MM) | (np.abs(apart) <= _IN_A_ROW_MM)
    return bool(np.ptp(wide) <= _IN_A_ROW_MM and side_by_side.all())


def _check_sheet(plan: CrossingMap, sheet: Sheet, rows: list[_Row], place: Place) -> None:
    """Check the cuts of a sheet: along rows first, then those of each row from end to end."""
    boxes, along = _boxes(plan, sheet)
    sides = sheet.width_mm, sheet.height_mm
    whole = sides[along] if sheet.roll_mm is None else sheet.roll_mm
    kinds = [row["cut"] for row in rows]
    place.expect("rip" not in kinds[kinds.count("rip") :], "a cut along rows comes after others")
    rips = [float(row["to_mm"]) for row in rows if row["cut"] == "rip"]
    place.expect(rips == sorted(rips), "cuts along rows are not in order")
    edges = np.array([0.0, *rips, sides[1 - along]])
    lanes: dict[str, list[tuple[float, float]]] = {}
    numbers = [row["row"] for row in rows if row["cut"] != "rip"]
    place.expect(
        len(list(itertools.groupby(numbers))) == len(set(numbers)), "rows are not one after another"
    )
    for number in dict.fromkeys(numbers):
        row_place, end, used = place.at(f"row {number}"), 0.0, 0.0
        own = [row for row in rows if row["cut"] != "rip" and row["row"] == number]
        row_place.expect(
            all(row["cut"] == "piece" for row in own[:-1]), "its rest is not at its end"
        )
        for row in own:
            at = row_place.at(f"piece {row['piece']}" if row["piece"] else row["cut"])
            begin, end_before, end = float(row["from_mm"]), end, float(row["to_mm"])
            at.at_least("apart_mm", begin - end_before, -_SAME_MM, "it begins {} after the last")
            _check_length(row, end - begin, at)
            if row["cut"] == "rest":
                at.number("to_mm", end, whole, within=_SAME_MM)
                at.number("from_mm", begin, end_before, within=_SAME_MM)
            elif (box := boxes.get(row["piece"])) is not None:
                at.number("from_mm", begin, float(box[0, along]), within=_SAME_MM)
                at.number("to_mm", end, float(box[1, along]), within=_SAME_MM)
                used += end - begin
                lanes.setdefault(number, []).append((box[0, 1 - along], box[1, 1 - along]))
            else:
                at.fail("it is not on this sheet")
        row_place.at_most("length_mm", used, whole + _SAME_MM, "its strips are {} long together")
        row_place.at_most("rest_mm", whole - end, _SAME_MM, "{} of it are not told")
    _check_lanes(plan, sheet, lanes, edges, place)
    _check_numbers(rows, lanes, place)


def _check_numbers(
    rows: list[_Row], lanes: dict[str, list[tuple[float, float]]], place: Place
) -> None:
    """Check that rows count from the edge on, and cuts along them from before the first row."""
    starts = sorted(min(low for low, _ in sides) for sides in lanes.values())
    for number, sides in lanes.items():
        at = starts.index(min(low for low, _ in sides)) + 1
        place.at(f"row {number}").equal("its number", number, str(at))
    for row in (row for row in rows if row["cut"] == "rip"):
        before = sum(start < float(row["to_mm"]) - _SAME_MM for start in starts)
        place.at(f"the cut at {row['to_mm']} mm").equal("its number", row["row"], str(before))


def _check_lanes(
    plan: CrossingMap,
    sheet: Sheet,
    lanes: dict[str, list[tuple[float, float]]],
    edges: Floats,
    place: Place,
) -> None:
    """Check that strips of a row are between two cuts along it, or fill the width of a roll."""
    half = plan.layout.gap_mm / 2.0 + _SAME_MM
    taken = set()
    for number, sides in lanes.items():
        row = place.at(f"row {number}")
        low, high = np.array(sides).T
        row.at_most("askew_mm", float(np.ptp(low) + np.ptp(high)), _SAME_MM, "it is {} off")
        first = int(np.abs(edges - low[0]).argmin())
        second = int(np.abs(edges - high[0]).argmin())
        row.at_most("rip_mm", abs(edges[first] - low[0]), half, "no cut is nearer to it than {}")
        row.at_most("rip_mm", abs(edges[second] - high[0]), half, "no cut is nearer to it than {}")
        row.expect(second == first + 1, "a cut along rows goes through it")
        row.expect(first not in taken, "another row is in its place")
        taken.add(first)
        if sheet.roll_mm is not None:
            row.number("the width of strips", float(high[0] - low[0]), sheet.height_mm, within=2e-3)
    one = len(lanes) == 1 and len(edges) == 2
    place.expect(sheet.roll_mm is None or one, "a roll has one row")


def _check_length(row: _Row, length_mm: float, place: Place) -> None:
    """Check a length in all three of its units against what lies between its ends."""
    place.number("length_mm", float(row["length_mm"]), length_mm, within=_SAME_MM)
    inches = length_mm / _INCH_MM
    place.number("length_in", float(row["length_in"]), inches, within=1e-3)
    words = row["length_32nds"]
    fine = float(sum(map(Fraction, words.split()))) if _FINE.fullmatch(words) else math.nan
    place.number("length_32nds", fine, inches, within=1.0 / 64.0 + 1e-3)
