"""Lay the pieces of a job out, one nesting for each material."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fabweave.core.arrays import (
    IntArray,
    Progress,
    no_progress,
    offsets_of,
)
from fabweave.core.parallel.executors import Executors, here
from fabweave.core.search import Search
from fabweave.nest.layout import Layout
from fabweave.nest.nesting import nest
from fabweave.piece.piece import Piece
from fabweave.plan.recorded_layout import read_layout, require_kept
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.supplies import Supplies


def nest_pieces(
    pieces: Sequence[Piece],
    supplies: Supplies,
    bunches: IntArray,
    search: Search,
    executors: Executors = here,
    progress: Progress = no_progress,
) -> Layout:
    """Nest the pieces of each supply on its own sheets, or take the layout of a finished job.

    Parameters
    ----------
    pieces : sequence of Piece
    supplies : Supplies
    bunches : (T,) int array
        The bunch of each thread.
    search : Search
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
    rotations = parse_rotations(supplies.rotations)
    if search.layout is not None:
        path, gap = Path(search.layout), min(supply.gap_mm for supply in supplies.each)
        recorded = read_layout(
            path,
            outlines,
            ids,
            supplies.as_nested(supplies.sheets),
            margin_mm=supplies.margin_mm,
            gap_mm=gap,
            rotations=rotations,
        )
        for supply, group in zip(supplies.each, groups, strict=True):
            # The rules of each material, too: its own gap, on its own sheets.
            part = replace(part_of(recorded, group), gap_mm=supply.gap_mm)
            few = [outlines[piece] for piece in group], [ids[piece] for piece in group]
            require_kept(path, part, *few, supplies.as_nested(supply.sheets))
        return recorded
    parts = [
        nest(
            [outlines[piece] for piece in group],
            supplies.as_nested(supply.sheets),
            margin_mm=supplies.margin_mm,
            gap_mm=supply.gap_mm,
            effort=search.effort,
            seed=search.seed,
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
