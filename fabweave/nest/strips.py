"""Lay straight strips side by side in rows: what shears and paper cutters can follow, too."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.place.greedy import order_of_use
from fabweave.stock.rotations import FREE, Rotations
from fabweave.stock.sheet_size import SheetSize, usable_size

#: Corners of strips are where they are to this.
_SAME_MM = 1e-6
#: Lengths are added up in steps of this, rounded up.
_STEP_MM = 0.05
_CORNERS = 4


def fill_rows(lengths: Sequence[float], row_mm: float, gap_mm: float = 0.0) -> list[list[int]]:
    """Deal lengths to rows, as few as may be: one-dimensional cutting stock.

    Each row takes the longest length that is left, and with it those that fill it best (minimum
    bin slack: Gupta and Ho, "A new heuristic algorithm for the one-dimensional bin-packing
    problem", Production Planning & Control 10, 1999). No dealing has fewer rows than all lengths,
    each with its gap, take in one.

    Parameters
    ----------
    lengths : sequence of float
        None longer than a row.
    row_mm : float
    gap_mm : float
        Between two in a row.

    Returns
    -------
    list of list of int
        Numbers of lengths in each row, the longest first.

    Examples
    --------
    >>> fill_rows([6.0, 5.0, 5.0, 4.0], 10.0)
    [[0, 3], [1, 2]]
    """
    steps = np.ceil((np.array(lengths) + gap_mm) / _STEP_MM - _SAME_MM).astype(np.int64)
    room = int((row_mm + gap_mm) / _STEP_MM + _SAME_MM)
    sizes = steps.tolist()
    left = sorted(range(len(sizes)), key=lambda at: (-lengths[at], at))
    rows = []
    while left:
        first = left.pop(0)
        free = max(min(room - sizes[first], sum(sizes[at] for at in left)), 0)
        # Bit by bit, which sums can be reached with the lengths up to each.
        reached, within = [1], (2 << free) - 1
        for at in left:
            if reached[-1] >> free:
                break
            reached.append((reached[-1] | reached[-1] << sizes[at]) & within)
        total, row = reached[-1].bit_length() - 1, [first]
        for place in range(len(reached) - 1, 0, -1):
            if not reached[place - 1] >> total & 1:
                row.insert(1, left.pop(place - 1))
                total -= sizes[row[1]]
        rows.append(row)
    return rows


def row_rests(lengths: Sequence[float], row_mm: float, gap_mm: float = 0.0) -> float:
    """Return what strips waste of rows: of each row its rest, times the share that is full.

    The rest of a row that is nearly empty is as good as new.

    Examples
    --------
    >>> row_rests([6.0, 5.0, 4.0], 10.0)
    2.5
    """
    rows = fill_rows(lengths, row_mm, gap_mm)
    full = np.array([sum(lengths[at] for at in row) for row in rows]) / row_mm
    return float(row_mm * (full * (1.0 - full)).sum())


def nest_strips(
    outlines: Sequence[FloatArray],
    sheets: Sequence[SheetSize],
    *,
    margin_mm: float,
    gap_mm: float,
    ids: Sequence[str] = (),
    rotations: Rotations = FREE,
) -> Layout | None:
    """Lay rectangles of one width in rows; None for others, or on sheets that are no rectangles.

    Parameters are those of :func:`fabweave.nest.nesting.nest`.

    Raises
    ------
    CannotMakeError
        If the sheets run out, or a strip is longer than all of them.
    """
    frames = [_frame(outline) for outline in outlines]
    plain = all(not sheet.outline and not sheet.defects for sheet in sheets)
    if not plain or not all(frames) or not frames:
        return None
    shapes = np.array(frames)
    wide = float(shapes[:, 1].max())
    # Angles count from a piece's own x axis, along which strips lie.
    askew = np.abs((shapes[:, 2] + 90.0) % 180.0 - 90.0)
    if np.ptp(shapes[:, 1]) > _SAME_MM or (rotations.step_deg and askew.max() > _SAME_MM):
        return None
    left = list(range(len(outlines)))
    used: list[SheetSize] = []
    placements: dict[int, Placement] = {}
    for sheet in (sheets[at] for at in order_of_use(sheets)):
        turn, count, rows = _dealt(sheet, left, shapes, margin_mm, gap_mm, rotations)
        rows = rows if sheet.quantity is None else rows[: sheet.quantity * count]
        for start in range(0, len(rows), count):
            for number, row in enumerate(rows[start : start + count]):
                along = margin_mm
                for at in row:
                    corner = along, margin_mm + number * (wide + gap_mm)
                    if turn:
                        corner = corner[::-1]
                    placements[at] = _placed(
                        at, len(used), outlines[at], turn - shapes[at, 2], corner
                    )
                    along += shapes[at, 0] + gap_mm
            used.append(replace(sheet, quantity=1))
            if sheet.is_roll:
                used[-1] = replace(used[-1], width_mm=min(_rounded_up(along), sheet.width_mm))
        left = [at for at in left if at not in placements]
    if left:
        ids = ids or [str(at) for at in range(len(outlines))]
        raise CannotMakeError(
            f"{agree(len(left), '{n} strip[ has|s have]')} no room on the sheets that there are: "
            f"{few_of([ids[at] for at in left])}; a larger or another --sheet, or a smaller "
            "--max-length, would help"
        )
    notes: tuple[str, ...] = ()
    if any(sheet.is_roll for sheet in used):
        longest = max(sheet.width_mm for sheet in sheets)
        notes = (_roll_note(used, float(shapes[:, 0].sum()), longest),)
    return Layout(
        sheets=tuple(used),
        placements=tuple(placements[at] for at in range(len(outlines))),
        margin_mm=margin_mm,
        gap_mm=gap_mm,
        rotations=rotations,
        notes=notes,
    )


def _rounded_up(length_mm: float) -> float:
    """Return a length in hundredths of a millimetre."""
    return math.ceil(100.0 * length_mm - _SAME_MM) / 100.0


def _roll_note(rolls: Sequence[SheetSize], length_mm: float, longest_mm: float) -> Note:
    """Say how much of each roll is used and left, and how few of the longest could do."""
    told = [(roll.width_mm / 1000.0, (roll.roll_mm or 0.0) / 1000.0) for roll in rolls]
    least = math.ceil(length_mm / longest_mm - _SAME_MM)
    each = "; ".join(
        f"roll {number}: {used:.2f} m of {whole:g} m used, {whole - used:.2f} m left"
        for number, (used, whole) in enumerate(told, start=1)
    )
    return Note(
        "rolls",
        f"rolls: {length_mm / 1000.0:.2f} m of strips on {agree(len(rolls), '{n} roll[|s]')}; no "
        f"fewer than {least} could do",
        each,
    )


def _frame(outline: FloatArray) -> tuple[float, float, float] | None:
    """Return length, width and direction in degrees of a rectangle; None for what is none."""
    if len(outline) < _CORNERS:
        return None
    side = np.roll(outline, -1, axis=0) - outline
    size = np.hypot(*side.T)
    way = side[int(size.argmax())] / size.max()
    # Forwards, so that letters stand upright.
    way = -way if way[0] < 0.0 else way
    along, across = outline @ way, outline @ np.array([-way[1], way[0]])
    ends = [np.minimum(np.abs(one - one.min()), np.abs(one - one.max())) for one in (along, across)]
    # Each corner lies on two sides of the box around it, and what is between on one.
    corner, border = np.maximum(*ends) <= _SAME_MM, np.minimum(*ends) <= _SAME_MM
    if np.count_nonzero(corner) != _CORNERS or not border.all():
        return None
    direction = float(np.degrees(np.arctan2(way[1], way[0])))
    return float(np.ptp(along)), float(np.ptp(across)), direction


def _dealt(
    sheet: SheetSize,
    left: Sequence[int],
    shapes: FloatArray,
    margin_mm: float,
    gap_mm: float,
    rotations: Rotations,
) -> tuple[float, int, list[list[int]]]:
    """Return in which direction rows run on a sheet, how many it takes, and strips dealt to rows.

    Rows run where they hold as many strips as may be, on few sheets, and on little of the last one;
    those of a roll along it. There are none if no strip has room.
    """
    size, wide = usable_size(sheet, margin_mm), float(shapes[:, 1].max())
    turns = rotations.along(sheet.grain_deg)
    found = []
    for turn, (row_mm, high) in ((0.0, size), (90.0, size[::-1])):
        count = int((high + gap_mm) / (wide + gap_mm) + _SAME_MM)
        allowed = float(turns.off_deg(np.array([turn]))[0]) == 0.0
        if not (count and allowed) or (sheet.is_roll and turn):
            continue
        fitting = [at for at in left if shapes[at, 0] <= row_mm + _SAME_MM]
        rows = fill_rows(shapes[fitting, 0].tolist(), row_mm, gap_mm)
        worth = -len(fitting), math.ceil(len(rows) / count), len(rows) * row_mm
        found.append((worth, turn, count, [[fitting[at] for at in row] for row in rows]))
    return min(found)[1:] if found else (0.0, 1, [])


def _placed(
    piece: int, sheet: int, outline: FloatArray, turn_deg: float, corner: tuple[float, float]
) -> Placement:
    """Return where a strip lies whose row begins at a corner, along and across rows."""
    turned = Placement(piece, sheet, turn_deg % 360.0, 0.0, 0.0)
    low = turned.apply(outline).min(axis=0)
    return replace(turned, x_mm=float(corner[0] - low[0]), y_mm=float(corner[1] - low[1]))
