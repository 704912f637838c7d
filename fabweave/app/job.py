"""Hold a job: first as far as its pieces are known, then with all that is written."""

from collections.abc import Callable, Sequence

import numpy as np

from fabweave.app.colours import piece_colours, woven_colours
from fabweave.app.joined_pieces import chosen_fastening
from fabweave.app.settings import Settings
from fabweave.app.woven_object import WovenObject
from fabweave.assembly.order.planning import Order
from fabweave.core.arrays import IntArray, frozen_value
from fabweave.core.colour_space import Colours
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.labels.marks import Marks
from fabweave.flat.congruence import spare_pieces
from fabweave.flat.joint.holes import HoleRule
from fabweave.flat.piece import Piece
from fabweave.flat.pieces import PieceSet
from fabweave.flat.split.split_plan import SplitPlan
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.allotment import Allotment
from fabweave.nest.layout import Layout
from fabweave.nest.offcut import Offcut
from fabweave.report.comparison import GrainCost
from fabweave.report.costs.costs import Costs
from fabweave.report.verdict import Verdict, judge
from fabweave.ribbon.rules.finding import Finding
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


@frozen_value
class Job(PlannedJob):
    """Everything that a job makes, before it is written.

    Parameters
    ----------
    layout : Layout
        Where each piece lies on which sheet.
    allotment : Allotment
        Which supply every thread and sheet is of.
    offcuts : tuple of Offcut
        What is left of sheets and worth keeping, as it is drawn.
    holes : tuple of Finding
        Crossings without a hole.
    marks : tuple of Marks
        What is engraved on each piece.
    spare_marks : tuple of Marks
        What is engraved on each spare.
    engrave_seen_mm : float or None
        How much of that is seen when it is woven; None if it was not to be hidden.
    order : Order
        The order of assembly.
    portrait : callable
        Waits for the picture of the woven object, a PNG file, which may still be in the making.
    likeness : callable
        Waits for the picture of what the model lost where it was remeshed, a PNG file; None where
        it was not.
    drawings : tuple of SheetDrawing
        The nominal sheets.
    code : str
        What the QR code on the sheets says.
    kerfed : tuple of SheetDrawing
        The sheets with kerf and micro-joints; none where the others are to be cut as they are.
    costs : Costs
        Times and money: what waste.json, the manual and the terminal say.
    notes : tuple of str
        What a maker should know.
    grain_cost : GrainCost or None
        What it costs that pieces lie across the grain; None where they need not.
    rim_layout : Layout or None
        Where the pieces of rings lie, on sheets of their own; None without rings.
    rim_drawings : tuple of SheetDrawing
        These sheets.
    rim_kerfed : tuple of SheetDrawing
        The same with kerf and micro-joints; none where the others are to be cut as they are.
    given_mesh : PolyMesh or None
        A mesh that came from memory, and is kept in the job's folder.
    """

    layout: Layout
    allotment: Allotment
    offcuts: tuple[Offcut, ...]
    holes: tuple[Finding, ...]
    marks: tuple[Marks, ...]
    spare_marks: tuple[Marks, ...]
    engrave_seen_mm: float | None
    order: Order
    portrait: Callable[[], bytes]
    likeness: Callable[[], bytes | None]
    drawings: tuple[SheetDrawing, ...]
    code: str
    kerfed: tuple[SheetDrawing, ...]
    costs: Costs
    notes: tuple[str, ...]
    grain_cost: GrainCost | None = None
    rim_layout: Layout | None = None
    rim_drawings: tuple[SheetDrawing, ...] = ()
    rim_kerfed: tuple[SheetDrawing, ...] = ()
    given_mesh: PolyMesh | None = None

    @property
    def verdict(self) -> Verdict:
        """Whether it can be built, with all that is known of it."""
        unnamed = sum(
            any(missing.kind == "id" for missing in marks.dropped) for marks in self.marks
        )
        return self._judged(self.holes, unnamed)
