"""Hold what becomes of the material: the accounts of sheets and materials, and their sums.

Areas are in square millimetres, lengths in millimetres; prices are in any currency, None where one
is not known.
"""

from collections.abc import Sequence

from fabweave.core.records import inline, optional, record


@record
class SheetAccount:
    """What becomes of a sheet: pieces without their holes, and waste, add up to its area.

    Holes are waste, and told by themselves, too. ``sheet`` counts from 1. ``utilisation`` is the
    share of its pieces, and ``stock`` what it is called in the list of stock.
    """

    sheet: int
    width_mm: float
    height_mm: float
    area_mm2: float
    piece_area_mm2: float
    hole_area_mm2: float
    waste_mm2: float
    utilisation: float
    pieces: int
    cut_length_mm: float
    pierces: int
    stock: str
    price: float | None
    material: str
    thickness_mm: float


@record
class SheetSums:
    """How many sheets there are, and what their areas, pieces and prices sum up to."""

    sheets: int
    area_mm2: float
    piece_area_mm2: float
    hole_area_mm2: float
    waste_mm2: float
    pieces: int
    price: float | None
    utilisation: float


@record
class MaterialAccount:
    """What a material comes to: its sheets, and the mass of its pieces."""

    material: str
    thickness_mm: float
    density_kg_m3: float
    bunches: tuple[str, ...]
    sums: SheetSums = inline()
    mass_g: float


@record
class Totals:
    """What all sheets come to.

    ``engrave_seen_mm`` is how much of the engraving no strand covers when the object is woven,
    where it was to be hidden.
    """

    sums: SheetSums = inline()
    cut_length_mm: float
    pierces: int
    engrave_length_mm: float
    holes: int
    mass_g: float
    engrave_seen_mm: float | None = optional()


def sum_sheets(sheets: Sequence[SheetAccount]) -> SheetSums:
    """Sum up sheets."""
    area, piece_area, hole_area, waste = (
        sum(getattr(sheet, name) for sheet in sheets)
        for name in ("area_mm2", "piece_area_mm2", "hole_area_mm2", "waste_mm2")
    )
    prices = [sheet.price for sheet in sheets if sheet.price is not None]
    return SheetSums(
        sheets=len(sheets),
        area_mm2=area,
        piece_area_mm2=piece_area,
        hole_area_mm2=hole_area,
        waste_mm2=waste,
        pieces=sum(sheet.pieces for sheet in sheets),
        # A sum that lacks a price would be none.
        price=sum(prices) if len(prices) == len(sheets) else None,
        utilisation=piece_area / area if sheets else 0.0,
    )
