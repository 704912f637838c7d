"""Say which pieces fit on no sheet, or how many sheets are missing, and what would help."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.messages import agree, few_of
from fabweave.nest.container import Container, clear_rectangle
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.next_sheet import next_sheet
from fabweave.nest.place.fill import NestingJob, fill_sheet
from fabweave.stock.sheet_text import format_stock

#: A piece that is too large by its width may be this share as long, to be narrower.
_SHORTER = 0.9


def too_large_message(job: NestingJob, stranded: Sequence[int]) -> str:
    """Say which pieces fit on no sheet, what size would take them, and how long others may be."""
    shapes = [job.shape(piece) for piece in stranded]
    pieces = [
        f"{job.names[piece]} ({shape.length_mm:.1f} × {shape.width_mm:.1f} mm)"
        for piece, shape in zip(stranded, shapes, strict=True)
    ]
    clear = [clear_rectangle(container, job.gap_mm) for container in job.containers]
    wide, high = max(clear, key=lambda size: size[0] * size[1])
    sides = [
        math.ceil(max(values) + 2.0 * job.margin_mm)
        for values in ([s.length_mm for s in shapes], [s.width_mm for s in shapes])
    ]
    shortest = _SHORTER * min(shape.length_mm for shape in shapes)
    length = math.floor(min(max(max(size) for size in clear), shortest))
    remedies = [f"--sheet {sides[0]}x{sides[1]}mm", "a smaller --margin"]
    if length > 0:
        remedies.append(f"shorter pieces with --max-length {length}mm")
    free = any(fits_rectangle(shape, Container(size)) for shape in shapes for size in clear)
    if free and job.containers[0].rotations.step_deg is not None:
        remedies.append("--rotations free")
    return (
        f"{len(stranded)} of {agree(len(job.poses), '{n} piece[|s]')} "
        f"{agree(len(stranded), '[fits|fit]')} on no sheet at any allowed rotation: "
        f"{few_of(pieces)}; the largest free rectangle of the stock is {wide:.1f} × "
        f"{high:.1f} mm, inside the margins and clear of defects. Use {', '.join(remedies[:-1])}, "
        f"or {remedies[-1]}"
    )


def out_of_sheets_message(job: NestingJob, queue: Sequence[int], sheets: Sequence[int]) -> str:
    """Say which pieces are left when the stock is used up, and what would take them.

    What is missing is not guessed: the pieces are placed on as many more sheets as they take.
    """
    # Whoever has no more offcuts buys sheets; only if there are none to buy, offcuts are missing.
    bought = [number for number, sheet in enumerate(job.stock) if not sheet.offcut]
    enough = replace(
        job,
        stock=tuple(
            replace(sheet, quantity=None if number in bought or not bought else 0)
            for number, sheet in enumerate(job.stock)
        ),
    )
    missing: Counter[int] = Counter()
    rest = list(queue)
    while rest:
        number = next_sheet(enough, rest, ())
        if number is None:  # what is left fits on offcuts only
            number = int(np.argmax(job.fits[job.poses[rest[0]].shape]))
        placements = fill_sheet(enough, rest, number, 0)
        rest = [piece for piece in rest if piece not in placements]
        missing[number] += 1
    taken = Counter(sheets)
    for number in missing:
        missing[number] -= (job.stock[number].quantity or 0) - taken[number]
    more = " and ".join(
        f"{count} more of {_sheet_name(job, number)}"
        for number, count in sorted(missing.items())
        if count > 0
    )
    pieces = few_of([job.names[piece] for piece in queue])
    return (
        f"the sheets run out: {len(queue)} of {agree(len(job.poses), '{n} piece[|s]')} "
        f"{agree(len(queue), '[is|are]')} left ({pieces}) "
        f"after {agree(len(sheets), '{n} sheet[|s]')}; {more} would hold them. Add sheets, use "
        "larger ones, or try --effort best"
    )


def _sheet_name(job: NestingJob, number: int) -> str:
    """Return what a sheet of the stock is called, with its size."""
    sheet = job.stock[number]
    size = format_stock(replace(sheet, quantity=None))
    return f"{sheet.name} ({size})" if sheet.name else size
