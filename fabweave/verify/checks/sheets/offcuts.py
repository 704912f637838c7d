"""Check what is kept of the sheets: that it is free, drawn as it is, and listed as stock."""

from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, corners_apart
from fabweave.verify.read.folders import OFFCUTS, STOCK, Offcuts
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

_SAME_MM = 1e-3


def check_offcuts(job: Job, tally: Tally) -> None:
    """Check every rest of a sheet against the sheet, its drawing and the list of stock."""
    plan, offcuts = required(job.map), job.offcuts or Offcuts()
    rests = {
        f"{OFFCUTS}/{sheet.rest.name}.dxf": sheet for sheet in plan.sheets if sheet.rest is not None
    }
    tally.at("crossing_map.json").same("rests of sheets", rests, offcuts.dxf)
    for name, sheet in rests.items():
        if (drawing := offcuts.dxf.get(name)) is not None:
            _check_rest(drawing, sheet, plan, tally.at(name))
    if rests or offcuts.stock is not None:
        _check_entries(offcuts.stock, rests, tally.at(STOCK))


def _check_rest(drawing: Drawing, sheet: Sheet, plan: CrossingMap, place: Place) -> None:
    """Check that a file draws the map's rest of a sheet, and what is no good in it, and no more.

    It is within its sheet, the gap off its pieces, and off its defects.
    """
    place.expect(not drawing.problems, "; ".join(drawing.problems[:2]))
    shapes = drawing.shapes
    closed = all(shape.layer == NOTES and shape.closed for shape in shapes)
    if not place.expect(
        shapes and closed and sheet.rest is not None,
        f"it does not draw its outline and holes, and nothing else, as closed lines on {NOTES}",
    ):
        return
    if sheet.rest is not None:
        place.expect(
            corners_apart(sheet.rest.outline, shapes[0].points) <= _SAME_MM,
            f"it is not what the map has as the rest of {sheet.name}",
        )
    rest = shapely.Polygon(shapes[0].points, [shape.points for shape in shapes[1:]])
    if not place.expect(rest.is_valid, "it crosses itself"):
        return
    material = shapely.Polygon(sheet.outline).buffer(_SAME_MM)
    place.expect(material.covers(rest), f"it is not within {sheet.name}")
    pieces = plan.on_sheet(sheet.number)
    outlines = [shapely.Polygon(piece.placed(piece.outline)) for piece in pieces]
    away = shapely.distance(np.array(outlines, dtype=object), rest)
    for piece, distance in zip(pieces, away.tolist(), strict=True):
        place.at_least(
            "offcut_gap_mm",
            distance,
            max(plan.layout.gap_mm - _SAME_MM, _SAME_MM),
            f"it is {{}} from piece {piece.id}",
        )
    for at, defect in enumerate(sheet.defects, start=1):
        place.expect(not shapely.Polygon(defect).intersects(rest), f"it overlaps defect {at}")


def _check_entries(stock: dict[str, Any] | None, sheets: dict[str, Sheet], place: Place) -> None:
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
    outlines = [f"{OFFCUTS}/{entry.get('outline')}" for entry in entries]
    place.same("outlines", outlines, sheets)
    for name, entry in zip(outlines, entries, strict=True):
        if (sheet := sheets.get(name)) is not None:
            stated = {key: entry[key] for key in entry if key not in ("name", "outline")}
            wanted = {"material": sheet.material, "grain": sheet.grain_deg}
            wanted = {key: value for key, value in wanted.items() if value is not None}
            place.equal(f"what is said of {name}", stated, wanted)
