"""Plan the pieces of a job: where threads are cut, and what other lengths would come to."""

import math
from collections.abc import Sequence

import numpy as np

from fabweave.app.settings import Settings
from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.core.errors import CannotMakeError
from fabweave.flat.joint.holes import WANTED_SHARE, HoleRule
from fabweave.flat.joint.planning import lap_beyond
from fabweave.flat.split.candidate_costs import Bed, list_candidates
from fabweave.flat.split.length_curve import LENGTHS, compare_lengths, knee
from fabweave.flat.split.runs import Runs
from fabweave.flat.split.split_plan import SplitPlan
from fabweave.flat.split.splitting import choose_runs
from fabweave.nest.container import Container, clear_rectangle, container_of
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.item_shape import shape_of
from fabweave.ribbon.measures import ribbon_widths, thread_lengths
from fabweave.ribbon.project import Ribbons
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.supplies import Supplies
from fabweave.weave.pattern import Weave

#: The shortest of the lengths that are compared, in crossings.
_FEW_CROSSINGS = 6


def plan_pieces(
    ribbons: Ribbons,
    weave: Weave,
    labels: tuple[str, ...],
    settings: Settings,
    rules: Sequence[HoleRule],
    supplies: Supplies,
    barred: Runs | None = None,
) -> SplitPlan:
    """Split ribbons so that every piece fits the stock, at the least predicted cost.

    Without a greatest length in the settings, the one at the knee of the curve of sheet area over
    joints is taken; threads that cannot be cut so short get longer pieces.

    Parameters
    ----------
    ribbons, weave, labels
        The ribbons, who is on top, and the names of the threads.
    settings : Settings
        Complete settings.
    rules : sequence of HoleRule
        The holes that joints may have, the preferred first.
    supplies : Supplies
        What it is cut from; with several materials, every piece fits the stock of each.
    barred : Runs, optional
        Stretches that no piece may carry all of.

    Raises
    ------
    CannotMakeError
        If a thread cannot be cut as asked.
    """
    # Long laps go on beyond the panels with which the pieces end that are measured here.
    beyond = lap_beyond(ribbons, settings.lap_mm)
    margin = settings.margin_mm + beyond
    rotations = parse_rotations(settings.rotations)
    # Pieces are planned for rectangles; nesting may find more room beside a defect.
    clear = [
        [
            Container(clear_rectangle(area, supply.gap_mm), None, area.rotations)
            for area in (
                container_of(sheet, margin, supply.gap_mm, rotations)
                for sheet in settings.as_nested(supply.sheets)
            )
        ]
        for supply in supplies.each
    ]

    def fits(outline: FloatArray) -> bool:
        # A piece lies along its least rectangle.
        shape = shape_of(outline)[0]
        return all(any(fits_rectangle(shape, area) for area in areas) for areas in clear)

    sides = [max(max(area.size_mm) for area in areas) for areas in clear]
    if not min(sides) > 0.0:
        raise CannotMakeError(
            "between margin and defects, the sheets have no free rectangle for any piece; use a "
            "smaller margin or another sheet"
        )
    # Where angles are few, or sheets of several materials differ, each piece must be asked for.
    easy = rotations.step_deg is None and not supplies.several
    largest = [max((area.size_mm for area in areas), key=math.prod) for areas in clear]
    bed = Bed(
        fits,
        tuple(area.size_mm for area in clear[0]) if easy else (),
        supplies.gap_mm,
        min(largest, key=math.prod),
    )
    side = min(sides)
    pitch = float(thread_lengths(ribbons).sum()) / max(len(ribbons.entry), 1)
    max_length = settings.max_length_mm
    every = np.arange(weave.threads.n_threads)
    candidates = list_candidates(
        ribbons, weave, bed, max(side, max_length or 0.0), every, barred=barred
    )
    choices = compare_lengths(
        candidates, bed, np.geomspace(min(_FEW_CROSSINGS * pitch, side), side, LENGTHS).tolist()
    )
    if max_length is not None:
        length = limit = max_length - 2 * beyond
    else:
        length, limit = knee(choices).length_mm if choices else side, np.inf
    room = room_for_joints(ribbons, weave, rules)
    runs = choose_runs(candidates, weave, bed, labels, length, limit, room)
    return SplitPlan(runs, max_length or length, choices)


def room_for_joints(ribbons: Ribbons, weave: Weave, rules: Sequence[HoleRule]) -> BoolArray | None:
    """Return at which crossings both ribbons are wide enough for a joint's hole, (X,).

    That hole is the largest for which nine crossings of ten are; None if no holes are wanted.
    """
    if not rules:
        return None
    width = ribbon_widths(ribbons)
    half = (width[ribbons.entry] + width[ribbons.entry + 1]) / 4
    room = np.full(weave.threads.n_crossings, np.inf)
    np.minimum.at(room, weave.threads.crossing, half)
    wide = [room >= rule.edge_mm for rule in rules]
    return next((roomy for roomy in wide if roomy.mean() >= WANTED_SHARE), wide[-1])
