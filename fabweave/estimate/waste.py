"""Account for the material: what of every sheet becomes pieces, and what is waste."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Literal, TypeVar

import numpy as np

from fabweave.core.arc_path import stretch
from fabweave.core.arrays import IntArray
from fabweave.core.files import csv_text
from fabweave.core.records import inline, optional, record
from fabweave.estimate.accounts import MaterialAccount, SheetAccount, SheetSums, Totals, sum_sheets
from fabweave.estimate.comparison import Comparison, GrainCost, compare_use
from fabweave.estimate.costs import Costs, SideSheet, side_costs
from fabweave.estimate.offcuts import KeptOffcut
from fabweave.nest.layout import Layout
from fabweave.piece.piece import Piece
from fabweave.piece.split.length_curve import SplittingRecord
from fabweave.plan.allotment import Allotment
from fabweave.plan.bill_of_materials import BillOfMaterials
from fabweave.sheet.drawing import Circle, Entity, Layer, Polyline, SheetDrawing
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.side_sheets import SideSheets
from fabweave.stock.material import sheet_mass_kg

_DECIMALS = 6
_Account = TypeVar("_Account", SheetAccount, MaterialAccount, Totals, SheetSums)


def piece_table(
    pieces: Sequence[Piece],
    origins: IntArray,
    kinds: IntArray,
    labels: Sequence[str],
    layout: Layout,
    allotment: Allotment,
) -> str:
    """Return the pieces as CSV: one row each with sheet, size, area, mass and holes.

    Pieces of one kind are interchangeable but for their labels. Spares come last, with the piece
    that they are a copy of.
    Length and width are those of the piece's smallest rectangle; the area is without holes.

    Parameters
    ----------
    pieces : sequence of Piece
        All that is cut.
    origins : int array
        Which piece of the object each is, or is a spare of.
    kinds : int array
        Which kind each piece of the object is of.
    labels : sequence of str
        Names of the threads.
    layout : Layout
    allotment : Allotment
    """
    columns = (
        "id", "thread", "sheet", "length_mm", "width_mm", "area_mm2", "mass_g", "holes", "kind",
        "material", "thickness_mm",
    )  # fmt: skip
    spares = ("spare_of",) if len(pieces) > len(kinds) else ()
    rows = []
    for at, (piece, placement, origin) in enumerate(
        zip(pieces, layout.placements, origins.tolist(), strict=True)
    ):
        length, width = np.ptp(piece.outline, axis=0)
        area = piece.net_area_mm2
        material = allotment.of_thread(piece.thread).material
        rows.append(
            (
                piece.id,
                labels[piece.thread],
                placement.sheet + 1,
                f"{length:.3f}",
                f"{width:.3f}",
                f"{area:.3f}",
                f"{1000 * sheet_mass_kg(material, area):.3f}",
                len(piece.holes) + len(piece.slots),
                kinds[origin],
                material.name,
                f"{material.thickness_mm:.10g}",
                *(pieces[origin].id if origin != at else "" for _ in spares),
            )
        )
    return csv_text((*columns, *spares), rows)


@record
class MaterialName:
    """The one material of a job."""

    name: str
    thickness_mm: float


@record
class WasteReport:
    """What becomes of the material, what it costs, and what is kept and bought: ``waste.json``.

    ``material`` is None where there are several.
    """

    schema: Literal["fabweave.waste/1"] = "fabweave.waste/1"
    units: Literal["mm"] = "mm"
    material: MaterialName | None
    materials: tuple[MaterialAccount, ...]
    sheets: tuple[SheetAccount, ...]
    totals: Totals
    estimate: Costs
    comparison: Comparison
    notes: tuple[str, ...]
    offcuts: tuple[KeptOffcut, ...]
    bill: BillOfMaterials = inline()
    kerf_mm: float
    splitting: SplittingRecord
    rim: tuple[SideSheet, ...] | None = optional()
    former: tuple[SideSheet, ...] | None = optional()


def waste_report(
    pieces: Sequence[Piece],
    splitting: SplittingRecord,
    machine: MachineSettings,
    layout: Layout,
    drawings: Sequence[SheetDrawing],
    allotment: Allotment,
    *,
    notes: Sequence[str],
    offcuts: Sequence[KeptOffcut],
    costs: Costs,
    bill: BillOfMaterials,
    engrave_seen_mm: float | None = None,
    grain: GrainCost | None = None,
    rim: SideSheets | None = None,
    former: SideSheets | None = None,
) -> WasteReport:
    """Account for every sheet, for each material, and for all together.

    Parameters
    ----------
    pieces : sequence of Piece
        All that is cut.
    splitting : SplittingRecord
    machine : MachineSettings
    layout : Layout
    drawings : sequence of SheetDrawing
        The sheets of the layout, as they are drawn.
    allotment : Allotment
    notes, offcuts, costs, bill
        What the report says besides.
    engrave_seen_mm : float, optional
        How much of the engraving is seen when the object is woven, if it was to be hidden.
    grain : GrainCost, optional
        What it costs that pieces lie across the grain.
    rim, former : SideSheets, optional
        The sheets of rings and of a former, which only the costs count, too.
    """
    sheets = [
        _sheet_account(number, pieces, layout, drawing, allotment)
        for number, drawing in enumerate(drawings)
    ]
    materials = _material_accounts(sheets, allotment)
    totals = Totals(
        sums=sum_sheets(sheets),
        cut_length_mm=sum(sheet.cut_length_mm for sheet in sheets),
        pierces=sum(sheet.pierces for sheet in sheets),
        engrave_length_mm=sum(
            length_mm(entities_on(drawing, Layer.ENGRAVE_LABEL, Layer.ENGRAVE_MARK))
            for drawing in drawings
        ),
        holes=sum(len(entities_on(drawing, Layer.CUT_INNER)) for drawing in drawings),
        mass_g=sum(account.mass_g for account in materials),
        engrave_seen_mm=engrave_seen_mm,
    )
    only = materials[0] if len(materials) == 1 else None
    return WasteReport(
        material=None
        if only is None
        else MaterialName(name=only.material, thickness_mm=only.thickness_mm),
        materials=tuple(map(_rounded, materials)),
        sheets=tuple(map(_rounded, sheets)),
        totals=_rounded(totals),
        estimate=costs,
        comparison=compare_use(totals.sums, pieces, layout, allotment, offcuts, grain),
        notes=tuple(notes),
        offcuts=tuple(offcuts),
        bill=bill,
        kerf_mm=machine.kerf_mm,
        splitting=splitting,
        rim=side_costs(rim, machine.calibrate) if rim else None,
        former=side_costs(former, machine.calibrate) if former else None,
    )


def _sheet_account(
    number: int,
    pieces: Sequence[Piece],
    layout: Layout,
    drawing: SheetDrawing,
    allotment: Allotment,
) -> SheetAccount:
    """Account for a sheet, counted from 0."""
    sheet, material = layout.sheets[number], allotment.of_sheet(number).material
    cut = entities_on(drawing, Layer.CUT_INNER, Layer.CUT_OUTER)
    placed = [pieces[p.piece] for p in layout.placements if p.sheet == number]
    outlines = sum(piece.path.area for piece in placed)
    holes = sum(piece.hole_area_mm2 for piece in placed)
    area = sheet.area_mm2
    return SheetAccount(
        sheet=number + 1,
        width_mm=sheet.width_mm,
        height_mm=sheet.height_mm,
        area_mm2=area,
        piece_area_mm2=outlines - holes,
        hole_area_mm2=holes,
        waste_mm2=area - outlines + holes,
        utilisation=(outlines - holes) / area,
        pieces=len(placed),
        cut_length_mm=length_mm(cut),
        pierces=len(cut),
        stock=sheet.name,
        price=0.0 if sheet.offcut and sheet.price is None else sheet.price,
        material=material.name,
        thickness_mm=material.thickness_mm,
    )


def _material_accounts(
    sheets: Sequence[SheetAccount], allotment: Allotment
) -> list[MaterialAccount]:
    """Return what each material comes to."""
    accounts = []
    for index, supply in enumerate(allotment.supplies.each):
        material = supply.material
        numbers = np.flatnonzero(allotment.sheets == index).tolist()
        sums = sum_sheets([sheets[number] for number in numbers])
        accounts.append(
            MaterialAccount(
                material=material.name,
                thickness_mm=material.thickness_mm,
                density_kg_m3=material.density_kg_m3,
                bunches=supply.bunches,
                sums=sums,
                mass_g=1000 * sheet_mass_kg(material, sums.piece_area_mm2),
            )
        )
    return accounts


def entities_on(drawing: SheetDrawing, *layers: Layer) -> list[Entity]:
    """Return what pieces of a sheet have on some layers."""
    return [
        entity for piece in drawing.pieces for entity in piece.entities if entity.layer in layers
    ]


def length_mm(entities: Sequence[Entity]) -> float:
    """Return how far the tool travels along entities, from one to the next not counted."""
    circles = 2 * np.pi * sum(entity.radius for entity in entities if isinstance(entity, Circle))
    lines = [entity for entity in entities if isinstance(entity, Polyline)]
    if not lines:
        return float(circles)
    runs = [
        np.concatenate((line.points, line.points[:1])) if line.closed else line.points
        for line in lines
    ]
    steps = np.hypot(*np.diff(np.concatenate(runs), axis=0).T)
    ends = np.cumsum([len(run) for run in runs])
    # The step from each run to the next is no travel along an entity.
    steps[ends[:-1] - 1] = 0.0
    for line, run, end in zip(lines, runs, ends.tolist(), strict=True):
        if line.bulges is not None:
            steps[end - len(run) : end - 1] *= stretch(line.bulges[: len(run) - 1])
    return float(circles + steps.sum())


def _rounded(account: _Account) -> _Account:
    """Return an account with its floats rounded, those of its sums, too."""
    values = {name.name: getattr(account, name.name) for name in fields(account)}
    for name, value in values.items():
        if isinstance(value, float):
            values[name] = round(value, _DECIMALS)
        elif isinstance(value, SheetSums):
            values[name] = _rounded(value)
    return replace(account, **values)
