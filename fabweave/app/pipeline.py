"""Run a job: from a mesh to the plan of everything that is cut."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fabweave.app.joined_object import check_made, hole_rules, lay_job
from fabweave.app.nest_job import lay_out
from fabweave.app.options.file_kinds import LAYOUT_FILE
from fabweave.app.refinement_remedy import try_refinement
from fabweave.app.remake_command import command_text, usual_settings
from fabweave.app.settings import Settings
from fabweave.app.woven_object import (
    WovenObject,
    width_notes,
)
from fabweave.assembly.order.planning import Order, plan_order
from fabweave.assembly.steps import build_steps, order_note
from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.colour_space import Colours
from fabweave.core.parallel.executors import Executors, here
from fabweave.core.parallel.workers import Start, at_once
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.kerfed_sheets import check_kerf, ready_notes, ready_sheets
from fabweave.cut.labels.marks import Marks, mark_pieces
from fabweave.cut.notes.qr_code import code_notes, with_code
from fabweave.cut.sheets import draw_sheets
from fabweave.flat.pieces import PieceSet, build_pieces
from fabweave.flat.split.split_plan import SplitPlan
from fabweave.nest.allotment import Allotment, allot
from fabweave.nest.layout import Layout
from fabweave.nest.offcut import Offcut, usable_offcuts
from fabweave.picture.portrait import portrait_png
from fabweave.picture.thread_colours import thread_colours
from fabweave.report.notes import all_notes
from fabweave.report.ribbon_report import hole_findings, ribbon_notes
from fabweave.ribbon.rules.finding import Finding
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.per_bunch import by_bunch
from fabweave.stock.supplies import Supplies
from fabweave.stock.supply_plan import parse_materials, plan_supplies
from fabweave.weave.pattern import Weave


@frozen_value
class Job:
    """Everything that a job makes, before it is written."""

    settings: Settings
    #: What each bunch is cut from.
    supplies: Supplies
    woven: WovenObject
    check: RibbonCheck
    plan: SplitPlan
    piece_set: PieceSet
    holes: tuple[Finding, ...]
    marks: tuple[Marks, ...]
    layout: Layout
    #: What is left of sheets and worth keeping, as it is drawn.
    offcuts: tuple[Offcut, ...]
    #: Which supply every thread and sheet is of.
    allotment: Allotment
    order: Order
    #: Waits for the picture of the woven object, a PNG file, which may still be in the making.
    portrait: Callable[[], bytes]
    drawings: tuple[SheetDrawing, ...]
    #: What the sheets' QR code says.
    code: str
    #: The sheets with kerf and micro-joints; none where the others are to be cut as they are.
    ready: tuple[SheetDrawing, ...]
    notes: tuple[str, ...]

    @property
    def weave(self) -> Weave:
        """The weave."""
        return self.woven.weave

    @property
    def colours(self) -> Colours:
        """The colour of each thread."""
        return thread_colours(self.woven.bunches, self.settings.colours)


def make_job(
    settings: Settings,
    progress: Progress = no_progress,
    *,
    start: Start = at_once,
    executors: Executors = here,
) -> Job:
    """Make everything that a job writes: weave, ribbons, pieces, layout and drawings.

    Parameters
    ----------
    settings : Settings
    progress : callable
        Told what is being done.
    start : callable
        How to start work beside this process, from ``side_workers``; changes no result.
    executors : callable
        Opens the executor that nests very many pieces; changes no result.

    Returns
    -------
    Job
        Its settings are complete: what was left to fabweave is filled in.

    Raises
    ------
    InputError
        For bad input or settings.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.
    """
    settings, supplies = complete_settings(settings)
    rules = hole_rules(settings, supplies)
    laid = lay_job(settings, supplies, rules, progress)
    woven, plan, weave = laid.woven, laid.plan, laid.woven.weave
    progress("checks", 0, 1)
    check = try_refinement(check_made(woven, settings, supplies), woven, settings, supplies)
    piece_set = build_pieces(
        woven.ribbons, weave, plan.runs, woven.labels, rules, laid.joints, slots=settings.slots
    )
    progress("marks", 0, 1)
    # Letters do not depend on where a piece stands: they are placed while pieces are nested. The
    # picture is made meanwhile, too.
    marked = start(
        mark_pieces,
        piece_set.pieces,
        weave.threads.n_crossings,
        settings.labels,
        settings.label_side,
    )
    portrait = start(portrait_png, woven.ribbons, thread_colours(woven.bunches, settings.colours))
    ordered = start(_plan_order, piece_set, woven, settings)
    progress("nesting", 0, len(piece_set.pieces))
    layout = lay_out(piece_set.pieces, settings, supplies, woven.bunches, executors, progress)
    allotment = allot(supplies, woven.bunches, layout, piece_set.pieces)
    if layout.recorded:
        settings = replace(settings, layout=LAYOUT_FILE)
    progress("marks", 0, 1)
    marks = marked()
    order = ordered()
    progress("drawings", 0, 1)
    mirrored = settings.label_side == "inside"
    offcuts = usable_offcuts(layout, [piece.outline for piece in piece_set.pieces])
    if mirrored:
        widths = [layout.sheets[offcut.sheet].width_mm for offcut in offcuts]
        offcuts = tuple(map(Offcut.mirrored, offcuts, widths))
    drawings = draw_sheets(
        piece_set.pieces,
        marks,
        layout,
        title=woven.title,
        captions=allotment.captions(),
        mirrored=mirrored,
        offcuts=offcuts,
        cool=settings.cut_order == "cool",
    )
    code = command_text(settings, complete_settings(usual_settings(settings))[0])
    drawings = tuple(with_code(drawing, code) for drawing in drawings)
    ready = ready_sheets(drawings, settings.kerf_mm, settings.micro_joints)
    return Job(
        settings=settings,
        supplies=supplies,
        woven=woven,
        check=check,
        plan=plan,
        piece_set=piece_set,
        holes=tuple(hole_findings(piece_set, rules, weave, woven.ribbons, woven.labels)),
        marks=marks,
        layout=layout,
        offcuts=offcuts,
        allotment=allotment,
        order=order,
        portrait=portrait,
        drawings=drawings,
        code=code,
        ready=ready,
        notes=(
            *woven.source.notes,
            *woven.result.notes,
            *all_notes(woven.mesh, weave, woven.ribbons, piece_set, marks, rules),
            *width_notes(woven, settings, supplies),
            *ribbon_notes(check),
            order_note(order, build_steps(piece_set, order)),
            *layout.notes,
            *code_notes(drawings),
            *ready_notes(
                ready,
                settings.kerf_mm,
                settings.micro_joints,
                service=settings.profile == "service",
            ),
        ),
    )


def _plan_order(piece_set: PieceSet, woven: WovenObject, settings: Settings) -> Order:
    """Plan the order of assembly."""
    return plan_order(
        piece_set.pieces,
        woven.ribbons.centre,
        enclosed=bool(np.all(woven.halfedges.twin >= 0)),
        effort=settings.effort,
        seed=settings.seed,
    )


def complete_settings(settings: Settings) -> tuple[Settings, Supplies]:
    """Fill in what was left to fabweave: thickness, gap and sheet.

    Raises
    ------
    InputError
        If settings by bunch name other bunches than the rest, or the kerf wants a larger gap.
    """
    supplies = plan_supplies(
        parse_materials(settings.material),
        by_bunch(settings.thickness_mm),
        by_bunch(settings.gap_mm),
        settings.sheets,
        settings.materials,
    )
    check_kerf(settings.kerf_mm, min(supply.gap_mm for supply in supplies.each))
    return (
        replace(
            settings,
            thickness_mm=supplies.by_bunch(lambda one: one.material.thickness_mm),
            sheets=supplies.sheets,
            gap_mm=supplies.by_bunch(lambda one: one.gap_mm),
        ),
        supplies,
    )
