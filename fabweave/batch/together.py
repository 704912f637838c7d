"""Nest the pieces of several jobs on shared sheets, and write these for the cutter."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

import numpy as np
import shapely

from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.files import csv_text
from fabweave.core.job_folder import finished_folder, write_contents
from fabweave.core.parallel.executors import Executors, here
from fabweave.core.records import record, to_json
from fabweave.core.search import Search
from fabweave.job.map_builder import layout_record, sheet_records
from fabweave.job.papers import lettered_ids, show_sheet
from fabweave.job.planned import PlannedJob
from fabweave.job.write import cut_record, json_text, write_cuts, write_proof, write_text
from fabweave.nest.layout import Layout
from fabweave.piece.piece import Piece
from fabweave.plan.allotment import Allotment
from fabweave.plan.crossing_map import (
    CutRecord,
    LayoutRecord,
    PlacementRecord,
    SheetRecord,
    StepRecord,
    read_crossing_map,
)
from fabweave.plan.nest_pieces import nest_pieces
from fabweave.sheet.kerf import CUT_FOLDER, kerfed_sheets
from fabweave.sheet.labels.lettering import lettered
from fabweave.sheet.labels.marks import Marks, mark_pieces, mark_spares
from fabweave.sheet.labels.texts import kind_name
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.sheets import draw_sheets
from fabweave.stock.supplies import Supplies
from fabweave.verify.proof import prove_plan, sealed

#: What is on shared sheets, and where.
QUEUE_FILE = "queue.json"
#: So many letters of a note stand in a line.
_LINE = 56


@frozen_value
class Cut:
    """What a job cuts of one supply, as it shares sheets with others.

    Parameters
    ----------
    number, name : int, str
        Of the job in its batch.
    pieces : tuple of Piece
        Spares too; the number stands before their ids.
    marks : tuple of Marks
        What is engraved on each.
    names : tuple of str
        What people call each piece, where that is not its id.
    labels : str
        How they are lettered.
    supplies : Supplies
        That supply alone.
    machine : MachineSettings
    search : Search
    common : bool
        Whether strips share cuts.
    """

    number: int
    name: str
    pieces: tuple[Piece, ...]
    marks: tuple[Marks, ...]
    names: tuple[str, ...]
    labels: str
    supplies: Supplies
    machine: MachineSettings
    search: Search
    common: bool

    @property
    def rule(self) -> tuple[Any, ...]:
        """How it is cut: jobs share sheets where these are equal."""
        return self.supplies, self.machine, self.labels, self.common

    @property
    def prefix(self) -> str:
        """What stands before the ids of its pieces."""
        return prefix_of(self.number)


def prefix_of(number: int) -> str:
    """Return what stands before the ids of the pieces of a job."""
    return str(number)


def cuts_of(
    planned: PlannedJob, steps: Iterable[StepRecord], number: int, name: str
) -> tuple[Cut, ...]:
    """Return what a job cuts of each of its supplies; none of one that it has twice, or of rolls.

    Parameters
    ----------
    planned : PlannedJob
    steps : iterable of StepRecord
        How it is put together: pieces bear the step in which they are placed.
    number, name : int, str
        Of the job in its batch, from 1.
    """
    settings, pieces, supplies = planned.settings, planned.piece_set, planned.supplies
    how = settings.pieces.labels, settings.pieces.label_side
    crossings, prefix = planned.weave.threads.n_crossings, prefix_of(number)
    placed = {piece: step.step for step in steps for piece in step.pieces}
    least_mm = settings.machine.letters_mm
    marks = mark_pieces(pieces.pieces, crossings, *how, pieces.kinds, placed, prefix, least_mm)
    to_cut = planned.to_cut
    spares = to_cut[len(marks) :]
    marks += mark_spares(spares, [marks[at] for at in planned.spared.tolist()], *how, prefix)
    kinds = planned.kinds[planned.origins].tolist()
    of = supplies.of(planned.woven.bunches)[[piece.thread for piece in to_cut]].tolist()
    materials = [supply.material for supply in supplies.each]
    cuts = []
    for index, supply in enumerate(supplies.each):
        if supplies.rolls or materials.count(supply.material) > 1:
            continue
        own = [at for at, supply_of in enumerate(of) if supply_of == index]
        only = replace(supply, bunches=())
        cuts.append(
            Cut(
                number, name,
                tuple(replace(to_cut[at], id=prefix + to_cut[at].id, thread=0) for at in own),
                tuple(marks[at] for at in own),
                tuple(prefix + kind_name(kinds[at]) for at in own) if how[0] == "kinds" else (),
                "/".join(how),
                replace(supplies, each=(only,), sheets=only.sheets, former=None),
                settings.machine,
                replace(settings.search, pin=None, layout=None),
                settings.common_cuts,
            )
        )  # fmt: skip
    return tuple(cuts)


@record
class QueuedPiece:
    """A piece on a shared sheet: what it bears, whose it is and which there, and where it lies."""

    id: str
    job: int
    piece: str
    sheet: int
    placement: PlacementRecord


@record
class QueuedJob:
    """A job whose pieces are on shared sheets: its number and name, and its plan's SHA-256."""

    number: int
    name: str
    crossing_map: str


@record
class Account:
    """How many sheets there are, how large they are together, and what share becomes pieces."""

    sheets: int
    area_mm2: float
    waste_mm2: float
    utilisation: float


@record
class Queue:
    """What is on shared sheets, and what that saves: ``queue.json``."""

    schema: Literal["fabweave.queue/1"] = "fabweave.queue/1"
    units: Literal["mm"] = "mm"
    material: str
    thickness_mm: float
    jobs: tuple[QueuedJob, ...]
    together: Account
    one_by_one: Account
    layout: LayoutRecord
    cut: CutRecord
    sheets: tuple[SheetRecord, ...]
    pieces: tuple[QueuedPiece, ...]


def shared(cuts: Iterable[Cut]) -> list[list[Cut]]:
    """Return which jobs share sheets: what is cut of one supply in one way, of two at least."""
    groups: list[list[Cut]] = []
    for cut in cuts:
        for group in groups:
            if group[0].rule == cut.rule:
                group.append(cut)
                break
        else:
            groups.append([cut])
    return [group for group in groups if len(group) > 1]


def write_together(
    group: Sequence[Cut],
    directory: Path,
    jobs: Path,
    executors: Executors = here,
    progress: Progress = no_progress,
) -> Queue:
    """Nest what some jobs cut of one supply, write the sheets into a folder, and prove them.

    Parameters
    ----------
    group : sequence of Cut
        Of one rule.
    directory : Path
        New, empty, or with an older queue.
    jobs : Path
        Where the folders of the jobs are.

    Raises
    ------
    CannotMakeError
        If the sheets run out, or a check objects.
    """
    first = group[0]
    supply, machine = first.supplies.each[0], first.machine
    pieces = tuple(piece for cut in group for piece in cut.pieces)
    marks = tuple(each for cut in group for each in cut.marks)
    bunches = np.zeros(1, dtype=np.int64)
    layout = nest_pieces(pieces, first.supplies, bunches, first.search, executors, progress)
    mirrored = first.supplies.mirrored
    drawings = draw_sheets(
        pieces, marks, layout, title="SHARED", mirrored=mirrored,
        captions=[supply.material.caption] * len(layout.sheets),
        names=[name for cut in group for name in cut.names],
        cool=machine.cut_order == "cool", warnings=_legend(group),
    )  # fmt: skip
    kerfed = kerfed_sheets(drawings, machine.kerf_mm, machine.micro_joints, common=first.common)
    allotment = Allotment(first.supplies, bunches, np.zeros(len(layout.sheets), dtype=np.int64))
    queue = Queue(
        material=supply.material.name,
        thickness_mm=supply.material.thickness_mm,
        jobs=tuple(_queued(cut, jobs) for cut in group),
        together=_account([one.width_mm * one.height_mm for one in layout.sheets], pieces),
        one_by_one=_account([each for cut in group for each in _own_area_mm2(cut, jobs)], pieces),
        layout=layout_record(layout),
        cut=cut_record(machine, first.labels.partition("/")[0]),
        sheets=sheet_records(layout, drawings, allotment, (), mirrored=mirrored),
        pieces=tuple(_places(group, layout)),
    )
    with finished_folder(directory) as fresh:
        ids = lettered_ids(pieces, marks)
        for folder, each in ((fresh / "sheets", drawings), (fresh / CUT_FOLDER, kerfed)):
            if each:
                folder.mkdir()
            for drawing in each:
                write_cuts(folder, drawing, machine)
        for drawing in drawings:
            show_sheet(fresh / "sheets", drawing, machine, ids)
        write_text(fresh / QUEUE_FILE, json_text(to_json(queue)))
        write_text(fresh / "pieces.csv", _table(queue))
        proof = prove_plan(fresh, jobs)
        if not proof.ok:  # a defect of fabweave's and never the user's
            found = [f"{one.name}: {one.findings[0]}" for one in proof.checks if not one.ok]
            raise CannotMakeError(
                f"shared sheets did not pass the proof; please report it: {'; '.join(found)}"
            )
        write_contents(fresh)
        write_proof(fresh, sealed(proof, fresh))
    return queue


def _legend(group: Sequence[Cut]) -> list[str]:
    """Return which number is of which job, in short lines."""
    lines = [""]
    for cut in group:
        told = f"{cut.prefix} {lettered(cut.name)}"
        if lines[-1] and len(lines[-1]) + len(told) > _LINE:
            lines.append("")
        lines[-1] += f"{', ' if lines[-1] else ''}{told}"
    return lines


def _queued(cut: Cut, jobs: Path) -> QueuedJob:
    """Return a job as the queue names it, with the digest of its plan."""
    plan = (jobs / cut.name / "crossing_map.json").read_bytes()
    return QueuedJob(number=cut.number, name=cut.name, crossing_map=sha256(plan).hexdigest())


def _own_area_mm2(cut: Cut, jobs: Path) -> list[float]:
    """Return how large the sheets are that a job takes of a supply by itself."""
    material = cut.supplies.each[0].material
    return [
        sheet.width_mm * sheet.height_mm
        for sheet in read_crossing_map(jobs / cut.name / "crossing_map.json").sheets
        if (sheet.material, sheet.thickness_mm) == (material.name, material.thickness_mm)
    ]


def _account(sheets_mm2: Sequence[float], pieces: Sequence[Piece]) -> Account:
    """Account for sheets of some areas, and the pieces on them."""
    area, used = sum(sheets_mm2), sum(shapely.Polygon(piece.outline).area for piece in pieces)
    return Account(
        sheets=len(sheets_mm2),
        area_mm2=round(area, 3),
        waste_mm2=round(area - used, 3),
        utilisation=round(used / area, 6),
    )


def _places(group: Sequence[Cut], layout: Layout) -> Iterator[QueuedPiece]:
    """Yield where each piece lies."""
    own = [(cut, piece) for cut in group for piece in cut.pieces]
    for (cut, piece), place in zip(own, layout.placements, strict=True):
        motion = PlacementRecord(rotation_deg=place.rotation_deg, x_mm=place.x_mm, y_mm=place.y_mm)
        yield QueuedPiece(
            id=piece.id, job=cut.number, piece=piece.id.removeprefix(cut.prefix),
            sheet=place.sheet + 1, placement=motion,
        )  # fmt: skip


def _table(queue: Queue) -> str:
    """Return the list of all pieces: on which sheet each lies, and of which job it is."""
    names = {job.number: job.name for job in queue.jobs}
    rows = sorted((one.sheet, one.job, at) for at, one in enumerate(queue.pieces))
    return csv_text(
        ("sheet", "job", "piece", "engraved"),
        (
            (queue.sheets[sheet - 1].name, names[job], queue.pieces[at].piece, queue.pieces[at].id)
            for sheet, job, at in rows
        ),
    )
