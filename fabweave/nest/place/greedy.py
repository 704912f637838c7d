"""Place pieces greedily: sheets are filled one after another, largest pieces first."""

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.nest.layout import Placement
from fabweave.nest.next_sheet import next_sheet
from fabweave.nest.place.fill import NestingJob, Plan, fill_sheet
from fabweave.nest.refusal import out_of_sheets_message, too_large_message

#: How much a seed may change the length by which pieces are ordered, as a share.
_JITTER = 0.05


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
        Without a placement for the pieces that the stock has no sheet left for.
    """
    queue = _ordered(job, seed)
    placements: dict[int, Placement] = {}
    sheets: list[int] = []
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
        raise CannotMakeError(too_large_message(job, stranded))


def require_all(job: NestingJob, plan: Plan) -> None:
    """Raise CannotMakeError if the sheets ran out before every piece had a place."""
    queue = [piece for piece in _ordered(job, 0) if piece not in plan.placements]
    if queue:
        raise CannotMakeError(out_of_sheets_message(job, queue, plan.sheets))
