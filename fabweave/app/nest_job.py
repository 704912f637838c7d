"""Lay the pieces of a job out, one nesting for each material, or foretell its sheets roughly."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fabweave.app.settings import Settings
from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    no_progress,
    offsets_of,
)
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.parallel.executors import Executors, here
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.rim_sheets import draw_rim_sheets
from fabweave.flat.piece import Piece
from fabweave.flat.rim_ring import RimRing
from fabweave.flat.split.preferences import SHEET_EUR_M2, SheetsNeeded, sum_sheets
from fabweave.nest.effort import ROUGH
from fabweave.nest.fits import fits_stock
from fabweave.nest.layout import Layout
from fabweave.nest.nesting import nest
from fabweave.nest.recorded_layout import read_layout, require_kept
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


#: Arcs of rings are nested as chords that are off by this at most, millimetres.
FLAT_MM = 0.01


def nest_pieces(
    pieces: Sequence[Piece],
    settings: Settings,
    supplies: Supplies,
    bunches: IntArray,
    executors: Executors = here,
    progress: Progress = no_progress,
) -> Layout:
    """Nest the pieces of each supply on its own sheets, or take the layout of a finished job.

    Parameters
    ----------
    pieces : sequence of Piece
    settings : Settings
    supplies : Supplies
    bunches : (T,) int array
        The bunch of each thread.
    executors : callable
        What nests batches of very many pieces; the same bytes with any.
    progress : callable

    Returns
    -------
    Layout
        The sheets of the first supply come first. Its gap is the least of all supplies' gaps.

    Raises
    ------
    InputError
        If a layout that is given cannot be taken.
    CannotMakeError
        If a piece fits no sheet of its material, or the sheets of one run out.
    """
    outlines, ids = [piece.outline for piece in pieces], [piece.id for piece in pieces]
    supply_of_piece = supplies.of(bunches)[[piece.thread for piece in pieces]]
    groups = [
        np.flatnonzero(supply_of_piece == index).tolist() for index in range(len(supplies.each))
    ]
    rotations = parse_rotations(settings.rotations)
    if settings.layout is not None:
        path, gap = Path(settings.layout), min(supply.gap_mm for supply in supplies.each)
        recorded = read_layout(
            path,
            outlines,
            ids,
            settings.as_nested(supplies.sheets),
            margin_mm=settings.margin_mm,
            gap_mm=gap,
            rotations=rotations,
        )
        for supply, group in zip(supplies.each, groups, strict=True):
            # The rules of each material, too: its own gap, on its own sheets.
            part = replace(part_of(recorded, group), gap_mm=supply.gap_mm)
            few = [outlines[piece] for piece in group], [ids[piece] for piece in group]
            require_kept(path, part, *few, settings.as_nested(supply.sheets))
        return recorded
    parts = [
        nest(
            [outlines[piece] for piece in group],
            settings.as_nested(supply.sheets),
            margin_mm=settings.margin_mm,
            gap_mm=supply.gap_mm,
            effort=settings.effort,
            seed=settings.seed,
            ids=[ids[piece] for piece in group],
            rotations=rotations,
            executors=executors,
            progress=progress,
        )
        for supply, group in zip(supplies.each, groups, strict=True)
    ]
    if len(parts) == 1:
        return parts[0]
    named = [
        replace(part, notes=tuple(f"{supply.material.caption}: {note}" for note in part.notes))
        for part, supply in zip(parts, supplies.each, strict=True)
    ]
    return joined(named, groups)


def rings_fit(ring: RimRing, settings: Settings, supplies: Supplies) -> bool:
    """Return whether each piece of a ring fits on a sheet of the first material, alone."""
    supply = supplies.each[0]
    return bool(
        fits_stock(
            [piece.path.flattened(FLAT_MM) for piece in ring.pieces],
            settings.as_nested(supply.sheets),
            margin_mm=settings.margin_mm,
            gap_mm=supply.gap_mm,
            effort=settings.effort,
            rotations=parse_rotations(settings.rotations),
        ).all()
    )


def ring_sheets(
    rings: Sequence[RimRing], settings: Settings, supplies: Supplies, title: str
) -> tuple[Layout | None, tuple[SheetDrawing, ...]]:
    """Nest the pieces of rings on sheets of their own, of the first material, and draw these.

    Without rings there is no layout.

    Raises
    ------
    CannotMakeError
        If a piece fits no sheet, or sheets run out.
    """
    pieces = [piece for ring in rings for piece in ring.pieces]
    if not pieces:
        return None, ()
    supply = supplies.each[0]
    layout = nest(
        [piece.path.flattened(FLAT_MM) for piece in pieces],
        supply.sheets,
        margin_mm=settings.margin_mm,
        gap_mm=supply.gap_mm,
        effort="quick",
        ids=[piece.id for piece in pieces],
        rotations=parse_rotations(settings.rotations),
    )
    return layout, draw_rim_sheets(rings, layout, title)


def outlines_with_place(
    outlines: Sequence[FloatArray],
    threads: IntArray,
    settings: Settings,
    supplies: Supplies,
    bunches: IntArray,
) -> BoolArray:
    """Return which pieces fit on a sheet of their own supply, each alone, (N,).

    Parameters
    ----------
    outlines : sequence of (K, 2) float arrays
        The pieces as they are cut.
    threads : (N,) int array
        The thread of each.
    settings, supplies, bunches
        As for :func:`nest_pieces`.
    """
    placed = np.zeros(len(outlines), dtype=np.bool_)
    supply_of_piece = supplies.of(bunches)[threads]
    for index, supply in enumerate(supplies.each):
        group = np.flatnonzero(supply_of_piece == index)
        placed[group] = fits_stock(
            [outlines[piece] for piece in group.tolist()],
            settings.as_nested(supply.sheets),
            margin_mm=settings.margin_mm,
            gap_mm=supply.gap_mm,
            effort=settings.effort,
            rotations=parse_rotations(settings.rotations),
        )
    return placed


def part_of(layout: Layout, group: Sequence[int]) -> Layout:
    """Return the part of a layout that holds some pieces, sheets and pieces numbered anew.

    Every sheet that holds one of them belongs to the part.
    """
    placements = [layout.placements[piece] for piece in group]
    sheets = sorted({placement.sheet for placement in placements})
    number = {sheet: at for at, sheet in enumerate(sheets)}
    return replace(
        layout,
        sheets=tuple(layout.sheets[sheet] for sheet in sheets),
        placements=tuple(
            replace(placement, piece=at, sheet=number[placement.sheet])
            for at, placement in enumerate(placements)
        ),
    )


def joined(parts: Sequence[Layout], groups: Sequence[Sequence[int]]) -> Layout:
    """Return the layouts of several groups of pieces as one, their sheets numbered through.

    Examples
    --------
    >>> from fabweave.nest.layout import Placement
    >>> from fabweave.stock.sheet_size import SheetSize
    >>> parts = [Layout((SheetSize(9.0, 9.0),), (Placement(0, 0, 0.0, 1.0, 1.0),), 1.0, gap)
    ...     for gap in (2.0, 3.0)]
    >>> both = joined(parts, [[1], [0]])
    >>> [(place.piece, place.sheet) for place in both.placements], both.gap_mm
    ([(0, 1), (1, 0)], 2.0)
    """
    first = offsets_of(np.array([len(part.sheets) for part in parts])).tolist()
    placements = {
        group[placement.piece]: replace(
            placement, piece=group[placement.piece], sheet=start + placement.sheet
        )
        for part, group, start in zip(parts, groups, first, strict=False)
        for placement in part.placements
    }
    return replace(
        parts[0],
        sheets=tuple(sheet for part in parts for sheet in part.sheets),
        placements=tuple(placements[piece] for piece in sorted(placements)),
        gap_mm=min(part.gap_mm for part in parts),
        notes=tuple(note for part in parts for note in part.notes),
        recorded=any(part.recorded for part in parts),
    )
