"""Plan a job: from ribbons as wide as asked to pieces, and to their places on sheets."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.app.colours import piece_colours, woven_colours
from fabweave.app.joined_object import check_joined, split_object, try_refinement
from fabweave.app.joined_pieces import chosen_fastening, joined_pieces, with_grain
from fabweave.app.nest_job import nest_pieces
from fabweave.app.request import chosen_grain, hole_rules
from fabweave.app.settings import Settings
from fabweave.app.woven_object import WovenObject
from fabweave.core.arrays import IntArray, Progress, frozen_value, no_progress
from fabweave.core.colour_space import Colours
from fabweave.core.parallel.executors import (
    Executors,
    here,
)
from fabweave.flat.congruence import spare_pieces, spared
from fabweave.flat.joint.holes import HoleRule
from fabweave.flat.piece import Piece
from fabweave.flat.pieces import PieceSet
from fabweave.flat.split.split_plan import SplitPlan
from fabweave.nest.layout import Layout
from fabweave.report.verdict import NotMakeableError, Verdict, judge
from fabweave.ribbon.rules.finding import Finding
from fabweave.ribbon.rules.remedy import Depth
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
        return chosen_fastening(self.settings)

    @property
    def colours(self) -> Colours:
        """The colours of all passes, as they come and as they leave, (P, 2, 3)."""
        return woven_colours(self.woven, self.settings, self.supplies, self.piece_set.pieces)

    @property
    def piece_colours(self) -> Colours:
        """The one colour in which each piece is shown flat."""
        return piece_colours(self.weave, self.piece_set.pieces, self.colours)

    @property
    def verdict(self) -> Verdict:
        """Whether it can be built."""
        return self._judged((), 0)

    def _judged(self, holes: Sequence[Finding], unnamed: int) -> Verdict:
        """Return the verdict with what is known of holes and labels."""
        return judge(
            (*self.check.findings, *holes),
            narrowest_mm=float(self.check.measured["width"].value.min(initial=np.inf)),
            bodies=count_bodies(self.weave.threads),
            left_out=self.woven.source.left_out,
            unnamed=unnamed,
            forced=self.settings.force,
        )

    @property
    def mirrored(self) -> bool:
        """Whether sheets are drawn mirrored, since the inside is engraved."""
        return self.settings.label_side == "inside"


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
    settings, supplies = chosen_grain(woven.ribbons, woven.bunches, settings, supplies)
    settings = replace(settings, up=settings.up or woven.source.up)
    rules = hole_rules(settings, supplies)
    joined = split_object(woven, settings, supplies, rules, progress)
    woven = joined.woven
    progress("checks", 0, 1)
    check = check_joined(woven, settings, supplies, joined.repeats, depth)
    if depth == Depth.SEARCHED:
        check = try_refinement(check, woven, settings, supplies)
    pieces = joined_pieces(joined, settings, supplies, rules)
    check = with_grain(check, joined, pieces.pieces, settings)
    spares = spared(pieces.kinds.number, settings.spares)
    planned = PlannedJob(settings, supplies, rules, woven, check, joined.plan, pieces, spares)
    if planned.verdict.stops and not settings.force:
        raise NotMakeableError(planned.verdict)
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
        pieces, planned.settings, planned.supplies, planned.woven.bunches, executors, progress
    )
