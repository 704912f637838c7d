"""Nest a finished plan on fewer sheets, one sheet less at a time."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from fabweave.nest.place.coarse_search import CoarseSearch
from fabweave.nest.place.fill import NestingJob, Plan, fill_sheet
from fabweave.nest.separate.emptying import (
    UNPLACED,
    Arrangement,
    SeparationProblem,
    arrangement_of,
    empty_sheet,
    placement_of,
)
from fabweave.nest.separate.overlap import ItemField, item_field, obstacle_field

#: How strongly pieces are drawn to the left on the last sheet: its rest stays in one piece.
_LAST_PULL = 3.0
#: The share of a piece's rim that counts with the gap: half of it, at least, as inside a bend the
#: grown rim overlaps itself; and only half the gap is the piece's own.
_RIM_SHARE = 0.25

#: Called with how many sheets there are, and what share of the pieces of one has room elsewhere.
Progress = Callable[[int, float], None]


def fewer_sheets(job: NestingJob, plan: Plan, seed: int, progress: Progress) -> Iterator[Plan]:
    """Yield ever better plans: with one sheet less, and at last with an emptier last sheet.

    Parameters
    ----------
    job : NestingJob
        Shapes, stock and settings.
    plan : Plan
        All pieces, as the greedy search placed them.
    seed : int
        For what is tried.
    progress : callable
        Told how it goes.

    Yields
    ------
    Plan
        Complete, whenever something is better than before.
    """
    if job.effort.rounds == 0 or len(plan.sheets) < 2:
        return
    items: list[ItemField] = []
    search = CoarseSearch()
    obstacles = {
        number: obstacle_field(job.containers[number], job.gap_mm) for number in set(plan.sheets)
    }
    while len(plan.sheets) > 1:
        sheet = emptiest(job, plan)
        others = [number for number in range(len(plan.sheets)) if number != sheet]
        offered = sum(_offered_mm2(job, plan.sheets[other]) for other in others)
        if _needed_mm2(job) > job.effort.density * offered:
            return
        if not items:
            fields = [item_field(shape, job.gap_mm) for shape in job.shapes]
            items = [fields[pose.shape] for pose in job.poses]
        problem = SeparationProblem(
            items,
            [job.containers[number] for number in plan.sheets],
            [obstacles[number] for number in plan.sheets],
            job.gap_mm,
            search,
        )
        count, sheet_mm2 = len(plan.sheets), plan.areas_mm2(job)[sheet]

        def unplaced(area_mm2: float, count: int = count, sheet_mm2: float = sheet_mm2) -> None:
            progress(count, 1.0 - area_mm2 / sheet_mm2)

        arrangement = empty_sheet(
            problem,
            arrangement_of(plan.placements.values(), job.poses, items, job.margin_mm),
            sheet,
            rounds=job.effort.rounds,
            patience=job.effort.patience,
            seed=seed + count,
            progress=unplaced,
        )
        better = _plan_of(job, plan, arrangement, items, [*others, sheet])
        if better is None:
            return
        plan = better
        yield plan
        if arrangement.pieces_on(UNPLACED):
            return


def emptiest(job: NestingJob, plan: Plan) -> int:
    """Return the sheet with the least on it: one that is bought, if there is any."""
    areas = np.round(plan.areas_mm2(job), 6)
    offcut = np.array([job.stock[number].offcut for number in plan.sheets])
    if not offcut.all():
        areas[offcut] = np.inf
    return int(np.argmin(areas))


def _plan_of(
    job: NestingJob,
    plan: Plan,
    arrangement: Arrangement,
    items: Sequence[ItemField],
    order: list[int],
) -> Plan | None:
    """Return the plan of an arrangement, with what is unplaced on the last sheet of the order.

    Without that sheet if nothing is unplaced; None if not all of it fits there.
    """
    unplaced = arrangement.pieces_on(UNPLACED)
    if not unplaced:
        order = order[:-1]
    number = {sheet: new for new, sheet in enumerate(order)}
    placements = {
        piece: placement_of(
            piece,
            number[int(sheet)],
            arrangement.poses[piece],
            job.poses[piece],
            items[piece],
            job.margin_mm,
        )
        for piece, sheet in enumerate(arrangement.sheet_of)
        if sheet != UNPLACED
    }
    sheets = tuple(plan.sheets[sheet] for sheet in order)
    if unplaced:
        queue = sorted(unplaced, key=lambda piece: (-job.shape(piece).length_mm, piece))
        last = fill_sheet(job, queue, sheets[-1], len(sheets) - 1, pull=_LAST_PULL)
        if len(last) < len(unplaced):
            return None
        placements.update(last)
    return Plan(sheets, dict(sorted(placements.items())))


def _needed_mm2(job: NestingJob) -> float:
    """Return the area of all pieces, each grown by half the gap (corners left out)."""
    shapes = [job.shapes[pose.shape] for pose in job.poses]
    rims = [
        np.hypot(*(np.roll(shape.outline, -1, axis=0) - shape.outline).T).sum() for shape in shapes
    ]
    return sum(
        shape.area_mm2 + _RIM_SHARE * job.gap_mm * float(rim)
        for shape, rim in zip(shapes, rims, strict=True)
    )


def _offered_mm2(job: NestingJob, number: int) -> float:
    """Return the usable area of a sheet of the stock, grown by half the gap."""
    container = job.containers[number]
    width, height = container.size_mm
    return container.open_mm2 + job.gap_mm * (width + height + job.gap_mm)
