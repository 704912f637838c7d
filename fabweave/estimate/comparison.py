"""Compare how the material is used with the best there could be, and with two naive ways."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.records import optional, record
from fabweave.estimate.accounts import SheetSums
from fabweave.estimate.offcuts import KeptOffcut
from fabweave.nest.layout import Layout
from fabweave.piece.development import unfold_threads
from fabweave.piece.on_stock import rough_nesting
from fabweave.piece.piece import Piece
from fabweave.plan.allotment import Allotment
from fabweave.plan.planned_job import PlannedJob
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.sheet_size import usable_size
from fabweave.stock.supplies import Supplies


def shelf_sheets(
    sizes_mm: FloatArray, sheet_mm: tuple[float, float], gap_mm: float
) -> tuple[int, int]:
    """Pack rectangles on shelves along the longer side of sheets, the highest first.

    Each lies along the shelf, and goes on the first shelf that has room for it, else on a new one
    of the first sheet that has. They stand at the gap from one another.

    Parameters
    ----------
    sizes_mm : (N, 2) float array
        Sides of each.
    sheet_mm : (float, float)
        Sides of what is usable of a sheet.
    gap_mm : float

    Returns
    -------
    sheets : int
        How many sheets are used.
    left_out : int
        How many rectangles fit on none.

    Examples
    --------
    Two of 4 × 2 fill a shelf of 9 × 2, and two shelves a sheet; one of 10 × 1 fits nowhere.

    >>> import numpy as np
    >>> shelf_sheets(np.array([[4.0, 2.0]] * 5 + [[1.0, 10.0]]), (9.0, 5.0), 1.0)
    (2, 1)
    """
    wide, high = max(sheet_mm) + gap_mm, min(sheet_mm) + gap_mm
    length, height = sizes_mm.max(axis=1) + gap_mm, sizes_mm.min(axis=1) + gap_mm
    fits = (length <= wide + 1e-9) & (height <= high + 1e-9)
    order = np.lexsort((-length, -height))
    shelves: list[list[float]] = []  # of each shelf: what is left of its length, and its height
    sheets: list[float] = []  # of each sheet: what is left above its shelves
    for rectangle in order[fits[order]].tolist():
        own = float(length[rectangle])
        shelf = next((one for one in shelves if one[0] >= own - 1e-9), None)
        if shelf is None:
            rise = float(height[rectangle])
            at = next((n for n, left in enumerate(sheets) if left >= rise - 1e-9), None)
            if at is None:
                at = len(sheets)
                sheets.append(high)
            sheets[at] -= rise
            shelf = [wide, rise]
            shelves.append(shelf)
        shelf[0] -= own
    return len(sheets), int(np.count_nonzero(~fits))


@record
class NaiveWay:
    """Rectangles in place of shapes: their area, the sheets they take, and how many fit on none.

    ``utilisation`` is the share of pieces in these sheets, None where some rectangle fits on none.
    """

    area_mm2: float
    sheets: int
    too_large: int
    utilisation: float | None


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
    within their margins, and ``best`` the share of pieces in these. ``rectangles`` has the least
    rectangles of the pieces on shelves, ``strips`` those of whole threads, not cut. ``grain`` has
    what lying across the grain costs, where pieces do.
    """

    gross: float
    net: float
    kept_mm2: float
    bound_mm2: float
    bound_sheets: int
    best: float
    rectangles: NaiveWay
    strips: NaiveWay
    grain: GrainCost | None = optional(default=None)


def compare_use(
    sums: SheetSums,
    planned: PlannedJob,
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
    planned : PlannedJob
    layout : Layout
    allotment : Allotment
    offcuts : sequence of KeptOffcut
    grain : GrainCost, optional
        What it costs that pieces lie across the grain.
    """
    pieces = planned.to_cut
    kept = sum(offcut.area_mm2 for offcut in offcuts)
    outlines = [shapely.Polygon(piece.outline) for piece in pieces]
    unfolded = unfold_threads(planned.woven.ribbons)
    # Threads that cross nothing have no rungs, and are left out.
    filled = np.flatnonzero(np.diff(unfolded.offsets))
    whole = [
        np.concatenate((unfolded.right[own], unfolded.left[own]))
        for own in (
            slice(unfolded.offsets[thread], unfolded.offsets[thread + 1])
            for thread in filled.tolist()
        )
    ]
    of_strip = allotment.threads[filled]
    of_piece = np.array(allotment.of_pieces(pieces), dtype=np.int64)
    bound, bound_sheets, bound_area = 0.0, 0, 0.0
    boxes, strips = (_rectangles(rings) for rings in ([p.outline for p in pieces], whole))
    counts = np.zeros((2, 3))  # of both naive ways: sheets, their area, and what is too large
    for index, supply in enumerate(allotment.supplies.each):
        numbers = np.flatnonzero(allotment.sheets == index).tolist()
        if not numbers:
            continue
        sheet = max((layout.sheets[number] for number in numbers), key=lambda one: one.area_mm2)
        usable, gap = usable_size(sheet, layout.margin_mm), supply.gap_mm
        own = [outlines[piece] for piece in np.flatnonzero(of_piece == index).tolist()]
        room = float(np.sum(shapely.area(shapely.buffer(own, gap / 2))))
        # Half the gap of a piece may reach into the margin.
        needed = math.ceil(room / math.prod(side + gap for side in usable) - 1e-9)
        bound, bound_sheets = bound + room, bound_sheets + needed
        bound_area += needed * sheet.area_mm2
        for way, (sizes, supply_of) in enumerate(((boxes, of_piece), (strips, of_strip))):
            count, left_out = shelf_sheets(sizes[supply_of == index], usable, gap)
            counts[way] += count, count * sheet.area_mm2, left_out
    used, spares = sums.piece_area_mm2, pieces[len(planned.kinds) :]
    return Comparison(
        gross=round(sums.utilisation, 6),
        net=round(used / (sums.area_mm2 - kept), 6),
        kept_mm2=round(kept, 6),
        bound_mm2=round(bound, 3),
        bound_sheets=bound_sheets,
        best=round(used / bound_area, 6),
        rectangles=_naive(boxes, counts[0], used),
        strips=_naive(strips, counts[1], used - sum(p.net_area_mm2 for p in spares)),
        grain=grain,
    )


def _rectangles(rings: Sequence[FloatArray]) -> FloatArray:
    """Return the sides of the least rectangle around each ring, (N, 2)."""
    around = shapely.oriented_envelope([shapely.MultiPoint(ring) for ring in rings])
    corners = np.stack([shapely.get_coordinates(one)[:3] for one in around])
    sides = np.diff(corners, axis=1)
    return np.hypot(sides[..., 0], sides[..., 1])


def _naive(sizes: FloatArray, counts: FloatArray | IntArray, used_mm2: float) -> NaiveWay:
    sheets, area, too_large = counts.tolist()
    return NaiveWay(
        area_mm2=round(float(sizes.prod(axis=1).sum()), 3),
        sheets=int(sheets),
        too_large=int(too_large),
        utilisation=None if too_large else round(used_mm2 / area, 6),
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
