"""Run a job: from a mesh to the plan of everything that is cut."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fabweave.arrays import Progress, no_progress
from fabweave.assembly.order import Order, plan_order
from fabweave.assembly.steps import build_steps, order_note
from fabweave.command import command_text
from fabweave.cut.code import code_notes, with_code
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.marks import Marks, mark_pieces
from fabweave.cut.ready import check_kerf, ready_notes, ready_sheets
from fabweave.cut.sheets import draw_sheets
from fabweave.errors import InputError
from fabweave.executors import Executors, here
from fabweave.flat.holes import HoleRule
from fabweave.flat.joint import JointRule, parse_joint
from fabweave.flat.joints import JointPlan, plan_joints
from fabweave.flat.pieces import Pieces, build_pieces
from fabweave.flat.runs import Runs
from fabweave.plan import Plan, plan_pieces
from fabweave.report.notes import all_notes
from fabweave.report.portrait import portrait_png
from fabweave.report.ribbons import hole_findings, ribbon_notes
from fabweave.ribbon.check import require_width
from fabweave.ribbon.finding import Finding
from fabweave.ribbon.findings import RibbonCheck
from fabweave.ribbon.turns import require_no_loop
from fabweave.settings import CHOICES, LAYOUT_FILE, JobSettings
from fabweave.sheet.given import read_layout
from fabweave.sheet.layout import Layout, SheetSize
from fabweave.sheet.material import (
    Material,
    hole_edge_mm,
    material_named,
    min_hole_mm,
    with_thickness,
)
from fabweave.sheet.nest import nest
from fabweave.sheet.offcut import Offcut, best_offcut
from fabweave.sheet.stock import stock_for
from fabweave.sheet.turns import parse_rotations
from fabweave.weave.colours import thread_colours
from fabweave.weave.colourspace import Colours
from fabweave.weave.pattern import Weave
from fabweave.workers import Start, at_once
from fabweave.woven import (
    WovenObject,
    check_object,
    keep_clear,
    require_stiffness,
    weave_object,
    width_notes,
)

#: Hole diameters to choose from, in millimetres: a fastener of a common size and its clearance.
HOLES_MM = (4.1, 3.3, 2.5, 2.0, 1.6, 1.3, 1.0)


@dataclass(frozen=True, eq=False)
class Job:
    """Everything that a job makes, before it is written."""

    settings: JobSettings
    material: Material
    object: WovenObject
    check: RibbonCheck
    plan: Plan
    made: Pieces
    holes: tuple[Finding, ...]
    marks: tuple[Marks, ...]
    layout: Layout
    #: What is left of a sheet and worth keeping, as it is drawn.
    offcut: Offcut | None
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
        return self.object.weave

    @property
    def colours(self) -> Colours:
        """The colour of each thread."""
        return thread_colours(self.object.bunches, self.settings.colours)


def make_job(
    settings: JobSettings,
    progress: Progress = no_progress,
    *,
    start: Start = at_once,
    executors: Executors = here,
) -> Job:
    """Make everything that a job writes: weave, ribbons, pieces, layout and drawings.

    Parameters
    ----------
    settings : JobSettings
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
    settings, material = complete_settings(settings)
    thing = weave_object(settings, material, progress)
    weave, rules = thing.weave, hole_rules(settings, material)
    require_width(thing.ribbons, thing.labels, thing.size_mm)
    require_no_loop(weave.threads, thing.woven.halfedges)
    require_stiffness(thing, settings, material)
    progress("pieces", 0, 1)
    plan = plan_pieces(thing.ribbons, weave, thing.labels, settings, rules)
    rule = parse_joint(settings.joint, lap_mm=settings.lap_mm, thickness_mm=material.thickness_mm)
    thing, joints = _with_joints(thing, plan.runs, rule, settings, material)
    progress("checks", 0, 1)
    check = check_object(thing, settings, material)
    made = build_pieces(
        thing.ribbons, weave, plan.runs, thing.labels, rules, joints, slots=settings.slots
    )
    progress("marks", 0, 1)
    # Letters do not depend on where a piece stands: they are placed while pieces are nested. The
    # picture is made meanwhile, too.
    marked = start(
        mark_pieces,
        made.pieces,
        weave.threads.n_crossings,
        settings.labels,
        settings.label_side,
    )
    portrait = start(portrait_png, thing.ribbons, thread_colours(thing.bunches, settings.colours))
    ordered = start(_plan_order, made, thing, settings)
    progress("nesting", 0, len(made.pieces))
    layout = _laid_out(made, settings, executors, progress)
    if layout.recorded:
        settings = replace(settings, layout=LAYOUT_FILE)
    progress("marks", 0, 1)
    marks = marked()
    order = ordered()
    progress("drawings", 0, 1)
    offcut, mirrored = _offcut(made, layout, settings), settings.label_side == "inside"
    drawings = draw_sheets(
        made.pieces,
        marks,
        layout,
        title=thing.woven.title,
        material=f"{material.name} {material.thickness_mm:g} mm",
        mirrored=mirrored,
        offcut=offcut,
        cool=settings.cut_order == "cool",
    )
    usual, _ = complete_settings(JobSettings(settings.mesh, material=settings.material))
    code = command_text(settings, usual)
    drawings = tuple(with_code(drawing, code) for drawing in drawings)
    ready = ready_sheets(drawings, settings.kerf_mm, settings.micro_joints)
    return Job(
        settings=settings,
        material=material,
        object=thing,
        check=check,
        plan=plan,
        made=made,
        holes=tuple(hole_findings(made, rules, weave, thing.ribbons, thing.labels)),
        marks=marks,
        layout=layout,
        offcut=offcut,
        order=order,
        portrait=portrait,
        drawings=drawings,
        code=code,
        ready=ready,
        notes=(
            *thing.woven.notes,
            *thing.chosen.notes,
            *all_notes(thing.woven.mesh, weave, thing.ribbons, made, marks, rules),
            *width_notes(thing, settings, material),
            *ribbon_notes(check),
            order_note(order, build_steps(made, order)),
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


def _with_joints(
    thing: WovenObject, runs: Runs, rule: JointRule, settings: JobSettings, material: Material
) -> tuple[WovenObject, JointPlan]:
    """Plan the joints, and lay the ribbons again with room for laps where they are."""
    laps = plan_joints(thing.ribbons, thing.weave, runs, rule).laps
    while True:
        thing = keep_clear(thing, settings, material, laps)
        joints = plan_joints(thing.ribbons, thing.weave, runs, rule)
        # Panels keep their shape when the strands move apart; but where ribbons were narrowed,
        # there may be room for nothing but a lap.
        more = np.setdiff1d(joints.laps, laps)
        if not len(more):
            return thing, joints
        laps = np.concatenate((laps, more))


def _laid_out(
    made: Pieces, settings: JobSettings, executors: Executors, progress: Progress
) -> Layout:
    """Nest the pieces, or take the layout of a finished job."""
    outlines, ids = [piece.outline for piece in made.pieces], [piece.id for piece in made.pieces]
    gap_mm, turns = _given(settings.gap_mm), parse_rotations(settings.rotations)
    if settings.layout is not None:
        path = Path(settings.layout)
        return read_layout(
            path,
            outlines,
            ids,
            settings.stock,
            margin_mm=settings.margin_mm,
            gap_mm=gap_mm,
            turns=turns,
        )
    return nest(
        outlines,
        settings.stock,
        margin_mm=settings.margin_mm,
        gap_mm=gap_mm,
        effort=settings.effort,
        seed=settings.seed,
        ids=ids,
        turns=turns,
        executors=executors,
        progress=progress,
    )


def _offcut(made: Pieces, layout: Layout, settings: JobSettings) -> Offcut | None:
    """Return what is left of a sheet and worth keeping, as it is drawn."""
    offcut = best_offcut(layout, [piece.outline for piece in made.pieces])
    if offcut is None or settings.label_side != "inside":
        return offcut
    return offcut.mirrored(layout.sheets[offcut.sheet].width_mm)


def _plan_order(made: Pieces, thing: WovenObject, settings: JobSettings) -> Order:
    """Plan the order of assembly."""
    return plan_order(
        made.pieces,
        thing.ribbons.centre,
        enclosed=bool(np.all(thing.woven.halfedges.twin >= 0)),
        effort=settings.effort,
        seed=settings.seed,
    )


def complete_settings(settings: JobSettings) -> tuple[JobSettings, Material]:
    """Fill in what was left to fabweave: thickness, gap and sheet.

    Raises
    ------
    InputError
        If a setting is none of its choices.
    """
    for name, choices in CHOICES.items():
        value = getattr(settings, name)
        if value not in choices:
            raise InputError(f"{name} is {value!r}, and must be one of {', '.join(choices)}")
    material = material_named(settings.material)
    if settings.thickness_mm is not None:
        material = with_thickness(material, settings.thickness_mm)
    sheets = stock_for(settings.sheets, material.name) or (SheetSize(*material.sheet_mm),)
    gap_mm = material.gap_mm if settings.gap_mm is None else settings.gap_mm
    check_kerf(settings.kerf_mm, gap_mm)
    return (
        replace(
            settings,
            thickness_mm=material.thickness_mm,
            sheets=sheets,
            gap_mm=gap_mm,
        ),
        material,
    )


def hole_rules(settings: JobSettings, material: Material) -> tuple[HoleRule, ...]:
    """Return the holes that may be used, the largest first; none if none are wanted."""
    if settings.hole_mm == 0:
        return ()
    least = min_hole_mm(material)
    if settings.hole_mm is not None:
        if settings.hole_mm < least:
            raise InputError(
                f"a hole of {settings.hole_mm:g} mm is too small for a laser in "
                f"{material.thickness_mm:g} mm {material.title}: use {least:g} mm or more, "
                "or --hole none"
            )
        holes: Sequence[float] = (settings.hole_mm,)
    else:
        holes = [hole for hole in HOLES_MM if hole >= least] or [least]
    return tuple(HoleRule(hole, hole_edge_mm(material, hole)) for hole in holes)


def _given(value: float | None) -> float:
    """Return a setting that complete_settings has filled in."""
    if value is None:
        raise ValueError("settings must be completed first")
    return value
