"""Say what the rings around openings take: sheets of their own, material, time of the machine."""

from collections.abc import Sequence

from fabweave.core.records import inline, record
from fabweave.cut.drawing import SheetDrawing
from fabweave.flat.rim_ring import RimRing
from fabweave.nest.layout import Layout
from fabweave.report.costs.machine_time import MachineTime, scaled_time, sheet_time
from fabweave.report.costs.money import Price, sheet_price
from fabweave.stock.material import Material

_DECIMALS = 6


@record
class RimSheet:
    """A sheet with pieces of rings: its name and size, their area without holes, time, price."""

    sheet: str
    width_mm: float
    height_mm: float
    pieces: int
    piece_area_mm2: float
    material: str
    thickness_mm: float
    machine: MachineTime = inline()
    price: Price | None


def rim_sheets(
    rings: Sequence[RimRing],
    layout: Layout | None,
    drawings: Sequence[SheetDrawing],
    material: Material,
    *,
    calibration: float,
) -> tuple[RimSheet, ...] | None:
    """Return what each sheet of rings takes; None without rings.

    Parameters
    ----------
    rings : sequence of RimRing
    layout : Layout or None
        Of their pieces, one after another.
    drawings : sequence of SheetDrawing
        Its sheets.
    material : Material
        Of all of them.
    calibration : float
        What the machine took, divided by what was estimated.
    """
    if layout is None:
        return None
    areas = [piece.net_area_mm2 for ring in rings for piece in ring.pieces]
    found = []
    for number, (sheet, drawing) in enumerate(zip(layout.sheets, drawings, strict=True)):
        own = [areas[one.piece] for one in layout.placements if one.sheet == number]
        stated = 0.0 if sheet.offcut and sheet.price is None else sheet.price
        found.append(
            RimSheet(
                sheet=drawing.name,
                width_mm=sheet.width_mm,
                height_mm=sheet.height_mm,
                pieces=len(own),
                piece_area_mm2=round(sum(own), _DECIMALS),
                material=material.name,
                thickness_mm=material.thickness_mm,
                machine=scaled_time(sheet_time(drawing, material), calibration),
                price=sheet_price(sheet.area_mm2, material, stated),
            )
        )
    return tuple(found)
