"""Run a job: from a mesh to the plan of everything that is cut."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fabweave.arrays import FloatArray, IntArray, Progress, no_progress
from fabweave.assembly.order import Order, plan_order
from fabweave.assembly.steps import order_note
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.marks import Marks, mark_pieces
from fabweave.cut.sheets import draw_sheets
from fabweave.errors import CannotMakeError, InputError
from fabweave.flat.holes import HoleRule
from fabweave.flat.joint import parse_joint
from fabweave.flat.joints import plan_joints
from fabweave.flat.pieces import Pieces, build_pieces
from fabweave.flat.runs import Runs
from fabweave.flat.split import split_threads
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import largest_dimension
from fabweave.report.notes import all_notes
from fabweave.report.portrait import portrait_png
from fabweave.report.ribbons import hole_findings, ribbon_notes
from fabweave.ribbon.check import require_width, thread_lengths, widest_width
from fabweave.ribbon.finding import Finding
from fabweave.ribbon.findings import RibbonCheck, check_ribbons, require_pliable
from fabweave.ribbon.project import Ribbons, project_ribbons
from fabweave.ribbon.smooth import smooth_ribbons
from fabweave.ribbon.turns import require_no_loop
from fabweave.ribbon.width import WidthRule
from fabweave.settings import CHOICES, JobSettings
from fabweave.sheet.layout import Layout, SheetSize
from fabweave.sheet.limits import ribbon_limits, thickness_for_bend
from fabweave.sheet.material import (
    Material,
    hole_edge_mm,
    material_named,
    min_hole_mm,
    with_thickness,
)
from fabweave.sheet.nest import fits_some_sheet, nest
from fabweave.sheet.stock import usable_size
from fabweave.source import WovenMesh, load_mesh
from fabweave.weave.bunches import part_bunches
from fabweave.weave.choose import Chosen, weave_pattern
from fabweave.weave.colours import thread_colours
from fabweave.weave.colourspace import Colours
from fabweave.weave.labels import thread_labels
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import trace_threads
from fabweave.workers import Start, at_once

#: Hole diameters to choose from, in millimetres: a fastener of a common size and its clearance.
HOLES_MM = (4.1, 3.3, 2.5, 2.0, 1.6, 1.3, 1.0)

#: Pieces pass about this many crossings unless a length is asked for: a dozen keeps strips short
#: enough to nest well and joints few.
CROSSINGS_A_PIECE = 12


@dataclass(frozen=True, eq=False)
class WovenObject:
    """A woven mesh with its ribbons, before anything is unfolded or cut.

    Parameters
    ----------
    woven : WovenMesh
        The mesh.
    chosen : Chosen
        The weave, in the pattern that was asked for.
    labels : tuple of str
        Names of the threads.
    bunches : (T,) int array
        The bunch of each thread.
    ribbons : Ribbons
        The ribbons.
    """

    woven: WovenMesh
    chosen: Chosen
    labels: tuple[str, ...]
    bunches: IntArray
    ribbons: Ribbons

    @property
    def weave(self) -> Weave:
        """The weave."""
        return self.chosen.weave

    @property
    def size_mm(self) -> float:
        """Largest dimension."""
        return largest_dimension(self.woven.mesh)


@dataclass(frozen=True, eq=False)
class Job:
    """Everything that a job makes, before it is written."""

    settings: JobSettings
    material: Material
    object: WovenObject
    check: RibbonCheck
    made: Pieces
    holes: tuple[Finding, ...]
    marks: tuple[Marks, ...]
    layout: Layout
    order: Order
    #: Waits for the picture of the woven object, a PNG file, which may still be in the making.
    portrait: Callable[[], bytes]
    drawings: tuple[SheetDrawing, ...]
    notes: tuple[str, ...]

    @property
    def weave(self) -> Weave:
        """The weave."""
        return self.object.weave

    @property
    def colours(self) -> Colours:
        """The colour of each thread."""
        return thread_colours(self.object.bunches, self.settings.colours)


def weave_object(
    settings: JobSettings, material: Material, progress: Progress = no_progress
) -> WovenObject:
    """Bring the mesh of a job to the loom, weave it, and lay its ribbons.

    Raises
    ------
    InputError
        For bad input or settings.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.
    """
    progress("mesh", 0, 1)
    woven = load_mesh(settings, progress)
    progress("weave", 0, 1)
    threads = trace_threads(woven.halfedges, turn=settings.boundary == "turn")
    labels = thread_labels(threads.n_threads)
    bunches = part_bunches(threads)
    chosen = weave_pattern(
        settings.pattern,
        woven.halfedges,
        threads,
        bunches,
        labels,
        n_old_vertices=woven.n_old_vertices,
        effort=settings.effort,
        seed=settings.seed,
        progress=progress,
    )
    progress("ribbons", 0, 1)
    ribbons = lay_ribbons(woven, chosen.weave, settings, material)
    if ribbons.n_rungs == 0:
        raise CannotMakeError(
            "nothing crosses anything on this mesh: no edge lies between two faces; "
            "weaving needs faces that share edges"
        )
    return WovenObject(woven, chosen, labels, bunches, ribbons)


def lay_ribbons(
    woven: WovenMesh,
    weave: Weave,
    settings: JobSettings,
    material: Material,
    laps: IntArray | None = None,
) -> Ribbons:
    """Lay the ribbons of a weave, with room for two layers, and for three where a joint laps.

    Parameters
    ----------
    woven, weave
        The mesh and its weave.
    settings, material
        Width, clearance and thickness.
    laps : (N,) int array, optional
        The crossings at which a joint laps; before pieces are planned it may be any.
    """
    thickness = material.thickness_mm
    height = np.full(weave.threads.n_crossings, (thickness + settings.clearance_mm) / 2)
    # A lap is two layers thick, around the same middle: half a layer more between the strands.
    height[slice(None) if laps is None else laps] += thickness / 4
    ribbons = project_ribbons(
        woven.mesh,
        woven.halfedges,
        weave,
        height_mm=height,
        length=settings.crossing,
        width=settings.width,
    )
    return smooth_ribbons(ribbons, settings.smooth)


def check_object(thing: WovenObject, settings: JobSettings, material: Material) -> RibbonCheck:
    """Check the ribbons of a woven object against its material, and look for remedies.

    The ribbons are those with room for a lap at every crossing: a joint may come to lie at any.
    """

    def lay(size_mm: float, narrower: float) -> Ribbons:
        mesh = thing.woven.mesh
        mesh = PolyMesh(mesh.vertices * (size_mm / thing.size_mm), mesh.offsets, mesh.indices)
        rule = settings.width
        rule = WidthRule(
            rule.relative * narrower, rule.least_mm * narrower, rule.most_mm * narrower
        )
        woven, changed = replace(thing.woven, mesh=mesh), replace(settings, width=rule)
        return lay_ribbons(woven, thing.weave, changed, material)

    return check_ribbons(
        lay(thing.size_mm, 1.0),
        thing.weave,
        thing.labels,
        ribbon_limits(material),
        size_mm=thing.size_mm,
        lay=lay,
    )


def require_stiffness(check: RibbonCheck, material: Material) -> None:
    """Raise CannotMakeError if a material is too stiff for an object."""
    for found in check.refused:
        thin = thickness_for_bend(material, found.value)
        require_pliable(check, material.title, thin)


def make_job(
    settings: JobSettings, progress: Progress = no_progress, *, start: Start = at_once
) -> Job:
    """Make everything that a job writes: weave, ribbons, pieces, layout and drawings.

    Parameters
    ----------
    settings : JobSettings
    progress : callable
        Told what is being done.
    start : callable
        How to start work beside this process, from ``side_workers``; changes no result.

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
    progress("checks", 0, 1)
    check = check_object(thing, settings, material)
    require_stiffness(check, material)
    progress("pieces", 0, 1)
    runs = plan_runs(thing, settings)
    rule = parse_joint(settings.joint, lap_mm=settings.lap_mm, thickness_mm=material.thickness_mm)
    # Panels keep their shape when the strands move apart, so that joints can be planned before.
    laps = plan_joints(thing.ribbons, weave, runs, rule).laps
    ribbons = lay_ribbons(thing.woven, weave, settings, material, laps)
    thing = replace(thing, ribbons=ribbons)
    joints = plan_joints(ribbons, weave, runs, rule)
    made = build_pieces(ribbons, weave, runs, thing.labels, rules, joints, slots=settings.slots)
    progress("marks", 0, 1)
    # Letters do not depend on where a piece stands: they are placed while pieces are nested. The
    # picture is made meanwhile, too.
    marked = start(mark_pieces, made.pieces, weave.threads.n_crossings)
    portrait = start(portrait_png, thing.ribbons, thread_colours(thing.bunches, settings.colours))
    ordered = start(_plan_order, made, thing, settings)
    progress("nesting", 0, len(made.pieces))
    layout = nest(
        [piece.outline for piece in made.pieces],
        settings.sheets,
        margin_mm=settings.margin_mm,
        gap_mm=_given(settings.gap_mm),
        effort=settings.effort,
        seed=settings.seed,
        ids=[piece.id for piece in made.pieces],
        progress=progress,
    )
    progress("marks", 0, 1)
    marks = marked()
    order = ordered()
    progress("drawings", 0, 1)
    return Job(
        settings=settings,
        material=material,
        object=thing,
        check=check,
        made=made,
        holes=tuple(hole_findings(made, rules, weave, thing.ribbons, thing.labels)),
        marks=marks,
        layout=layout,
        order=order,
        portrait=portrait,
        drawings=draw_sheets(made.pieces, marks, layout, title=thing.woven.title),
        notes=(
            *thing.woven.notes,
            *thing.chosen.notes,
            *all_notes(thing.woven.mesh, weave, thing.ribbons, made, marks, rules),
            _widest_note(thing, settings),
            *ribbon_notes(check),
            order_note(order),
            *layout.notes,
        ),
    )


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
    sheets = settings.sheets or (SheetSize(*material.sheet_mm),)
    return (
        replace(
            settings,
            thickness_mm=material.thickness_mm,
            sheets=sheets,
            gap_mm=material.gap_mm if settings.gap_mm is None else settings.gap_mm,
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


def _widest_note(thing: WovenObject, settings: JobSettings) -> str:
    """Say how wide ribbons of one width could be."""
    widest = widest_width(
        thing.woven.mesh, thing.woven.halfedges, thing.weave, length=settings.crossing
    )
    # Rounded down: what is said has room.
    return f"width: ribbons of one width have room everywhere up to {int(widest * 100) / 100:g} mm"


def plan_runs(thing: WovenObject, settings: JobSettings) -> Runs:
    """Split the ribbons of a woven object so that every piece fits the stock."""

    def fits(outline: FloatArray) -> bool:
        return fits_some_sheet(outline, settings.sheets, settings.margin_mm)

    return split_threads(
        thing.ribbons,
        thing.weave,
        length_mm=_wanted_length(thing.ribbons, settings),
        max_length_mm=settings.max_length_mm or np.inf,
        fits=fits,
        labels=thing.labels,
        usable=[usable_size(sheet, settings.margin_mm) for sheet in settings.sheets],
        gap_mm=_given(settings.gap_mm),
    )


def _wanted_length(ribbons: Ribbons, settings: JobSettings) -> float:
    """Return how long pieces should be: as asked, or a dozen crossings, if the sheet allows."""
    if settings.max_length_mm is not None:
        return settings.max_length_mm
    pitch = float(thread_lengths(ribbons).sum()) / len(ribbons.entry)
    longest = max(max(usable_size(sheet, settings.margin_mm)) for sheet in settings.sheets)
    return min(CROSSINGS_A_PIECE * pitch, longest / 2)


def _given(value: float | None) -> float:
    """Return a setting that complete_settings has filled in."""
    if value is None:
        raise ValueError("settings must be completed first")
    return value
