"""Ask what room outlines find on the stock: alone, or nested roughly."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.nest.fits import fits_stock
from fabweave.nest.layout import ROUGH
from fabweave.nest.nesting import nest
from fabweave.nest.strips import nest_strips, row_rests
from fabweave.piece.split.preferences import SHEET_EUR_M2, SheetsNeeded, sum_sheets
from fabweave.piece.split.row_filling import Rests
from fabweave.stock.material import Material
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.supplies import Supplies, Supply

#: Where straight strips are cut so that they fill rows, a piece more must save so much of a row, by
#: what is preferred, an estimate: without, one of 603 crossings took 32 pieces for 20 to save two
#: rows of 20. Where work is to be saved, rows are not filled.
PIECE_ROWS = {"balanced": 0.1, "waste": 0.0}


def rough_nesting(
    supplies: Supplies,
) -> Callable[[Sequence[FloatArray], IntArray], SheetsNeeded | None]:
    """Return what nests outlines roughly, and tells the sheets that they take.

    Parameters
    ----------
    supplies : Supplies

    Returns
    -------
    callable
        Of outlines and the supply of each, (P,); its answer is None where the stock has no room for
        them.
    """
    rotations = parse_rotations(supplies.rotations)
    # Threads that are cut to several greatest lengths often come to the same pieces.
    known: dict[tuple[bytes, ...], SheetsNeeded | None] = {}

    def needed(outlines: Sequence[FloatArray], supply_of: IntArray) -> SheetsNeeded | None:
        key = (supply_of.tobytes(), *(outline.tobytes() for outline in outlines))
        if key not in known:
            known[key] = nested(outlines, supply_of)
        return known[key]

    def nested(outlines: Sequence[FloatArray], supply_of: IntArray) -> SheetsNeeded | None:
        found = []
        for number, supply in enumerate(supplies.each):
            try:
                own = [outlines[piece] for piece in np.flatnonzero(supply_of == number).tolist()]
                stock = supplies.as_nested(supply.sheets)
                margin, gap = supplies.margin_mm, supply.gap_mm
                layout = nest_strips(
                    own, stock, margin_mm=margin, gap_mm=gap, rotations=rotations
                ) or nest(
                    own, stock, margin_mm=margin, gap_mm=gap, effort=ROUGH, rotations=rotations,
                    workers=1,
                )  # fmt: skip
            except (CannotMakeError, InputError):
                # No room, or outlines that cross themselves, and will be cut elsewhere.
                return None
            found += [
                SheetsNeeded(1, sheet.area_mm2, sheet_price(sheet, supply.material), 0.0)
                for sheet in layout.sheets
            ]
        return sum_sheets(found)

    return needed


def strip_rests(
    supply_of: IntArray, row_mm: float, gap_mm: float, wide_mm: float, piece_rows: float
) -> Rests:
    """Return what tells the area of rows that straight strips waste, and what pieces are worth.

    Parameters
    ----------
    supply_of : (T,) int array
        The supply of each thread.
    row_mm, gap_mm : float
        How long rows are, and what lies between two strips.
    wide_mm : float
        How wide strips are.
    piece_rows : float
        What a piece is worth, in rows.
    """

    def rests(lengths: Mapping[int, FloatArray]) -> float:
        rows: list[list[float]] = [[] for _ in range(int(supply_of.max(initial=0)) + 1)]
        for thread, own in lengths.items():
            rows[supply_of[thread]] += own.tolist()
        return wide_mm * sum(
            piece_rows * row_mm * len(own) + row_rests(own, row_mm, gap_mm) for own in rows
        )

    return rests


def sheet_price(sheet: SheetSize, material: Material) -> float:
    """Return the price of a sheet: its own, none for an offcut, or by the material's area.

    Where the material's is a range, its middle counts.
    """
    if sheet.price is not None or sheet.offcut:
        return sheet.price or 0.0
    by_area = SHEET_EUR_M2 if material.price_per_m2 is None else np.mean(material.price_per_m2)
    return float(by_area) * sheet.area_mm2 * 1e-6


def outlines_with_place(
    outlines: Sequence[FloatArray],
    threads: IntArray,
    supplies: Supplies,
    bunches: IntArray,
    effort: str,
) -> BoolArray:
    """Return which pieces fit on a sheet of their own supply, each alone, (N,).

    Parameters
    ----------
    outlines : sequence of (K, 2) float arrays
        The pieces as they are cut.
    threads : (N,) int array
        The thread of each.
    supplies, bunches, effort
        As for :func:`nest_pieces`.
    """
    placed = np.zeros(len(outlines), dtype=np.bool_)
    supply_of_piece = supplies.of(bunches)[threads]
    for index, supply in enumerate(supplies.each):
        group = np.flatnonzero(supply_of_piece == index)
        placed[group] = alone_on_sheet(
            [outlines[piece] for piece in group.tolist()], supply, supplies, effort
        )
    return placed


def alone_on_sheet(
    outlines: Sequence[FloatArray], supply: Supply, supplies: Supplies, effort: str
) -> BoolArray:
    """Return which outlines fit on a sheet of a supply, each alone, (N,)."""
    return fits_stock(
        outlines,
        supplies.as_nested(supply.sheets),
        margin_mm=supplies.margin_mm,
        gap_mm=supply.gap_mm,
        effort=effort,
        rotations=parse_rotations(supplies.rotations),
    )
