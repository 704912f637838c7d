"""Lay the pieces of a job out: nested, one material at a time, or as an older job has them."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, IntArray, Progress, no_progress, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of
from fabweave.core.parallel.executors import Executors, here
from fabweave.core.search import Search
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.pins import nest_around, parse_pins
from fabweave.nest.strips import nest_strips
from fabweave.piece.piece import Piece
from fabweave.plan.crossing_map import PieceRecord, read_crossing_map
from fabweave.stock.rotations import FREE, Rotations, parse_rotations
from fabweave.stock.sheet_size import SheetSize, format_stock
from fabweave.stock.supplies import Supplies

#: What is forgiven, millimetres (as an area mm²) and degrees.
_TOLERANCE_MM, _TOLERANCE_DEG = 1e-6, 1e-6


def check_layout(
    layout: Layout, outlines: Sequence[FloatArray], *, ids: Sequence[str] | None = None
) -> list[str]:
    """Return everything that is wrong with a layout; nothing if it may be cut.

    Every piece must be placed exactly once, on a sheet that exists, the margin from its border,
    and the gap from every other piece and from defects there, at an angle that is allowed; a
    micrometre's thousandth is forgiven.

    Parameters
    ----------
    layout : Layout
        What to check.
    outlines : sequence of (K, 2) float arrays
        The pieces in their own coordinates, millimetres.
    ids : sequence of str, optional
        What the pieces are called in messages; else their numbers.

    Returns
    -------
    list of str
        One sentence for each fault.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.layout import Placement
    >>> from fabweave.stock.sheet_size import SheetSize
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> two = (Placement(0, 0, 0.0, 1.0, 1.0), Placement(1, 0, 0.0, 2.5, 1.0))
    >>> check_layout(Layout((SheetSize(9.0, 9.0),), two, 1.0, 2.0), [square, square])
    ['pieces 0 and 1 on sheet 1 are 0.500 mm apart; the gap is 2.000 mm']
    """
    names = [str(number) for number in range(len(outlines))] if ids is None else list(ids)
    times = Counter(placement.piece for placement in layout.placements)
    faults = [
        f"piece {name} is placed {times[piece]} times, not once"
        for piece, name in enumerate(names)
        if times[piece] != 1
    ]
    by_sheet: dict[int, list[tuple[str, shapely.Polygon]]] = {}
    for placement in layout.placements:
        name, sheet = names[placement.piece], layout.sheets[placement.sheet]
        polygon = shapely.Polygon(placement.apply(outlines[placement.piece]))
        by_sheet.setdefault(placement.sheet, []).append((name, polygon))
        off = float(
            layout.rotations.along(sheet.grain_deg).off_deg(np.array([placement.rotation_deg]))[0]
        )
        if off > _TOLERANCE_DEG:
            faults.append(
                f"piece {name} on sheet {placement.sheet + 1} is turned {off:.3f}° further than is "
                "allowed"
            )
    for number, placed in sorted(by_sheet.items()):
        faults.extend(_sheet_faults(number, placed, layout.sheets[number], layout))
        faults.extend(_gap_faults(number, placed, layout.gap_mm))
    return faults


def _sheet_faults(
    number: int, placed: list[tuple[str, shapely.Polygon]], sheet: SheetSize, layout: Layout
) -> list[str]:
    """Return the pieces that come near the border of their sheet, or near a defect."""
    polygons = np.array([polygon for _, polygon in placed])
    border = shapely.Polygon(sheet.ring)
    # What fills the sheet may be off by a rounding.
    around = shapely.buffer(border, _TOLERANCE_MM, join_style="mitre")
    held, room = shapely.contains(around, polygons), shapely.distance(polygons, border.exterior)
    faults = [
        f"piece {placed[at][0]} {f'is {room[at]:.3f} mm from' if held[at] else 'reaches over'} the "
        f"border of sheet {number + 1}; the margin is {layout.margin_mm:.3f} mm"
        for at in np.flatnonzero(~(held & (room >= layout.margin_mm - _TOLERANCE_MM))).tolist()
    ]
    for ring in sheet.defects:
        apart = shapely.distance(polygons, shapely.Polygon(ring))
        faults += [
            f"piece {placed[at][0]} is {apart[at]:.3f} mm from a defect of sheet {number + 1}; the "
            f"gap is {layout.gap_mm:.3f} mm"
            for at in np.flatnonzero(
                (apart < layout.gap_mm - _TOLERANCE_MM) | (apart <= 0.0)
            ).tolist()
        ]
    return faults


def _gap_faults(number: int, placed: list[tuple[str, shapely.Polygon]], gap_mm: float) -> list[str]:
    """Return the pairs on one sheet that overlap or are nearer than the gap."""
    polygons = np.array([polygon for _, polygon in placed])
    tree = shapely.STRtree(polygons)
    near = tree.query(polygons, predicate="dwithin", distance=max(gap_mm, _TOLERANCE_MM))
    first, second = near[:, near[0] < near[1]]
    order = np.lexsort((second, first))
    first, second = first[order], second[order]
    distance = shapely.distance(polygons[first], polygons[second])
    # Outlines that only touch are 0 apart as well: what they share has no area.
    shared = shapely.area(shapely.intersection(polygons[first], polygons[second]))
    faults = []
    for a, b, apart, area in zip(first, second, distance, shared, strict=True):
        pair = f"pieces {placed[a][0]} and {placed[b][0]} on sheet {number + 1}"
        if area > _TOLERANCE_MM:
            faults.append(f"{pair} overlap by {area:.3f} mm²")
        elif apart < gap_mm - _TOLERANCE_MM:
            faults.append(f"{pair} are {apart:.3f} mm apart; the gap is {gap_mm:.3f} mm")
    return faults


#: Outlines in a crossing map are rounded to a millionth of a millimetre.
_ROUNDED_MM = 2e-6
#: Sheets whose sides differ by less, together, have one size.
_SAME_MM = 1e-6
#: How many faults of a layout a message names.
_NAMED = 4


def read_layout(
    path: Path,
    outlines: Sequence[FloatArray],
    ids: Sequence[str],
    sheets: Sequence[SheetSize],
    *,
    margin_mm: float,
    gap_mm: float,
    rotations: Rotations = FREE,
) -> Layout:
    """Return the layout that a crossing map records, checked from scratch.

    Parameters
    ----------
    path : Path
        A finished job's ``crossing_map.json``.
    outlines : sequence of (K, 2) float arrays
        The pieces to be placed; the map must hold the same ones.
    ids : sequence of str
        What they are called.
    sheets : sequence of SheetSize
        The stock.
    margin_mm, gap_mm : float
        What the layout must keep.
    rotations : Rotations
        The angles that it must keep.

    Returns
    -------
    Layout
        Its placements, to the last bit.

    Raises
    ------
    InputError
        If the file is not a crossing map, holds other pieces or sheets, or breaks a rule.
    """
    crossing_map = read_crossing_map(path)
    records = {piece.id: piece for piece in crossing_map.to_cut}
    recorded_outlines = {name: np.array(piece.outline) for name, piece in records.items()}
    differing = [
        name
        for name, outline in zip(ids, outlines, strict=True)
        if name not in recorded_outlines
        or recorded_outlines[name].shape != outline.shape
        or np.abs(recorded_outlines[name] - outline).max() > _ROUNDED_MM
    ] + sorted(set(recorded_outlines) - set(ids))
    if differing:
        raise InputError(
            f"the layout in {path} is for other pieces: {agree(len(differing), '{n} differ[s|]')} "
            f"({few_of(differing)}); leave out --layout, or "
            "use the settings of that job"
        )
    used = _sheets_of_stock(
        [(sheet.width_mm, sheet.height_mm, sheet.stock) for sheet in crossing_map.sheets], sheets
    )
    layout = Layout(
        sheets=tuple(
            replace(_used(sheets[number], record.width_mm), quantity=1, bunch="")
            if isinstance(number, int)
            else number
            for number, record in zip(used, crossing_map.sheets, strict=True)
        ),
        placements=tuple(_placement(number, records[name]) for number, name in enumerate(ids)),
        margin_mm=margin_mm,
        gap_mm=gap_mm,
        notes=crossing_map.layout.notes,
        recorded=True,
        rotations=rotations,
    )
    require_kept(path, layout, outlines, ids, sheets)
    return layout


def require_kept(
    path: Path,
    layout: Layout,
    outlines: Sequence[FloatArray],
    ids: Sequence[str],
    sheets: Sequence[SheetSize],
) -> None:
    """Raise InputError if a layout that was read breaks a rule, or takes what is not in stock."""
    used = _sheets_of_stock(
        [(sheet.width_mm, sheet.height_mm, sheet.name) for sheet in layout.sheets], sheets
    )
    faults = _stock_faults(used) + check_layout(layout, outlines, ids=ids)
    if faults:
        raise InputError(
            f"the layout in {path} cannot be used, for {agree(len(faults), '{n} reason[|s]')}: "
            + "; ".join(faults[:_NAMED])
        )


def _placement(number: int, piece: PieceRecord) -> Placement:
    """Return the placement that a piece's record holds."""
    motion = piece.placement
    return Placement(number, piece.sheet - 1, motion.rotation_deg, motion.x_mm, motion.y_mm)


def _sheets_of_stock(
    used: Sequence[tuple[float, float, str]], stock: Sequence[SheetSize]
) -> list[int | SheetSize]:
    """Return which sheets of the stock are used, given width, height and name of each.

    For one that is not in stock, or no longer, its size.
    """
    taken: Counter[int] = Counter()
    result: list[int | SheetSize] = []
    for width, height, name in used:
        for number, sheet in enumerate(stock):
            short = sheet.width_mm - width
            near = (sheet.is_roll and short > 0.0) or abs(short) < _SAME_MM
            near = near and abs(sheet.height_mm - height) < _SAME_MM
            left = sheet.quantity is None or taken[number] < sheet.quantity
            if near and left and sheet.name == name:
                taken[number] += 1
                result.append(number)
                break
        else:
            result.append(SheetSize(width, height, 1, name=name))
    return result


def _used(sheet: SheetSize, length_mm: float) -> SheetSize:
    """Return so much of a roll; a sheet as it is."""
    return replace(sheet, width_mm=length_mm) if sheet.is_roll else sheet


def _stock_faults(used: Sequence[int | SheetSize]) -> list[str]:
    """Return what the stock does not have of the sheets in use."""
    return [
        f"there is no sheet of {format_stock(replace(sheet, quantity=None))} left in stock"
        for sheet in used
        if isinstance(sheet, SheetSize)
    ]


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
        If a layout that is given cannot be taken, or a piece cannot stay where it is pinned.
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
    pins = parse_pins(search.pin) if search.pin else ()
    if strange := [pin.id for pin in pins if pin.id not in ids]:
        raise InputError(f"there is no piece {few_of(strange)} to be pinned; leave it out of --pin")
    parts: list[Layout] = []
    for supply, group in zip(supplies.each, groups, strict=True):
        own, stock = [outlines[piece] for piece in group], supplies.as_nested(supply.sheets)
        names = [ids[piece] for piece in group]
        strips = None
        if not pins:
            strips = nest_strips(
                own, stock, margin_mm=supplies.margin_mm, gap_mm=supply.gap_mm, ids=names,
                rotations=rotations,
            )  # fmt: skip
        parts.append(strips or nest_around(
            pins, own, stock, margin_mm=supplies.margin_mm, gap_mm=supply.gap_mm,
            effort=search.effort, seed=search.seed, ids=names, rotations=rotations,
            before=sum(len(part.sheets) for part in parts), executors=executors, progress=progress,
        ))  # fmt: skip
    for part, group in zip(parts, groups, strict=True) if pins else ():
        own = [outlines[piece] for piece in group]
        if faults := check_layout(part, own, ids=[ids[piece] for piece in group]):
            raise InputError(
                f"pieces cannot stay where they are pinned: {'; '.join(faults[:_NAMED])}"
            )
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
