"""Account for the material: what of every sheet becomes pieces, and what is waste."""

import math
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Literal, TypeVar

import numpy as np
import shapely

from fabweave.core.arrays import IntArray
from fabweave.core.files import csv_text
from fabweave.core.records import inline, optional, record
from fabweave.estimate.accounts import MaterialAccount, SheetAccount, SheetSums, Totals, sum_sheets
from fabweave.estimate.costs import Costs, SideSheet, side_costs
from fabweave.estimate.machine_time import runs_of
from fabweave.estimate.offcuts import KeptOffcut
from fabweave.nest.layout import Layout
from fabweave.piece.piece import Piece
from fabweave.piece.split.length_curve import SplittingRecord
from fabweave.plan.allotment import Allotment
from fabweave.plan.bill_of_materials import BillOfMaterials
from fabweave.sheet.drawing import Entity, Layer, SheetDrawing
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.side_sheets import SideSheets
from fabweave.stock.material import sheet_mass_kg
from fabweave.stock.sheet_size import usable_size

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
class Comparison:
    """How the sheets are used, beside what could be; holes are waste everywhere.

    ``gross`` is the share of pieces in whole sheets, and ``net`` that in what of the sheets is not
    kept as offcuts, ``kept_mm2``. ``bound_mm2`` is what pieces take with half the gap around, so
    that no layout at that gap could use less, ``bound_sheets`` so many of the largest sheets used,
    within their margins, and ``best`` the share of pieces in these.
    """

    gross: float
    net: float
    kept_mm2: float
    bound_mm2: float
    bound_sheets: int
    best: float


def compare_use(
    sums: SheetSums,
    to_cut: Sequence[Piece],
    layout: Layout,
    allotment: Allotment,
    offcuts: Sequence[KeptOffcut],
) -> Comparison:
    """Measure what could be, on the largest sheet that is used of each material.

    Parameters
    ----------
    sums : SheetSums
        What the sheets come to.
    to_cut : sequence of Piece
        In the order of the layout.
    layout : Layout
    allotment : Allotment
    offcuts : sequence of KeptOffcut
    """
    kept = sum(offcut.area_mm2 for offcut in offcuts)
    outlines = np.array([shapely.Polygon(piece.outline) for piece in to_cut])
    of_piece = np.array(allotment.of_pieces(to_cut), dtype=np.int64)
    bound, bound_sheets, bound_area = 0.0, 0, 0.0
    for index, supply in enumerate(allotment.supplies.each):
        numbers = np.flatnonzero(allotment.sheets == index).tolist()
        if not numbers:
            continue
        sheet = max((layout.sheets[number] for number in numbers), key=lambda one: one.area_mm2)
        usable, gap = usable_size(sheet, layout.margin_mm), supply.gap_mm
        room = float(np.sum(shapely.area(shapely.buffer(outlines[of_piece == index], gap / 2))))
        # Half the gap of a piece may reach into the margin.
        needed = math.ceil(room / math.prod(side + gap for side in usable) - 1e-9)
        bound, bound_sheets = bound + room, bound_sheets + needed
        bound_area += needed * sheet.area_mm2
    return Comparison(
        gross=round(sums.utilisation, 6),
        net=round(sums.piece_area_mm2 / (sums.area_mm2 - kept), 6),
        kept_mm2=round(kept, 6),
        bound_mm2=round(bound, 3),
        bound_sheets=bound_sheets,
        best=round(sums.piece_area_mm2 / bound_area, 6),
    )


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
    beside: Sequence[SideSheets] = (),
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
    beside : sequence of SideSheets
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
    aside = {sheets.folder: side_costs(sheets, machine.calibrate) for sheets in beside}
    only = materials[0] if len(materials) == 1 else None
    return WasteReport(
        material=None
        if only is None
        else MaterialName(name=only.material, thickness_mm=only.thickness_mm),
        materials=tuple(map(_rounded, materials)),
        sheets=tuple(map(_rounded, sheets)),
        totals=_rounded(totals),
        estimate=costs,
        comparison=compare_use(totals.sums, pieces, layout, allotment, offcuts),
        notes=tuple(notes),
        offcuts=tuple(offcuts),
        bill=bill,
        kerf_mm=machine.kerf_mm,
        splitting=splitting,
        rim=aside.get("rim"),
        former=aside.get("former"),
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
    return float(runs_of(entities).length_mm.sum())


def _rounded(account: _Account) -> _Account:
    """Return an account with its floats rounded, those of its sums, too."""
    values = {name.name: getattr(account, name.name) for name in fields(account)}
    for name, value in values.items():
        if isinstance(value, float):
            values[name] = round(value, _DECIMALS)
        elif isinstance(value, SheetSums):
            values[name] = _rounded(value)
    return replace(account, **values)
