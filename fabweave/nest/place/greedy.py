"""Place pieces greedily: sheets are filled one after another, largest pieces first."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree, few_of
from fabweave.nest.container import Container, clear_rectangle
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.place.fill import NestingJob, Plan, fill_sheet
from fabweave.stock.sheet_size import SheetSize, format_stock


def order_of_use(stock: Sequence[SheetSize]) -> list[int]:
    """Return the numbers of the stock in the order in which sheets are taken.

    Offcuts come first, the smallest first: they are paid for. Then the sheets that cost least for
    their area; then, as they stand, those without a price.

    Examples
    --------
    >>> stock = [SheetSize(9, 9), SheetSize(8, 8, price=4.0), SheetSize(2, 2, price=0.1)]
    >>> order_of_use([*stock, SheetSize(1, 3, 1, offcut=True)])
    [3, 2, 1, 0]
    """

    def key(number: int) -> tuple[int, float]:
        sheet = stock[number]
        if sheet.offcut:
            return 0, sheet.area_mm2
        return (2, 0.0) if sheet.price is None else (1, sheet.price / sheet.area_mm2)

    return sorted(range(len(stock)), key=key)


def next_sheet(job: NestingJob, queue: Sequence[int], sheets: Sequence[int]) -> int | None:
    """Return the sheet of the stock to fill next; None if none is left for the queue's first piece.

    ``sheets`` are in use already, by their number in the stock. An offcut is taken if any piece of
    the queue fits it, another sheet if the first one does.
    """
    shapes = np.unique([job.poses[piece].shape for piece in queue])
    first, taken = job.poses[queue[0]].shape, Counter(sheets)
    for number in order_of_use(job.stock):
        sheet = job.stock[number]
        if sheet.quantity is not None and taken[number] >= sheet.quantity:
            continue
        if job.fits[first, number] or (sheet.offcut and job.fits[shapes, number].any()):
            return number
    return None


#: A piece that is too large by its width may be this share as long, to be narrower.
_SHORTER = 0.9


def _too_large(job: NestingJob, stranded: Sequence[int]) -> CannotMakeError:
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
    return CannotMakeError(
        f"{len(stranded)} of {agree(len(job.poses), '{n} piece[|s]')} "
        f"{agree(len(stranded), '[fits|fit]')} on no sheet at any allowed rotation: "
        f"{few_of(pieces)}; the largest free rectangle of the stock is {wide:.1f} × "
        f"{high:.1f} mm, inside the margins and clear of defects",
        f"use {', '.join(remedies[:-1])}, or {remedies[-1]}",
    )


def _out_of_sheets(job: NestingJob, queue: Sequence[int], sheets: Sequence[int]) -> CannotMakeError:
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
    return CannotMakeError(
        f"the sheets run out: {len(queue)} of {agree(len(job.poses), '{n} piece[|s]')} "
        f"{agree(len(queue), '[is|are]')} left ({pieces}) "
        f"after {agree(len(sheets), '{n} sheet[|s]')}; {more} would hold them",
        "add sheets, use larger ones, or try --effort best",
    )


def _sheet_name(job: NestingJob, number: int) -> str:
    """Return what a sheet of the stock is called, with its size."""
    sheet = job.stock[number]
    size = format_stock(replace(sheet, quantity=None))
    return f"{sheet.name} ({size})" if sheet.name else size


#: How much a seed may change the length by which pieces are ordered, as a share.
_JITTER = 0.05
#: A last sheet that is filled to less than this share may be saved, by a closer look at so many
#: sheets before it, with pixels of this size: what more of them would gain takes long. So many
#: pieces are tried at all angles; with more, that takes ten times as long as all else.
_LITTLE, _AGAIN, _CLOSER_MM, _ALL_ANGLES = 0.05, 4, 1.25, 60


def greedy_plan(job: NestingJob, seed: int, progress: Progress = no_progress) -> Plan:
    """Place pieces, sheet after sheet, and never move one again.

    Parameters
    ----------
    job : NestingJob
        Shapes, stock and settings; every shape fits on some sheet.
    seed : int
        Changes the order of the pieces a little; 0 is strictly by length.
    progress : Progress
        Told how many pieces are placed after each sheet.

    Returns
    -------
    Plan
        Without a placement for the pieces that the stock has no sheet left for. Where the last
        sheet holds so little that a closer look may save it, what lies on the last sheets is placed
        again: few pieces in other orders, too, and at all angles.
    """
    plan = _filled(job, seed, Plan((), {}), progress)
    if len(plan.sheets) < 2 or not job.effort.orders:
        return plan
    if plan.areas_mm2(job)[-1] >= _LITTLE * job.stock[plan.sheets[-1]].area_mm2:
        return plan
    kept = max(len(plan.sheets) - 1 - _AGAIN, 0)
    first = {piece: place for piece, place in plan.placements.items() if place.sheet < kept}
    few = len(job.poses) - len(first) <= _ALL_ANGLES
    effort = replace(
        job.effort,
        likely=job.effort.angles if few else job.effort.likely,
        pixel_mm=min(_CLOSER_MM, job.effort.pixel_mm),
    )
    if effort == job.effort:  # there is no closer look; sheets are emptied after this
        return plan
    closer = replace(job, effort=effort)
    for turn in range(job.effort.orders if few else 1):
        again = _filled(closer, seed + turn, Plan(plan.sheets[:kept], first), progress)
        if (-len(again.placements), len(again.sheets)) < (-len(plan.placements), len(plan.sheets)):
            return again
    return plan


def _filled(job: NestingJob, seed: int, begun: Plan, progress: Progress) -> Plan:
    """Fill sheet after sheet with what has no place yet."""
    placements, sheets = dict(begun.placements), list(begun.sheets)
    queue = [piece for piece in _ordered(job, seed) if piece not in placements]
    while queue:
        number = next_sheet(job, queue, sheets)
        if number is None:
            break
        placements.update(fill_sheet(job, queue, number, len(sheets)))
        queue = [piece for piece in queue if piece not in placements]
        sheets.append(number)
        plan = Plan(tuple(sheets), placements)
        progress(progress_text(job, plan, len(sheets)), len(placements), len(job.poses))
    return Plan(tuple(sheets), placements)


def progress_text(job: NestingJob, plan: Plan, count: int) -> str:
    """Say how many sheets there are, and how much of them is used."""
    sheets_mm2 = sum(job.stock[number].area_mm2 for number in plan.sheets)
    share = sum(plan.areas_mm2(job)) / sheets_mm2 if sheets_mm2 else 0.0
    return f"nesting: {agree(count, '{n} sheet[|s]')}, {share:.0%} used"


def _ordered(job: NestingJob, seed: int) -> list[int]:
    """Return the pieces: those that fit on the fewest sheets first, then the longest."""
    fitting = job.fits.sum(axis=1)
    # Rounded, so that the last bit of a length does not order congruent pieces.
    lengths = np.array([shape.length_mm for shape in job.shapes]).round(6)
    if seed != 0:
        generator = np.random.default_rng(seed)
        lengths = lengths * generator.uniform(1.0 - _JITTER, 1.0 + _JITTER, len(lengths))

    def key(piece: int) -> tuple[int, float, float, int, int]:
        shape = job.poses[piece].shape
        width = round(job.shapes[shape].width_mm, 6)
        return (int(fitting[shape]), -float(lengths[shape]), -width, shape, piece)

    return sorted(range(len(job.poses)), key=key)


def require_fitting(job: NestingJob) -> None:
    """Raise CannotMakeError if a piece fits on no sheet, even an empty one."""
    fitting = job.fits.sum(axis=1)
    stranded = [piece for piece, pose in enumerate(job.poses) if fitting[pose.shape] == 0]
    if stranded:
        raise _too_large(job, stranded)


def require_all(job: NestingJob, plan: Plan) -> None:
    """Raise CannotMakeError if the sheets ran out before every piece had a place."""
    queue = [piece for piece in _ordered(job, 0) if piece not in plan.placements]
    if queue:
        raise _out_of_sheets(job, queue, plan.sheets)
