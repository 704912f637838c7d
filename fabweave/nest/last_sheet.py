"""Finish a plan: the last sheet is as cheap as it may be, and leaves as large a rest as it can."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fabweave.nest.fits import fits_rectangle
from fabweave.nest.item_shape import rotated
from fabweave.nest.layout import Placement
from fabweave.nest.offcut import offcut_of
from fabweave.nest.place.fill import NestingJob, Plan, filled_sheet

_PULLS = (1.0, 3.0)  # how strongly pieces are drawn aside, in each try
_MOST_PACKED = 120  # a sheet with more pieces is not packed again


def finished(job: NestingJob, plan: Plan) -> Plan:
    """Return the plan with its last sheet exchanged for a cheaper one, and packed to one side.

    The cheapest sheet in stock that takes all its pieces is taken. On it they are packed anew,
    drawn to the left more strongly; of these packings and the one that was found, the one whose
    rest holds the largest rectangle stays. At best effort, they are packed into parts of the
    sheet besides. At quick effort, and where it holds very many pieces, a sheet is left as it is.

    Parameters
    ----------
    job : NestingJob
    plan : Plan
        Complete.
    """
    if not plan.used:
        return plan
    last = len(plan.used) - 1
    standing = {piece: at for piece, at in plan.placements.items() if at.sheet == last}
    queue = sorted(
        standing, key=lambda piece: (-round(job.shapes[job.poses[piece].shape].length_mm, 6), piece)
    )
    stock = plan.used[last]
    for cheaper in _cheaper(job, plan, queue):
        found = filled_sheet(job, queue, cheaper, last)
        if len(found) == len(queue):
            stock, standing = cheaper, found
            break
    if job.effort.rounds and len(queue) <= _MOST_PACKED:
        best = _rest_mm2(job, stock, standing)
        for pull in _PULLS:
            found = filled_sheet(job, queue, stock, last, pull=pull)
            if len(found) == len(queue):
                rest = _rest_mm2(job, stock, found)
                if rest > best:
                    best, standing = rest, found
        if job.effort.halvings:
            standing = _narrowed(job, queue, stock, last, standing, best)
    placements = dict(sorted((plan.placements | standing).items()))
    return Plan((*plan.used[:last], stock), placements)


def _narrowed(
    job: NestingJob,
    queue: list[int],
    stock: int,
    number: int,
    standing: dict[int, Placement],
    best: float,
) -> dict[int, Placement]:
    """Pack a sheet's pieces into ever less of its width, then of its height, while that pays.

    ``best`` is the rest that they leave as they stand.
    """
    area = job.areas[stock]
    shapes = [job.shapes[job.poses[piece].shape] for piece in queue]
    ground = sum(shape.area_mm2 for shape in shapes)
    for axis in (0, 1):
        size = list(area.size_mm)
        most, least = size[axis], ground / size[1 - axis]
        for _ in range(job.effort.halvings):
            size[axis] = (least + most) / 2.0
            part = replace(area, size_mm=(size[0], size[1]))
            found: dict[int, Placement] = {}
            if all(fits_rectangle(shape, part) for shape in shapes):
                areas = (*job.areas[:stock], part, *job.areas[stock + 1 :])
                found = filled_sheet(replace(job, areas=areas), queue, stock, number)
            if len(found) < len(queue):
                least = size[axis]
                continue
            most = size[axis]
            rest = _rest_mm2(job, stock, found)
            if rest > best:
                best, standing = rest, found
    return standing


def _cheaper(job: NestingJob, plan: Plan, queue: list[int]) -> list[int]:
    """Return the sheets in stock that cost less than the last one and may do, cheapest first."""
    price = job.sheets[plan.used[-1]].price
    if price is None or job.sheets[plan.used[-1]].offcut:
        return []
    shapes = [job.poses[piece].shape for piece in queue]
    area = sum(job.shapes[shape].area_mm2 for shape in shapes)
    able: list[tuple[float, int]] = []
    for number, sheet in enumerate(job.sheets):
        left = sheet.quantity is None or plan.used.count(number) < sheet.quantity
        cost = 0.0 if sheet.offcut else sheet.price
        room = area <= job.areas[number].open_mm2 and job.fits[shapes, number].all()
        if left and room and cost is not None and cost < price:
            able.append((cost, number))
    return [number for _, number in sorted(able)]


def _rest_mm2(job: NestingJob, stock: int, standing: Mapping[int, Placement]) -> float:
    """Return the area of the largest rectangle in what pieces leave of a sheet."""
    placed = []
    for piece, at in standing.items():
        pose = job.poses[piece]
        # A shape's outline, back to the piece's own frame, and from there to the sheet.
        shift = np.array([pose.x_mm, pose.y_mm])
        own = rotated(job.shapes[pose.shape].outline - shift, np.array([-pose.angle_deg]))[0]
        placed.append(at.apply(own))
    rest = offcut_of(job.sheets[stock], 0, placed, job.gap_mm)
    return 0.0 if rest is None else round(float(np.prod(rest.rectangle_mm)), 3)
