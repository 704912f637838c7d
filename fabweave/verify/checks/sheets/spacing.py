"""Check sheets: margins and gaps; and every figure of areas, lengths and waste."""

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.checks.plan.pieces import areas_of
from fabweave.verify.checks.reports.splitting import check_splitting
from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import ENGRAVE_LAYERS, Floats
from fabweave.verify.read.job_files import Job, Rows
from fabweave.verify.report import Tally

#: Rounding in the files may bring pieces this much nearer.
ROUNDING_MM = 1e-3
AREA_MM2 = 0.01
UTILISATION = 6e-5
#: Tables for people are rounded, but not more coarsely than this.
_COARSEST = {"length_mm": 0.06, "width_mm": 0.06, "area_mm2": 0.06, "mass_g": 0.006}


def check_sheets(job: Job, tally: Tally) -> None:
    """Check that placed pieces keep the margin and the gap, by exact distances."""
    plan = job.map
    if plan is None:
        return
    numbers = {sheet.number for sheet in plan.sheets}
    for piece in plan.pieces:
        tally.expect(piece.sheet in numbers, f"piece {piece.id} is on no sheet")
    for sheet in plan.sheets:
        pieces = [piece for piece in plan.pieces if piece.sheet == sheet.number]
        if not pieces:
            continue
        placed = [piece.placed(piece.outline) for piece in pieces]
        for piece, points in zip(pieces, placed, strict=True):
            border = min(
                float(points.min()),
                float(sheet.width_mm - points[:, 0].max()),
                float(sheet.height_mm - points[:, 1].max()),
            )
            tally.measure(
                "margin_mm",
                border,
                plan.margin_mm - ROUNDING_MM,
                f"piece {piece.id} on {sheet.name} is {border:.4f} mm from the border, not "
                f"{plan.margin_mm:g}",
                least=True,
            )
        polygons = shapely.make_valid(np.array([shapely.Polygon(points) for points in placed]))
        _check_room(sheet, [piece.id for piece in pieces], polygons, plan, tally)
        own = [job.supplies[piece.thread].gap_mm for piece in pieces]
        gap = min((gap for gap in own if gap is not None), default=plan.gap_mm)
        reach = max(gap - ROUNDING_MM, 0.0)
        # A little beyond the gap, so that the narrowest kept gap is reported too.
        first, second = shapely.STRtree(polygons).query(
            polygons, predicate="dwithin", distance=reach + 1.0
        )
        for a, b in zip(
            first[first < second].tolist(), second[first < second].tolist(), strict=True
        ):
            apart = float(shapely.distance(polygons[a], polygons[b]))
            overlap = apart == 0.0 and shapely.intersection(polygons[a], polygons[b]).area
            tally.measure(
                "gap_mm",
                apart,
                reach,
                f"pieces {pieces[a].id} and {pieces[b].id} on {sheet.name} "
                + (f"overlap by {overlap:.3f} mm²" if overlap else f"are {apart:.4f} mm apart"),
                least=True,
            )
            if overlap:
                tally.expect(
                    False,
                    f"pieces {pieces[a].id} and {pieces[b].id} on {sheet.name} cut into each other",
                )


def _check_room(
    sheet: Sheet,
    names: list[str],
    polygons: npt.NDArray[np.object_],
    plan: CrossingMap,
    tally: Tally,
) -> None:
    """Check that pieces keep the margin from the sheet's outline, and the gap from its defects."""
    inside = shapely.Polygon(sheet.outline)
    edge = shapely.distance(polygons, inside.exterior)
    edge[~shapely.covers(inside, polygons)] = -1.0
    for name, room in zip(names, edge.tolist(), strict=True):
        tally.measure(
            "outline_margin_mm",
            room,
            plan.margin_mm - ROUNDING_MM,
            f"piece {name} on {sheet.name} is "
            + (f"{room:.4f} mm from the outline" if room >= 0.0 else "not within the outline")
            + f", not {plan.margin_mm:g}",
            least=True,
        )
    for number, ring in enumerate(sheet.defects, start=1):
        defect = shapely.make_valid(shapely.Polygon(ring))
        for name, apart in zip(names, shapely.distance(polygons, defect).tolist(), strict=True):
            tally.measure(
                "defect_mm",
                apart,
                max(plan.gap_mm - ROUNDING_MM, 1e-9),
                f"piece {name} on {sheet.name} is {apart:.4f} mm from its defect {number}, not "
                f"{plan.gap_mm:g}",
                least=True,
            )


def check_areas(job: Job, tally: Tally) -> None:
    """Recompute pieces.csv and waste.json from outlines and sheets."""
    plan = job.map
    if plan is None or job.piece_rows is None or job.waste is None:
        return
    _check_piece_rows(plan, job, job.piece_rows, tally)
    check_splitting(plan, job.waste, tally)
    figures = {piece.id: areas_of(piece, plan) for piece in plan.pieces}
    sums = np.zeros(4)
    stated = {entry.get("sheet"): entry for entry in job.waste["sheets"] if isinstance(entry, dict)}
    tally.expect(
        sorted(stated, key=str) == sorted((sheet.number for sheet in plan.sheets), key=str)
        and len(stated) == len(job.waste["sheets"]),
        f"waste.json lists sheets {list(stated)}",
    )
    for sheet in plan.sheets:
        names = [piece.id for piece in plan.pieces if piece.sheet == sheet.number]
        outline = sum(figures[name][0] for name in names)
        holes = sum(figures[name][1] for name in names)
        area = sheet.area_mm2
        values = np.array([area, outline, holes, len(names)])
        sums += values
        where = f"waste.json, sheet {sheet.number}"
        entry = stated.get(sheet.number, {})
        _check_budget(where, entry, values, tally)
        for key, value in (("width_mm", sheet.width_mm), ("height_mm", sheet.height_mm)):
            _check_figure(where, entry, key, value, 1e-6, tally)
    totals = job.waste["totals"]
    where = "waste.json, totals"
    _check_budget(where, totals, sums, tally)
    _check_figure(where, totals, "sheets", len(plan.sheets), 0.0, tally)
    n_holes = sum(len(plan.holes[piece.id]) + len(piece.slots) for piece in plan.pieces)
    _check_figure(where, totals, "holes", n_holes, 0.0, tally)
    cut = sum(figure[2] for figure in figures.values())
    _check_figure(where, totals, "cut_length_mm", cut, 0.05 + 1e-6 * cut, tally)
    engraved = sum(
        float(drawing.lengths[shapes].sum())
        for drawing in job.dxf.values()
        for (layer, _), shapes in drawing.groups.items()
        if layer in ENGRAVE_LAYERS
    )
    if len(job.dxf) < len(plan.sheets):
        tally.fail("the engraved length is not checked, because not every DXF could be read")
    else:
        _check_figure(where, totals, "engrave_length_mm", engraved, 0.05 + 1e-6 * engraved, tally)


def _check_figure(
    where: str, entry: dict[str, Any], key: str, value: float, tolerance: float, tally: Tally
) -> None:
    """Check one stated figure."""
    stated = entry.get(key)
    if not isinstance(stated, int | float) or isinstance(stated, bool):
        tally.fail(f"{where}: {key} is {stated!r}, not a number")
        return
    tally.expect(
        abs(stated - value) <= tolerance, f"{where}: {key} is {stated}, but comes to {value:.6f}"
    )


def _check_budget(where: str, entry: dict[str, Any], values: Floats, tally: Tally) -> None:
    """Check that piece, hole and waste areas are right and make up the sheets."""
    area, outline, holes, pieces = values.tolist()
    slack = AREA_MM2 + 1e-8 * area
    for key, value in (
        ("area_mm2", area),
        ("piece_area_mm2", outline - holes),
        ("hole_area_mm2", holes),
        ("waste_mm2", area - outline),
    ):
        _check_figure(where, entry, key, value, slack, tally)
    _check_figure(where, entry, "utilisation", outline / area if area else 0.0, UTILISATION, tally)
    _check_figure(where, entry, "pieces", pieces, 0.0, tally)


def _check_piece_rows(plan: CrossingMap, job: Job, rows: Rows, tally: Tally) -> None:
    """Check lengths, widths, areas, masses and hole counts of pieces.csv."""
    slack = {
        key: min(0.5 * 10.0 ** -max((_decimals(row[key]) for row in rows), default=0), coarsest)
        * 1.001
        + 1e-3
        for key, coarsest in _COARSEST.items()
    }
    names, masses, areas = [], [], []
    for row in rows:
        piece = plan.piece.get(row["id"])
        if piece is None:
            continue
        where = f"pieces.csv, piece {piece.id}"
        outline, holes, _ = areas_of(piece, plan)
        area = outline - holes
        stated = {key: float(row[key]) for key in _COARSEST}
        tally.expect(
            abs(stated["area_mm2"] - area) <= slack["area_mm2"],
            f"{where}: area_mm2 is {row['area_mm2']}, but comes to {area:.4f}",
        )
        rectangles = _rectangles(piece.outline)
        least = rectangles[np.argmin(rectangles.prod(axis=1))]
        fits = (
            (np.abs(rectangles[:, 0] - stated["length_mm"]) <= slack["length_mm"])
            & (np.abs(rectangles[:, 1] - stated["width_mm"]) <= slack["width_mm"])
            & (rectangles.prod(axis=1) <= least.prod() * (1.0 + 1e-6))
        )
        tally.expect(
            np.any(fits),
            f"{where}: {row['length_mm']} × {row['width_mm']} mm, but the least rectangle is "
            f"{least[0]:.4f} × {least[1]:.4f} mm",
        )
        names.append(piece.id)
        masses.append(stated["mass_g"])
        areas.append(area)
    _check_masses(job, names, np.array(masses), np.array(areas), slack["mass_g"], tally)


def _decimals(text: str) -> int:
    """Return the number of decimals of a number as written."""
    return len(text.partition(".")[2])


def _rectangles(outline: Floats) -> Floats:
    """Return length and width of the rectangle along each side of the hull, (K, 2)."""
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(outline)))
    steps = np.diff(hull, axis=0)
    steps = steps / np.hypot(*steps.T)[:, None]
    spans = np.stack(
        [
            np.ptp(hull @ steps.T, axis=0),
            np.ptp(hull @ np.array([-steps[:, 1], steps[:, 0]]), axis=0),
        ],
        axis=1,
    )
    return np.sort(spans, axis=1)[:, ::-1]


def _check_masses(
    job: Job, names: list[str], masses: Floats, areas: Floats, slack: float, tally: Tally
) -> None:
    """Check that all masses have one weight for an area, if one is stated that of their material.

    Where none is, neither in waste.json nor in the settings, they agree with one another.
    """
    if len(masses) == 0 or areas.sum() <= 0.0:
        return
    own = _weight(job.settings or {})
    weight = np.full(len(masses), masses.sum() / areas.sum() if own is None else own)
    records = (job.waste or {}).get("materials") or []
    told = {
        (record["material"], record["thickness_mm"]): record["thickness_mm"]
        * record["density_kg_m3"]
        * 1e-6
        for record in records
    }
    if job.map is not None and told:
        sheet = {sheet.number: (sheet.material, sheet.thickness_mm) for sheet in job.map.sheets}
        weight = np.array([told[sheet[job.map.piece[name].sheet]] for name in names])
    off = np.abs(masses - weight * areas)
    tally.count(len(masses))
    tally.expect(np.all(weight > 0.0), "pieces.csv: the pieces weigh nothing")
    for at in np.flatnonzero(~(off <= slack)):
        tally.fail(
            f"pieces.csv, piece {names[at]}: mass_g is {masses[at]:g}, but its "
            f"area at {weight[at] * 1e6:.4g} g/m² makes {weight[at] * areas[at]:.4f}"
        )


def _weight(settings: dict[str, Any]) -> float | None:
    """Return grams for a square millimetre, if thickness and density are stated once each."""
    found: dict[str, set[float]] = {"thickness_mm": set(), "density_kg_m3": set()}

    def search(node: object) -> None:
        """Collect both keys at any depth."""
        if isinstance(node, dict):
            for key, value in node.items():
                if key in found and isinstance(value, int | float):
                    found[key].add(float(value))
                search(value)

    search(settings)
    if all(len(values) == 1 for values in found.values()):
        return found["thickness_mm"].pop() * found["density_kg_m3"].pop() * 1e-6
    return None
