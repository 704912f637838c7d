"""Hold a job with all that is written, and draw its sheets."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.finding import Note
from fabweave.core.parallel.executors import Start, at_once
from fabweave.estimate.costs import Costs, job_costs
from fabweave.form.body import off_by
from fabweave.form.compensate import vertex_means
from fabweave.form.relaxed import shown_relaxed
from fabweave.form.settle import Form
from fabweave.former.plates import Former, Laid
from fabweave.former.sheets import with_room
from fabweave.former.way_out import let_out
from fabweave.job.former import former_of, former_on_sheets, told_steps
from fabweave.job.letting_go import LetGo, let_job_go
from fabweave.job.notes import job_notes
from fabweave.job.planned import PlannedJob, order_of
from fabweave.job.ribbon_report import hole_findings
from fabweave.mesh.one_rings import irregular_share
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.layout import Layout
from fabweave.nest.offcut import Offcut, usable_offcuts
from fabweave.options.file_kinds import LAYOUT_FILE
from fabweave.options.settings import Settings
from fabweave.piece.piece import find_owners
from fabweave.plan.allotment import Allotment, allot
from fabweave.plan.bill_of_materials import BillOfMaterials, bill_of_materials
from fabweave.plan.crossing_map import StepRecord
from fabweave.plan.grade import Grade, grade
from fabweave.plan.order import Order
from fabweave.plan.steps import build_steps
from fabweave.plan.verdict import FORCED, Verdict
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.sheet.base_board import WIRE_MM, BaseBoard, base_board
from fabweave.sheet.drawing import SheetDrawing
from fabweave.sheet.kerf import kerfed_sheets
from fabweave.sheet.labels.marks import Marks, mark_pieces, mark_spares, seen_mm
from fabweave.sheet.labels.texts import kind_name
from fabweave.sheet.rim_sheets import ring_sheets
from fabweave.sheet.sheets import draw_sheets
from fabweave.sheet.side_sheets import SideSheets
from fabweave.stock.hardware import sort_asked

#: Where a former stays inside by an order, so many are tried in all.
_ORDERS = 4


class SideWork(NamedTuple):
    """What is made while pieces are nested, as it does not depend on where they lie.

    Each waits for its result when it is called.
    """

    order: Callable[[], Order]
    form: Callable[[], LetGo | None]
    former: Callable[[], Former | None]


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
    holes : tuple of BrokenRule
        Crossings without a hole.
    marks : tuple of Marks
        What is engraved on each piece.
    spare_marks : tuple of Marks
        What is engraved on each spare.
    engrave_seen_mm : float or None
        How much of that is seen when it is woven; None if it was not to be hidden.
    order : Order
        The order of assembly.
    steps : tuple of StepRecord
        Of assembly, in that order.
    bill : BillOfMaterials
        What joins the pieces.
    drawings : tuple of SheetDrawing
        The nominal sheets.
    kerfed : tuple of SheetDrawing
        The sheets with kerf and micro-joints; none where the others are to be cut as they are.
    costs : Costs
        Times and money: what waste.json, the manual and the terminal say.
    notes : tuple of Note
        What a maker should know.
    beside : tuple of SideSheets
        What is cut beside the pieces, on sheets of its own: rings, and the plates of a former.
    laid : Laid or None
        The former, and how it comes out.
    former_steps : tuple of str
        How it is put together, used and taken out.
    given_mesh : PolyMesh or None
        A mesh that came from memory, and is kept in the job's folder.
    let_go : LetGo or None
        What becomes of it when it is let go; None where that would take minutes.
    base : BaseBoard or None
        The board that its feet are tied to.
    """

    layout: Layout
    allotment: Allotment
    offcuts: tuple[Offcut, ...]
    holes: tuple[BrokenRule, ...]
    marks: tuple[Marks, ...]
    spare_marks: tuple[Marks, ...]
    engrave_seen_mm: float | None
    order: Order
    steps: tuple[StepRecord, ...]
    bill: BillOfMaterials
    drawings: tuple[SheetDrawing, ...]
    kerfed: tuple[SheetDrawing, ...]
    costs: Costs
    notes: tuple[Note, ...]
    beside: tuple[SideSheets, ...] = ()
    laid: Laid | None = None
    former_steps: tuple[str, ...] = ()
    given_mesh: PolyMesh | None = None
    let_go: LetGo | None = None
    base: BaseBoard | None = None

    @property
    def form(self) -> Form | None:
        """What becomes of its form when it is let go; None where that is not known."""
        return None if self.let_go is None else self.let_go.settled.form

    @property
    def form_text(self) -> str:
        """What becomes of its form in words, and what fasteners would do; empty if not known."""
        form = self.form
        if form is None:
            return ""
        loose = not self.fasten.startswith(("form", "all")) and not form.keeps
        return form.text + ("; --fasten form may keep it nearer" if loose else "")

    @property
    def relaxed(self) -> Ribbons | None:
        """Its ribbons as pictures show them when it was let go; None where that is not known."""
        if self.let_go is None:
            return None
        settled = self.let_go.settled
        rest = settled.states["let go"] if self.woven.aim is None else settled.end
        return shown_relaxed(self.woven.ribbons, self.weave, settled.body, rest.state)

    @property
    def settled_mesh(self) -> PolyMesh | None:
        """The mesh as the object comes to rest on it; None where that is not known or not whole."""
        woven, form = self.woven, self.form
        whole = not (woven.source.openings or woven.source.n_old_vertices)
        if self.let_go is None or form is None or form.collapse or not whole:
            return None
        mesh = woven.wished
        off = off_by(self.let_go.settled.body, self.let_go.settled.end.state.bodies.origin)
        return mesh.with_vertices(mesh.vertices + vertex_means(woven) @ off)

    @property
    def shown(self) -> tuple[Ribbons, str]:
        """Its ribbons as its picture shows them, let go where that can be seen, and which it is."""
        form, thinnest_mm = self.form, min(one.thickness_mm for one in self.supplies.materials)
        seen = form is not None and max(form.settles_mm, form.moved_mm or 0.0) > thinnest_mm
        let_go = self.relaxed if seen else None
        return (self.woven.ribbons, "as drawn") if let_go is None else (let_go, "let go")

    @property
    def verdict(self) -> Verdict:
        """Whether it can be built, with all that is known of it."""
        unnamed = sum(
            any(missing.kind == "id" for missing in marks.dropped) for marks in self.marks
        )
        cure = "" if self.let_go is None else self.let_go.cure
        return self._judged(self.holes, unnamed, self.form, cure, former=self.laid is not None)

    @property
    def grade(self) -> Grade:
        """How good it is, out of 10."""
        return grade(
            self.piece_set.pieces, self.verdict, self.woven.source.likeness, self.form,
            irregular=irregular_share(self.woven.mesh),
        )  # fmt: skip


def start_side_work(
    planned: PlannedJob, asked: Settings, given: PolyMesh | None = None, start: Start = at_once
) -> SideWork:
    """Start the order of assembly, the search of a former, and let the object go.

    ``asked`` are the settings as they were asked for, and ``given`` a mesh from memory.
    """
    settings = planned.settings
    return SideWork(
        order=start(order_of, planned, settings.search.effort, settings.search.seed),
        form=start(let_job_go, planned, asked, given),
        former=start(former_of, planned),
    )


def _let_out(planned: PlannedJob, former: Former, order: Order) -> tuple[Order, Laid]:
    """Return an order by which a former comes out, and its way; that order if none is found."""
    pieces, search = planned.piece_set.pieces, planned.settings.search
    first = let_out(former, planned.woven, pieces, order)
    for number in range(1, _ORDERS if first.way is None else 1):
        other = order_of(planned, search.effort, search.seed + number)
        laid = let_out(former, planned.woven, pieces, other)
        if laid.way is not None:
            return other, laid
    return order, first


def draw_job(
    planned: PlannedJob,
    layout: Layout,
    side: SideWork,
    progress: Progress = no_progress,
    given_mesh: PolyMesh | None = None,
) -> Job:
    """Draw the sheets of a job, and say what a maker should know about it.

    Raises
    ------
    CannotMakeError
        If a drawing would be cut wrongly, as where the kerf is wider than a slot.
    """
    settings, pieces, to_cut = planned.settings, planned.piece_set, planned.to_cut
    allotment = allot(planned.supplies, planned.woven.bunches, layout, to_cut)
    if layout.recorded:
        settings = settings.but(layout=LAYOUT_FILE)
    former, order, laid = side.former(), side.order(), None
    if former is not None:
        order, laid = _let_out(planned, former, order)
        laid = with_room(laid, pieces.pieces)
    hardware = sort_asked(settings.pieces.fastener)
    steps = build_steps(pieces, order, hardware)
    progress("marks", 0, 1)
    marks = mark_pieces(
        pieces.pieces,
        planned.weave.threads.n_crossings,
        settings.pieces.labels,
        settings.pieces.label_side,
        pieces.kinds,
        {name: step.step for step in steps for name in step.pieces},
        least_mm=settings.machine.letters_mm,
    )
    spare_marks = mark_spares(
        to_cut[len(marks) :],
        [marks[at] for at in planned.spared.tolist()],
        settings.pieces.labels,
        settings.pieces.label_side,
    )
    progress("drawings", 0, 1)
    offcuts = usable_offcuts(layout, [piece.outline for piece in to_cut])
    if planned.mirrored:
        widths = [layout.sheets[offcut.sheet].width_mm for offcut in offcuts]
        offcuts = tuple(map(Offcut.mirrored, offcuts, widths))
    drawings = draw_sheets(
        to_cut,
        (*marks, *spare_marks),
        layout,
        title=planned.woven.title,
        captions=allotment.captions(),
        mirrored=planned.mirrored,
        names=[kind_name(kind) for kind in planned.kinds[planned.origins].tolist()]
        if settings.pieces.labels == "kinds"
        else (),
        offcuts=offcuts,
        cool=settings.machine.cut_order == "cool",
        warnings=[
            *([FORCED] if planned.verdict.forced else []),
            *(
                ["S1, S2 ... AFTER AN ID: A SPARE OF THAT KIND"]
                if spare_marks and settings.pieces.labels not in ("kinds", "none")
                else []
            ),
        ],
    )
    machine = settings.machine
    kerfed = kerfed_sheets(
        drawings, machine.kerf_mm, machine.micro_joints, common=settings.common_cuts
    )
    woven = planned.woven
    hidden = settings.pieces.labels in ("hidden", "kinds") and not planned.mirrored
    seen = seen_mm(pieces.pieces, marks) if hidden else None
    told = told_steps(planned, laid, order)
    rim = ring_sheets(pieces.rings, planned.supplies, machine, woven.title)
    plates = former_on_sheets(planned, laid, told)
    beside = tuple(sheets for sheets in (rim, plates) if sheets is not None)
    bill = bill_of_materials(pieces, hardware, order)
    let_go = side.form()
    return Job(
        **{**vars(planned), "settings": settings},
        layout=layout,
        allotment=allotment,
        offcuts=offcuts,
        holes=tuple(hole_findings(planned)),
        marks=marks,
        spare_marks=spare_marks,
        engrave_seen_mm=seen,
        order=order,
        steps=tuple(steps),
        bill=bill,
        let_go=let_go,
        drawings=drawings,
        kerfed=kerfed,
        costs=job_costs(
            pieces,
            kerfed if settings.common_cuts else drawings,
            layout.sheets,
            allotment.sheet_materials,
            steps,
            bill,
            beside=beside,
            calibration=settings.machine.calibrate,
        ),
        notes=(
            *job_notes(
                planned,
                layout,
                marks,
                order,
                steps,
                bill,
                drawings,
                kerfed,
                seen,
                [drawing for sheets in beside for drawing in sheets.drawings],
                laid,
            ),
            *(let_go.notes(planned, order.order) if let_go is not None else ()),
        ),
        beside=beside,
        laid=laid,
        former_steps=tuple(told),
        given_mesh=given_mesh,
        base=_base_of(planned),
    )


def _base_of(planned: PlannedJob) -> BaseBoard | None:
    """Return the board that the feet of a job's object are tied to, if one is asked for."""
    pieces, woven = planned.piece_set, planned.woven
    if not pieces.tied or pieces.hanging is None:
        return None
    feet = np.flatnonzero(pieces.hanging)
    owners = find_owners(pieces.pieces, len(pieces.hanging)).piece[feet]
    names = [" ".join(pieces.pieces[at].id for at in own[::-1]) for own in owners.tolist()]
    places = woven.ribbons.centre if woven.aim is None else woven.aim.places
    places = places - (0.0, 0.0, woven.wished.vertices[:, 2].min())
    hole_mm = max((rule.hole_mm for rule in pieces.rules), default=WIRE_MM)
    return base_board(names, places[feet], woven.ribbons.normal[feet], hole_mm)
