"""Run every check on a finished job, and hold its files to the list of all, by their SHA-256."""

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fabweave.verify.check import (
    base,
    colours,
    drawings,
    fastening,
    form,
    former,
    joints,
    kerf,
    notes,
    pieces,
    ribbons,
    rim,
    service,
    shared,
    sheets,
    source,
    space,
    steps,
    tables,
    weave,
)
from fabweave.verify.drawing import ReadError, read_text, too_large
from fabweave.verify.read.job_files import Job, load_job
from fabweave.verify.read.queue import QUEUE, load_queue
from fabweave.verify.report import Tally, VerifyReport

#: The list of a job's files; it does not list itself, nor what the proof itself writes last.
SEAL, PROOF = "contents.json", "verify.json"
#: What file managers leave in folders that somebody looks at.
_LITTER = (".DS_Store", "Thumbs.db", "desktop.ini")


@dataclass(frozen=True)
class _Task:
    """A check: its name, the files it cannot do without, and what runs it."""

    name: str
    needs: tuple[str, ...]
    run: Callable[[Job, Tally], None]


_FILES = {
    "map": "crossing_map.json",
    "mesh": "woven_mesh.obj",
    "model": "model.glb",
    "ribbons": "ribbons.json",
}

_TASKS = (
    _Task("files", (), source.check_references),
    _Task("source", ("mesh",), source.check_source),
    _Task("mesh-walks", ("map", "mesh"), weave.check_walks),
    _Task("over-under", ("map",), weave.check_over_under),
    _Task("pattern", ("map", "mesh"), weave.check_pattern),
    _Task("space", ("map", "mesh", "model"), space.check_space),
    _Task("clearance", ("map", "model", "ribbons"), ribbons.check_clearance),
    _Task("bends", ("map", "model", "ribbons"), ribbons.check_bends),
    _Task("grain", ("map", "model", "ribbons"), ribbons.check_grain),
    _Task("piece-order", ("map",), pieces.check_piece_order),
    _Task("joints", ("map", "model"), joints.check_joints),
    _Task("kinds", ("map",), pieces.check_kinds),
    _Task("crossing-holes", ("map",), pieces.check_crossing_holes),
    _Task("fastened", ("map",), fastening.check_fastening),
    _Task("unfolding", ("map", "model"), pieces.check_unfolding),
    _Task("outlines-dxf", ("map",), drawings.check_dxf),
    _Task("outlines-svg", ("map",), drawings.check_svg),
    _Task("lines", ("map",), drawings.check_lines),
    _Task("cut", ("map",), kerf.check_ready),
    _Task("order", ("map",), drawings.check_order),
    _Task("colours", ("map",), colours.check_colours),
    _Task("labels", ("map",), drawings.check_labels),
    _Task("notes", ("map",), notes.check_notes),
    _Task("sheets", ("map",), sheets.check_sheets),
    _Task("service", ("map",), service.check_service),
    _Task("sticks", ("map",), tables.check_sticks),
    _Task("cut-list", ("map",), tables.check_cut_list),
    _Task("tables", ("map",), tables.check_tables),
    _Task("stock", ("map",), sheets.check_stock),
    _Task("offcuts", ("map",), sheets.check_offcuts),
    _Task("rim", ("map", "mesh"), rim.check_rim),
    _Task("former", ("map", "mesh"), former.check_former),
    _Task("base", ("map", "mesh"), base.check_base),
    _Task("form", ("map",), form.check_form),
    _Task("simple", ("map",), pieces.check_simple),
    _Task("materials", ("map",), sheets.check_materials),
    _Task("steps", ("map",), steps.check_steps),
)

#: Those of sheets that several jobs share, beside whose they are.
_OF_SHARED = frozenset((
    "outlines-dxf", "outlines-svg", "lines", "cut", "order", "colours", "labels", "notes", "sheets",
    "stock", "simple", "materials",
))  # fmt: skip
_SHARED_TASKS = (
    _Task("files", (), lambda _job, _tally: None),
    _Task("shared", ("map",), shared.check_shared),
    *(task for task in _TASKS if task.name in _OF_SHARED),
)


def verify_job(directory: Path) -> VerifyReport:
    """Read a finished job's files back and prove them.

    Parameters
    ----------
    directory : Path
        The folder that a run left: of a job, or of sheets that jobs share.

    Returns
    -------
    VerifyReport
        One result for each check, in a fixed order. Missing and malformed files are findings,
        never exceptions.

    Examples
    --------
    >>> report = verify_job(Path("no/such/folder"))
    >>> report.ok, report.checks[0].name, report.checks[0].findings[0]
    (False, 'seal', 'contents.json is missing')
    """
    return sealed(prove_plan(Path(directory)), Path(directory))


def prove_plan(directory: Path, jobs: Path | None = None) -> VerifyReport:
    """Prove what is cut, the model and the plan, whatever other files there are yet.

    The jobs whose pieces lie on shared sheets are two folders above these, or in that of ``jobs``.
    """
    results, tally = [], Tally("files")
    several = (directory / QUEUE).is_file()
    tasks = _SHARED_TASKS if several else _TASKS
    try:
        if several:
            job = load_queue(directory, jobs or directory.resolve().parents[1], tally)
        else:
            job = load_job(directory, tally)
    except Exception as error:  # whatever the folder holds, this is a finding
        tally.unfinished("the folder cannot be read to its end", error)
        job = Job()
    for task in tasks:
        tally = tally if task is tasks[0] else Tally(task.name)
        _run(task, job, tally)
        results.append(tally.result())
    return VerifyReport(tuple(results))


def sealed(proof: VerifyReport, directory: Path) -> VerifyReport:
    """Return a proof together with the seal on all files of the folder."""
    seal = Tally("seal")
    check_seal(directory, seal)
    return VerifyReport((seal.result(), *proof.checks))


def _run(task: _Task, job: Job, tally: Tally) -> None:
    """Run one check if its files are there."""
    missing = [_FILES[need] for need in task.needs if getattr(job, need) is None]
    if missing:
        tally.fail(f"not checked, because {' and '.join(missing)} could not be read")
        return
    try:
        with np.errstate(all="ignore"):  # what is not finite fails its comparison
            task.run(job, tally)
    except Exception as error:  # whatever the files hold, this is a finding
        tally.unfinished("not finished", error)


def check_seal(directory: Path, tally: Tally) -> None:
    """Check that a folder holds the files that its list names, unchanged, and no others.

    Parameters
    ----------
    directory : Path
        The job's folder.
    tally : Tally
        Told every file that is missing, added or changed.
    """
    try:
        seal = json.loads(read_text(directory / SEAL))
        listed, sizes = dict(seal["files"].items()), dict(seal.get("bytes", {}).items())
    except FileNotFoundError:
        tally.fail(f"{SEAL} is missing")
        return
    except (
        ReadError, OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError
    ) as error:  # fmt: skip
        tally.fail(f"{SEAL} cannot be read: {error}")
        return
    there = set()
    for where, _, names in os.walk(directory):
        folder = Path(where).relative_to(directory)
        there |= {(folder / name).as_posix() for name in names if name not in _LITTER}
    for name in sorted((there - {SEAL, PROOF}) | set(listed)):
        wrong = ""
        if name not in listed:
            wrong = f"{SEAL} does not list it"
        elif name not in there:
            wrong = "it is missing"
        else:
            wrong = _changed(directory / name, listed[name], sizes.get(name))
        tally.at(name).expect(not wrong, wrong)


def _changed(path: Path, digest: object, size: object) -> str:
    """Say how a file is not what the seal says, by its size first; older seals have no sizes."""
    if path.is_symlink() or not path.is_file():
        return "it was changed: it is no plain file"
    there = path.stat().st_size
    if size not in (None, there):
        return f"it was changed: it has {there} bytes, and {SEAL} says {size}"
    if large := too_large(path.name, there):
        return large
    with path.open("rb") as file:
        same = hashlib.file_digest(file, "sha256").hexdigest() == digest
    return "" if same else f"it was changed: it is not what {SEAL} says"
