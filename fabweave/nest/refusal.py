"""Say which pieces fit on no sheet, or how many sheets are missing, and what would help."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.messages import agree, few_of
from fabweave.nest.area import Area, clear_rectangle
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.next_sheet import next_sheet
from fabweave.nest.place.fill import NestingJob, filled_sheet
from fabweave.stock.sheet_text import format_stock

_SHORTER = 0.9  # a piece that is too large by its width may be this share as long


def too_large(job: NestingJob, stranded: Sequence[int]) -> str:
    """Say which pieces fit on no sheet, what size would take them, and how long others may be."""
    shapes = [job.shapes[job.poses[piece].shape] for piece in stranded]
    said = [
        f"{job.names[piece]} ({shape.length_mm:.1f} × {shape.width_mm:.1f} mm)"
        for piece, shape in zip(stranded, shapes, strict=True)
    ]
    clear = [clear_rectangle(area, job.gap_mm) for area in job.areas]
    wide, high = max(clear, key=lambda size: size[0] * size[1])
    sides = [
        math.ceil(max(values) + 2.0 * job.margin_mm)
        for values in ([s.length_mm for s in shapes], [s.width_mm for s in shapes])
    ]
    shortest = _SHORTER * min(shape.length_mm for shape in shapes)
    length = math.floor(min(max(max(size) for size in clear), shortest))
    helps = [f"--sheet {sides[0]}x{sides[1]}mm", "a smaller --margin"]
    if length > 0:
        helps.append(f"shorter pieces with --max-length {length}mm")
    free = any(fits_rectangle(shape, Area(size)) for shape in shapes for size in clear)
    if free and job.areas[0].turns.step_deg is not None:
        helps.append("--rotations free")
    return (
        f"{len(stranded)} of {agree(len(job.poses), '{n} piece[|s]')} "
        f"{agree(len(stranded), '[fits|fit]')} on no sheet at any rotation that is allowed: "
        f"{few_of(said)}; the largest free rectangle of the stock is {wide:.1f} × "
        f"{high:.1f} mm within margins and off defects. Take {', '.join(helps[:-1])}, or "
        f"{helps[-1]}"
    )


def run_out(job: NestingJob, queue: Sequence[int], used: Sequence[int]) -> str:
    """Say which pieces are left when the stock is used up, and what would take them.

    What is missing is not guessed: the pieces are placed on as many more sheets as they take.
    """
    # Whoever has no more offcuts buys sheets; only if there are none to buy, offcuts are missing.
    bought = [number for number, sheet in enumerate(job.sheets) if not sheet.offcut]
    enough = replace(
        job,
        sheets=tuple(
            replace(sheet, quantity=None if number in bought or not bought else 0)
            for number, sheet in enumerate(job.sheets)
        ),
    )
    missing: Counter[int] = Counter()
    rest = list(queue)
    while rest:
        choice = next_sheet(enough, rest, ())
        if choice is None:  # what is left fits on offcuts only
            choice = int(np.argmax(job.fits[job.poses[rest[0]].shape]))
        placed = filled_sheet(enough, rest, choice, 0)
        rest = [piece for piece in rest if piece not in placed]
        missing[choice] += 1
    taken = Counter(used)
    for number in missing:
        missing[number] -= (job.sheets[number].quantity or 0) - taken[number]
    wanted = " and ".join(
        f"{count} more of {_called(job, number)}"
        for number, count in sorted(missing.items())
        if count > 0
    )
    said = few_of([job.names[piece] for piece in queue])
    return (
        f"the sheets run out: {len(queue)} of {agree(len(job.poses), '{n} piece[|s]')} "
        f"{agree(len(queue), '[is|are]')} left ({said}) "
        f"after {agree(len(used), '{n} sheet[|s]')}; {wanted} would take them. Add sheets, take "
        "larger ones, or try --effort best"
    )


def _called(job: NestingJob, number: int) -> str:
    """Return what a sheet of the stock is called, with its size."""
    sheet = job.sheets[number]
    size = format_stock(replace(sheet, quantity=None))
    return f"{sheet.name} ({size})" if sheet.name else size
