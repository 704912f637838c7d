"""Write a finished job's folder: all of it, or nothing."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from fabweave.app.job_files import write_job, write_proof
from fabweave.app.pipeline import Job, make_job
from fabweave.app.preflight_job import Preflight
from fabweave.app.settings import Settings
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.parallel.executors import Executors, processes
from fabweave.core.parallel.interrupt import held_back
from fabweave.core.parallel.workers import side_workers
from fabweave.verify import VerifyReport, verify_job

#: More processes than these find nothing to do in most jobs.
_MOST_WORKERS = 4


class FinishedJob(NamedTuple):
    """A job that is made and written: all of it, what proves it, and which rules it breaks."""

    job: Job
    proof: VerifyReport
    preflight: Preflight


def check_destination(directory: Path) -> None:
    """Raise InputError unless a job may be written to this folder.

    It may if there is nothing there yet, or an empty folder, or an older job of fabweave's.
    """
    if not directory.exists():
        above = next(folder for folder in directory.absolute().parents if folder.exists())
        if not above.is_dir():
            raise InputError(f"{above} is a file, so there can be no folder in it; name another")
        if not os.access(above, os.W_OK):
            raise InputError(f"nothing may be written in {above}; name another folder with -o")
        return
    if not directory.is_dir():
        raise InputError(f"{directory} is a file; name a folder with -o")
    # All of it: where a generator is left half-way, Ctrl-C may come to nothing.
    if list(directory.iterdir()) and not (directory / "job.toml").is_file():
        raise InputError(
            f"{directory} holds files that are no fabweave job (it has no job.toml), and they "
            "would be lost; name another folder with -o, or empty it"
        )


@contextmanager
def finished_folder(directory: Path) -> Iterator[Path]:
    """Give a temporary folder beside the destination and move it there when all went well.

    An older job stays in place until the new one is complete. If the block fails or is
    interrupted, nothing is left behind.
    """
    check_destination(directory)
    directory = directory.absolute()
    directory.parent.mkdir(parents=True, exist_ok=True)
    with held_back():
        temporary = Path(tempfile.mkdtemp(prefix=f".{directory.name}.", dir=directory.parent))
    try:
        fresh = temporary / "new"
        fresh.mkdir()
        yield fresh
        with held_back():
            _put_in_place(fresh, directory, temporary / "old")
    finally:
        with held_back():
            shutil.rmtree(temporary, ignore_errors=True)


def _put_in_place(fresh: Path, directory: Path, old: Path) -> None:
    """Move a folder to its destination, and what was there aside; back if that fails."""
    if directory.exists():
        directory.rename(old)
    try:
        fresh.rename(directory)
    except OSError:
        if old.exists():
            old.rename(directory)
        raise


def run_job(
    settings: Settings,
    directory: Path,
    progress: Progress = no_progress,
    *,
    workers: int = 0,
    executors: Executors | None = None,
) -> FinishedJob:
    """Make a job, write its folder, and prove the written files.

    Parameters
    ----------
    settings : Settings
    directory : Path
        New, empty, or an older job's folder, which is replaced when the new one is proved.
    progress : callable
    workers : int
        Processes beside this one; the same bytes are written with any number.
    executors : callable, optional
        Opens the executor that nests very many pieces, in place of these processes.

    Returns
    -------
    Done
        Every check holds; what was proved stands in ``verify.json`` too.

    Raises
    ------
    InputError
        For bad input or settings, or a folder with anything else in it.
    CannotMakeError
        For what cannot be made as asked, or if a check objects to the written files.
    """
    check_destination(directory)
    with ExitStack() as stack:
        start = stack.enter_context(side_workers(min(workers, _MOST_WORKERS)))
        job = make_job(settings, progress, start=start, executors=executors or processes(workers))
        # Processes end before the folder is moved, or removed: no file comes to it late.
        with finished_folder(directory) as folder, stack.pop_all():
            found = write_job(job, folder, progress, start=start)
            progress("verify", 0, 1)
            proof = verify_job(folder)
            if not proof.ok:
                raise CannotMakeError(_disproved(proof))
            write_proof(folder, proof)
    return FinishedJob(job, proof, found)


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


def folder_is_readable(directory: Path) -> None:
    """Raise InputError unless the folder is there and can be listed."""
    if not directory.is_dir() or not os.access(directory, os.R_OK):
        raise InputError(f"{directory} is no folder that can be read; name a finished job's folder")
