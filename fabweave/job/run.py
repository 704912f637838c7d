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
    processes,
    side_workers,
)
from fabweave.job.draw import Job, draw_job, start_side_work
from fabweave.job.papers import show_job, start_pictures
from fabweave.job.stations import Stations
from fabweave.job.write import write_plan, write_proof
from fabweave.plan.preflight import Preflight
from fabweave.verify.proof import prove_plan, sealed
from fabweave.verify.report import VerifyReport

#: More processes than these find nothing to do in most jobs.
_MOST_WORKERS = 4


class FinishedJob(NamedTuple):
    """A job that is made and proved, which rules it breaks, and which papers could not be made."""

    job: Job
    proof: VerifyReport
    preflight: Preflight
    missing: tuple[str, ...] = ()


def write_and_prove(
    job: Job, folder: Path, progress: Progress = no_progress, start: Start = at_once
) -> FinishedJob:
    """Write a job's plan into an empty folder, read it back and prove it, and show what was proved.

    CannotMakeError is raised if a rule is broken and that was ruled out, or if a check objects.
    """
    pictures = start_pictures(job, start)
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
    missing = show_job(job, report, pictures, folder, progress, start=start)
    job_folder.write_contents(folder)
    proof = sealed(proof, folder)
    write_proof(folder, proof)
    return FinishedJob(job, proof, preflight, missing)


def run_job(
    job: Stations,
    directory: Path,
    *,
    workers: int = 0,
    executors: Executors | None = None,
    replaced: Collection[Path] = (),
) -> FinishedJob:
    """Make a job, write its folder, and prove the written files: every check holds, or it raises.

    InputError is raised for bad input or settings, or a folder with anything else in it;
    CannotMakeError for what cannot be made as asked, or if a check objects to the written files.

    Parameters
    ----------
    job : Stations
        A mesh from memory is kept in the folder under its name.
    directory : Path
        New, empty, or with nothing but an older job, which is then replaced.
    workers : int
        Processes beside this one; the same bytes are written with any number.
    executors : callable, optional
        Opens the executor that nests, in place of those processes: they also write files, which
        other machines could not.
    replaced : collection of Path
        Files of that older job that may have been changed, as the settings were read from them.
    """
    job_folder.clear_abandoned(directory)
    source = None if job.given is not None else job.asked.mesh.source
    job_folder.check_destination(directory, replaced, mesh=source)
    job.executors = executors or processes(workers)
    with ExitStack() as stack:
        start = stack.enter_context(side_workers(min(workers, _MOST_WORKERS)))
        drawn = draw_stations(job, start)
        # Processes end before the folder is moved, or removed: no file comes to it late.
        with told_where(directory), finished_folder(directory, replaced) as new, stack.pop_all():
            return write_and_prove(drawn, new, job.progress, start)


def draw_stations(job: Stations, start: Start = at_once) -> Job:
    """Make everything that a job writes; ``start`` does work beside this process."""
    planned = job.buildable
    side = start_side_work(planned, job.asked, job.given, start)
    return draw_job(planned, job.layout, side, job.progress, job.given)
