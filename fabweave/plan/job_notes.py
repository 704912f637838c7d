"""Gather what a maker should know about a job, in the order in which it arises."""

from collections.abc import Sequence

from fabweave.core.messages import agree
from fabweave.nest.layout import Layout
from fabweave.piece.grain import grain_notes
from fabweave.piece.pieces import PieceSet
from fabweave.piece.split.length_curve import splitting_reason
from fabweave.plan.extent import extent_notes
from fabweave.plan.notes import all_notes, fastening_notes, hanging_notes
from fabweave.plan.order.planning import Order
from fabweave.plan.planned_job import PlannedJob
from fabweave.plan.ribbon_report import ribbon_notes
from fabweave.plan.steps import build_steps, order_note
from fabweave.ribbon.lay import width_notes
from fabweave.sheet.drawing import SheetDrawing
from fabweave.sheet.kerf import kerf_notes
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.qr_code import code_notes
from fabweave.sheet.rim_sheets import rim_notes
from fabweave.stock.rotations import parse_rotations

#: What is moved by less than this is as it was.
_TOLD_MM = 1e-3


def job_notes(
    planned: PlannedJob,
    layout: Layout,
    marks: Sequence[Marks],
    order: Order,
    drawings: Sequence[SheetDrawing],
    kerfed: Sequence[SheetDrawing],
    seen_mm: float | None = None,
) -> tuple[str, ...]:
    """Return the notes on mesh, weave, ribbons, pieces, order, layout and drawings of a job."""
    settings, woven, pieces = planned.settings, planned.woven, planned.piece_set
    steps = build_steps(pieces, order)
    plan = planned.split_plan
    reason = splitting_reason(plan.chosen.record(), plan.prefer, len(plan.choices))
    return (
        *woven.source.notes,
        *woven.result.notes,
        *fastening_notes(planned.fasten, settings.pieces.fasten, pieces),
        *all_notes(
            woven.mesh,
            woven.weave,
            woven.ribbons,
            pieces,
            marks,
            planned.rules,
            seen_mm=seen_mm,
            hardware=settings.pieces.hardware,
        ),
        *rim_notes(pieces.rings),
        *hanging_notes(pieces, woven.weave, woven.labels),
        f"pieces: {reason}",
        *_fit_notes(pieces),
        *_spare_notes(planned),
        *width_notes(woven, settings.ribbons, planned.supplies),
        *ribbon_notes(planned.check, planned.supplies.materials),
        *grain_notes(
            woven.ribbons,
            planned.check.limits,
            planned.supplies.materials,
            parse_rotations(settings.stock.rotations),
        ),
        order_note(order, steps),
        *layout.notes,
        *(code_notes(drawings) if settings.machine.qr != "none" else ()),
        *kerf_notes(
            kerfed,
            settings.machine.kerf_mm,
            settings.machine.micro_joints,
            service=settings.machine.profile == "service",
        ),
        *extent_notes(woven.weave.threads.n_crossings, len(steps)),
    )


def _fit_notes(pieces: PieceSet) -> tuple[str, ...]:
    """Say how far pieces were moved to be equal to others, if it was more than rounding."""
    fitted = pieces.fitted_mm[pieces.fitted_mm > _TOLD_MM]
    if not len(fitted):
        return ()
    note = agree(
        len(fitted), "kinds: {n} [piece was|pieces were] made equal to others, from which "
    )
    return (
        note + agree(len(fitted), "[it differs|they differ]") + f" by up to {fitted.max():.3f} mm: "
        "less than the play of fasteners in their holes",
    )


def _spare_notes(planned: PlannedJob) -> tuple[str, ...]:
    """Say how many spares there are, and how they are told from the pieces."""
    spares, kinds = len(planned.spared), planned.piece_set.kinds.count
    if not spares:
        return ()
    some = planned.to_cut[-spares].id
    note = agree(spares, "spares: {n} [piece is|pieces are] cut besides, ")
    note += (
        f"for {agree(kinds, '{n} kind[|s]')} ({planned.settings.pieces.spares}); {some} is a spare "
    )
    note += "of " + some[: some.rindex("S")] + ", and of all pieces of its kind"
    if 2 * spares > len(planned.kinds) and planned.settings.pieces.kinds != "fewest":
        note += ". Few pieces repeat: --kinds fewest may ask for fewer spares"
    return (note,)
