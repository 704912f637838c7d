"""Nest very many pieces in batches that need not know of one another.

Similar pieces keep together in short runs, since they lie well in one another; the runs are dealt
to batches of equal area, so that each has long pieces to begin with and short ones to fill up. The
last sheets of the batches are poor: their pieces are pooled and nested again. How many batches
there are depends on the pieces alone, so the layout does not depend on who nests them.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fabweave.core.parallel.executors import Executors, finished
from fabweave.nest.place.fill import NestingJob, Plan, kernel_cache
from fabweave.nest.place.greedy import greedy_plan, require_all
from fabweave.nest.separate.fewer_sheets import fewer_sheets

#: Pieces in a batch, or a few more.
_PIECES = 400
#: Fewer batches are not worth the sheets that they lose.
_LEAST_BATCHES = 3
#: Sheets that a batch fills, about, and the share of a sheet that pieces fill, about.
_LEAST_SHEETS, _FILLED = 4, 0.4
#: Similar pieces that are dealt together.
_RUN = 8
#: Classes of similar pieces: for each doubling of the length, and of the share of the rectangle
#: that is filled.
_LENGTH_CLASSES, _BEND_CLASSES = 6.0, 8.0

#: Called with the plan so far, and with how many pieces are on its sheets for good.
Progress = Callable[[Plan, int], None]


def batch_count(job: NestingJob) -> int:
    """Return in how many batches the pieces of a job are nested; 1 if they are not very many."""
    area = sum(job.shapes[pose.shape].area_mm2 for pose in job.poses)
    sheets = area / (_FILLED * max(sheet.area_mm2 for sheet in job.stock))
    count = min(len(job.poses) // _PIECES, int(sheets / _LEAST_SHEETS))
    return count if count >= _LEAST_BATCHES else 1


def deal(job: NestingJob, count: int) -> list[list[int]]:
    """Deal the pieces to batches of about equal area, similar ones in runs.

    Returns
    -------
    list of list of int
        The pieces of each batch, in ascending order; every piece once.
    """
    shapes = job.shapes

    def likeness(piece: int) -> tuple[int, int, float, int, int]:
        number = job.poses[piece].shape
        shape = shapes[number]
        # Of about equal length; how bent, by the share of the rectangle that is filled; how wide.
        filled = shape.area_mm2 / (shape.length_mm * shape.width_mm)
        return (
            -round(_LENGTH_CLASSES * float(np.log2(shape.length_mm))),
            round(_BEND_CLASSES * filled),
            round(shape.width_mm, 6),
            number,
            piece,
        )

    order = sorted(range(len(job.poses)), key=likeness)
    batches: list[list[int]] = [[] for _ in range(count)]
    area = np.zeros(count)
    for start in range(0, len(order), _RUN):
        run = order[start : start + _RUN]
        least = int(np.argmin(area.round(3)))
        batches[least] += run
        area[least] += sum(shapes[job.poses[piece].shape].area_mm2 for piece in run)
    return [sorted(batch) for batch in batches]


def nest_in_batches(
    job: NestingJob, seed: int, count: int, executors: Executors, progress: Progress
) -> Iterator[Plan]:
    """Yield ever better plans of all pieces, nested in batches.

    Parameters
    ----------
    job : NestingJob
        Shapes, stock and settings; every shape fits on some sheet.
    seed : int
        For the order of the pieces, and for what is tried.
    count : int
        How many batches, from `batch_count`.
    executors : callable
        Opens the executor that does the batches; it changes no plan.
    progress : callable
        Told of what is complete so far.

    Yields
    ------
    Plan
        Complete, with never more sheets than the one before.

    Raises
    ------
    CannotMakeError
        If the sheets run out.
    """
    batches = deal(job, count)
    with executors() as executor:
        tasks = [
            (_subjob(job, pieces, quantities), seed)
            for pieces, quantities in zip(batches, _deal_stock(job, count), strict=True)
        ]
        plans = [Plan((), {}) for _ in batches]
        for number, plan in finished(executor, _greedy, tasks):
            plans[number] = _numbered(plan, batches[number])
            merged = _merged(plans)
            progress(merged, len(merged.placements))
        plans = _pool_last_sheets(job, plans, seed)
        merged = _merged(plans)
        if len(merged.placements) < len(job.poses):
            # Scarce stock was dealt badly: one batch of all deals better, if slowly.
            plans = [greedy_plan(job, seed)]
            merged = _merged(plans)
            require_all(job, merged)
        yield merged
        if not job.effort.rounds:
            return
        batches = [sorted(plan.placements) for plan in plans]
        improvements = []
        for pieces, plan in zip(batches, plans, strict=True):
            number_in_batch = {piece: number for number, piece in enumerate(pieces)}
            improvements.append((_subjob(job, pieces), _numbered(plan, number_in_batch), seed))
        done = 0
        for number, plan in finished(executor, _improved, improvements):
            plans[number] = _numbered(plan, batches[number])
            done += len(batches[number])
            progress(_merged(plans), done)
            yield _merged(plans)
        yield _merged(_pool_last_sheets(job, plans, seed))


def _deal_stock(job: NestingJob, count: int) -> list[list[int | None]]:
    """Deal scarce sheets evenly: for each batch, how many of each size it may take."""
    return [
        [
            None
            if sheet.quantity is None
            # Single ones of many sizes go to different batches.
            else (sheet.quantity + count - 1 - (batch + number) % count) // count
            for number, sheet in enumerate(job.stock)
        ]
        for batch in range(count)
    ]


def _subjob(
    job: NestingJob, pieces: Sequence[int], quantities: Sequence[int | None] | None = None
) -> NestingJob:
    """Return the job of some pieces alone, numbered anew, with this much of each size."""
    shapes = sorted({job.poses[piece].shape for piece in pieces})
    number = {shape: new for new, shape in enumerate(shapes)}
    stock = job.stock
    if quantities is not None:
        stock = tuple(
            replace(sheet, quantity=quantity)
            for sheet, quantity in zip(job.stock, quantities, strict=True)
        )
    return replace(
        job,
        shapes=tuple(job.shapes[shape] for shape in shapes),
        poses=tuple(
            replace(job.poses[piece], shape=number[job.poses[piece].shape]) for piece in pieces
        ),
        names=[job.names[piece] for piece in pieces],
        stock=stock,
        workers=1,
        fits=job.fits[shapes],
        cache=kernel_cache(),
    )


def _forgetful(job: NestingJob) -> NestingJob:
    """Return a batch with a cache that goes when it is done: the list of batches outlives it."""
    return replace(job, cache=kernel_cache())


def _greedy(job: NestingJob, seed: int) -> Plan:
    """Return a first plan for one batch."""
    return greedy_plan(_forgetful(job), seed)


def _improved(job: NestingJob, plan: Plan, seed: int) -> Plan:
    """Return the best plan that can be found for one batch."""
    job = _forgetful(job)
    with threadpool_limits(limits=1, user_api="blas"):
        for better in fewer_sheets(job, plan, seed, lambda _count, _share: None):
            plan = better
    return plan


def _numbered(plan: Plan, numbers: Sequence[int] | Mapping[int, int]) -> Plan:
    """Return a plan with the numbers that its pieces have in the whole job, or in a batch."""
    placements = {
        numbers[piece]: replace(placement, piece=numbers[piece])
        for piece, placement in plan.placements.items()
    }
    return replace(plan, placements=placements)


def _merged(plans: Sequence[Plan]) -> Plan:
    """Return one plan of all, sheets after sheets."""
    sheets: tuple[int, ...] = ()
    placements = {}
    for plan in plans:
        for piece, placement in plan.placements.items():
            placements[piece] = replace(placement, sheet=placement.sheet + len(sheets))
        sheets += plan.sheets
    return Plan(sheets, dict(sorted(placements.items())))


def _pool_last_sheets(job: NestingJob, plans: list[Plan], seed: int) -> list[Plan]:
    """Nest the pieces of the last sheets, and those that are unplaced, as a batch of their own.

    The plans stay as they are if that takes more sheets, or has no place for more pieces.
    """
    full = [_without_last_sheet(plan) for plan in plans]
    placed = {piece for plan in full for piece in plan.placements}
    pool = [piece for piece in range(len(job.poses)) if piece not in placed]
    taken = Counter(number for plan in full for number in plan.sheets)
    left = [
        None if sheet.quantity is None else sheet.quantity - taken[number]
        for number, sheet in enumerate(job.stock)
    ]
    subjob = _subjob(job, pool, left)
    pool_plan = greedy_plan(subjob, seed)
    if len(pool_plan.placements) == len(pool):
        pool_plan = _improved(subjob, pool_plan, seed)
    pooled = [*[plan for plan in full if plan.sheets], _numbered(pool_plan, pool)]
    before, after = _merged(plans), _merged(pooled)
    if (-len(after.placements), len(after.sheets)) <= (-len(before.placements), len(before.sheets)):
        return pooled
    return plans


def _without_last_sheet(plan: Plan) -> Plan:
    """Return a plan without its last sheet."""
    last = len(plan.sheets) - 1
    kept = {piece: place for piece, place in plan.placements.items() if place.sheet != last}
    return Plan(plan.sheets[:-1], kept)
