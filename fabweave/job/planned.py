"""Plan a job: from ribbons as wide as asked to pieces, and to their places on sheets."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fabweave.core.arrays import IntArray, Progress, frozen_value, no_progress
from fabweave.core.colour_space import Colours
from fabweave.core.parallel.executors import Executors, here
from fabweave.estimate.costs import Costs, pieces_costs
from fabweave.form.hold import form_hold
from fabweave.form.settle import Form
from fabweave.job.ask import brief_of, settle_grain, try_refinement
from fabweave.nest.layout import Layout
from fabweave.options.settings import Settings
from fabweave.piece.congruence import spare_pieces, spared
from fabweave.piece.cut_up import joined_pieces, with_grain
from fabweave.piece.joined_strands import check_joined, split_object
from fabweave.piece.joint.holes import HoleRule
from fabweave.piece.piece import Piece
from fabweave.piece.pieces import PieceSet
from fabweave.piece.split.length_curve import SplitPlan
from fabweave.plan.colours import piece_colours, woven_colours
from fabweave.plan.nest_pieces import nest_pieces
from fabweave.plan.verdict import NotMakeableError, Verdict, judge
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.ribbon.rules.remedy import FEW, Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.supplies import Supplies
from fabweave.weave.bunches import count_bodies
from fabweave.weave.pattern import Weave


@frozen_value
class PlannedJob:
    """A job whose pieces are known, but not where they lie on sheets.

    Parameters
    ----------
    settings : Settings
        Complete: what was left to fabweave is filled in.
    supplies : Supplies
        What each bunch is cut from.
    rules : tuple of HoleRule
        The holes that were considered, the largest first.
    woven : WovenObject
        With ribbons as they are cut, laps included.
    check : RibbonCheck
        Where ribbons break the rules of their material, and what would mend it.
    split_plan : SplitPlan
        Where threads are cut.
    piece_set : PieceSet
        Pieces, joints and holes.
    spared : (S,) int array
        Which pieces are cut once more, as spares: the first of their kinds.
    """

    settings: Settings
    supplies: Supplies
    rules: tuple[HoleRule, ...]
    woven: WovenObject
    check: RibbonCheck
    split_plan: SplitPlan
    piece_set: PieceSet
    spared: IntArray

    @property
    def kinds(self) -> IntArray:
        """Which kind each piece is of, from 1: congruent pieces of one material are of one."""
        return self.piece_set.kinds.number

    @property
    def to_cut(self) -> tuple[Piece, ...]:
        """All that is cut: the pieces of the object, then the spares."""
        pieces = self.piece_set.pieces
        return (*pieces, *spare_pieces(pieces, self.spared))

    @property
    def origins(self) -> IntArray:
        """Of all that is cut, which piece of the object each is, or is a spare of."""
        return np.append(np.arange(len(self.kinds)), self.spared)

    @property
    def weave(self) -> Weave:
        """The weave."""
        return self.woven.weave

    @property
    def fasten(self) -> str:
        """Which crossings take a fastener, as ``--fasten`` says it."""
        return brief_of(self.settings, self.supplies).fasten

    @property
    def colours(self) -> Colours:
        """The colours of all passes, as they come and as they leave, (P, 2, 3)."""
        return woven_colours(
            self.woven, self.settings.pieces.colours, self.supplies, self.piece_set.pieces
        )

    @property
    def piece_colours(self) -> Colours:
        """The one colour in which each piece is shown flat."""
        return piece_colours(self.weave, self.piece_set.pieces, self.colours)

    @property
    def verdict(self) -> Verdict:
        """Whether it can be built."""
        return self._judged((), 0)

    def _judged(
        self,
        holes: Sequence[BrokenRule],
        unnamed: int,
        form: Form | None = None,
        cure: str = "",
        *,
        former: bool = False,
    ) -> Verdict:
        """Return the verdict with what is known of holes, labels, form, and what it lies on."""
        return judge(
            (*self.check.findings, *holes),
            narrowest_mm=float(self.check.measured["width"].value.min(initial=np.inf)),
            bodies=count_bodies(self.weave.threads),
            left_out=self.woven.source.left_out,
            unnamed=unnamed,
            form=form,
            cure=cure,
            former=former,
            forced=self.settings.pieces.force,
        )

    @property
    def mirrored(self) -> bool:
        """Whether sheets are drawn mirrored, since the inside is engraved."""
        return self.settings.pieces.mirrored


def plan_job(
    woven: WovenObject,
    settings: Settings,
    supplies: Supplies,
    progress: Progress = no_progress,
    *,
    depth: Depth = Depth.SEARCHED,
) -> PlannedJob:
    """Split threads, lay their ribbons with room for the laps, check them, and build the pieces.

    Parameters
    ----------
    woven : WovenObject
        With ribbons as wide as asked, from :func:`lay_object`.
    settings : Settings
        Complete.
    supplies : Supplies
    progress : callable
    depth : Depth
        How far ribbons are checked: remedies are looked for only at the greatest.

    Raises
    ------
    InputError, CannotMakeError
        As for :func:`make_job`; ``NotMakeableError`` if it cannot be built, and is not forced.
    """
    settings, supplies = settle_grain(woven, settings, supplies)
    settings = settings.but(up=settings.mesh.up or woven.source.up)
    brief = brief_of(settings, supplies)
    joined = split_object(woven, brief, progress)
    woven = joined.woven
    progress("checks", 0, 1)
    pieces = joined_pieces(joined, brief, form_hold(joined, brief, closely=depth == Depth.SEARCHED))
    spares = spared(pieces.kinds.number, settings.pieces.spares)

    def checked(depth: Depth) -> PlannedJob:
        check = check_joined(woven, brief, joined.repeats, depth)
        if depth == Depth.SEARCHED and not woven.straight:
            check = try_refinement(check, woven, settings, supplies)
        check = with_grain(check, joined, pieces.pieces, supplies.rotations)
        return PlannedJob(
            settings, supplies, brief.rules, woven, check, joined.plan, pieces, spares
        )

    # What would help takes long to find on a large object: it is looked for where it is refused.
    many = woven.weave.threads.n_crossings > FEW and depth == Depth.SEARCHED
    planned = checked(Depth.NEAR if many else depth)
    if planned.verdict.stops and not settings.pieces.force:
        raise NotMakeableError((checked(depth) if many else planned).verdict)
    return planned


def nest_job(
    planned: PlannedJob, progress: Progress = no_progress, executors: Executors = here
) -> Layout:
    """Nest the pieces of a job on its stock, each material on its own sheets.

    Raises
    ------
    InputError
        If a layout that was given cannot be taken.
    CannotMakeError
        If a piece fits no sheet, or sheets run out.
    """
    pieces = planned.to_cut
    progress("nesting", 0, len(pieces))
    return nest_pieces(
        pieces,
        planned.supplies,
        planned.woven.bunches,
        planned.settings.search,
        executors,
        progress,
    )


def recorded_layout(planned: PlannedJob, crossing_map: Path) -> Layout:
    """Return the layout of a finished job as its crossing map has it, without nesting.

    Raises
    ------
    InputError
        If the map is of other pieces, or its layout breaks a rule.
    """
    kept = replace(planned.settings.search, layout=str(crossing_map))
    layout = nest_pieces(planned.to_cut, planned.supplies, planned.woven.bunches, kept)
    return replace(layout, recorded=planned.settings.search.layout is not None)


def planned_costs(planned: PlannedJob) -> Costs:
    """Return what a job will cost that is planned, but not nested."""
    return pieces_costs(
        planned.piece_set,
        planned.woven,
        planned.settings.pieces,
        planned.supplies,
        planned.settings.machine.calibrate,
        common=planned.settings.common_cuts,
    )
