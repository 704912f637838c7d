"""Check that sheets are those of the stock in the settings, and pieces at allowed angles."""

import re
from collections import Counter
from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, corners_apart
from fabweave.verify.read.folders import OFFCUTS, STOCK, Offcuts
from fabweave.verify.read.job_files import Job, required, sheet_drawings
from fabweave.verify.statement import Place, Tally


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
        _check_offcut_entries(offcuts.stock, rests, tally.at(STOCK))


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


def _check_offcut_entries(
    stock: dict[str, Any] | None, sheets: dict[str, Sheet], place: Place
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
    outlines = [f"{OFFCUTS}/{entry.get('outline')}" for entry in entries]
    place.same("outlines", outlines, sheets)
    for name, entry in zip(outlines, entries, strict=True):
        if (sheet := sheets.get(name)) is not None:
            stated = {key: entry[key] for key in entry if key not in ("name", "outline")}
            wanted = {"material": sheet.material, "grain": sheet.grain_deg}
            wanted = {key: value for key, value in wanted.items() if value is not None}
            place.equal(f"what is said of {name}", stated, wanted)


_SAME_MM = 1e-3
#: Outlines in notes are drawn without sides shorter than this.
_DRAWN_MM = 0.2
_ANGLE_DEG = 1e-5
_PLAIN = re.compile(r"([\d.]+)x([\d.]+)mm(?::(\d+))?")
_GRAIN = re.compile(r"(grain|across)(?::([\d.]+)deg)?")


def check_stock(job: Job, tally: Tally) -> None:
    """Check sheets against the settings and the drawings, and angles."""
    plan, options = required(job.map), job.options
    if "sheet" in options or "stock" in options:
        _check_entries(plan, options, tally)
    _check_angles(plan, options, tally)
    for sheet in plan.sheets:
        _check_shape(sheet, tally.at(sheet.name))
    for kind in ("dxf", "svg"):
        for sheet, drawing, place in sheet_drawings(job, kind, tally):
            _check_notes(sheet, drawing, place)


def _check_entries(plan: CrossingMap, options: dict[str, Any], tally: Tally) -> None:
    """Check each sheet against its entry in the settings, and how many there are."""
    entries: dict[tuple[str, float, float], dict[str, Any]] = {}
    quantities: Counter[tuple[str, float, float]] = Counter()
    for text in options.get("sheet", []):
        # A sheet may be for one bunch only, which is checked with the materials.
        match = _PLAIN.fullmatch(text.rpartition("=")[2])
        if not tally.at("job.toml").expect(match, f"sheet {text!r} is no size in mm"):
            continue
        width, height, quantity = match.groups() if match else ("0", "0", None)
        key = ("", float(width), float(height))
        entries[key] = {}
        quantities[key] += int(quantity) if quantity else 10**9
    for kind, tables in options.get("stock", {}).items():
        for entry in tables:
            points = entry.get("outline")
            if points is None:
                match = _PLAIN.fullmatch(entry["size"])
                width, height = (float(match[1]), float(match[2])) if match else (0.0, 0.0)
            else:
                width, height = np.ptp(np.array(points, dtype=float), axis=0).tolist()
            key = (str(entry["name"]), round(width, 6), round(height, 6))
            entries[key] = {**entry, "offcut": kind == "offcut"}
            quantities[key] += int(entry.get("quantity", 10**9))
    used: Counter[tuple[str, float, float]] = Counter()
    for sheet in plan.sheets:
        place = tally.at(sheet.name)
        near = [
            key
            for key in entries
            if key[0] == sheet.stock
            and abs(key[1] - sheet.width_mm) <= _SAME_MM
            and abs(key[2] - sheet.height_mm) <= _SAME_MM
        ]
        if place.expect(
            near,
            f"it is {sheet.stock or 'a sheet'} of {sheet.width_mm:g} × {sheet.height_mm:g} mm, "
            "which is not in the stock of job.toml",
        ):
            used[near[0]] += 1
            _check_entry(sheet, entries[near[0]], place.against("job.toml"))
    for key, count in used.items():
        tally.at(f"stock {key[0]}".rstrip(), f"{key[1]:g} × {key[2]:g} mm").expect(
            count <= quantities[key], f"{count} sheets are used, and there are {quantities[key]}"
        )


def _check_entry(sheet: Sheet, entry: dict[str, Any], place: Place) -> None:
    """Check what the map says of a sheet against its entry."""
    for key, stated in (
        ("price", sheet.price),
        ("grain", sheet.grain_deg),
        ("offcut", sheet.offcut),
    ):
        place.equal(key, stated, entry.get(key, False if key == "offcut" else None))
    if "outline" in entry:
        place.expect(
            corners_apart(sheet.outline, np.array(entry["outline"], dtype=float)) <= _SAME_MM,
            "its outline is not that of job.toml",
        )
    defects = [np.array(defect["polygon"], dtype=float) for defect in entry.get("defects", [])]
    place.expect(
        len(defects) == len(sheet.defects)
        and all(
            corners_apart(a, b) <= _SAME_MM for a, b in zip(sheet.defects, defects, strict=True)
        ),
        "its defects are not those of job.toml",
    )


def _check_shape(sheet: Sheet, place: Place) -> None:
    """Check that a sheet's outline is simple, and fills its width and height."""
    low, high = sheet.outline.min(axis=0), sheet.outline.max(axis=0)
    size = np.array([sheet.width_mm, sheet.height_mm])
    place.expect(
        shapely.is_valid(shapely.Polygon(sheet.outline))
        and np.abs(low).max() <= _SAME_MM
        and np.abs(high - size).max() <= _SAME_MM,
        f"its outline crosses itself, or is not {sheet.width_mm:g} × {sheet.height_mm:g} mm",
    )


def _check_angles(plan: CrossingMap, options: dict[str, Any], tally: Tally) -> None:
    """Check that pieces stand at allowed angles, and that the settings allow the same."""
    step, tolerance, aslant = (
        plan.layout.rotations.step_deg,
        plan.layout.rotations.tolerance_deg,
        plan.layout.rotations.from_grain_deg,
    )
    if "rotations" in options:
        text = str(options["rotations"]).strip().lower()
        grain = _GRAIN.fullmatch(text)
        wanted: tuple[float | None, float, float] = (None, 0.0, 0.0)
        if grain is not None:
            wanted = (180.0, float(grain[2] or 0.0), 90.0 if grain[1] == "across" else 0.0)
        elif text not in ("auto", "free"):
            wanted = (float(text.removesuffix("deg")), 0.0, 0.0)
        tally.at("crossing_map.json").against(f"job.toml, {text!r}").equal(
            "the angle by which pieces may be turned, with its tolerance, and from the grain,",
            (step, tolerance, aslant),
            wanted,
        )
    if step is None:
        return
    for piece in plan.to_cut:
        sheet = plan.sheet.get(piece.sheet)
        grain_deg = (sheet.grain_deg if sheet is not None else None) or 0.0
        # A mirrored sheet is turned over: its angles run the other way.
        turn = (
            piece.placement.rotation_deg
            if piece.mirror_mm is None
            else -piece.placement.rotation_deg
        )
        aside = abs((turn - grain_deg - aslant + step / 2.0) % step - step / 2.0)
        tally.at(f"piece {piece.id}").at_most(
            "angle_deg",
            aside,
            tolerance + _ANGLE_DEG,
            "it is turned {} from the nearest of the angles that are allowed",
        )


def _check_notes(sheet: Sheet, drawing: Drawing, place: Place) -> None:
    """Check that all notes are on the material, and outline and defects among them."""
    notes = drawing.of(NOTES, None)
    points, note = drawing.traced(notes)
    lines = shapely.linestrings(points, indices=note)
    material = shapely.Polygon(sheet.outline).buffer(_DRAWN_MM)
    shapely.prepare(material)
    beside = int(np.count_nonzero(~shapely.covers(material, lines)))
    place.expect(not beside, f"{beside} of {len(notes)} notes are beside the material")
    if not sheet.stock:
        return
    closed = notes[drawing.closed[notes]]
    drawn = [shapely.Polygon(drawing.shape(at).points).exterior for at in closed.tolist()]
    for what, ring in [("outline", sheet.outline), *(("defect", ring) for ring in sheet.defects)]:
        wanted = shapely.Polygon(ring).exterior
        if np.ptp(ring, axis=0).min() < 2.0 * _DRAWN_MM:
            continue
        place.expect(
            any(shapely.hausdorff_distance(wanted, line) <= _DRAWN_MM for line in drawn),
            f"no closed line in the notes is the {what} in the map",
        )
