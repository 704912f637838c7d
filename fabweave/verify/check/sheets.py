"""Check that sheets are those of the stock in the settings, and pieces at allowed angles."""

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, Floats, corners_apart
from fabweave.verify.read.job_files import OFFCUT_STOCK, OFFCUTS, Job, Supply, by_bunch, required
from fabweave.verify.report import Place, Tally

#: Rounding in the files may bring pieces this much nearer.
ROUNDING_MM = 1e-3


def check_sheets(job: Job, tally: Tally) -> None:
    """Check that placed pieces keep the margin and the gap, by exact distances."""
    plan = required(job.map)
    for piece in plan.to_cut:
        tally.at(f"piece {piece.id}").expect(piece.sheet in plan.sheet, "it is on no sheet")
    for sheet in plan.sheets:
        pieces = plan.on_sheet(sheet.number)
        if not pieces:
            continue
        place = tally.at(sheet.name)
        names = [piece.id for piece in pieces]
        placed = np.array([shapely.Polygon(piece.placed(piece.outline)) for piece in pieces])
        polygons = shapely.make_valid(placed)
        check_room(names, polygons, sheet.outline, plan.layout.margin_mm - ROUNDING_MM, place)
        for number, ring in enumerate(sheet.defects, start=1):
            defect = shapely.make_valid(shapely.Polygon(ring))
            for name, apart in zip(names, shapely.distance(polygons, defect).tolist(), strict=True):
                place.at(f"piece {name}").at_least(
                    "defect_mm",
                    apart,
                    max(plan.layout.gap_mm - ROUNDING_MM, 1e-9),
                    f"it is {{}} from defect {number}",
                )
        gaps = [job.supplies[piece.thread].gap_mm for piece in pieces]
        gap = min((gap for gap in gaps if gap is not None), default=plan.layout.gap_mm)
        check_gaps(names, polygons, max(gap - ROUNDING_MM, 0.0), place)


def check_gaps(
    names: Sequence[str], polygons: npt.NDArray[np.object_], gap_mm: float, place: Place
) -> None:
    """Check that pieces keep a gap from one another."""
    # A little beyond the gap, so that the narrowest kept gap is reported too.
    first, second = shapely.STRtree(polygons).query(
        polygons, predicate="dwithin", distance=gap_mm + 1.0
    )
    for a, b in zip(first[first < second].tolist(), second[first < second].tolist(), strict=True):
        pair = place.at(f"pieces {names[a]} and {names[b]}")
        apart = float(shapely.distance(polygons[a], polygons[b]))
        pair.at_least("gap_mm", apart, gap_mm, "they are {} apart")
        overlap = shapely.intersection(polygons[a], polygons[b]).area if apart == 0.0 else 0.0
        # What lies edge on edge overlaps by a rounding, times its length.
        if overlap > (0.0 if gap_mm else ROUNDING_MM * polygons[a].length):
            pair.count()
            pair.fail(f"they overlap by {overlap:.3f} mm²")


def check_room(
    names: Sequence[str],
    polygons: npt.NDArray[np.object_],
    outline: Floats,
    margin_mm: float,
    place: Place,
) -> None:
    """Check that pieces keep the margin from the sheet's outline."""
    inside = shapely.Polygon(outline)
    edge = shapely.distance(polygons, inside.exterior)
    # What fills a sheet is off by a rounding.
    edge[~shapely.covers(inside.buffer(ROUNDING_MM, join_style="mitre"), polygons)] = -1.0
    for name, room in zip(names, edge.tolist(), strict=True):
        place.at(f"piece {name}").at_least(
            "margin_mm",
            room,
            margin_mm,
            "it is {} from the edge" if room >= 0.0 else "it is not within the sheet",
        )


def check_offcuts(job: Job, tally: Tally) -> None:
    """Check every rest of a sheet against the sheet and its drawing."""
    plan, offcuts = required(job.map), job.offcuts
    rests = {
        f"{OFFCUTS}/{sheet.rest.name}.dxf": sheet for sheet in plan.sheets if sheet.rest is not None
    }
    tally.at("crossing_map.json").same("rests of sheets", rests, offcuts)
    for name, sheet in rests.items():
        if (drawing := offcuts.get(name)) is not None:
            _check_rest(drawing, sheet, plan, tally.at(name))
    stock = tally.at(OFFCUT_STOCK)
    if job.offcut_stock is None:
        stock.expect(not rests, "it is missing")
        return
    entries = {str(one.get("outline")): one for one in job.offcut_stock.get("offcut", [])}
    drawn = {f"{sheet.rest.name}.dxf": sheet for sheet in plan.sheets if sheet.rest is not None}
    stock.same("outlines", entries, drawn)
    for name in entries.keys() & drawn.keys():
        threads = {piece.thread for piece in plan.on_sheet(drawn[name].number)}
        materials = {job.supplies[thread].material for thread in threads} - {None}
        entry = stock.at(name)
        entry.expect(
            entries[name].get("material") in materials or not materials,
            f"material is {entries[name].get('material')!r}, and pieces beside it are of "
            f"{', '.join(map(str, materials))}",
        )
        entry.number("grain", entries[name].get("grain"), drawn[name].grain_deg, within=_ANGLE_DEG)


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


_SAME_MM = 1e-3
_ANGLE_DEG = 1e-5
_PLAIN = re.compile(r"([\d.]+)x([\d.]+)mm(?::(\d+))?")
_ROLL = re.compile(r"(?:roll:)?([\d.]+)mm:([\d.]+)mm(?::(\d+))?")
_GRAIN = re.compile(r"(grain|across)(?::([\d.]+)deg)?")


def check_stock(job: Job, tally: Tally) -> None:
    """Check sheets and angles against the settings."""
    plan, options = required(job.map), job.options
    if "sheet" in options or "stock" in options:
        _check_entries(plan, options, tally)
    _check_angles(plan, options, tally)
    for sheet in plan.sheets:
        _check_shape(sheet, tally.at(sheet.name))


def _check_entries(plan: CrossingMap, options: dict[str, Any], tally: Tally) -> None:
    """Check each sheet against its entry in the settings, and how many there are."""
    entries: dict[tuple[str, float, float], dict[str, Any]] = {}
    quantities: Counter[tuple[str, float, float]] = Counter()
    # A sheet may be for one bunch only, which is checked with the materials.
    told: list[dict[str, Any]] = [
        {"size": text.rpartition("=")[2]} for text in options.get("sheet", [])
    ]
    stock = options.get("stock", [])
    for one in stock if isinstance(stock, list) else [stock]:
        # Rolls of which there is nothing to know but their size are texts beside the tables.
        told += [{"roll": one}] if isinstance(one, str) else itertools.chain(*one.values())
    tally.count(sum("name" not in entry for entry in told))
    for entry in told:
        count = None
        pattern, text = (_ROLL, entry["roll"]) if "roll" in entry else (_PLAIN, entry.get("size"))
        if "outline" in entry:
            width, height = np.ptp(np.array(entry["outline"], dtype=float), axis=0).tolist()
        elif match := pattern.fullmatch(str(text)):
            count = match[3]
            width, height = map(float, match.group(2, 1) if "roll" in entry else match.group(1, 2))
        else:
            tally.at("job.toml").fail(f"{text!r} is neither a sheet nor a roll, in mm")
            continue
        key = (str(entry.get("name", "")), round(width, 6), round(height, 6))
        entries[key] = entry
        quantities[key] += int(entry.get("quantity", count or 10**9) or 0)
    used: Counter[tuple[str, float, float]] = Counter()
    for sheet in plan.sheets:
        place = tally.at(sheet.name)
        near = [
            key
            for key in entries
            if key[0] == sheet.stock
            and abs(key[1] - (sheet.roll_mm or sheet.width_mm)) <= _SAME_MM
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
    place.equal("grain", sheet.grain_deg, entry.get("grain"))
    place.equal("that it is a roll", sheet.roll_mm is not None, "roll" in entry)
    place.at_most("used_mm", sheet.width_mm, sheet.roll_mm or sheet.width_mm, "it is {} long")
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


#: Sizes of sheets agree to this.
_SIZE_MM = 0.011


def check_materials(job: Job, tally: Tally) -> None:
    """Check that pieces lie on sheets of what the settings cut their threads from.

    Where settings name materials by bunch, they name every bunch, and threads of one bunch do not
    cross one another.
    """
    plan = required(job.map)
    for sheet in plan.sheets:
        for piece in plan.on_sheet(sheet.number):
            supply = job.supplies.get(piece.thread, Supply())
            tally.at(f"piece {piece.id}").expect(
                supply.material in (None, sheet.material)
                and supply.thickness_mm in (None, sheet.thickness_mm),
                f"it is of {supply.material}, {supply.thickness_mm} mm, and lies on "
                f"{sheet.name} of {sheet.material}, {sheet.thickness_mm} mm",
            )
    bunches, parted = {thread.bunch for thread in plan.threads}, False
    for key in ("material", "thickness", "gap"):
        named = set(by_bunch(job.options.get(key))) - {None}
        parted = parted or bool(named)
        tally.at("job.toml", key).same("bunches", named or bunches, bunches)
    gaps = [supply.gap_mm for supply in job.supplies.values() if supply.gap_mm is not None]
    least, place = min(gaps, default=plan.layout.gap_mm), tally.at("crossing_map.json")
    place.against("job.toml").number("the least gap", plan.layout.gap_mm, least, within=1e-6)
    for crossing in plan.crossings if parted else ():
        one, other = (plan.thread[s.thread] for s in (crossing.over, crossing.under))
        tally.at(f"crossing {crossing.id}").expect(
            one is other or one.bunch != other.bunch,
            f"threads {one.label} and {other.label} of bunch {one.bunch} cross there",
        )
    _check_sheets_of_bunches(job, plan, tally)


def _check_sheets_of_bunches(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that no sheet that the settings keep for one bunch holds pieces of another."""
    kept = []
    for text in job.options.get("sheet", ()):
        # All sizes for one bunch, or for all under None.
        for bunch, size in by_bunch(text).items():
            match = _PLAIN.match(size)
            if match is not None:
                kept.append((bunch, float(match[1]), float(match[2])))
    for sheet in plan.sheets if any(bunch is not None for bunch, *_ in kept) else ():
        fits = {
            bunch
            for bunch, width, height in kept
            if abs(width - sheet.width_mm) + abs(height - sheet.height_mm) < _SIZE_MM
        }
        there = {plan.thread[piece.thread].bunch for piece in plan.on_sheet(sheet.number)}
        tally.at(sheet.name).expect(
            bool(sheet.stock) or None in fits or there <= fits,
            f"it holds pieces of bunches {sorted(there)}, and in job.toml its size is for bunches "
            f"{sorted(fits, key=str)}",
        )
