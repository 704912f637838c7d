"""Hold a job: first as far as its pieces are known, then with all that is written."""

from collections.abc import Callable

from fabweave.app.planned_job import PlannedJob
from fabweave.assembly.order.planning import Order
from fabweave.core.arrays import frozen_value
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.labels.marks import Marks
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.allotment import Allotment
from fabweave.nest.layout import Layout
from fabweave.nest.offcut import Offcut
from fabweave.report.comparison import GrainCost
from fabweave.report.costs.costs import Costs
from fabweave.report.verdict import Verdict
from fabweave.ribbon.rules.finding import Finding


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
