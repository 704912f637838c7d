"""Take the layout of a finished job, so that the job can be made again whatever found it."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of
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
        If the file is no crossing map, holds other pieces or sheets, or breaks a rule.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        records = {str(record["id"]): record for record in document["pieces"]}
        recorded = _stock_numbers(document["sheets"], sheets)
        layout = Layout(
            sheets=tuple(
                replace(sheets[sheet], quantity=1, bunch="") if isinstance(sheet, int) else sheet
                for sheet in recorded
            ),
            placements=tuple(
                _placement(number, records[name])
                for number, name in enumerate(ids)
                if name in records
            ),
            margin_mm=margin_mm,
            gap_mm=gap_mm,
            notes=tuple(str(note) for note in document["layout"].get("notes", ())),
            recorded=True,
            rotations=rotations,
        )
        recorded_outlines = {
            name: np.array(record["outline"], dtype=float) for name, record in records.items()
        }
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the layout in {path}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path} is no crossing map with a layout ({type(error).__name__}: {error}); name the "
            "crossing_map.json of a finished job"
        ) from error
    differing = [
        name
        for name, outline in zip(ids, outlines, strict=True)
        if name not in recorded_outlines
        or recorded_outlines[name].shape != outline.shape
        or np.abs(recorded_outlines[name] - outline).max() > _ROUNDED_MM
    ] + sorted(set(recorded_outlines) - set(ids))
    if differing:
        raise InputError(
            f"the layout in {path} is of other pieces: {agree(len(differing), '{n} differ[s|]')} "
            f"({few_of(differing)}); leave out --layout, or "
            "give the settings of that job"
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
    used = _stock_numbers(
        [
            {"width_mm": sheet.width_mm, "height_mm": sheet.height_mm, "stock": sheet.name}
            for sheet in layout.sheets
        ],
        sheets,
    )
    faults = _stock_faults(used) + check_layout(layout, outlines, ids=ids)
    if faults:
        raise InputError(
            f"the layout in {path} cannot be taken, for {agree(len(faults), '{n} reason[|s]')}: "
            + "; ".join(faults[:_NAMED])
        )


def _placement(number: int, record: Any) -> Placement:
    """Return the placement in a piece's record."""
    motion = record["placement"]
    return Placement(
        number,
        int(record["sheet"]) - 1,
        float(motion["rotation_deg"]),
        float(motion["x_mm"]),
        float(motion["y_mm"]),
    )


def _stock_numbers(records: Any, stock: Sequence[SheetSize]) -> list[int | SheetSize]:
    """Return the stock's number of each sheet of records; the size of one that is not there."""
    taken: Counter[int] = Counter()
    numbers: list[int | SheetSize] = []
    for record in records:
        width, height = float(record["width_mm"]), float(record["height_mm"])
        name = str(record.get("stock", ""))
        for number, sheet in enumerate(stock):
            same = abs(sheet.width_mm - width) + abs(sheet.height_mm - height) < _SAME_MM
            left = sheet.quantity is None or taken[number] < sheet.quantity
            if same and left and sheet.name == name:
                taken[number] += 1
                numbers.append(number)
                break
        else:
            numbers.append(SheetSize(width, height, 1, name=name))
    return numbers


def _stock_faults(used: Sequence[int | SheetSize]) -> list[str]:
    """Return what the stock does not have of the sheets in use."""
    return [
        f"a sheet of {format_stock(replace(sheet, quantity=None))} is not (or no more) in stock"
        for sheet in used
        if isinstance(sheet, SheetSize)
    ]
