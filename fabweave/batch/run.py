"""Make the jobs of a batch, each in its folder, and tell of those that cannot be made."""

import hashlib
import json
import re
import shutil
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from fabweave import __version__
from fabweave.batch.asked import PAGE, RECORD, TOGETHER, Asked, Batch
from fabweave.batch.page import batch_page
from fabweave.batch.together import QUEUE_FILE, Cut, cuts_of, shared, write_together
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, FabweaveError, InputError
from fabweave.core.files import write_files
from fabweave.core.job_folder import (
    clear_abandoned,
    file_names,
    finished_folder,
    is_complete,
    told_where,
)
from fabweave.core.messages import shown
from fabweave.core.parallel.executors import Executors, finished, here
from fabweave.design.making import make_or_advise
from fabweave.design.wishes import Wishes, parse_wishes
from fabweave.job.remake import asked_of
from fabweave.job.stations import Stations
from fabweave.job.write import json_text
from fabweave.mesh.given import GivenMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings, settings_table
from fabweave.plan.crossing_map import StepRecord, read_crossing_map

SCHEMA = "fabweave.batch/1"
#: Reads the mesh and the options of a job.
Read: TypeAlias = Callable[[Any, Mapping[str, Any]], Stations]
#: Told of each job: its name, and why it could not be made, if it was not.
Told: TypeAlias = Callable[[str, str], None]
#: More pieces than these nobody weaves.
_MOST_PIECES = 1_000_000


class Part(NamedTuple):
    """What a worker makes of a job: its files by their names, and what it cuts."""

    files: dict[str, bytes]
    cuts: tuple[Cut, ...]


@dataclass(frozen=True)
class Outcome:
    """What became of a batch.

    Parameters
    ----------
    made, kept : tuple of str
        The jobs that were made now, and those that were there.
    failed : mapping
        Why the others were not, by their names.
    together : tuple of Path
        The folders of sheets that jobs share.
    """

    made: tuple[str, ...]
    kept: tuple[str, ...]
    failed: Mapping[str, str]
    together: tuple[Path, ...]


class _Ready(NamedTuple):
    """A job that can be begun: how it is made, and what tells it from others of its name."""

    asked: Asked
    number: int
    job: Stations
    wishes: Wishes
    digest: str


def run_batch(
    batch: Batch,
    directory: Path,
    *,
    read: Read,
    executors: Executors = here,
    told: Told = lambda _name, _why: None,
    progress: Progress = no_progress,
) -> Outcome:
    """Make what is missing of a batch: a folder for each job, shared sheets, and a page of all.

    A job that cannot be made is told, and does not stop the rest. Each folder is put in place when
    it is proved, so that Ctrl-C leaves whole jobs; another run makes the rest. The files do not
    depend on who made them, nor in which order.

    Parameters
    ----------
    batch : Batch
    directory : Path
        Holds the folders of the jobs.
    read : callable
        Reads the mesh and the options of each.
    executors : callable
        Opens the executor that makes jobs.
    told, progress : callable
        Told of each job that is made or fails, and how many are done.
    """
    with told_where(directory):
        directory.mkdir(parents=True, exist_ok=True)
    names = {TOGETHER, *(one.name for one in batch.jobs)}
    done = {name: digest for name, digest in _record(directory).items() if name in names}
    failed: dict[str, str] = {}
    ready = _each(batch, read, failed)
    for name, why in failed.items():
        told(name, why)
    left = [one for one in ready if not _is_there(one, directory, done)]
    cuts: dict[str, tuple[Cut, ...]] = {}
    total = len(batch.jobs)
    progress("jobs", total - len(left), total)
    with tempfile.TemporaryDirectory(prefix="fabweave-batch-") as scratch, executors() as executor:
        tasks = [
            (one.job.asked, one.job.given, one.job.given_mesh, one.wishes,
             (one.number, one.asked.name) if batch.together else None, scratch)
            for one in left
        ]  # fmt: skip
        for count, (at, part) in enumerate(finished(executor, make_part, tasks, lost=str), start=1):
            name = left[at].asked.name
            try:
                if isinstance(part, str):
                    raise CannotMakeError(part)
                _put(part.files, directory / name)
                cuts[name], done[name] = part.cuts, left[at].digest
                _write_record(directory, done)
            except FabweaveError as error:
                failed[name] = str(error)
            told(name, failed.get(name, ""))
            progress("jobs", total - len(left) + count, total)
    whole = [one for one in ready if one.asked.name not in failed]
    there = [one.asked.name for one in whole]
    folders: tuple[Path, ...] = ()
    if batch.together:
        folders = _together(whole, cuts, directory, executors, told, progress)
    page = batch_page(directory, there, {one: failed[one] for one in sorted(failed)}, folders)
    write_files({directory / PAGE: page.encode()})
    made = {one.asked.name for one in left}
    return Outcome(
        tuple(name for name in there if name in made),
        tuple(name for name in there if name not in made),
        failed,
        folders,
    )


def _each(batch: Batch, read: Read, failed: dict[str, str]) -> list[_Ready]:
    """Return the jobs whose mesh and options can be read; why others cannot goes to ``failed``."""
    ready = []
    for number, asked in enumerate(batch.jobs, start=1):
        try:
            if asked.pieces is not None and not (
                type(asked.pieces) is int and 1 <= asked.pieces <= _MOST_PIECES
            ):
                raise InputError(f"pieces is {shown(asked.pieces)}, and must be a whole number")
            wishes = parse_wishes(str(asked.goal), asked.pieces)
            job = read(asked.mesh, asked.options)
            mesh = job.given_mesh.mesh
        except FabweaveError as error:
            failed[asked.name] = str(error)
            continue
        told = [__version__, settings_table(job.asked), repr(wishes)]
        digest = hashlib.sha256(json.dumps(told, sort_keys=True, default=str).encode())
        for array in (mesh.vertices, mesh.indices, mesh.offsets):
            digest.update(array.tobytes())
        ready.append(_Ready(asked, number, job, wishes, digest.hexdigest()))
    return ready


def make_part(
    settings: Settings,
    given: PolyMesh | None,
    given_mesh: GivenMesh,
    wishes: Wishes,
    named: tuple[int, str] | None,
    scratch: str,
) -> Part | str:
    """Make a job somewhere, and return its files; or why it cannot be made.

    Parameters
    ----------
    settings, given, given_mesh
        Its stations.
    wishes : Wishes
    named : (int, str), optional
        The number and the name of a job that may share sheets.
    scratch : str
        A folder of the machine that asks: where it is not there, another one does.
    """
    job = Stations(settings, given).know(given_mesh=given_mesh)
    near = scratch if Path(scratch).is_dir() else None
    try:
        with tempfile.TemporaryDirectory(prefix="fabweave-job-", dir=near) as folder:
            made = make_or_advise(job, Path(folder) / "job", wishes=wishes)
            if made.finished.missing:
                return f"papers could not be made: {'; '.join(made.finished.missing)}"
            there = Path(folder) / "job"
            files = {name: (there / name).read_bytes() for name in file_names(there)}
            return Part(
                files,
                ()
                if named is None
                else cuts_of(made.finished.job, made.finished.job.steps, *named),
            )
    except FabweaveError as error:
        return str(error)
    except MemoryError:
        return "there was not enough memory; use a coarser mesh, or fewer jobs at a time"
    except Exception as error:  # a defect, which is no reason to lose the other jobs
        where = traceback.extract_tb(error.__traceback__)[-1]
        return (
            f"this is a defect of fabweave ({type(error).__name__}: {error}, in {where.name}); "
            "please report it with the mesh and the options"
        )


def cut_part(
    settings: Settings,
    given: PolyMesh | None,
    steps: tuple[StepRecord, ...],
    number: int,
    name: str,
) -> tuple[Cut, ...]:
    """Return what a finished job cuts, planned once more, with its steps."""
    return cuts_of(Stations(settings, given).planned, steps, number, name)


def _put(files: Mapping[str, bytes], folder: Path) -> None:
    """Write a job's folder, whole."""
    clear_abandoned(folder)
    with told_where(folder), finished_folder(folder) as fresh:
        for name, data in files.items():
            path = fresh / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


def _record(directory: Path) -> dict[str, str]:
    """Return what tells which jobs are there; nothing where that cannot be read."""
    try:
        told = json.loads((directory / RECORD).read_bytes())
        return {str(name): str(digest) for name, digest in told["jobs"].items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return {}


def _write_record(directory: Path, done: Mapping[str, str]) -> None:
    """Write which jobs are there."""
    told = {"schema": SCHEMA, "jobs": dict(sorted(done.items()))}
    write_files({directory / RECORD: json_text(told).encode()})


def _is_there(one: _Ready, directory: Path, done: Mapping[str, str]) -> bool:
    """Tell whether a job is there, as it is asked for now, and nothing was changed."""
    folder = directory / one.asked.name
    return done.get(one.asked.name) == one.digest and folder.is_dir() and is_complete(folder)


def _together(
    jobs: Sequence[_Ready],
    cuts: dict[str, tuple[Cut, ...]],
    directory: Path,
    executors: Executors,
    told: Told,
    progress: Progress,
) -> tuple[Path, ...]:
    """Write the sheets that jobs share, unless they are there; sheets of other jobs are removed."""
    place = directory / TOGETHER
    plans = [
        (one.number, one.asked.name, hashlib.sha256(plan.read_bytes()).hexdigest())
        for one in jobs
        for plan in [directory / one.asked.name / "crossing_map.json"]
    ]
    asked = hashlib.sha256(json.dumps([__version__, plans]).encode()).hexdigest()
    there = sorted(path for path in place.glob("*") if (path / QUEUE_FILE).is_file())
    known = _record(directory).get(TOGETHER)
    if known == asked and there and all(map(is_complete, there)):
        return tuple(there)
    left = [one for one in jobs if one.asked.name not in cuts]
    tasks = [
        (
            *asked_of(directory / one.asked.name),
            read_crossing_map(directory / one.asked.name / "crossing_map.json").steps,
            one.number,
            one.asked.name,
        )
        for one in left
    ]
    with executors() as executor:
        for at, found in finished(executor, cut_part, tasks):
            cuts[left[at].asked.name] = found
    folders: list[Path] = []
    for group in shared(cut for one in jobs for cut in cuts[one.asked.name]):
        material = re.sub(r"[^a-z0-9.]+", "-", group[0].supplies.each[0].material.caption.lower())
        names = (material, *(f"{material}-{number}" for number in range(2, len(jobs) + 2)))
        folder = next(place / name for name in names if place / name not in folders)
        clear_abandoned(folder)
        try:
            write_together(group, folder, directory, executors, progress)
        except FabweaveError as error:
            told(f"{TOGETHER}/{folder.name}", str(error))
            continue
        folders.append(folder)
    for stale in there:
        # Whoever cuts these, cuts what is no job's any more.
        if stale not in folders and is_complete(stale):
            shutil.rmtree(stale)
    done = _record(directory) | {TOGETHER: asked}
    _write_record(directory, done)
    return tuple(sorted(folders))
