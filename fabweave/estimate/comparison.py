"""Compare how the material is used with the best there could be."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from fabweave.core.arrays import IntArray
from fabweave.core.records import optional, record
from fabweave.estimate.accounts import SheetSums
from fabweave.estimate.offcuts import KeptOffcut
from fabweave.nest.layout import Layout
from fabweave.piece.on_stock import rough_nesting
from fabweave.piece.piece import Piece
from fabweave.plan.allotment import Allotment
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.sheet_size import usable_size
from fabweave.stock.supplies import Supplies


@record
class RoughWay:
    """Sheets that the pieces take when they are nested roughly, and the share that they fill."""

    area_mm2: float
    sheets: int
    utilisation: float


@record
class GrainCost:
    """What it costs that pieces lie across the grain: both ways nested roughly, so alike."""

    free: RoughWay
    across: RoughWay


@record
class Comparison:
    """How the sheets are used, beside what could be; holes are waste everywhere.

    ``gross`` is the share of pieces in whole sheets, and ``net`` that in what of the sheets is not
    kept as offcuts, ``kept_mm2``. ``bound_mm2`` is what pieces take with half the gap around, so
    that no layout at that gap could use less, ``bound_sheets`` so many of the largest sheets used,
    within their margins, and ``best`` the share of pieces in these. ``grain`` has what lying across
    the grain costs, where pieces do.
    """

    gross: float
    net: float
    kept_mm2: float
    bound_mm2: float
    bound_sheets: int
    best: float
    grain: GrainCost | None = optional(default=None)


def compare_use(
    sums: SheetSums,
    to_cut: Sequence[Piece],
    layout: Layout,
    allotment: Allotment,
    offcuts: Sequence[KeptOffcut],
    grain: GrainCost | None = None,
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
    grain : GrainCost, optional
        What it costs that pieces lie across the grain.
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
        grain=grain,
    )


#: More pieces are not nested a second and a third time to tell what the grain costs.
MOST_PIECES = 500


def grain_cost(pieces: Sequence[Piece], supplies: Supplies, bunches: IntArray) -> GrainCost | None:
    """Return what it costs that pieces lie across the grain; None where they need not.

    The pieces are nested roughly, as they must lie and at any angle. It is not told of more than
    ``MOST_PIECES``, which would take minutes, nor where the stock has no room for such a nesting.

    Parameters
    ----------
    pieces : sequence of Piece
    supplies : Supplies
    bunches : (T,) int array
        The bunch of each thread.
    """
    if not parse_rotations(supplies.rotations).across or len(pieces) > MOST_PIECES:
        return None
    outlines = [piece.outline for piece in pieces]
    supply_of = supplies.of(bunches)[[piece.thread for piece in pieces]]
    used = sum(piece.net_area_mm2 for piece in pieces)
    ways = []
    for rotations in (supplies.rotations, "free"):
        needed = rough_nesting(replace(supplies, rotations=rotations))(outlines, supply_of)
        if needed is None:
            return None
        area = round(needed.area_mm2, 3)
        share = round(used / area, 6)
        ways.append(RoughWay(area_mm2=area, sheets=round(needed.count), utilisation=share))
    return GrainCost(across=ways[0], free=ways[1])
