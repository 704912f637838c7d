"""Finish a plan: the last sheet is as cheap as possible, and as much of it as can be is left."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from fabweave.nest.fits import fits_rectangle
from fabweave.nest.item_shape import rotated
from fabweave.nest.layout import Placement
from fabweave.nest.offcut import offcut_of
from fabweave.nest.place.fill import NestingJob, Plan, fill_sheet

#: How strongly pieces are drawn aside, in each try.
_PULLS = (1.0, 3.0)
#: A sheet with more pieces is not packed again.
_MOST_PACKED = 120


def repack_last_sheet(job: NestingJob, plan: Plan) -> Plan:
    """Return the plan with its last sheet exchanged for a cheaper one, and packed to one side.

    The cheapest sheet in stock that takes all its pieces is taken. On it they are packed anew,
    drawn to the left more strongly; of these packings and the plan's own, the one whose rest holds
    the largest rectangle stays. At best effort, they are packed into parts of the sheet besides. At
    quick effort, and where it holds very many pieces, a sheet is left as it is.

    Parameters
    ----------
    job : NestingJob
    plan : Plan
        Complete.
    """
    if not plan.sheets:
        return plan
    last, number = len(plan.sheets) - 1, plan.sheets[-1]
    placements = {piece: at for piece, at in plan.placements.items() if at.sheet == last}
    queue = sorted(placements, key=lambda piece: (-round(job.shape(piece).length_mm, 6), piece))
    for cheaper in _cheaper(job, plan, queue):
        packing = fill_sheet(job, queue, cheaper, last)
        if len(packing) == len(queue):
            number, placements = cheaper, packing
            break
    if job.effort.rounds and len(queue) <= _MOST_PACKED:
        packings = [
            packing for packing in _packings(job, queue, number, last) if len(packing) == len(queue)
        ]
        placements = max(
            (placements, *packings), key=lambda packing: _rest_mm2(job, number, packing)
        )
    merged = dict(sorted((plan.placements | placements).items()))
    return Plan((*plan.sheets[:last], number), merged)


def _packings(
    job: NestingJob, queue: list[int], number: int, sheet: int
) -> Iterator[dict[int, Placement]]:
    """Yield packings of a sheet's pieces to one side; some may leave pieces out.

    The last ones are into ever less of its width, then of its height, as long as there is room.
    """
    for pull in _PULLS:
        yield fill_sheet(job, queue, number, sheet, pull=pull)
    container = job.containers[number]
    shapes = [job.shape(piece) for piece in queue]
    pieces_mm2 = sum(shape.area_mm2 for shape in shapes)
    for axis in (0, 1):
        size = list(container.size_mm)
        most, least = size[axis], pieces_mm2 / size[1 - axis]
        for _ in range(job.effort.halvings):
            size[axis] = (least + most) / 2.0
            part = replace(container, size_mm=(size[0], size[1]))
            packing: dict[int, Placement] = {}
            if all(fits_rectangle(shape, part) for shape in shapes):
                containers = (*job.containers[:number], part, *job.containers[number + 1 :])
                packing = fill_sheet(replace(job, containers=containers), queue, number, sheet)
                yield packing
            if len(packing) < len(queue):
                least = size[axis]
            else:
                most = size[axis]


def _cheaper(job: NestingJob, plan: Plan, queue: list[int]) -> list[int]:
    """Return the sheets in stock that cost less than the last one and may do, cheapest first."""
    price = job.stock[plan.sheets[-1]].price
    if price is None or job.stock[plan.sheets[-1]].offcut:
        return []
    shapes = [job.poses[piece].shape for piece in queue]
    area = sum(job.shapes[shape].area_mm2 for shape in shapes)
    cheaper: list[tuple[float, int]] = []
    for number, sheet in enumerate(job.stock):
        left = sheet.quantity is None or plan.sheets.count(number) < sheet.quantity
        cost = 0.0 if sheet.offcut else sheet.price
        room = area <= job.containers[number].open_mm2 and job.fits[shapes, number].all()
        if left and room and cost is not None and cost < price:
            cheaper.append((cost, number))
    return [number for _, number in sorted(cheaper)]


def _rest_mm2(job: NestingJob, number: int, placements: Mapping[int, Placement]) -> float:
    """Return the area of the largest rectangle in what pieces leave of a sheet of the stock."""
    outlines = []
    for piece, placement in placements.items():
        pose = job.poses[piece]
        # A shape's outline, back to the piece's own frame, and from there to the sheet.
        shifted = job.shapes[pose.shape].outline - np.array([pose.x_mm, pose.y_mm])
        outline = rotated(shifted, np.array([-pose.angle_deg]))[0]
        outlines.append(placement.apply(outline))
    rest = offcut_of(job.stock[number], 0, outlines, job.gap_mm)
    return 0.0 if rest is None else round(float(np.prod(rest.rectangle_mm)), 3)
