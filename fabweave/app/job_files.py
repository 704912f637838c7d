"""Put together what the files of a job say, and write them into a folder."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from fabweave.app.job import Job
from fabweave.app.job_folder import file_names
from fabweave.app.preflight_job import Preflight
from fabweave.app.settings import Settings, job_toml
from fabweave.assembly.csv_tables import crossing_table, station_table
from fabweave.assembly.extent import MOST_VIEWED
from fabweave.assembly.manual.cover import Facts
from fabweave.assembly.manual.writing import write_manual
from fabweave.assembly.map_builder import build_crossing_map
from fabweave.assembly.viewer.page import viewer_page
from fabweave.assembly.viewer.space import space_record
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.parallel.executors import Start, at_once
from fabweave.core.records import to_json
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.kerf import CUT_FOLDER
from fabweave.cut.notes.qr_code import CODE_FILE, code_png
from fabweave.cut.notes.stock_notes import draw_offcut
from fabweave.cut.preflight.rules import preflight
from fabweave.cut.preflight.targets import target_named
from fabweave.cut.preflight.violations import flaw_lines
from fabweave.cut.rim_sheets import FOLDER, RECORD, TEXT, rim_record, rim_text
from fabweave.cut.service import PieceMaterial, kind_files, write_kind_files
from fabweave.cut.write.dxf import dxf_bytes
from fabweave.cut.write.preview import png_bytes
from fabweave.cut.write.svg import svg_text
from fabweave.cut.write.template import template_pdf
from fabweave.flat.bill_of_materials import BillOfMaterials
from fabweave.flat.crossing_map import CrossingMap
from fabweave.flat.file_records import CutRecord, LayerRecord
from fabweave.flat.joint.holes import HoleRule
from fabweave.flat.unfold.development import piece_stretches
from fabweave.mesh.io.files import mesh_bytes
from fabweave.mesh.io.obj import obj_bytes
from fabweave.model.rung_colours import rung_colours
from fabweave.model.woven_glb import woven_glb
from fabweave.picture.camera import View, choose_view
from fabweave.picture.strand_colours import crossing_colours
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.report.bom import bill_of_materials
from fabweave.report.costs.assembly_time import step_seconds
from fabweave.report.costs.texts import cost_rows, costs_text
from fabweave.report.index_page import INDEX_FILE, About, index_page
from fabweave.report.offcuts import (
    OFFCUT_FOLDER,
    OFFCUT_STOCK,
    KeptOffcut,
    offcut_records,
    stock_entries,
    stock_text,
)
from fabweave.report.ribbon_report import RibbonReport, ribbon_report
from fabweave.report.rings import rim_sheets
from fabweave.report.splitting import splitting_record
from fabweave.report.verdict import verdict_json, verdict_words
from fabweave.report.waste import WasteReport, piece_table, waste_report
from fabweave.report.waste_page import waste_page
from fabweave.verify import VerifyReport


def job_map(job: Job) -> CrossingMap:
    """Return the crossing map of a job."""
    woven = job.woven
    return build_crossing_map(
        woven.halfedges,
        woven.result,
        woven.bunches,
        woven.labels,
        woven.ribbons,
        job.piece_set,
        job.spared,
        (*job.marks, *job.spare_marks),
        job.layout,
        job.drawings,
        job.order,
        job.allotment,
        offcuts=job.offcuts,
        mirrored=job.settings.label_side == "inside",
        cut=_cut_record(job.settings, job.code),
    )


def _cut_record(settings: Settings, code: str) -> CutRecord:
    """Return what the map says about the files for the cutter."""
    return CutRecord(
        profile=settings.profile,
        preset=settings.preset.name,
        dxf=settings.dxf,
        svg_units=settings.svg_units,
        hairline_mm=settings.line_mm,
        labels=settings.labels,
        layers=tuple(
            LayerRecord(layer=layer.value, colour=entry.colour, aci=entry.aci)
            for layer, entry in settings.preset.colours.items()
        ),
        code=code,
    )


def job_facts(job: Job, bill: BillOfMaterials) -> Facts:
    """Return what the manual says about a job besides its crossing map."""
    return Facts(
        title=job.woven.title,
        buildable=verdict_words(job.verdict),
        size_mm=tuple(np.ptp(job.woven.mesh.vertices, axis=0).tolist()),
        material=job.supplies.description,
        bill=bill,
        colours=crossing_colours(job.weave, job.colours),
        portrait=job.portrait(),
        costs=cost_rows(job.costs),
        rim_sheets=len(job.rim_drawings),
    )


def job_viewer(job: Job, crossing_map: CrossingMap, views: Sequence[View] = ()) -> str:
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
        space_record(ribbons, job.weave, job.piece_set.pieces, layer_mm=layer),
        title=job.woven.title,
        colours=rung_colours(ribbons, job.colours)[rungs],
        view_deg=(view.azimuth_deg, view.elevation_deg),
        step_views_deg=[(one.azimuth_deg, one.elevation_deg) for one in views],
        hands={
            "seconds": [round(seconds, 1) for seconds in step_seconds(crossing_map)],
            "hours": list(job.costs.assembly.hours),
        },
    )


_Made = TypeVar("_Made")

#: The picture of what a remeshed model lost.
LIKENESS = "likeness.png"


class Written(NamedTuple):
    """What came of writing: which rules the pieces break, and the papers that could not be made."""

    preflight: Preflight
    missing: tuple[str, ...]


def write_job(
    job: Job, directory: Path, progress: Progress = no_progress, *, start: Start = at_once
) -> Written:
    """Write every file of a job into an existing empty folder, all but ``verify.json``.

    What is cut and the plan have to be there. A paper that cannot be made is left out: what can be
    built is worth more than its papers.

    Returns
    -------
    Written

    Raises
    ------
    CannotMakeError
        If they break any, and the settings are strict.
    """
    progress("files", 0, len(job.drawings))
    sheets = directory / "sheets"
    sheets.mkdir()
    ids = _lettered_ids(job)
    shown = [start(_write_sheet, sheets, drawing, job.settings, ids) for drawing in job.drawings]
    written: list[Callable[[], None]] = []
    if job.kerfed:
        (directory / CUT_FOLDER).mkdir()
    written += [
        start(_write_cuts, directory / CUT_FOLDER, drawing, job.settings)
        for drawing in (*job.kerfed, *job.rim_kerfed)
    ]
    if job.rim_layout is not None:
        rim = directory / FOLDER
        rim.mkdir()
        letters = {
            piece.id: float(piece.label[3]) for ring in job.piece_set.rings for piece in ring.pieces
        }
        shown += [
            start(_write_sheet, rim, drawing, job.settings, letters) for drawing in job.rim_drawings
        ]
        _write(rim / RECORD, json_text(to_json(rim_record(job.piece_set.rings, job.rim_layout))))
        _write(rim / TEXT, rim_text(job.piece_set.rings))
    _write_code(job, directory)
    crossing_map, bill = job_map(job), bill_of_materials(job.piece_set, job.settings.hardware)
    manual = start(
        _write_manual,
        directory / "assembly.pdf",
        crossing_map,
        job_facts(job, bill),
        job.drawings,
        (job.woven.ribbons, job.weave, job.piece_set.pieces, job.piece_colours),
        step_seconds(crossing_map),
        job.settings.paper,
        job.piece_set.rings,
    )
    if job.settings.profile == "service":
        _write_service(job, directory / "service")
    report = _waste_report(job, bill)
    entries = _write_offcuts(job, report.offcuts, directory / OFFCUT_FOLDER)
    check = _write_tables(job, crossing_map, report, directory)
    for number, finish in enumerate(written):
        progress("files", number, len(written))
        finish()
    missing = [one for finish in shown for one in finish()]
    papers: list[tuple[str, Callable[[], bytes | str | None]]] = [
        ("waste.html", lambda: _waste_page(job, report, entries)),
        ("render.png", job.portrait),
        (LIKENESS, job.likeness),
    ]
    views, unmade = manual()
    missing += unmade
    if job.weave.threads.n_crossings <= MOST_VIEWED:
        papers.append(("assembly.html", lambda: job_viewer(job, crossing_map, views)))
    papers.append((INDEX_FILE, lambda: _index(job, crossing_map, report, directory)))
    for name, make in papers:
        missing += _write_paper(directory / name, make)
    return Written(check, tuple(missing))


def _write_paper(path: Path, make: Callable[[], bytes | str | None]) -> list[str]:
    """Write what a paper is made of, if there is any; say why where it cannot be made."""
    content, missing = _attempt(path, make)
    if content is not None:
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    return missing


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


def _lettered_ids(job: Job) -> dict[str, float]:
    """Return how high ids are engraved, of pieces on which they are."""
    marks = (*job.marks, *job.spare_marks)
    return {
        piece.id: label.height_mm
        for piece, own in zip(job.to_cut, marks, strict=True)
        for label in own.labels
        if "id" in label.kinds and label.text.startswith(piece.id)
    }


def _write_sheet(
    folder: Path, drawing: SheetDrawing, settings: Settings, ids: Mapping[str, float]
) -> list[str]:
    """Write one sheet as DXF, SVG, picture, and PDF at full size; say which of these is missing."""
    _write_cuts(folder, drawing, settings)
    missing = []
    if settings.template != "none":
        missing += _write_paper(
            folder / f"{drawing.name}.pdf", lambda: template_pdf(drawing, settings.template)
        )
    return missing + _write_paper(
        folder / f"{drawing.name}.png",
        lambda: png_bytes(drawing, colours=settings.preset, lettered=ids),
    )


def _write_cuts(folder: Path, drawing: SheetDrawing, settings: Settings) -> None:
    """Write one sheet as DXF and SVG."""
    dxf = dxf_bytes(drawing, version=settings.dxf, colours=settings.preset)
    (folder / f"{drawing.name}.dxf").write_bytes(dxf)
    svg = svg_text(
        drawing,
        colours=settings.preset,
        units=settings.svg_units,
        stroke_width_mm=settings.line_mm,
    )
    _write(folder / f"{drawing.name}.svg", svg)


def _write_code(job: Job, directory: Path) -> None:
    """Write the QR code as a picture."""
    if job.settings.qr != "none":
        (directory / CODE_FILE).write_bytes(code_png(job.code))


def _write_service(job: Job, directory: Path) -> None:
    """Write a file for each distinct piece, and the table of quantities."""
    supply_materials = [
        PieceMaterial(material.name, material.thickness_mm) for material in job.supplies.materials
    ]
    piece_materials = [supply_materials[index] for index in job.allotment.of_pieces(job.to_cut)]
    kinds = job.kinds[job.origins].tolist()
    write_kind_files(
        directory,
        kind_files(job.to_cut, kinds, piece_materials),
        version=job.settings.dxf,
        colours=job.settings.preset,
        units=job.settings.svg_units,
        stroke_width_mm=job.settings.line_mm,
    )


def _index(job: Job, crossing_map: CrossingMap, report: WasteReport, directory: Path) -> str:
    """Return the page that opens the job, once all else is in its folder."""
    about = About(
        title=job.woven.title,
        verdict=job.verdict,
        size_mm=tuple(np.ptp(job.woven.mesh.vertices, axis=0).tolist()),
        material=job.supplies.description,
        given_mesh=None if job.given_mesh is None else job.settings.mesh,
    )
    cut_names = [drawing.name for drawing in job.kerfed]
    return index_page(about, crossing_map, report, cut_names, file_names(directory))


def _waste_report(job: Job, bill: BillOfMaterials) -> WasteReport:
    """Return what becomes of the material."""
    woven = job.woven
    return waste_report(
        job.to_cut,
        job.layout,
        job.drawings,
        job.allotment,
        notes=job.notes,
        offcuts=offcut_records(job.offcuts, job.layout, job.allotment),
        bill=bill,
        kerf_mm=job.settings.kerf_mm,
        splitting=splitting_record(job.split_plan, job.piece_set.pieces, woven.labels),
        costs=job.costs,
        ribbons=woven.ribbons,
        engrave_seen_mm=job.engrave_seen_mm,
        spares=len(job.spared),
        grain=job.grain_cost,
        rim=rim_sheets(
            job.piece_set.rings,
            job.rim_layout,
            job.rim_drawings,
            job.supplies.materials[0],
            calibration=job.settings.calibrate,
        ),
    )


def _hole_sizes(rules: Sequence[HoleRule]) -> float | list[float]:
    """Return the size of holes, 0 for none, or those that there are if there are several."""
    sizes = [rule.hole_mm for rule in rules]
    return sizes if len(sizes) > 1 else sum(sizes)


def _write_tables(
    job: Job, crossing_map: CrossingMap, report: WasteReport, directory: Path
) -> Preflight:
    """Write every file but sheets, manual, viewer and pictures; see ``write_job``."""
    woven = job.woven
    _write(directory / "verdict.json", json_text(verdict_json(job.verdict)))
    outcome = {
        "verdict": job.verdict.level,
        "threads": job.weave.threads.n_threads,
        "crossings": job.weave.threads.n_crossings,
        "pieces": len(job.piece_set.pieces),
        **({"spares": len(job.spared)} if len(job.spared) else {}),
        "joints": len(job.piece_set.joints),
        "sheets": len(job.drawings),
        "utilisation": report.totals.sums.utilisation,
        "hole_mm": _hole_sizes(job.piece_set.rules),
        "fasten": job.fasten,
        "costs": costs_text(job.costs),
        **_likeness(job),
        **_openings(job),
        "notes": list(job.notes),
    }
    _write(directory / "job.toml", job_toml(job.settings, outcome))
    (directory / "woven_mesh.obj").write_bytes(obj_bytes(woven.mesh))
    if job.given_mesh is not None:
        kept = directory / job.settings.mesh
        kept.write_bytes(mesh_bytes(kept, job.given_mesh))
    findings = (*job.check.findings, *job.holes)
    (directory / "model.glb").write_bytes(
        woven_glb(woven.ribbons, woven.labels, job.colours, findings)
    )
    _write(directory / "crossing_map.json", json_text(crossing_map.to_json()))
    _write(directory / "crossing_map.csv", crossing_table(crossing_map))
    _write(directory / "stations.csv", station_table(crossing_map))
    _write(
        directory / "pieces.csv",
        piece_table(job.to_cut, job.kinds, job.origins, job.layout, woven.labels, job.allotment),
    )
    ribbons = ribbon_report(job.check, woven.ribbons, woven.labels, job.holes)
    _write(directory / "ribbons.json", json_text(to_json(ribbons)))
    check = _preflight(job, crossing_map, ribbons)
    _write(directory / "preflight.json", json_text(check.record))
    _write(directory / "waste.json", json_text(to_json(report)))
    return check


def _waste_page(job: Job, report: WasteReport, entries: Sequence[str]) -> str:
    """Return the page on what becomes of the material."""
    return waste_page(
        report,
        title=job.woven.title,
        verdict=job.verdict,
        allotment=job.allotment,
        sheet_names=[drawing.name for drawing in job.drawings],
        entries=entries,
        likeness=LIKENESS if job.woven.source.likeness is not None else None,
    )


def _likeness(job: Job) -> dict[str, float]:
    """Return how far the woven mesh is from the model at most, where it was remeshed."""
    like = job.woven.source.likeness
    return {} if like is None else {"likeness_mm": round(like.greatest_mm, 3)}


def _openings(job: Job) -> dict[str, list[dict[str, str | int | float]]]:
    """Return what was left out of the mesh, if anything was."""
    openings = job.woven.source.openings
    return {"openings": [opening.record() for opening in openings]} if openings else {}


def _preflight(job: Job, crossing_map: CrossingMap, ribbons: RibbonReport) -> Preflight:
    """Check the pieces against the rules of those who cut them."""
    target = target_named(job.settings.target, job.settings.targets)
    supplies = job.supplies
    materials = [supplies.materials[index] for index in job.allotment.threads.tolist()]
    check = Preflight(
        supplies, target, preflight(crossing_map, ribbons.findings, materials, target)
    )
    broken = flaw_lines(check.flaws) if check.flaws else []
    broken += [reason.told for reason in job.verdict.reasons if reason.rule == "ids"]
    if job.settings.strict and broken:
        lines = "\n".join(f"  {line}" for line in broken)
        raise CannotMakeError(f"with --strict, no job is written that breaks rules:\n{lines}")
    return check


def _write_offcuts(job: Job, records: Sequence[KeptOffcut], directory: Path) -> list[str]:
    """Draw what is worth keeping, if anything is, and list it as stock; return its entries."""
    entries = stock_entries(
        job.offcuts,
        job.layout,
        job.allotment,
        title=job.woven.title,
        mirrored=job.settings.label_side == "inside",
    )
    if job.offcuts:
        directory.mkdir()
        for offcut in job.offcuts:
            drawing = draw_offcut(offcut, job.layout.sheets[offcut.sheet])
            dxf = dxf_bytes(drawing, version=job.settings.dxf)
            (directory / f"{offcut.name}.dxf").write_bytes(dxf)
        _write(directory / OFFCUT_STOCK, stock_text(records, entries))
    return entries


def write_proof(directory: Path, proof: VerifyReport) -> None:
    """Write what was proved about a job's files beside them."""
    _write(directory / "verify.json", json_text(proof.to_json()))


def json_text(value: Any) -> str:
    """Return JSON with one short record a line: readable, and easy to compare."""
    if not isinstance(value, dict):
        return json.dumps(value) + "\n"
    parts = []
    for key, item in value.items():
        if isinstance(item, list) and item:
            rows = ",\n".join("  " + json.dumps(row) for row in item)
            parts.append(f" {json.dumps(key)}: [\n{rows}\n ]")
        else:
            parts.append(f" {json.dumps(key)}: {json.dumps(item)}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _write(path: Path, text: str) -> None:
    """Write text as UTF-8 with plain line ends on every system."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(text)
