"""Check what is said to be left of the sheets: where it is, what it is worth, and as stock."""

from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, Floats, corners_apart
from fabweave.verify.read.job_files import Job
from fabweave.verify.read.offcuts import STOCK, Offcuts
from fabweave.verify.report import Tally

_SAME_MM = 1e-3
#: Nothing is worth keeping in which no square of this side fits.
_LEAST_MM = 50.0
_SAME_WORTH = 1e-5


def check_offcuts(job: Job, tally: Tally) -> None:
    """Check every offcut in waste.json against its sheet, its drawing and the list of stock."""
    plan, waste = job.map, job.waste
    if plan is None or waste is None:
        return
    records = waste.get("offcuts")
    if not isinstance(records, list):
        tally.fail("waste.json has no list of offcuts")
        return
    found = job.offcuts or Offcuts({}, None)
    files = [str(record["file"]) for record in records]
    tally.expect(
        sorted(files) == sorted(found.drawings),
        f"waste.json tells of {files}; there are {sorted(found.drawings)}",
    )
    sheets = {sheet.number: sheet for sheet in plan.sheets}
    own = [sheets.get(record["sheet"]) for record in records]
    told = [sheet.number for sheet in own if sheet is not None]
    tally.expect(len(set(told)) == len(told), f"waste.json has two offcuts of a sheet: {told}")
    for name, record, sheet in zip(files, records, own, strict=True):
        if sheet is None:
            tally.fail(f"{name} is of sheet {record['sheet']}, which does not exist")
            continue
        _check_place(name, record, sheet, plan, tally)
        _check_figures(name, record, sheet, tally)
        if (drawing := found.drawings.get(name)) is not None:
            _check_drawing(name, _rings(record), drawing, tally)
    told_by_map = {sheet.rest[0] for sheet in plan.sheets if sheet.rest is not None}
    stems = {name.rpartition("/")[2].removesuffix(".dxf") for name in files}
    tally.expect(
        told_by_map == stems, f"the map tells of {sorted(told_by_map)}, waste.json of {files}"
    )
    if records or found.stock is not None:
        _check_entries(found.stock, dict(zip(files, own, strict=True)), tally)


def _rings(record: dict[str, Any]) -> list[Floats]:
    """Return the outline of an offcut, and what is no good in it."""
    return [np.array(ring, dtype=float) for ring in (record["outline"], *record["holes"])]


def _polygon(record: dict[str, Any]) -> shapely.Polygon:
    outline, *holes = _rings(record)
    return shapely.Polygon(outline, holes)


def _check_place(
    name: str, record: dict[str, Any], sheet: Sheet, plan: CrossingMap, tally: Tally
) -> None:
    """Check that an offcut is within its sheet, the gap off its pieces, and off its defects."""
    rest = _polygon(record)
    tally.expect(rest.is_valid, f"{name} crosses itself")
    tally.expect(
        shapely.Polygon(sheet.outline).buffer(_SAME_MM).covers(rest),
        f"{name} is not within {sheet.name}",
    )
    for piece in plan.pieces:
        if piece.sheet != sheet.number:
            continue
        apart = float(shapely.Polygon(piece.placed(piece.outline)).distance(rest))
        tally.measure(
            "offcut_gap_mm",
            apart,
            max(plan.gap_mm - _SAME_MM, _SAME_MM),
            f"{name} is {apart:.4f} mm from piece {piece.id}, not {plan.gap_mm:g}",
            least=True,
        )
    shown = sheet.rest is not None and corners_apart(sheet.rest[1], _rings(record)[0]) <= _SAME_MM
    tally.expect(shown, f"{name} is not what the map has as the rest of {sheet.name}")
    for at, defect in enumerate(sheet.defects, start=1):
        tally.expect(not shapely.Polygon(defect).intersects(rest), f"{name} overlaps defect {at}")


def _check_figures(name: str, record: dict[str, Any], sheet: Sheet, tally: Tally) -> None:
    """Check area, rectangle, material and worth of an offcut."""
    rest, area = _polygon(record), float(record["area_mm2"])
    tally.expect(
        abs(rest.area - area) <= 0.01 + 1e-8 * area,
        f"{name}: its area is {area} mm², but comes to {rest.area:.3f}",
    )
    (low_x, low_y), (high_x, high_y) = np.array(record["rectangle"], dtype=float).tolist()
    tally.expect(
        low_x < high_x
        and low_y < high_y
        and rest.buffer(_SAME_MM).covers(shapely.box(low_x, low_y, high_x, high_y)),
        f"{name}: its rectangle is not within it",
    )
    narrow = min(high_x - low_x, high_y - low_y)
    tally.expect(
        narrow >= _LEAST_MM,
        f"{name}: its rectangle is {narrow:.1f} mm narrow, and not worth keeping",
    )
    stated = record["material"], record["thickness_mm"]
    tally.expect(
        stated == (sheet.material, sheet.thickness_mm),
        f"{name} is of {stated}, its sheet of {(sheet.material, sheet.thickness_mm)}",
    )
    worth = None if sheet.price is None else sheet.price * rest.area / sheet.area_mm2
    told = record["worth"]
    same = told is None if worth is None else told is not None and _near(told, worth)
    tally.expect(same, f"{name}: it is worth {told}, but comes to {worth}")


def _near(told: float, worth: float) -> bool:
    return abs(told - worth) <= _SAME_WORTH * max(1.0, worth)


def _check_drawing(name: str, rings: list[Floats], drawing: Drawing, tally: Tally) -> None:
    """Check that the file draws the outline and the holes, and nothing else."""
    tally.expect(not drawing.problems, f"{name}: {'; '.join(drawing.problems[:2])}")
    shapes = [drawing.shape(at) for at in range(len(drawing.layer))]
    tally.expect(
        len(shapes) == len(rings)
        and all(
            shape.layer == NOTES and shape.closed and corners_apart(shape.points, ring) <= _SAME_MM
            for shape, ring in zip(shapes, rings, strict=True)
        ),
        f"{name} does not draw its outline and holes, and nothing else, as closed lines on {NOTES}",
    )


def _check_entries(
    stock: dict[str, Any] | None, own: dict[str, Sheet | None], tally: Tally
) -> None:
    """Check that the list of stock names each drawing once, of what it is, and how it lies."""
    if stock is None:
        tally.fail(f"{STOCK} is not checked, because it could not be read")
        return
    entries = stock.get("offcut")
    if not isinstance(entries, list) or set(stock) != {"offcut"}:
        tally.fail(f"{STOCK} lists {sorted(stock)}, not offcuts alone")
        return
    names = [entry.get("name") for entry in entries]
    tally.expect(
        len(set(names)) == len(names) and all(names), f"{STOCK} has names twice, or none: {names}"
    )
    folder = STOCK.rpartition("/")[0]
    listed = {f"{folder}/{entry.get('outline')}": entry for entry in entries}
    tally.expect(
        sorted(listed) == sorted(own) and len(listed) == len(entries),
        f"{STOCK} names {sorted(listed)}, and waste.json {sorted(own)}",
    )
    for name, sheet in own.items():
        entry = listed.get(name)
        if entry is None or sheet is None:
            continue
        stated = {key: entry[key] for key in entry if key not in ("name", "outline")}
        wanted = {"material": sheet.material, "grain": sheet.grain_deg}
        wanted = {key: value for key, value in wanted.items() if value is not None}
        tally.expect(stated == wanted, f"{STOCK}: {name} has {stated}, its sheet {wanted}")
