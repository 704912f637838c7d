"""Account for the material: what of every sheet becomes pieces, holes and waste."""

import csv
import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from fabweave.core.arc_path import stretch
from fabweave.cut.drawing import Circle, Entity, Layer, Polyline, SheetDrawing
from fabweave.flat.congruence import piece_kinds
from fabweave.flat.piece import Piece
from fabweave.nest.allotment import Allotment
from fabweave.nest.layout import Layout
from fabweave.report.estimate import estimate_record
from fabweave.stock.material import sheet_mass_kg

SCHEMA = "fabweave.waste/1"
_DECIMALS = 6


def outline_area_mm2(piece: Piece) -> float:
    """Return the nominal area of a piece's outline, holes not taken off."""
    return piece.path.area


def hole_area_mm2(piece: Piece) -> float:
    """Return the area of a piece's holes and slots."""
    slots = sum(slot.path.area for slot in piece.slots)
    return float(np.pi / 4 * np.sum(piece.holes[:, 3] ** 2) + slots)


def piece_table(
    pieces: Sequence[Piece], layout: Layout, labels: Sequence[str], allotment: Allotment
) -> str:
    """Return the pieces as CSV: one row each with sheet, size, area, mass and holes.

    Pieces of one kind are interchangeable but for their labels.
    Length and width are those of the piece's smallest rectangle; the area is without holes.
    """
    text = io.StringIO(newline="")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(
        ("id", "thread", "sheet", "length_mm", "width_mm", "area_mm2", "mass_g", "holes", "kind",
         "material", "thickness_mm")
    )  # fmt: skip
    kinds = piece_kinds(pieces, allotment.of_pieces(pieces)).tolist()
    for piece, placement, kind in zip(pieces, layout.placements, kinds, strict=True):
        length, width = np.ptp(piece.outline, axis=0)
        area = outline_area_mm2(piece) - hole_area_mm2(piece)
        material = allotment.of_thread(piece.thread).material
        rows.writerow(
            (
                piece.id,
                labels[piece.thread],
                placement.sheet + 1,
                f"{length:.3f}",
                f"{width:.3f}",
                f"{area:.3f}",
                f"{1000 * sheet_mass_kg(material, area):.3f}",
                len(piece.holes) + len(piece.slots),
                kind,
                material.name,
                f"{material.thickness_mm:.10g}",
            )
        )
    return text.getvalue()


def waste_report(
    pieces: Sequence[Piece],
    layout: Layout,
    drawings: Sequence[SheetDrawing],
    allotment: Allotment,
    notes: Sequence[str],
) -> dict[str, Any]:
    """Account for every sheet and for all together.

    On each sheet the areas of pieces (without holes), holes and waste add up to the sheet.
    Utilisation is the nominal area of the pieces' outlines over the area of the sheet. The totals
    of each material stand under ``materials``.

    Returns
    -------
    dict
        What ``waste.json`` holds.
    """
    rows = []
    for number, (sheet, drawing) in enumerate(zip(layout.sheets, drawings, strict=True)):
        cut = entities_on(drawing, Layer.CUT_INNER, Layer.CUT_OUTER)
        here = [pieces[p.piece] for p in layout.placements if p.sheet == number]
        outlines = sum(outline_area_mm2(piece) for piece in here)
        holes = sum(hole_area_mm2(piece) for piece in here)
        area = sheet.area_mm2
        rows.append(
            {
                "sheet": number + 1,
                "width_mm": sheet.width_mm,
                "height_mm": sheet.height_mm,
                "area_mm2": area,
                "piece_area_mm2": outlines - holes,
                "hole_area_mm2": holes,
                "waste_mm2": area - outlines,
                "utilisation": outlines / area,
                "pieces": len(here),
                "cut_length_mm": length_mm(cut),
                "pierces": len(cut),
                "stock": sheet.name,
                "price": 0.0 if sheet.offcut and sheet.price is None else sheet.price,
                "material": allotment.of_sheet(number).material.name,
                "thickness_mm": allotment.of_sheet(number).material.thickness_mm,
            }
        )
    totals = sum_rows(rows)
    materials = material_records(rows, allotment)
    totals["cut_length_mm"] = sum(row["cut_length_mm"] for row in rows)
    totals["pierces"] = sum(row["pierces"] for row in rows)
    totals["engrave_length_mm"] = sum(
        length_mm(entities_on(drawing, Layer.ENGRAVE_LABEL, Layer.ENGRAVE_MARK))
        for drawing in drawings
    )
    totals["holes"] = sum(len(entities_on(drawing, Layer.CUT_INNER)) for drawing in drawings)
    totals["mass_g"] = sum(record["mass_g"] for record in materials)
    only = materials[0] if len(materials) == 1 else None
    return {
        "schema": SCHEMA,
        "units": "mm",
        # What several materials have in common is nothing.
        "material": only and {"name": only["material"], "thickness_mm": only["thickness_mm"]},
        "materials": [_rounded(record) for record in materials],
        "sheets": [_rounded(row) for row in rows],
        "totals": _rounded(totals),
        "estimate": estimate_record(rows, allotment.sheet_materials),
        "notes": list(notes),
    }


def sum_rows(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return how many sheets there are, and what their areas and pieces sum up to."""
    totals: dict[str, Any] = {"sheets": len(rows)}
    for key in ("area_mm2", "piece_area_mm2", "hole_area_mm2", "waste_mm2", "pieces"):
        totals[key] = sum(row[key] for row in rows)
    prices = [row["price"] for row in rows]
    # A sum without a price would be none.
    totals["price"] = None if None in prices else sum(prices)
    used = totals["piece_area_mm2"] + totals["hole_area_mm2"]
    totals["utilisation"] = used / totals["area_mm2"] if rows else 0.0
    return totals


def material_records(rows: Sequence[dict[str, Any]], allotment: Allotment) -> list[dict[str, Any]]:
    """Return what each material comes to: its sheets, areas, price and mass.

    Parameters
    ----------
    rows : sequence of dict
        The records of all sheets.
    allotment : Allotment
    """
    records = []
    for index, supply in enumerate(allotment.supplies.each):
        material = supply.material
        own = sum_rows(
            [rows[sheet] for sheet in np.flatnonzero(allotment.sheets == index).tolist()]
        )
        records.append(
            {
                "material": material.name,
                "thickness_mm": material.thickness_mm,
                "density_kg_m3": material.density_kg_m3,
                "bunches": list(supply.bunches),
                **own,
                "mass_g": 1000 * sheet_mass_kg(material, own["piece_area_mm2"]),
            }
        )
    return records


def entities_on(drawing: SheetDrawing, *layers: Layer) -> list[Entity]:
    """Return what pieces of a sheet have on some layers."""
    return [
        entity for piece in drawing.pieces for entity in piece.entities if entity.layer in layers
    ]


def length_mm(entities: Sequence[Entity]) -> float:
    """Return how far the tool travels along entities, from one to the next not counted."""
    circles = 2 * np.pi * sum(one.radius for one in entities if isinstance(one, Circle))
    lines = [one for one in entities if isinstance(one, Polyline)]
    if not lines:
        return float(circles)
    runs = [
        np.concatenate((one.points, one.points[:1])) if one.closed else one.points for one in lines
    ]
    steps = np.hypot(*np.diff(np.concatenate(runs), axis=0).T)
    ends = np.cumsum([len(run) for run in runs])
    # The step from each run to the next is no travel along an entity.
    steps[ends[:-1] - 1] = 0.0
    for one, run, end in zip(lines, runs, ends.tolist(), strict=True):
        if one.bulges is not None:
            steps[end - len(run) : end - 1] *= stretch(one.bulges[: len(run) - 1])
    return float(circles + steps.sum())


def _rounded(row: dict[str, Any]) -> dict[str, Any]:
    """Return the row with its floats rounded."""
    return {
        key: round(value, _DECIMALS) if isinstance(value, float) else value
        for key, value in row.items()
    }
