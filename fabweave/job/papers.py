"""Write the papers of a job out of its plan, read back: manual, viewer, pages, pictures."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.colour_space import Colours
from fabweave.core.job_folder import file_names
from fabweave.core.parallel.executors import Start, at_once
from fabweave.estimate.assembly_time import step_seconds
from fabweave.estimate.costs import Costs
from fabweave.estimate.texts import cost_rows
from fabweave.estimate.waste import WasteReport
from fabweave.former.plates import Laid
from fabweave.job.draw import Job
from fabweave.job.write import offcut_entries
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.picture.camera import View, choose_view
from fabweave.picture.object_picture import likeness_png, portrait_png
from fabweave.picture.surfaces import ribbon_triangles, rung_colours
from fabweave.piece.development import piece_stretches
from fabweave.piece.piece import Piece
from fabweave.piece.rim_ring import RimRing
from fabweave.plan.bill_of_materials import BillOfMaterials
from fabweave.plan.crossing_map import CrossingMap, read_crossing_map
from fabweave.plan.verdict import verdict_words
from fabweave.ribbon.project import Ribbons
from fabweave.sheet.base_board import BaseBoard
from fabweave.sheet.drawing import SheetDrawing
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.write.preview import in_lanes, png_bytes
from fabweave.sheet.write.template import template_pdf
from fabweave.show.manual.base import base_words, write_base
from fabweave.show.manual.book import Book
from fabweave.show.manual.cover import Facts, write_cover
from fabweave.show.manual.former import FormerPages, former_pages, write_former
from fabweave.show.manual.lesson import write_lesson
from fabweave.show.manual.painting import build_scene
from fabweave.show.manual.parts_list import write_bags, write_legend, write_map, write_parts
from fabweave.show.manual.sheets import drawn_pieces, write_sheets
from fabweave.show.manual.step_pictures import WholePicture, step_pictures
from fabweave.show.manual.steps import write_steps
from fabweave.show.pages import INDEX_FILE, LIKENESS, index_page, waste_page
from fabweave.show.paper_limits import MOST_PICTURED, MOST_VIEWED
from fabweave.show.sticks import sticks_pdf
from fabweave.show.viewer.page import space_record, viewer_page
from fabweave.stock.machine import MIDDLE_PACE, PACE
from fabweave.weave.pattern import Weave
from fabweave.weave.strand_colours import crossing_colours

_Made = TypeVar("_Made")


class Pictures(NamedTuple):
    """Pictures in the making, PNG files: each waits for its result when it is called."""

    portrait: Callable[[], bytes]
    #: What the model lost where it was remeshed, and settles; None where it was not.
    likeness: Callable[[], bytes | None]


def start_pictures(job: Job, start: Start = at_once) -> Pictures:
    """Start the picture of the object, and that of how like its model it is."""
    source, (ribbons, state) = job.woven.source, job.shown
    return Pictures(
        start(portrait_png, ribbons, job.colours, state),
        start(_likeness_png, source, job.settled_mesh),
    )


def _likeness_png(source: LoadedMesh, settled: PolyMesh | None) -> bytes | None:
    """Return the picture of how like its model an object is when it has settled; None of none."""
    original = source.original
    if original is None or source.likeness is None:
        return None
    like = source.likeness if settled is None else original.likeness(settled)
    return likeness_png(original.loss(settled), like)


def show_job(
    job: Job,
    report: WasteReport,
    pictures: Pictures,
    directory: Path,
    progress: Progress = no_progress,
    *,
    start: Start = at_once,
) -> tuple[str, ...]:
    """Write the papers of a job whose plan is in a folder; say which of them could not be made.

    They show the crossing map that is read back from there, and so cannot differ from what was
    proved. A paper that cannot be made is left out: what can be built is worth more
    than its papers.
    """
    progress("papers", 0, 1)
    plan = read_crossing_map(directory / "crossing_map.json")
    machine, rings = job.settings.machine, job.piece_set.rings
    ids = lettered_ids(job.to_cut, (*job.marks, *job.spare_marks))
    shown = [
        start(show_sheet, directory / "sheets", drawing, machine, ids, roll=job.supplies.rolls)
        for drawing in job.drawings
    ]
    letters = {piece.id: float(piece.label[3]) for ring in rings for piece in ring.pieces}
    shown += [
        start(show_sheet, directory / sheets.folder, drawing, machine, letters)
        for sheets in job.beside
        for drawing in sheets.drawings
    ]
    if job.base is not None:
        shown.append(start(show_sheet, directory, job.base.drawing, machine, {}))
    sticks = machine.sticks or machine.paper
    if job.woven.straight and sticks != "none":
        path = directory / "sticks.pdf"
        shown.append(start(_write_sticks, path, plan, job.woven.title, sticks))
    manual = start(
        _write_manual,
        directory / "assembly.pdf",
        plan,
        job_facts(job, report.bill, report.estimate, pictures.portrait()),
        job.drawings,
        (job.woven.ribbons, job.weave, job.piece_set.pieces, job.piece_colours),
        step_seconds(plan, report.estimate.assembly),
        machine.paper,
        rings,
        (job.laid, job.former_steps),
        job.base,
    )
    missing = [one for finish in shown for one in finish()]
    views, unmade = manual()
    missing += unmade
    papers: list[tuple[str, Callable[[], bytes | str | None]]] = [
        (
            "waste.html",
            lambda: waste_page(
                report,
                job.allotment,
                title=job.woven.title,
                verdict=job.verdict,
                names=[drawing.name for drawing in job.drawings],
                entries=offcut_entries(job),
                remeshed=job.woven.source.likeness is not None,
            ),
        ),
        ("render.png", pictures.portrait),
        (LIKENESS, pictures.likeness),
    ]
    if job.weave.threads.n_crossings <= MOST_VIEWED:
        papers.append(("assembly.html", lambda: job_viewer(job, plan, report.estimate, views)))
    papers.append((INDEX_FILE, lambda: index_page(
        plan, report, title=job.woven.title, verdict=job.verdict, grade=job.grade,
        form=job.form_text, material=job.supplies.description,
        size_mm=np.ptp(job.woven.wished.vertices, axis=0),
        given_mesh=None if job.given_mesh is None else job.settings.mesh.source,
        cut_names=[drawing.name for drawing in job.kerfed], files=file_names(directory),
    )))  # fmt: skip
    for name, make in papers:
        missing += _write_paper(directory / name, make)
    return tuple(missing)


def job_facts(job: Job, bill: BillOfMaterials, costs: Costs, portrait: bytes) -> Facts:
    """Return what the manual says about a job besides its crossing map."""
    return Facts(
        title=job.woven.title,
        buildable=verdict_words(job.verdict),
        form=job.form_text,
        building=next((note for note in job.notes if note.rule == "building"), ""),
        size_mm=tuple(np.ptp(job.woven.wished.vertices, axis=0).tolist()),
        material=job.supplies.description,
        bill=bill,
        colours=crossing_colours(job.weave, job.colours),
        portrait=portrait,
        costs=cost_rows(costs),
        beside=tuple((sheets.folder, len(sheets.drawings)) for sheets in job.beside),
        base="" if job.base is None else base_words(job.base),
    )


def manual_pdf(
    crossing_map: CrossingMap,
    facts: Facts,
    drawings: Sequence[SheetDrawing],
    pictures: Sequence[WholePicture],
    seconds: Sequence[float],
    *,
    paper: str = "a4",
    rings: Sequence[RimRing] = (),
    former: FormerPages | None = None,
    base: BaseBoard | None = None,
) -> bytes:
    """Return the manual as a PDF.

    Overview, how to read a piece, threads with all that their pieces meet, parts list, a page or
    more for each sheet, and the steps.

    Parameters
    ----------
    crossing_map : CrossingMap
    facts : Facts
        What it tells besides.
    drawings : sequence of SheetDrawing
        The sheets.
    pictures : sequence of WholePicture
        Of all steps; none if they are too many.
    seconds : sequence of float
        About how long each step takes.
    paper : {"a4", "letter"}
    rings : sequence of RimRing
        Those of the last steps.
    former : FormerPages, optional
    base : BaseBoard, optional
        That its feet are tied to in the end.

    Returns
    -------
    bytes
        The same for the same input. Its texts are in the fonts that every reader has.
    """
    book = Book(paper, facts.title)
    write_cover(book, crossing_map, facts)
    write_legend(book, crossing_map, drawn_pieces(*drawings))
    if former is not None:
        write_former(book, former)
    write_steps(
        book, crossing_map, pictures, seconds, rings, None if former is None else former.leaving,
        tied=base is not None,
    )  # fmt: skip
    if base is not None:
        write_base(book, base)
    write_parts(book, crossing_map, drawings)
    write_sheets(book, crossing_map, drawings)
    write_map(book, crossing_map, facts.colours)
    if crossing_map.cut.profile == "school":
        write_lesson(book, crossing_map, PACE[1] / MIDDLE_PACE * sum(seconds))
    if crossing_map.cut.labels != "kinds":
        write_bags(book, crossing_map)
    return book.finish()


def write_manual(
    path: Path,
    crossing_map: CrossingMap,
    facts: Facts,
    drawings: Sequence[SheetDrawing],
    woven: tuple[Ribbons, Weave, Sequence[Piece], Colours],
    seconds: Sequence[float],
    paper: str,
    rings: Sequence[RimRing],
    former: tuple[Laid | None, Sequence[str]],
    base: BaseBoard | None = None,
) -> tuple[View, ...]:
    """Make the pictures of the steps, unless they are too many, and write the manual.

    Returns
    -------
    tuple of View
        From where each step is seen, for others that show it; nothing of those without a picture.
    """
    pictures: Sequence[WholePicture] = ()
    pages, (laid, texts) = None, former
    few = len(crossing_map.steps) <= MOST_PICTURED
    if few or laid is not None:
        ribbons, weave, pieces, colours = woven
        scene = build_scene(ribbons, weave, pieces, crossing_map, colours, laid)
        pictures = step_pictures(scene, crossing_map) if few else ()
        pages = None if laid is None else former_pages(laid, scene, texts)
    data = manual_pdf(
        crossing_map,
        facts,
        drawings,
        pictures,
        seconds,
        paper=paper,
        rings=rings,
        former=pages,
        base=base,
    )
    path.write_bytes(data)
    return tuple(step.view for picture in pictures for step in picture.steps)


def job_viewer(
    job: Job, crossing_map: CrossingMap, costs: Costs, views: Sequence[View] = ()
) -> str:
    """Return the page that shows a job's object, pieces, sheets and steps.

    ``views`` are those from which the manual shows the steps.
    """
    ribbons = job.woven.ribbons
    vertices, triangles, _ = ribbon_triangles(ribbons)
    view = choose_view(vertices, triangles)
    rungs = piece_stretches(ribbons, job.weave, job.piece_set.pieces).rung
    thickness = tuple(job.supplies.thickness_mm(job.woven.bunches).tolist())
    layer = thickness if job.supplies.several else thickness[0]
    return viewer_page(
        crossing_map,
        space_record(
            ribbons,
            job.weave,
            job.piece_set.pieces,
            layer_mm=layer,
            relaxed=job.relaxed,
            mode=None if job.let_go is None else job.let_go.settled.mode,
        ),
        title=job.woven.title,
        colours=rung_colours(ribbons, job.colours)[rungs],
        view_deg=(view.azimuth_deg, view.elevation_deg),
        step_views_deg=[(one.azimuth_deg, one.elevation_deg) for one in views],
        hands={
            "seconds": [
                round(seconds, 1) for seconds in step_seconds(crossing_map, costs.assembly)
            ],
            "hours": list(costs.assembly.hours),
        },
        worst=job.grade.worst,
        former=job.laid,
    )


def _write_paper(path: Path, make: Callable[[], bytes | str | None]) -> list[str]:
    """Write what a paper is made of, if there is any; say why where it cannot be made."""
    content, missing = _attempt(path, make)
    if content is not None:
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    return missing


def _write_sticks(path: Path, *args: Any) -> list[str]:
    """Write the story sticks; say why they could not be made, if so."""
    return _write_paper(path, lambda: sticks_pdf(*args))


def _write_manual(path: Path, *args: Any) -> tuple[tuple[View, ...], list[str]]:
    """Write the manual; return its views of the object, and why it could not be made, if so."""
    views, missing = _attempt(path, lambda: write_manual(path, *args))
    return views or (), missing


def _attempt(path: Path, make: Callable[[], _Made]) -> tuple[_Made | None, list[str]]:
    """Return what comes of making a paper, and why it could not be made, if so."""
    try:
        return make(), []
    except OSError:  # the disk is full, or the folder is gone: nothing else can be written, either
        raise
    except Exception as error:  # whatever it is, the job is worth more than this paper
        path.unlink(missing_ok=True)
        return None, [f"{path.name} could not be made ({type(error).__name__}: {error})"]


def lettered_ids(pieces: Sequence[Piece], marks: Sequence[Marks]) -> dict[str, float]:
    """Return how high ids are engraved, of pieces on which they are."""
    return {
        piece.id: label.height_mm
        for piece, own in zip(pieces, marks, strict=True)
        for label in own.labels
        if "id" in label.kinds and label.text.startswith(piece.id)
    }


def show_sheet(
    folder: Path,
    drawing: SheetDrawing,
    machine: MachineSettings,
    ids: Mapping[str, float],
    *,
    roll: bool = False,
) -> list[str]:
    """Show one sheet as a picture, and as PDF at full size; say which of these is missing.

    A roll is shown in lanes, and needs no template: its strips are measured off.
    """
    missing = []
    if machine.template != "none" and not roll:
        missing += _write_paper(
            folder / f"{drawing.name}.pdf", lambda: template_pdf(drawing, machine.template)
        )
    return missing + _write_paper(
        folder / f"{drawing.name}.png",
        lambda: png_bytes(
            in_lanes(drawing) if roll else drawing, colours=machine.preset, lettered=ids
        ),
    )
