"""Run a job: from a mesh to the plan of everything that is cut."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fabweave.arrays import FloatArray, IntArray, Progress, no_progress
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.marks import Marks, mark_pieces
from fabweave.cut.sheets import draw_sheets
from fabweave.errors import CannotMakeError, InputError
from fabweave.flat.pieces import HoleRule, Pieces, build_pieces
from fabweave.flat.split import split_threads
from fabweave.mesh.files import read_mesh
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.report import MeshReport
from fabweave.mesh.resize import largest_dimension, resize_mesh
from fabweave.mesh.shapes import PREFIX, is_shape, parse_shape
from fabweave.report.notes import all_notes
from fabweave.ribbon.check import require_width
from fabweave.ribbon.project import Ribbons, following_rung, project_ribbons
from fabweave.ribbon.turns import require_no_loop
from fabweave.settings import JobSettings
from fabweave.sheet.layout import Layout, SheetSize
from fabweave.sheet.material import (
    Material,
    hole_edge_mm,
    material_named,
    min_hole_mm,
    with_thickness,
)
from fabweave.sheet.nest import fits_some_sheet, nest
from fabweave.sheet.stock import usable_size
from fabweave.weave.bunches import part_bunches
from fabweave.weave.labels import thread_labels
from fabweave.weave.pattern import Weave, plain_weave
from fabweave.weave.threads import trace_threads
from fabweave.workers import side_workers

#: Hole diameters to choose from, in millimetres: a fastener of a common size and its clearance.
HOLES_MM = (4.1, 3.3, 2.5, 2.0, 1.6, 1.3, 1.0)

#: Pieces pass about this many crossings unless a length is asked for: a dozen keeps strips short
#: enough to nest well and joints few.
CROSSINGS_A_PIECE = 12


@dataclass(frozen=True, eq=False)
class WovenMesh:
    """The mesh of a job, ready to be woven, with what was done to it."""

    mesh: PolyMesh
    halfedges: Halfedges
    title: str
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Job:
    """Everything that a job makes, before it is written."""

    settings: JobSettings
    woven: WovenMesh
    material: Material
    weave: Weave
    labels: tuple[str, ...]
    bunches: IntArray
    ribbons: Ribbons
    made: Pieces
    marks: tuple[Marks, ...]
    layout: Layout
    drawings: tuple[SheetDrawing, ...]
    notes: tuple[str, ...]


def make_job(settings: JobSettings, progress: Progress = no_progress, *, workers: int = 0) -> Job:
    """Make everything that a job writes: weave, ribbons, pieces, layout and drawings.

    Parameters
    ----------
    settings : JobSettings
    progress : callable
        Told what is being done.
    workers : int
        Processes beside this one; changes no result.

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
    progress("mesh", 0, 1)
    woven = load_mesh(settings)
    progress("weave", 0, 1)
    weave = plain_weave(trace_threads(woven.halfedges, turn=settings.boundary == "turn"))
    labels = thread_labels(weave.threads.n_threads)
    bunches = part_bunches(weave.threads)
    progress("ribbons", 0, 1)
    ribbons = project_ribbons(
        woven.mesh,
        woven.halfedges,
        weave,
        height_mm=(material.thickness_mm + settings.clearance_mm) / 2,
        length=settings.crossing,
        width=settings.width,
    )
    size = largest_dimension(woven.mesh)
    if ribbons.n_rungs == 0:
        raise CannotMakeError(
            "nothing crosses anything on this mesh: no edge lies between two faces; "
            "weaving needs faces that share edges"
        )
    require_width(ribbons, labels, size)
    require_no_loop(weave.threads, woven.halfedges)
    progress("pieces", 0, 1)
    made = _make_pieces(ribbons, weave, settings, labels, material)
    progress("marks", 0, 1)
    with side_workers(min(workers, 1)) as start:
        # Letters do not depend on where a piece stands: they are placed while pieces are nested.
        marked = start(mark_pieces, made.pieces, weave.threads.n_crossings)
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
    progress("drawings", 0, 1)
    drawings = draw_sheets(made.pieces, marks, layout, title=woven.title)
    return Job(
        settings=settings,
        woven=woven,
        material=material,
        weave=weave,
        labels=labels,
        bunches=bunches,
        ribbons=ribbons,
        made=made,
        marks=marks,
        layout=layout,
        drawings=drawings,
        notes=(
            *woven.notes,
            *all_notes(woven.mesh, weave, ribbons, made, marks, hole_rules(settings, material)),
        ),
    )


def complete_settings(settings: JobSettings) -> tuple[JobSettings, Material]:
    """Fill in what was left to fabweave: thickness, gap and sheet."""
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


def load_mesh(settings: JobSettings) -> WovenMesh:
    """Read or build the mesh of a job, check it, orient it and bring it to size."""
    notes: list[str] = []
    unit: str | None = "mm"
    unit_mm = 1.0
    if is_shape(settings.mesh):
        mesh, title = parse_shape(settings.mesh), settings.mesh.removeprefix(PREFIX)
    else:
        found = read_mesh(settings.mesh)
        mesh, title, unit, unit_mm = (
            found.mesh,
            Path(settings.mesh).stem,
            found.unit,
            found.unit_mm or 1.0,
        )
        notes += found.notes
    mesh, report, repairs = prepare_mesh(mesh)
    notes += [*repairs, *_mesh_notes(mesh, report)]
    if settings.size_mm is None:
        mesh, factor = resize_mesh(
            mesh, scale=unit_mm * (1.0 if settings.scale is None else settings.scale)
        )
    else:
        mesh, factor = resize_mesh(mesh, size_mm=settings.size_mm, scale=settings.scale)
    x, y, z = np.ptp(mesh.vertices, axis=0)
    stated = f"the file states its unit ({unit})" if unit else "the file states no unit"
    if is_shape(settings.mesh):
        stated = "built-in shapes are in millimetres"
    how = f"is scaled by {factor:.6g}" if factor != 1.0 else "keeps its numbers as millimetres"
    notes.append(f"size: {x:.1f} × {y:.1f} × {z:.1f} mm; {stated}, and the mesh {how}")
    return WovenMesh(mesh, build_halfedges(mesh), title, tuple(notes))


def _mesh_notes(mesh: PolyMesh, report: MeshReport) -> list[str]:
    """Say what the mesh is, what is odd about it, and whether it runs through itself."""
    bounds = "closed" if report.closed else f"{report.n_boundary_loops} boundary loops"
    bodies = f"{report.n_components} bodies, " if report.n_components > 1 else ""
    notes = [
        f"mesh: {report.n_vertices} vertices, {report.n_edges} edges, {report.n_faces} faces, "
        f"{bodies}{bounds}, genus {report.genus}"
    ]
    notes += [str(problem) for problem in report.problems]
    pairs = self_intersections(mesh)
    if len(pairs):
        some = ", ".join(f"{a} and {b}" for a, b in pairs[:3].tolist())
        notes.append(
            f"{len(pairs)} pairs of faces run through one another or touch (faces {some}"
            f"{', …' if len(pairs) > 3 else ''}): ribbons may collide there; "
            "let the bodies keep clear of each other in the modelling program"
        )
    return notes


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


def _make_pieces(
    ribbons: Ribbons,
    weave: Weave,
    settings: JobSettings,
    labels: tuple[str, ...],
    material: Material,
) -> Pieces:
    """Split the ribbons so that every piece fits the stock, and build the pieces."""

    def fits(outline: FloatArray) -> bool:
        return fits_some_sheet(outline, settings.sheets, settings.margin_mm)

    runs = split_threads(
        ribbons,
        weave,
        length_mm=_wanted_length(ribbons, settings),
        max_length_mm=settings.max_length_mm or np.inf,
        fits=fits,
        labels=labels,
    )
    return build_pieces(ribbons, weave, runs, labels, hole_rules(settings, material))


def _wanted_length(ribbons: Ribbons, settings: JobSettings) -> float:
    """Return how long pieces should be: as asked, or a dozen crossings, if the sheet allows."""
    if settings.max_length_mm is not None:
        return settings.max_length_mm
    following = following_rung(ribbons.offsets, ribbons.closed)
    middle = (ribbons.right + ribbons.left)[following >= 0] / 2
    after = (ribbons.right + ribbons.left)[following[following >= 0]] / 2
    pitch = float(np.linalg.norm(after - middle, axis=1).sum()) / len(ribbons.entry)
    longest = max(max(usable_size(sheet, settings.margin_mm)) for sheet in settings.sheets)
    return min(CROSSINGS_A_PIECE * pitch, longest / 2)


def _given(value: float | None) -> float:
    """Return a setting that complete_settings has filled in."""
    if value is None:
        raise ValueError("settings must be completed first")
    return value
