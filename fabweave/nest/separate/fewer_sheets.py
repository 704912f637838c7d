"""Nest a finished plan on fewer sheets, one sheet less at a time."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from fabweave.nest.place.coarse_search import Finder
from fabweave.nest.place.fill import NestingJob, Plan, filled_sheet
from fabweave.nest.separate.arrangement import NOWHERE, Arrangement, arrangement_of, placement_of
from fabweave.nest.separate.emptying import Ground, emptied
from fabweave.nest.separate.item_field import Body, body_of
from fabweave.nest.separate.obstacle import barrier_of

_LAST_PULL = 3.0  # keeps the rest of the last sheet in one piece

#: Told how many sheets there are, and what share of the pieces of one has found room elsewhere.
Told = Callable[[int, float], None]


def reduced(job: NestingJob, plan: Plan, seed: int, told: Told) -> Iterator[Plan]:
    """Yield ever better plans: with one sheet less, and at last with an emptier last sheet.

    Parameters
    ----------
    job : NestingJob
        Shapes, stock and settings.
    plan : Plan
        All pieces, as the greedy search placed them.
    seed : int
        For what is tried.
    told : callable
        Told how it goes.

    Yields
    ------
    Plan
        Complete, whenever something is better than before.
    """
    if job.effort.rounds == 0 or len(plan.used) < 2:
        return
    bodies = _Bodies(job)
    finder = Finder()
    barriers = {stock: barrier_of(job.areas[stock], job.gap_mm) for stock in set(plan.used)}
    while len(plan.used) > 1:
        sheet = emptiest(job, plan)
        others = [number for number in range(len(plan.used)) if number != sheet]
        offered = sum(_area_offered(job, plan.used[other]) for other in others)
        if _area_needed(job) > job.effort.density * offered:
            return
        ground = Ground(
            bodies,
            [job.areas[stock] for stock in plan.used],
            [barriers[stock] for stock in plan.used],
            job.gap_mm,
            finder,
        )
        start = arrangement_of(plan.placements.values(), job.poses, bodies, job.margin_mm)
        count, whole = len(plan.used), plan.areas(job)[sheet]
        found = emptied(
            ground,
            start,
            sheet,
            rounds=job.effort.rounds,
            patience=job.effort.patience,
            seed=seed + count,
            told=partial(_tell, told, count, whole),
        )
        left = found.on(NOWHERE)
        better = _plan(job, plan, found, bodies, [*others, sheet], left)
        if better is None:
            return
        plan = better
        yield plan
        if left:
            return


def emptiest(job: NestingJob, plan: Plan) -> int:
    """Return the sheet with the least on it: one that is bought, if there is any."""
    areas = np.round(plan.areas(job), 6)
    offcut = np.array([job.sheets[stock].offcut for stock in plan.used])
    if not offcut.all():
        areas[offcut] = np.inf
    return int(np.argmin(areas))


def _tell(told: Told, count: int, whole: float, left: float) -> None:
    """Tell what share of an area is not left."""
    told(count, 1.0 - left / whole)


def _plan(
    job: NestingJob,
    plan: Plan,
    found: Arrangement,
    bodies: Sequence[Body],
    order: list[int],
    left: list[int],
) -> Plan | None:
    """Return the plan of an arrangement, with what is left on the last sheet of the order."""
    if not left:
        order = order[:-1]
    number = {sheet: new for new, sheet in enumerate(order)}
    placements = {
        piece: placement_of(
            piece, number[int(sheet)], found.poses[piece], job.poses[piece], bodies[piece],
            job.margin_mm,
        )
        for piece, sheet in enumerate(found.where)
        if sheet != NOWHERE
    }  # fmt: skip
    used = tuple(plan.used[sheet] for sheet in order)
    if left:
        shapes = [job.shapes[job.poses[piece].shape] for piece in left]
        queue = [
            piece for _, piece in sorted(zip([-s.length_mm for s in shapes], left, strict=True))
        ]
        last = filled_sheet(job, queue, used[-1], len(used) - 1, pull=_LAST_PULL)
        if len(last) < len(left):
            return None
        placements.update(last)
    return Plan(used, dict(sorted(placements.items())))


class _Bodies(Sequence[Body]):
    """The bodies of all pieces, made when they are asked for."""

    def __init__(self, job: NestingJob) -> None:
        """Make none yet."""
        self._job = job
        self._made: dict[int, Body] = {}

    def __len__(self) -> int:
        """Return the number of pieces."""
        return len(self._job.poses)

    def __getitem__(self, piece: int) -> Body:  # type: ignore[override] # slices are not asked for
        """Return the body of a piece."""
        shape = self._job.poses[piece].shape
        if shape not in self._made:
            self._made[shape] = body_of(self._job.shapes[shape], self._job.gap_mm)
        return self._made[shape]


def _area_needed(job: NestingJob) -> float:
    """Return the area of all pieces, each grown by half the gap (corners left out)."""
    shapes = [job.shapes[pose.shape] for pose in job.poses]
    rims = [
        np.hypot(*(np.roll(shape.outline, -1, axis=0) - shape.outline).T).sum() for shape in shapes
    ]
    # Inside a bend the grown rim overlaps itself: half of it is certain enough.
    return sum(
        shape.area_mm2 + 0.25 * job.gap_mm * float(rim)
        for shape, rim in zip(shapes, rims, strict=True)
    )


def _area_offered(job: NestingJob, stock: int) -> float:
    """Return the usable area of a sheet, grown by half the gap."""
    area = job.areas[stock]
    width, height = area.size_mm
    return area.open_mm2 + job.gap_mm * (width + height + job.gap_mm)
