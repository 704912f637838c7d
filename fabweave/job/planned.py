"""Plan a job: from ribbons as wide as asked to pieces, and to their places on sheets."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.colour_space import Colours
from fabweave.form.compensate import Begun
from fabweave.form.settle import Form
from fabweave.job.ask import brief_of
from fabweave.options.settings import Settings
from fabweave.piece.congruence import spare_pieces
from fabweave.piece.joint.holes import HoleRule
from fabweave.piece.piece import Piece
from fabweave.piece.pieces import PieceSet
from fabweave.piece.split.length_curve import SplitPlan
from fabweave.plan.colours import piece_colours, woven_colours
from fabweave.plan.order import Order, plan_order
from fabweave.plan.verdict import Verdict, judge
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.broken_rule import BrokenRule
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
    begun : Begun or None
        How far it came to rest, where it is cut to settle onto its mesh.
    """

    settings: Settings
    supplies: Supplies
    rules: tuple[HoleRule, ...]
    woven: WovenObject
    check: RibbonCheck
    split_plan: SplitPlan
    piece_set: PieceSet
    spared: IntArray
    begun: Begun | None

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


def order_of(planned: PlannedJob, effort: str, seed: int) -> Order:
    """Find an order in which the pieces of a job are put together."""
    woven, pieces = planned.woven, planned.piece_set
    return plan_order(
        pieces.pieces,
        woven.ribbons.centre,
        woven.ribbons.normal,
        pieces.fastened,
        enclosed=bool(np.all(woven.halfedges.twin >= 0)),
        effort=effort,
        seed=seed,
        begin=_first_gap(woven) if woven.straight else None,
    )


def _first_gap(woven: WovenObject) -> FloatArray | None:
    """Return where straight strips begin: at the lowest of the gaps with the fewest sides.

    That is a pentagon on a ball of triangles, as basket makers begin.
    """
    halfedges, vertices = woven.halfedges, woven.mesh.vertices
    sides = np.bincount(halfedges.tail, minlength=len(vertices))
    rim = halfedges.twin < 0
    sides[np.concatenate((halfedges.tail[rim], halfedges.head[rim]))] = 0
    inside = np.flatnonzero(sides)
    if not len(inside):
        return None
    fewest = inside[sides[inside] == sides[inside].min()]
    return np.asarray(vertices[fewest[np.argmin(np.round(vertices[fewest, 2], 6))]])
