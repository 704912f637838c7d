"""Check what is said to be left of the sheets: where it is, what it is worth, and as stock."""

from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, Floats, corners_apart
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.offcuts import STOCK, Offcuts
from fabweave.verify.statement import Place, Tally

_SAME_MM = 1e-3
#: The largest rectangle in an offcut has no side that could stand so much further out; what runs
#: nearly along a side may leave it less.
_GROWN_MM = 0.5
#: Corners are rounded to less than this.
_ROUNDED_MM = 5e-6
#: Nothing is worth keeping in which no square of this side fits.
_LEAST_MM = 50.0
_SAME_WORTH = 1e-5


def check_offcuts(job: Job, tally: Tally) -> None:
    """Check every offcut in waste.json against its sheet, its drawing and the list of stock."""
    plan, place = required(job.map), tally.at("waste.json")
    records = required(job.waste).get("offcuts")
    if not isinstance(records, list):
        place.fail("it has no list of offcuts")
        return
    offcuts = job.offcuts or Offcuts({}, None)
    files = [str(record["file"]) for record in records]
    place.same("offcuts", files, offcuts.drawings)
    sheets = [plan.sheet.get(record["sheet"]) for record in records]
    numbers = [sheet.number for sheet in sheets if sheet is not None]
    place.expect(len(set(numbers)) == len(numbers), f"two offcuts are of one sheet: {numbers}")
    for name, record, sheet in zip(files, records, sheets, strict=True):
        here = tally.at(name)
        if sheet is None:
            here.fail(f"it is of sheet {record['sheet']}, which does not exist")
            continue
        _check_place(record, sheet, plan, here)
        _check_figures(record, sheet, here)
        if (drawing := offcuts.drawings.get(name)) is not None:
            _check_drawing(_rings(record), drawing, here)
    rests = {sheet.rest.name for sheet in plan.sheets if sheet.rest is not None}
    stems = {name.rpartition("/")[2].removesuffix(".dxf") for name in files}
    tally.at("crossing_map.json").same("rests of sheets", rests, stems)
    if records or offcuts.stock is not None:
        _check_entries(offcuts.stock, dict(zip(files, sheets, strict=True)), tally.at(STOCK))


def _rings(record: dict[str, Any]) -> list[Floats]:
    """Return the outline of an offcut, and what is no good in it."""
    return [np.array(ring, dtype=float) for ring in (record["outline"], *record["holes"])]


def _polygon(record: dict[str, Any]) -> shapely.Polygon:
    outline, *holes = _rings(record)
    return shapely.Polygon(outline, holes)


def _check_place(record: dict[str, Any], sheet: Sheet, plan: CrossingMap, place: Place) -> None:
    """Check that an offcut is within its sheet, the gap off its pieces, and off its defects."""
    rest = _polygon(record)
    place.expect(rest.is_valid, "it crosses itself")
    material = shapely.Polygon(sheet.outline).buffer(_SAME_MM)
    place.expect(material.covers(rest), f"it is not within {sheet.name}")
    for piece in plan.on_sheet(sheet.number):
        place.at_least(
            "offcut_gap_mm",
            float(shapely.Polygon(piece.placed(piece.outline)).distance(rest)),
            max(plan.gap_mm - _SAME_MM, _SAME_MM),
            f"it is {{}} from piece {piece.id}",
        )
    shown = (
        sheet.rest is not None and corners_apart(sheet.rest.outline, _rings(record)[0]) <= _SAME_MM
    )
    place.expect(shown, f"it is not what the map has as the rest of {sheet.name}")
    for at, defect in enumerate(sheet.defects, start=1):
        place.expect(not shapely.Polygon(defect).intersects(rest), f"it overlaps defect {at}")


def _check_figures(record: dict[str, Any], sheet: Sheet, place: Place) -> None:
    """Check area, rectangle, material and worth of an offcut."""
    rest = _polygon(record)
    place.number("area_mm2", record["area_mm2"], rest.area, within=0.01 + 1e-8 * rest.area)
    near = rest.buffer(_SAME_MM)
    (low_x, low_y), (high_x, high_y) = np.array(record["rectangle"], dtype=float).tolist()
    place.expect(
        low_x < high_x
        and low_y < high_y
        and near.covers(shapely.box(low_x, low_y, high_x, high_y)),
        "its rectangle is not within it",
    )
    for side in range(4):
        # A little within the others, which are rounded: what stands in the way may be a needle.
        corners = np.array([low_x, low_y, high_x, high_y]) + _ROUNDED_MM * np.array([1, 1, -1, -1])
        corners[side] += _GROWN_MM if side > 1 else -_GROWN_MM
        place.expect(not rest.covers(shapely.box(*corners)), "its rectangle is not the largest")
    narrow = min(high_x - low_x, high_y - low_y)
    place.expect(
        narrow >= _LEAST_MM, f"its rectangle is {narrow:.1f} mm narrow, and not worth keeping"
    )
    place.equal(
        "what it is of",
        (record["material"], record["thickness_mm"]),
        (sheet.material, sheet.thickness_mm),
    )
    worth = None if sheet.price is None else sheet.price * rest.area / sheet.area_mm2
    place.number("worth", record["worth"], worth, within=_SAME_WORTH * max(1.0, worth or 0.0))


def _check_drawing(rings: list[Floats], drawing: Drawing, place: Place) -> None:
    """Check that the file draws the outline and the holes, and nothing else."""
    place.expect(not drawing.problems, "; ".join(drawing.problems[:2]))
    shapes = drawing.shapes
    place.expect(
        len(shapes) == len(rings)
        and all(
            shape.layer == NOTES and shape.closed and corners_apart(shape.points, ring) <= _SAME_MM
            for shape, ring in zip(shapes, rings, strict=True)
        ),
        f"it does not draw its outline and holes, and nothing else, as closed lines on {NOTES}",
    )


def _check_entries(
    stock: dict[str, Any] | None, sheets: dict[str, Sheet | None], place: Place
) -> None:
    """Check that the list of stock names each drawing once, of what it is, and how it lies."""
    if stock is None:
        place.fail("it is not checked, because it could not be read")
        return
    entries = stock.get("offcut")
    if not isinstance(entries, list) or set(stock) != {"offcut"}:
        place.fail(f"it lists {sorted(stock)}, not offcuts alone")
        return
    names = [entry.get("name") for entry in entries]
    place.expect(
        len(set(names)) == len(names) and all(names), f"it has names twice, or none: {names}"
    )
    folder = STOCK.rpartition("/")[0]
    outlines = [f"{folder}/{entry.get('outline')}" for entry in entries]
    listed = dict(zip(outlines, entries, strict=True))
    place.same("outlines", outlines, sheets)
    for name, sheet in sheets.items():
        entry = listed.get(name)
        if entry is None or sheet is None:
            continue
        stated = {key: entry[key] for key in entry if key not in ("name", "outline")}
        wanted = {"material": sheet.material, "grain": sheet.grain_deg}
        wanted = {key: value for key, value in wanted.items() if value is not None}
        place.equal(f"what is said of {name}", stated, wanted)
