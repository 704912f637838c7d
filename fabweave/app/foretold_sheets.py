"""Say how many sheets a few large pieces take, by nesting them roughly."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fabweave.app.settings import Settings
from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.flat.piece import Piece
from fabweave.flat.split.preferences import SHEET_EUR_M2, SheetsNeeded, sum_sheets
from fabweave.nest.effort import ROUGH
from fabweave.nest.nesting import nest
from fabweave.report.comparison import GrainCost, RoughWay
from fabweave.stock.material import Material
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.supplies import Supplies

#: More pieces are not nested a second and a third time to tell what the grain costs.
MOST_PIECES = 500


def rough_nesting(
    settings: Settings, supplies: Supplies
) -> Callable[[Sequence[FloatArray], IntArray], SheetsNeeded | None]:
    """Return what nests outlines roughly, and tells the sheets that they take.

    Parameters
    ----------
    settings : Settings
        Complete.
    supplies : Supplies

    Returns
    -------
    callable
        Of outlines and the supply of each, (P,); its answer is None where the stock has no room for
        them.
    """
    rotations = parse_rotations(settings.rotations)

    def needed(outlines: Sequence[FloatArray], supply_of: IntArray) -> SheetsNeeded | None:
        found = []
        for number, supply in enumerate(supplies.each):
            try:
                layout = nest(
                    [outlines[piece] for piece in np.flatnonzero(supply_of == number).tolist()],
                    settings.as_nested(supply.sheets),
                    margin_mm=settings.margin_mm,
                    gap_mm=supply.gap_mm,
                    effort=ROUGH,
                    rotations=rotations,
                    workers=1,
                )
            except (CannotMakeError, InputError):
                # No room, or outlines that cross themselves, and will be cut elsewhere.
                return None
            found += [
                SheetsNeeded(1, sheet.area_mm2, sheet_price(sheet, supply.material), 0.0)
                for sheet in layout.sheets
            ]
        return sum_sheets(found)

    return needed


def grain_cost(
    pieces: Sequence[Piece], settings: Settings, supplies: Supplies, bunches: IntArray
) -> GrainCost | None:
    """Return what it costs that pieces lie across the grain; None where they need not.

    The pieces are nested roughly, as they must lie and at any angle. It is not told of more than
    ``MOST_PIECES``, which would take minutes, nor where the stock has no room for such a nesting.

    Parameters
    ----------
    pieces : sequence of Piece
    settings : Settings
        Complete.
    supplies : Supplies
    bunches : (T,) int array
        The bunch of each thread.
    """
    if not parse_rotations(settings.rotations).across or len(pieces) > MOST_PIECES:
        return None
    outlines = [piece.outline for piece in pieces]
    supply_of = supplies.of(bunches)[[piece.thread for piece in pieces]]
    used = sum(piece.net_area_mm2 for piece in pieces)
    ways = []
    for rotations in (settings.rotations, "free"):
        needed = rough_nesting(replace(settings, rotations=rotations), supplies)(
            outlines, supply_of
        )
        if needed is None:
            return None
        area = round(needed.area_mm2, 3)
        share = round(used / area, 6)
        ways.append(RoughWay(area_mm2=area, sheets=round(needed.count), utilisation=share))
    return GrainCost(across=ways[0], free=ways[1])


def sheet_price(sheet: SheetSize, material: Material) -> float:
    """Return the price of a sheet: its own, none for an offcut, or by the material's area.

    Where the material's is a range, its middle counts.
    """
    if sheet.price is not None or sheet.offcut:
        return sheet.price or 0.0
    by_area = SHEET_EUR_M2 if material.price_per_m2 is None else np.mean(material.price_per_m2)
    return float(by_area) * sheet.area_mm2 * 1e-6
