"""Read the sheets that jobs share, and the plans of these jobs, as one plan of what is cut."""

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec

from fabweave.verify.crossing_map import (
    CrossingMap,
    Cut,
    Layout,
    Piece,
    Placement,
    Sheet,
    Thread,
    Weave,
    read_crossing_map,
    read_json,
)
from fabweave.verify.drawing import ReadError, read_content
from fabweave.verify.read.job_files import (
    Drawings,
    Job,
    find_strange,
    read_ready,
    read_table,
    read_toml,
    reader,
)
from fabweave.verify.report import Tally

#: What is on shared sheets, and the table of it.
QUEUE, TABLE = "queue.json", "pieces.csv"
#: A job is a folder beside, and never leads elsewhere.
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_. -]*")
#: What has to be the same for all jobs that share sheets, as their job.toml has it.
_SAME = (
    "kerf", "micro_joints", "strips", "profile", "preset", "dxf", "svg_units", "hairline", "labels",
    "label_side", "rotations", "margin",
)  # fmt: skip


class QueuedPiece(msgspec.Struct, frozen=True):
    """A piece on a shared sheet: what it bears, whose it is and which there, where it lies."""

    id: str
    job: int
    piece: str
    sheet: int
    placement: Placement


class QueuedJob(msgspec.Struct, frozen=True):
    """A job: its number, its folder's name, and the SHA-256 of its plan."""

    number: int
    name: str
    crossing_map: str


class Account(msgspec.Struct, frozen=True):
    """Sheets that are counted, and what of them becomes no piece."""

    sheets: int
    area_mm2: float
    waste_mm2: float
    utilisation: float


class Queue(msgspec.Struct, frozen=True):
    """What is said to be on shared sheets."""

    schema: Literal["fabweave.queue/1"]
    units: Literal["mm"]
    material: str
    thickness_mm: float
    jobs: tuple[QueuedJob, ...]
    together: Account
    one_by_one: Account
    layout: Layout
    cut: Cut
    sheets: tuple[Sheet, ...]
    pieces: tuple[QueuedPiece, ...]


@dataclass(frozen=True, eq=False)
class Shared:
    """A queue, the jobs whose pieces it has by their numbers, and its table for people."""

    queue: Queue
    jobs: dict[int, Job]
    rows: list[dict[str, str]]


def load_queue(directory: Path, jobs: Path, tally: Tally) -> Job:
    """Read shared sheets, as a job whose plan has the pieces of all.

    Parameters
    ----------
    directory : Path
        The folder of the shared sheets.
    jobs : Path
        The folder in which those of the jobs are.
    tally : Tally
        Where missing and malformed files are told.
    """
    read, of_jobs = reader(directory, tally), reader(jobs, tally)
    queue: Queue | None = read(QUEUE, lambda path: read_json(path, Queue))
    if queue is None:
        return Job()
    known = {}
    for one in queue.jobs:
        if not _NAME.fullmatch(one.name):
            tally.fail(f"{one.name!r} is the name of no job's folder")
            continue
        plan = of_jobs(f"{one.name}/crossing_map.json", _plan_of(one))
        settings = of_jobs(f"{one.name}/job.toml", read_toml)
        if plan is not None and settings is not None:
            known[one.number] = Job(map=plan, settings=settings)
    options = _options(queue, known, tally)
    names = [sheet.name for sheet in queue.sheets]
    sheets = Drawings("sheets")
    for name in names:
        sheets.add(name, read)
    find_strange(directory / sheets.folder, names, tally)
    rows = read(TABLE, read_table) or []
    return Job(
        map=_joined(queue, known, tally),
        sheets=sheets,
        settings={"job": options},
        ready=read_ready(directory, options, names, read, tally),
        shared=Shared(queue, known, rows),
    )


def _plan_of(job: QueuedJob) -> Callable[[Path], CrossingMap]:
    """Return what reads a job's plan, if it is still the one whose pieces were nested."""

    def read(path: Path) -> CrossingMap:
        if hashlib.sha256(read_content(path)).hexdigest() != job.crossing_map:
            raise ReadError("it is another plan than the one that was nested")
        return read_crossing_map(path)

    return read


def _options(queue: Queue, jobs: dict[int, Job], tally: Tally) -> dict[str, Any]:
    """Return the options by which the sheets are cut: those of all jobs, which agree."""
    each = {number: job.options for number, job in jobs.items()}
    first: dict[str, Any] = next(iter(each.values()), {})
    for number, options in each.items():
        place = tally.at(f"job {number}").against(f"job {next(iter(each))}")
        for key in _SAME:
            place.equal(key, options.get(key), first.get(key))
    gaps = [
        supply.gap_mm or 0.0
        for job in jobs.values()
        for supply in job.supplies.values()
        if (supply.material, supply.thickness_mm) == (queue.material, queue.thickness_mm)
    ]
    told = {
        "material": queue.material,
        "thickness": f"{queue.thickness_mm}mm",
        "gap": f"{max(gaps, default=0.0)}mm",
    }
    return {key: first[key] for key in (*_SAME, "sheet", "stock") if key in first} | told


def _joined(queue: Queue, jobs: dict[int, Job], tally: Tally) -> CrossingMap:
    """Return a plan with the pieces of all jobs where the queue has them."""
    pieces: list[Piece] = []
    for one in queue.pieces:
        plan = jobs[one.job].map if one.job in jobs else None
        own = plan.cut_piece.get(one.piece) if plan is not None else None
        if tally.at(one.id).expect(own, f"job {one.job} has no piece {one.piece}") and own:
            place = {"id": one.id, "sheet": one.sheet, "placement": one.placement, "thread": 0}
            pieces.append(msgspec.structs.replace(own, mirror_mm=None, **place))
    return CrossingMap(
        schema="fabweave.crossing-map/1",
        units="mm",
        weave=Weave("", exact=True, broken={}),
        layout=queue.layout,
        cut=queue.cut,
        sheets=queue.sheets,
        threads=(Thread(0, "", closed=False, bunch=0, crossings=(), over=(), pieces=()),),
        crossings=(),
        pieces=tuple(pieces),
        joints=(),
        steps=(),
    )
