"""Run a job from mesh to proof: every station makes a value and hands it on to the next.

Settings → LoadedMesh → WovenMesh → WovenObject → PlannedJob → Layout → Job → folder → proof
"""

from collections.abc import Callable, Collection
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabweave.app.job import Job, PlannedJob
from fabweave.app.job_files import write_job, write_proof
from fabweave.app.job_folder import (
    check_destination,
    clear_abandoned,
    finished_folder,
    told_where,
    write_contents,
)
from fabweave.app.job_notes import job_notes
from fabweave.app.joined_object import check_joined, split_object, try_refinement
from fabweave.app.joined_pieces import joined_pieces, with_grain
from fabweave.app.mesh_source import LoadedMesh, load_mesh
from fabweave.app.nest_job import grain_cost, nest_pieces, ring_sheets
from fabweave.app.options.file_kinds import LAYOUT_FILE
from fabweave.app.preflight_job import Preflight
from fabweave.app.remake_command import command_text, usual_settings
from fabweave.app.request import chosen_grain, complete_settings, hole_rules
from fabweave.app.settings import Settings
from fabweave.app.woven_mesh import weave_mesh
from fabweave.app.woven_object import WovenObject, lay_object
from fabweave.assembly.order.planning import Order, plan_order
from fabweave.assembly.steps import build_steps
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.parallel.executors import (
    Executors,
    Start,
    at_once,
    here,
    processes,
    side_workers,
)
from fabweave.cut.kerf import kerfed_sheets
from fabweave.cut.labels.exposure import seen_mm
from fabweave.cut.labels.marks import Marks, mark_pieces, mark_spares
from fabweave.cut.labels.texts import kind_name
from fabweave.cut.notes.qr_code import with_code
from fabweave.cut.sheets import draw_sheets
from fabweave.flat.congruence import spared
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.allotment import allot
from fabweave.nest.layout import Layout
from fabweave.nest.offcut import Offcut, usable_offcuts
from fabweave.picture.loss_picture import likeness_png
from fabweave.picture.portrait import portrait_png
from fabweave.report.bom import bill_of_materials
from fabweave.report.costs.costs import job_costs
from fabweave.report.ribbon_report import hole_findings
from fabweave.report.verdict import FORCED, NotMakeableError
from fabweave.ribbon.rules.remedy import Depth
from fabweave.stock.supplies import Supplies
from fabweave.verify import VerifyReport, verify_job

#: More processes than these find nothing to do in most jobs.
_MOST_WORKERS = 4


class FinishedJob(NamedTuple):
    """A job that is made and proved, which rules it breaks, and which papers could not be made."""

    job: Job
    proof: VerifyReport
    preflight: Preflight
    missing: tuple[str, ...] = ()


class SideWork(NamedTuple):
    """What is made while pieces are nested, as it does not depend on where they lie.

    Each waits for its result when it is called.
    """

    marks: Callable[[], tuple[Marks, ...]]
    portrait: Callable[[], bytes]
    order: Callable[[], Order]
    likeness: Callable[[], bytes | None]


def run_job(
    settings: Settings,
    directory: Path,
    progress: Progress = no_progress,
    *,
    mesh: PolyMesh | None = None,
    loaded: LoadedMesh | None = None,
    workers: int = 0,
    executors: Executors | None = None,
    replaced: Collection[Path] = (),
) -> FinishedJob:
    """Make a job, write its folder, and prove the written files.

    Parameters
    ----------
    settings : Settings
    directory : Path
        New, empty, or an older job's folder with nothing else in it, which is then replaced.
    progress : callable
    mesh : PolyMesh, optional
        A mesh from memory, in place of the file; it is kept in the folder under that name.
    loaded : LoadedMesh, optional
        What the settings make of the mesh, if that is known already.
    workers : int
        Processes beside this one; the same bytes are written with any number.
    executors : callable, optional
        Opens the executor that nests very many pieces, in place of these processes.
    replaced : collection of Path
        Files of that older job that may have been changed, as the settings were read from them.

    Returns
    -------
    FinishedJob
        Every check holds; what was proved stands in ``verify.json`` too.

    Raises
    ------
    InputError
        For bad input or settings, or a folder with anything else in it.
    CannotMakeError
        For what cannot be made as asked, or if a check objects to the written files.
    """
    clear_abandoned(directory)
    check_destination(directory, replaced, mesh=None if mesh is not None else settings.mesh)
    with ExitStack() as stack:
        start = stack.enter_context(side_workers(min(workers, _MOST_WORKERS)))
        nesting = executors or processes(workers)
        job = make_job(settings, progress, mesh=mesh, loaded=loaded, start=start, executors=nesting)
        # Processes end before the folder is moved, or removed: no file comes to it late.
        with told_where(directory), finished_folder(directory, replaced) as new, stack.pop_all():
            return write_and_prove(job, new, progress, start)


def make_job(
    settings: Settings,
    progress: Progress = no_progress,
    *,
    mesh: PolyMesh | None = None,
    loaded: LoadedMesh | None = None,
    start: Start = at_once,
    executors: Executors = here,
) -> Job:
    """Make everything that a job writes: weave, ribbons, pieces, layout and drawings.

    Parameters
    ----------
    settings : Settings
    progress : callable
        Told what is being done.
    mesh, loaded
        As for :func:`run_job`.
    start, executors : callable
        How to start work beside this process, from ``side_workers``, and what opens the executor
        that nests very many pieces; they change no result.

    Returns
    -------
    Job

    Raises
    ------
    InputError
        For bad input or settings.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.
    """
    settings, supplies = complete_settings(settings)
    loaded = loaded or load_mesh(settings, progress, mesh)
    weave = weave_mesh(loaded, settings, supplies, progress)
    ribbons = lay_object(weave, settings, supplies, progress)
    planned = plan_job(ribbons, settings, supplies, progress)
    side = start_side_work(planned, start)
    layout = nest_job(planned, progress, executors)
    return draw_job(planned, layout, side, progress, mesh)


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


def start_side_work(planned: PlannedJob, start: Start = at_once) -> SideWork:
    """Start the letters of pieces, the order of assembly and the picture of the object."""
    settings, woven, pieces = planned.settings, planned.woven, planned.piece_set.pieces
    crossings = planned.weave.threads.n_crossings
    source = woven.source
    kinds = planned.piece_set.kinds
    return SideWork(
        marks=start(mark_pieces, pieces, crossings, settings.labels, settings.label_side, kinds),
        portrait=start(portrait_png, woven.ribbons, planned.colours),
        order=start(
            plan_order,
            pieces,
            woven.ribbons.centre,
            woven.ribbons.normal,
            enclosed=bool(np.all(woven.halfedges.twin >= 0)),
            effort=settings.effort,
            seed=settings.seed,
        ),
        likeness=start(likeness_png, source.loss, source.likeness),
    )


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
        settings = replace(settings, layout=LAYOUT_FILE)
    progress("marks", 0, 1)
    marks, order = side.marks(), side.order()
    spare_marks = mark_spares(
        to_cut[len(marks) :],
        [marks[at] for at in planned.spared.tolist()],
        settings.labels,
        settings.label_side,
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
        if settings.labels == "kinds"
        else (),
        offcuts=offcuts,
        cool=settings.cut_order == "cool",
        warnings=[
            *([FORCED] if planned.verdict.forced else []),
            *(
                ["S1, S2 ... AFTER AN ID: A SPARE OF THAT KIND"]
                if spare_marks and settings.labels not in ("kinds", "none")
                else []
            ),
        ],
    )
    usual = complete_settings(usual_settings(settings))[0]
    code = "" if settings.qr == "none" else command_text(settings, usual)
    drawings = tuple(with_code(drawing, code) for drawing in drawings)
    kerfed = kerfed_sheets(drawings, settings.kerf_mm, settings.micro_joints)
    woven = planned.woven
    hidden = settings.labels in ("hidden", "kinds") and not planned.mirrored
    seen = seen_mm(pieces.pieces, marks) if hidden else None
    rim = ring_sheets(pieces.rings, settings, planned.supplies, woven.title)
    return Job(
        **{**vars(planned), "settings": settings},
        layout=layout,
        allotment=allotment,
        offcuts=offcuts,
        holes=tuple(hole_findings(pieces, planned.rules, woven.weave, woven.ribbons, woven.labels)),
        marks=marks,
        spare_marks=spare_marks,
        engrave_seen_mm=seen,
        order=order,
        portrait=side.portrait,
        likeness=side.likeness,
        drawings=drawings,
        code=code,
        kerfed=kerfed,
        costs=job_costs(
            pieces,
            drawings,
            layout.sheets,
            allotment.sheet_materials,
            build_steps(pieces, order),
            bill_of_materials(pieces, settings.hardware),
            calibration=settings.calibrate,
        ),
        notes=job_notes(planned, layout, marks, order, drawings, kerfed, seen),
        grain_cost=grain_cost(pieces.pieces, settings, planned.supplies, planned.woven.bunches),
        rim_layout=rim[0],
        rim_drawings=rim[1],
        rim_kerfed=kerfed_sheets(rim[1], settings.kerf_mm, settings.micro_joints),
        given_mesh=given_mesh,
    )


def write_and_prove(
    job: Job, folder: Path, progress: Progress = no_progress, start: Start = at_once
) -> FinishedJob:
    """Write a job's files into an empty folder, read them back, and prove them.

    Raises
    ------
    CannotMakeError
        If a rule is broken and that was ruled out, or if a check objects.
    """
    written = write_job(job, folder, progress, start=start)
    write_contents(folder)
    progress("verify", 0, 1)
    proof = verify_job(folder)
    if not proof.ok:
        raise CannotMakeError(_disproved(proof))
    write_proof(folder, proof)
    return FinishedJob(job, proof, *written)


def _disproved(proof: VerifyReport) -> str:
    """Say which checks objected; this is a defect of fabweave's and never the user's."""
    failed = [check for check in proof.checks if not check.ok]
    lines = [
        f"  {check.name}: {check.meaning}: {'; '.join(map(str, check.findings[:2]))}"
        for check in failed
    ]
    return (
        f"the written files did not pass {len(failed)} checks, so nothing was kept; "
        "please report this with the mesh and the command:\n" + "\n".join(lines)
    )
