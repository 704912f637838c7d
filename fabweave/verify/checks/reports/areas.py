"""Check every figure of areas, lengths, masses and waste."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fabweave.verify.checks.reports.comparison import check_comparison
from fabweave.verify.checks.reports.splitting import check_splitting
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import ENGRAVE_LAYERS, Floats
from fabweave.verify.measure.areas import (
    Areas,
    rectangles_around,
    sum_areas,
)
from fabweave.verify.read.job_files import Job, Rows, required
from fabweave.verify.statement import Place, Tally

AREA_MM2 = 0.01
UTILISATION = 6e-5
_SIZE_MM = 1e-6
#: Of lengths that add up: so many millimetres, and this share of themselves.
_LENGTH_MM, _SHARE = 0.05, 1e-6
#: Tables for people are rounded, but not more coarsely than this.
_COARSEST = {"length_mm": 0.06, "width_mm": 0.06, "area_mm2": 0.06, "mass_g": 0.006}


def check_areas(job: Job, tally: Tally) -> None:
    """Recompute pieces.csv and waste.json from outlines and sheets."""
    plan, waste = required(job.map), required(job.waste)
    _check_piece_rows(plan, job, required(job.piece_rows), tally)
    check_splitting(job, waste, tally.at("waste.json", "splitting"))
    report = tally.at("waste.json")
    rows = {row.get("sheet"): row for row in waste["sheets"] if isinstance(row, dict)}
    report.same(
        "sheets",
        [row.get("sheet") if isinstance(row, dict) else row for row in waste["sheets"]],
        plan.sheet,
    )
    for sheet in plan.sheets:
        row, place = rows.get(sheet.number, {}), report.at(f"sheet {sheet.number}")
        pieces = plan.on_sheet(sheet.number)
        figures = sum_areas(job.areas[piece.id] for piece in pieces)
        _check_budget(row, sheet.area_mm2, figures, len(pieces), place)
        place.numbers(
            row, {"width_mm": sheet.width_mm, "height_mm": sheet.height_mm}, within=_SIZE_MM
        )
    totals, place = waste["totals"], report.at("totals")
    placed = [piece for piece in plan.to_cut if piece.sheet in plan.sheet]
    area = sum(sheet.area_mm2 for sheet in plan.sheets)
    figures = sum_areas(job.areas[piece.id] for piece in placed)
    _check_budget(totals, area, figures, len(placed), place)
    figures = sum_areas(job.areas.values())
    place.numbers(totals, {"sheets": len(plan.sheets), "holes": figures.cutouts})
    if "comparison" in waste:
        check_comparison(plan, job, waste, report.at("comparison"))
    engraved = sum(
        float(drawing.lengths[shapes].sum())
        for drawing in job.dxf.values()
        for (layer, _), shapes in drawing.groups.items()
        if layer in ENGRAVE_LAYERS
    )
    lengths = {"cut_length_mm": figures.cut_mm, "engrave_length_mm": engraved}
    if len(job.dxf) < len(plan.sheets):
        tally.fail("the engraved length is not checked, because not every DXF could be read")
        del lengths["engrave_length_mm"]
    for name, value in lengths.items():
        place.number(name, totals.get(name), value, within=_LENGTH_MM + _SHARE * value)


def _check_budget(
    record: Mapping[str, Any], area: float, figures: Areas, pieces: int, place: Place
) -> None:
    """Check that piece, hole and waste areas are right, and that holes are waste."""
    wanted: dict[str, float | None] = {
        "area_mm2": area,
        "piece_area_mm2": figures.piece_mm2,
        "hole_area_mm2": figures.holes_mm2,
        "waste_mm2": area - figures.piece_mm2,
    }
    place.numbers(record, wanted, within=AREA_MM2 + 1e-8 * area)
    share = figures.piece_mm2 / area if area else 0.0
    place.number("utilisation", record.get("utilisation"), share, within=UTILISATION)
    place.number("pieces", record.get("pieces"), pieces)


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
        piece = plan.cut_piece.get(row["id"])
        if piece is None:
            continue
        place = tally.at("pieces.csv", f"piece {piece.id}")
        area = job.areas[piece.id].piece_mm2
        stated = {key: float(row[key]) for key in _COARSEST}
        place.number("area_mm2", stated["area_mm2"], area, within=slack["area_mm2"])
        rectangles = rectangles_around(piece.outline)
        least = rectangles[np.argmin(rectangles.prod(axis=1))]
        fits = (
            (np.abs(rectangles[:, 0] - stated["length_mm"]) <= slack["length_mm"])
            & (np.abs(rectangles[:, 1] - stated["width_mm"]) <= slack["width_mm"])
            & (rectangles.prod(axis=1) <= least.prod() * (1.0 + 1e-6))
        )
        place.expect(
            np.any(fits),
            f"it is {row['length_mm']} × {row['width_mm']} mm, but the least rectangle around it "
            f"is {least[0]:.4f} × {least[1]:.4f} mm",
        )
        names.append(piece.id)
        masses.append(stated["mass_g"])
        areas.append(area)
    _check_masses(job, names, np.array(masses), np.array(areas), slack["mass_g"], tally)


def _decimals(text: str) -> int:
    """Return the number of decimals of a number as written."""
    return len(text.partition(".")[2])


def _check_masses(
    job: Job, names: list[str], masses: Floats, areas: Floats, slack: float, tally: Tally
) -> None:
    """Check that all masses have one weight for an area, if one is stated that of their material.

    Where none is, neither in waste.json nor in the settings, they agree with one another.
    """
    if len(masses) == 0 or areas.sum() <= 0.0:
        return
    stated = _weight(job.settings or {})
    weight = np.full(len(masses), masses.sum() / areas.sum() if stated is None else stated)
    records = (job.waste or {}).get("materials") or []
    weights = {
        (record["material"], record["thickness_mm"]): record["thickness_mm"]
        * record["density_kg_m3"]
        * 1e-6
        for record in records
    }
    if job.map is not None and weights:
        sheets = [job.map.sheet[job.map.cut_piece[name].sheet] for name in names]
        weight = np.array([weights[sheet.material, sheet.thickness_mm] for sheet in sheets])
    table = tally.at("pieces.csv")
    table.expect(np.all(weight > 0.0), "the pieces weigh nothing")
    for name, mass, wanted in zip(names, masses.tolist(), (weight * areas).tolist(), strict=True):
        table.at(f"piece {name}").number("mass_g", mass, wanted, within=slack)


def _weight(settings: dict[str, Any]) -> float | None:
    """Return grams for a square millimetre, if thickness and density are stated once each."""
    values_of: dict[str, set[float]] = {"thickness_mm": set(), "density_kg_m3": set()}

    def search(node: object) -> None:
        """Collect both keys at any depth."""
        if isinstance(node, dict):
            for key, value in node.items():
                if key in values_of and isinstance(value, int | float):
                    values_of[key].add(float(value))
                search(value)

    search(settings)
    if all(len(values) == 1 for values in values_of.values()):
        return values_of["thickness_mm"].pop() * values_of["density_kg_m3"].pop() * 1e-6
    return None
