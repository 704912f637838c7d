"""Run a job from mesh to proof: every station makes a value and hands it on to the next.

Settings → LoadedMesh → WovenMesh → WovenObject → PlannedJob → Layout → Job → plan → proof → papers
"""

from collections.abc import Collection
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from fabweave.core import job_folder
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.job_folder import finished_folder, told_where
from fabweave.core.parallel.executors import (
    Executors,
    Start,
    at_once,
    here,
    processes,
    side_workers,
)
from fabweave.form.straight import lay_strips
from fabweave.job.ask import complete_settings, load_asked
from fabweave.job.draw import Job, draw_job, start_side_work
from fabweave.job.papers import show_job
from fabweave.job.planned import nest_job, plan_job, recorded_layout
from fabweave.job.write import write_plan, write_proof
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.plan.preflight import Preflight
from fabweave.verify.proof import prove_plan, sealed
from fabweave.verify.report import VerifyReport
from fabweave.weave.weave_mesh import weave_mesh

#: More processes than these find nothing to do in most jobs.
_MOST_WORKERS = 4


class FinishedJob(NamedTuple):
    """A job that is made and proved, which rules it breaks, and which papers could not be made."""

    job: Job
    proof: VerifyReport
    preflight: Preflight
    missing: tuple[str, ...] = ()


def make_job(
    settings: Settings,
    progress: Progress = no_progress,
    *,
    mesh: PolyMesh | None = None,
    loaded: LoadedMesh | None = None,
    start: Start = at_once,
    executors: Executors = here,
    recorded: Path | None = None,
) -> Job:
    """Make everything that a job writes: weave, ribbons, pieces, layout and drawings.

    Parameters are those of :func:`run_job`; ``start`` does work beside this process.
    """
    settings, supplies = complete_settings(settings)
    loaded = loaded or load_asked(settings, progress, mesh)
    weave = weave_mesh(loaded, settings.weave, settings.search, supplies, progress)
    ribbons = lay_strips(weave, settings.ribbons, supplies, progress)
    planned = plan_job(ribbons, settings, supplies, progress)
    side = start_side_work(planned, start)
    if recorded is None:
        layout = nest_job(planned, progress, executors)
    else:
        layout = recorded_layout(planned, recorded)
    return draw_job(planned, layout, side, progress, mesh, start=start)


def write_and_prove(
    job: Job, folder: Path, progress: Progress = no_progress, start: Start = at_once
) -> FinishedJob:
    """Write a job's plan into an empty folder, read it back and prove it, and show what was proved.

    CannotMakeError is raised if a rule is broken and that was ruled out, or if a check objects.
    """
    preflight, report = write_plan(job, folder, progress, start=start)
    progress("verify", 0, 1)
    proof = prove_plan(folder)
    if not proof.ok:
        lines = [
            f"\n  {check.name}: {check.meaning}: {'; '.join(map(str, check.findings[:2]))}"
            for check in proof.checks
            if not check.ok
        ]
        raise CannotMakeError(  # a defect of fabweave's and never the user's
            f"the written files did not pass {len(lines)} checks, so nothing was kept; "
            f"please report this with the mesh and the command:{''.join(lines)}"
        )
    missing = show_job(job, report, folder, progress, start=start)
    job_folder.write_contents(folder)
    proof = sealed(proof, folder)
    write_proof(folder, proof)
    return FinishedJob(job, proof, preflight, missing)


def run_job(
    settings: Settings,
    directory: Path,
    progress: Progress = no_progress,
    *,
    mesh: PolyMesh | None = None,
    loaded: LoadedMesh | None = None,
    workers: int = 0,
    replaced: Collection[Path] = (),
    recorded: Path | None = None,
) -> FinishedJob:
    """Make a job, write its folder, and prove the written files: every check holds, or it raises.

    InputError is raised for bad input or settings, or a folder with anything else in it;
    CannotMakeError for what cannot be made as asked, or if a check objects to the written files.

    Parameters
    ----------
    settings, directory, progress
        The directory is new, empty, or has nothing but an older job, which is then replaced.
    mesh : PolyMesh, optional
        A mesh from memory, in place of the file; it is kept in the folder under that name.
    loaded : LoadedMesh, optional
        What the settings make of the mesh, if that is known already.
    workers : int
        Processes beside this one; the same bytes are written with any number.
    replaced : collection of Path
        Files of that older job that may have been changed, as the settings were read from them.
    recorded : Path, optional
        The crossing map of this very job: pieces lie as it says, and are not nested.
    """
    job_folder.clear_abandoned(directory)
    source = None if mesh is not None else settings.mesh.source
    job_folder.check_destination(directory, replaced, mesh=source)
    with ExitStack() as stack:
        start = stack.enter_context(side_workers(min(workers, _MOST_WORKERS)))
        job = make_job(
            settings, progress, mesh=mesh, loaded=loaded, start=start,
            executors=processes(workers), recorded=recorded,
        )  # fmt: skip
        # Processes end before the folder is moved, or removed: no file comes to it late.
        with told_where(directory), finished_folder(directory, replaced) as new, stack.pop_all():
            return write_and_prove(job, new, progress, start)
