"""Nest pieces on sheets: greedy, largest first, where they touch most.

The sheets are filled one after another. On each, piece after piece is tried at every rotation and
every free position; it is put where it has the most contact, and slides to where the gap is exact.
A piece that does not fit is left for a later sheet, and so are those of nearly its size; smaller
ones fill up. Then whole sheets are emptied (`fewer_sheets`), as far as the effort goes. Very many
pieces are nested in batches. Everything is counted, never timed: same input, same settings and same
seed, same layout.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import FloatArray, Progress, no_progress
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.core.parallel.executors import Executors, finished, here
from fabweave.nest.container import container_of
from fabweave.nest.fits import fits_on, fits_rectangle
from fabweave.nest.item_shape import ItemShape, Pose, check_outlines, rotated, shapes_of
from fabweave.nest.layout import Effort, Layout, Placement, effort_named
from fabweave.nest.offcut import offcut_of
from fabweave.nest.place.fill import NestingJob, Plan, fill_sheet, kernel_cache
from fabweave.nest.place.greedy import greedy_plan, progress_text, require_all, require_fitting
from fabweave.nest.separate.fewer_sheets import fewer_sheets
from fabweave.stock.rotations import FREE, Rotations
from fabweave.stock.sheet_size import SheetSize, check_stock

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
BatchProgress = Callable[[Plan, int], None]


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
    job: NestingJob, seed: int, count: int, executors: Executors, progress: BatchProgress
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


#: How strongly pieces are drawn aside, in each try.
_PULLS = (1.0, 3.0)
#: A sheet with more pieces is not packed again, nor one that holds such a share of what another
#: holds, or that pieces cover so far, but at best effort: it has no rest to speak of.
_MOST_PACKED, _FULL, _COVERED = 120, 0.85, 0.3


def repack_last_sheet(job: NestingJob, plan: Plan) -> Plan:
    """Return the plan with its last sheet exchanged for a cheaper one, and packed to one side.

    The cheapest sheet in stock that takes all its pieces is taken. On it they are packed anew,
    drawn to the left more strongly; of these packings and the plan's own, the one whose rest holds
    the largest rectangle stays. At best effort, they are packed into parts of the sheet besides. At
    quick effort, and where it is about as full as others, or well covered, or holds very many
    pieces, a sheet is left as it is.

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
    # A packing that leaves a piece out is none: its first failure ends it.
    job = replace(job, effort=replace(job.effort, failures=1))
    for cheaper in _cheaper(job, plan, queue):
        packing = fill_sheet(job, queue, cheaper, last)
        if len(packing) == len(queue):
            number, placements = cheaper, packing
            break
    *others_mm2, last_mm2 = plan.areas_mm2(job)
    open_mm2 = job.containers[number].open_mm2
    most_mm2 = min(_FULL * max(others_mm2, default=math.inf), _COVERED * open_mm2)
    full = not job.effort.halvings and last_mm2 > most_mm2
    if job.effort.rounds and len(queue) <= _MOST_PACKED and not full:
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


def nest(
    outlines: Sequence[FloatArray],
    sheets: Sequence[SheetSize],
    *,
    margin_mm: float,
    gap_mm: float,
    effort: str | Effort = "normal",
    seed: int = 0,
    ids: Sequence[str] | None = None,
    rotations: Rotations = FREE,
    workers: int = -1,
    executors: Executors = here,
    progress: Progress = no_progress,
) -> Layout:
    """Place every piece on a sheet, the gap apart and the margin from the border.

    Parameters
    ----------
    outlines : sequence of (K, 2) float arrays
        Simple polygons, millimetres; they are turned and shifted, never mirrored.
    sheets : sequence of SheetSize
        The stock, in the order of preference.
    margin_mm : float
        Least distance of a piece from the border of its sheet.
    gap_mm : float
        Least distance between two pieces.
    effort : str or Effort
        ``quick``, ``normal`` or ``best``, or other counts.
    seed : int
        Another seed tries the pieces in a slightly different order; 0 is strictly by length.
    ids : sequence of str, optional
        What the pieces are called in messages; else their numbers.
    rotations : Rotations
        The angles at which pieces may stand, on each sheet from its grain on.
    workers : int
        Threads for the transforms, -1 for one for each core; does not change the layout.
    executors : callable
        Opens the executor that nests the batches of very many pieces; does not change the layout.
    progress : Progress
        Told how many pieces are placed.

    Returns
    -------
    Layout
        One placement for each piece, in the order given; sheets in the order of use.

    Raises
    ------
    InputError
        If an outline, the stock, the margin, the gap or the effort makes no sense.
    CannotMakeError
        If a piece fits on no sheet, or the sheets run out.

    References
    ----------
    Q. Cui, V. Rong, D. Chen, W. Matusik, "Dense, interlocking-free and scalable spectral packing
    of generic 3D objects", ACM Transactions on Graphics 42(4), 2023.

    Examples
    --------
    >>> import numpy as np
    >>> bar = np.array([[0.0, 0.0], [90.0, 0.0], [90.0, 10.0], [0.0, 10.0]])
    >>> layout = nest([bar] * 8, [SheetSize(100.0, 65.0)], margin_mm=5.0, gap_mm=2.0)
    >>> len(layout.sheets), sorted(p.sheet for p in layout.placements)
    (2, [0, 0, 0, 0, 1, 1, 1, 1])
    """
    outlines = [np.asarray(outline, dtype=np.float64) for outline in outlines]
    names = [str(number) for number in range(len(outlines))] if ids is None else list(ids)
    check_outlines(outlines, names)
    check_stock(sheets, margin_mm)
    if not (math.isfinite(gap_mm) and gap_mm >= 0.0):
        raise InputError(f"the gap is {gap_mm} mm; it must be zero or more")
    counts = effort_named(effort) if isinstance(effort, str) else effort
    shapes, poses = shapes_of(outlines, upright=rotations.step_deg is not None)
    containers = tuple(container_of(sheet, margin_mm, gap_mm, rotations) for sheet in sheets)
    job = NestingJob(
        shapes=shapes,
        poses=poses,
        names=names,
        stock=tuple(sheets),
        margin_mm=margin_mm,
        gap_mm=gap_mm,
        near_mm=_near_mm(shapes, poses, gap_mm),
        effort=counts,
        workers=workers,
        containers=containers,
        fits=fits_on(shapes, containers, gap_mm, counts),
    )
    require_fitting(job)
    plan: Plan | None = None
    notes: list[str] = []
    try:
        for better in _plans(job, seed, executors, progress):
            plan = better
        if plan is not None:
            plan = repack_last_sheet(job, plan)
    except KeyboardInterrupt:
        if plan is None:
            raise
        # The best plan so far is complete: it is kept.
        notes.append(
            f"nesting was cut short: the pieces are on {agree(len(plan.sheets), '{n} sheet[|s]')}; "
            "given more time it might need fewer, and the same settings may give another layout"
        )
    if plan is None:
        raise RuntimeError("nesting ended without a plan")
    return Layout(
        sheets=tuple(replace(sheets[number], quantity=1) for number in plan.sheets),
        placements=tuple(plan.placements[piece] for piece in range(len(outlines))),
        margin_mm=margin_mm,
        gap_mm=gap_mm,
        rotations=rotations,
        notes=tuple(notes),
        recorded=bool(notes),
    )


def _near_mm(shapes: Sequence[ItemShape], poses: Sequence[Pose], gap_mm: float) -> float:
    """Return within what distance neighbours count: the gap, and a piece's width on the mean."""
    widths = [shapes[pose.shape].area_mm2 / shapes[pose.shape].length_mm for pose in poses]
    return round(float(np.mean(widths)), 6) + gap_mm if widths else gap_mm


def _plans(job: NestingJob, seed: int, executors: Executors, progress: Progress) -> Iterator[Plan]:
    """Yield complete plans, each better than the one before."""
    pieces = len(job.poses)

    def placed(plan: Plan, done: int) -> None:
        progress(progress_text(job, plan, len(plan.sheets)), done, pieces)

    count = batch_count(job)
    if count > 1:
        yield from nest_in_batches(job, seed, count, executors, placed)
        return
    plan = greedy_plan(job, seed, progress)
    require_all(job, plan)
    yield plan

    def emptied(sheets: int, share: float) -> None:
        progress(progress_text(job, plan, sheets), round(share * pieces), pieces)

    # One thread: with more, sums are rounded otherwise, and these matrices are too small to gain
    # by it.
    with threadpool_limits(limits=1, user_api="blas"):
        for better in fewer_sheets(job, plan, seed, emptied):
            plan = better
            yield plan
            emptied(len(plan.sheets), 0.0)
