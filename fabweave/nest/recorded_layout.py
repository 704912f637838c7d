"""Take the layout of a finished job, so that the job can be made again however it was found."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of
from fabweave.flat.crossing_map import PieceRecord, read_crossing_map
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.layout_check import check_layout
from fabweave.stock.rotations import FREE, Rotations
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.sheet_text import format_stock

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
            replace(sheets[number], quantity=1, bunch="") if isinstance(number, int) else number
            for number in used
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
            near = abs(sheet.width_mm - width) + abs(sheet.height_mm - height) < _SAME_MM
            left = sheet.quantity is None or taken[number] < sheet.quantity
            if near and left and sheet.name == name:
                taken[number] += 1
                result.append(number)
                break
        else:
            result.append(SheetSize(width, height, 1, name=name))
    return result


def _stock_faults(used: Sequence[int | SheetSize]) -> list[str]:
    """Return what the stock does not have of the sheets in use."""
    return [
        f"there is no sheet of {format_stock(replace(sheet, quantity=None))} left in stock"
        for sheet in used
        if isinstance(sheet, SheetSize)
    ]
