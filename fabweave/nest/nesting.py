"""Nest pieces on sheets: greedy, largest first, where they touch most.

The sheets are filled one after another. On each, piece after piece is tried at every rotation and
every free position; it is put where it has the most contact, and slides to where the gap is exact.
A piece that does not fit is left for a later sheet, and so are those of nearly its size; smaller
ones fill up. Then whole sheets are emptied (`fewer_sheets`), as far as the effort goes. Very many
pieces are nested in batches. Everything is counted, never timed: same input, same settings and same
seed, same layout.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import FloatArray, Progress, no_progress
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.core.parallel.executors import Executors, here
from fabweave.nest.batches import batch_count, nest_in_batches
from fabweave.nest.container import container_of
from fabweave.nest.effort import Effort, effort_named
from fabweave.nest.fits import fits_on
from fabweave.nest.item_shape import ItemShape, Pose, check_outlines, shapes_of
from fabweave.nest.last_sheet import repack_last_sheet
from fabweave.nest.layout import Layout
from fabweave.nest.place.fill import NestingJob, Plan
from fabweave.nest.place.greedy import (
    greedy_plan,
    progress_text,
    require_all,
    require_fitting,
)
from fabweave.nest.separate.fewer_sheets import fewer_sheets
from fabweave.stock.rotations import FREE, Rotations
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.sheet_text import check_stock


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
