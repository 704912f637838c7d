"""Nest very many pieces in batches that need not know of one another.

Similar pieces keep together in short runs, since they lie well in one another; the runs are dealt
to batches of equal area, so that each has long pieces to begin with and short ones to fill up. The
last sheets of the batches are poor: their pieces are pooled and nested again. How many batches
there are depends on the pieces alone, so the layout does not depend on who nests them.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fabweave.core.parallel.executors import Executors, finished
from fabweave.nest.place.fill import KernelCache, NestingJob, Plan
from fabweave.nest.place.greedy import greedy, require_all
from fabweave.nest.separate.fewer_sheets import reduced

_PIECES = 400  # in a batch, or a few more
_LEAST_BATCHES = 3  # fewer are not worth the sheets that they lose
_LEAST_SHEETS = 4  # that a batch fills, about
_FILLED = 0.4  # of a sheet, about
_RUN = 8  # similar pieces that are dealt together

#: Told how many sheets there are so far, and how many pieces stand on them for good.
Told = Callable[[Plan, int], None]


def batch_count(job: NestingJob) -> int:
    """Return in how many batches the pieces of a job are nested; 1 if they are not very many."""
    area = sum(job.shapes[pose.shape].area_mm2 for pose in job.poses)
    largest = max(sheet.area_mm2 for sheet in job.sheets)
    sheets = area / (_FILLED * largest)
    count = min(len(job.poses) // _PIECES, int(sheets / _LEAST_SHEETS))
    return count if count >= _LEAST_BATCHES else 1


def dealt(job: NestingJob, count: int) -> list[list[int]]:
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
        bent = shape.area_mm2 / (shape.length_mm * shape.width_mm)
        return (
            -round(6.0 * float(np.log2(shape.length_mm))),
            round(8.0 * bent),
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


def nested_in_batches(
    job: NestingJob, seed: int, count: int, executors: Executors, told: Told
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
    told : callable
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
    batches = dealt(job, count)
    shares = _shared(job, count)
    with executors() as executor:
        tasks = [
            (_part(job, pieces, quantities), seed)
            for pieces, quantities in zip(batches, shares, strict=True)
        ]
        plans = [Plan((), {}) for _ in batches]
        for number, plan in finished(executor, _greedy_part, tasks):
            plans[number] = _renamed(plan, batches[number])
            whole = _joined(plans)
            told(whole, len(whole.placements))
        plans = _pooled(job, plans, seed)
        whole = _joined(plans)
        if len(whole.placements) < len(job.poses):
            # Scarce stock was dealt badly: one batch of all deals better, if slowly.
            plans = [greedy(job, seed)]
            whole = _joined(plans)
            require_all(job, whole)
        yield whole
        if not job.effort.rounds:
            return
        names = [sorted(plan.placements) for plan in plans]
        better = [
            (_part(job, pieces), _numbered(plan, pieces), seed)
            for pieces, plan in zip(names, plans, strict=True)
        ]
        done = 0
        for number, plan in finished(executor, _reduced_part, better):
            plans[number] = _renamed(plan, names[number])
            done += len(names[number])
            told(_joined(plans), done)
            yield _joined(plans)
        yield _joined(_pooled(job, plans, seed))


def _shared(job: NestingJob, count: int) -> list[list[int | None]]:
    """Deal scarce sheets evenly: for each batch, how many of each size it may take."""
    return [
        [
            None
            if sheet.quantity is None
            # Single ones of many sizes go to different batches.
            else (sheet.quantity + count - 1 - (batch + number) % count) // count
            for number, sheet in enumerate(job.sheets)
        ]
        for batch in range(count)
    ]


def _part(
    job: NestingJob, pieces: Sequence[int], quantities: Sequence[int | None] | None = None
) -> NestingJob:
    """Return the job of some pieces alone, numbered anew, with this much of each size."""
    shapes = sorted({job.poses[piece].shape for piece in pieces})
    number = {shape: new for new, shape in enumerate(shapes)}
    sheets = job.sheets
    if quantities is not None:
        sheets = tuple(
            replace(sheet, quantity=quantity)
            for sheet, quantity in zip(job.sheets, quantities, strict=True)
        )
    return replace(
        job,
        shapes=tuple(job.shapes[shape] for shape in shapes),
        poses=tuple(
            replace(job.poses[piece], shape=number[job.poses[piece].shape]) for piece in pieces
        ),
        names=[job.names[piece] for piece in pieces],
        sheets=sheets,
        workers=1,
        fits=job.fits[shapes],
        cache=KernelCache(),
    )


def _greedy_part(part: NestingJob, seed: int) -> Plan:
    """Place the pieces of one batch; what the stock has no sheet for is left out."""
    return greedy(part, seed)


def _reduced_part(part: NestingJob, plan: Plan, seed: int) -> Plan:
    """Return the best plan that can be found for one batch."""
    with threadpool_limits(limits=1, user_api="blas"):
        for better in reduced(part, plan, seed, lambda _count, _share: None):
            plan = better
    return plan


def _renamed(plan: Plan, pieces: Sequence[int]) -> Plan:
    """Return a batch's plan with the numbers that its pieces have in the whole."""
    placements = {
        pieces[own]: replace(placement, piece=pieces[own])
        for own, placement in plan.placements.items()
    }
    return replace(plan, placements=placements)


def _numbered(plan: Plan, pieces: Sequence[int]) -> Plan:
    """Return a plan with the numbers that its pieces have in a batch of these alone."""
    number = {piece: own for own, piece in enumerate(pieces)}
    placements = {
        number[piece]: replace(placement, piece=number[piece])
        for piece, placement in plan.placements.items()
    }
    return replace(plan, placements=placements)


def _joined(plans: Sequence[Plan]) -> Plan:
    """Return one plan of all, sheets after sheets."""
    used: tuple[int, ...] = ()
    placements = {}
    for plan in plans:
        for piece, placement in plan.placements.items():
            placements[piece] = replace(placement, sheet=placement.sheet + len(used))
        used += plan.used
    return Plan(used, dict(sorted(placements.items())))


def _pooled(job: NestingJob, plans: list[Plan], seed: int) -> list[Plan]:
    """Nest the pieces of the last sheets, and those that stand nowhere, as a batch of their own.

    The plans stay as they are if that takes more sheets, or has no place for more pieces.
    """
    closed = [_without_last(plan) for plan in plans]
    standing = {piece for plan in closed for piece in plan.placements}
    pool = [piece for piece in range(len(job.poses)) if piece not in standing]
    taken = Counter(number for plan in closed for number in plan.used)
    left = [
        None if sheet.quantity is None else sheet.quantity - taken[number]
        for number, sheet in enumerate(job.sheets)
    ]
    part = _part(job, pool, left)
    found = greedy(part, seed)
    with threadpool_limits(limits=1, user_api="blas"):
        if len(found.placements) == len(pool):
            found = _reduced_part(part, found, seed)
    better = [*[plan for plan in closed if plan.used], _renamed(found, pool)]
    before, after = _joined(plans), _joined(better)
    if (-len(after.placements), len(after.used)) <= (-len(before.placements), len(before.used)):
        return better
    return plans


def _without_last(plan: Plan) -> Plan:
    """Return a plan without its last sheet."""
    last = len(plan.used) - 1
    kept = {piece: place for piece, place in plan.placements.items() if place.sheet != last}
    return replace(plan, used=plan.used[:last] if plan.used else (), placements=kept)
