"""Write what is cut, and the plan of a job, into a folder: all that is proved afterwards."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.parallel.executors import Start, at_once
from fabweave.core.records import to_json
from fabweave.estimate.offcuts import (
    OFFCUT_FOLDER,
    OFFCUT_STOCK,
    KeptOffcut,
    offcut_records,
    stock_entries,
    stock_text,
)
from fabweave.estimate.texts import costs_text
from fabweave.estimate.waste import WasteReport, piece_table, waste_report
from fabweave.form.relaxed import PARTS, form_record, off_crossings_mm
from fabweave.job.draw import Job
from fabweave.job.map_builder import build_crossing_map
from fabweave.job.ribbon_report import RibbonReport, ribbon_report
from fabweave.mesh.io.text import obj_bytes
from fabweave.options.settings import job_toml
from fabweave.piece.split.length_curve import splitting_record
from fabweave.plan.crossing_map import CrossingMap, CutRecord, LayerRecord
from fabweave.plan.csv_tables import crossing_table, cut_list, station_table, stick_table
from fabweave.plan.grade import verdict_json
from fabweave.plan.preflight import Preflight, finding_lines, preflight
from fabweave.sheet.drawing import SheetDrawing
from fabweave.sheet.kerf import CUT_FOLDER
from fabweave.sheet.service import write_service
from fabweave.sheet.settings import MachineSettings
from fabweave.sheet.sheet_notes import draw_offcut
from fabweave.sheet.targets import target_named
from fabweave.sheet.write.dxf import dxf_bytes
from fabweave.sheet.write.svg import svg_text
from fabweave.verify.report import VerifyReport


def job_map(job: Job) -> CrossingMap:
    """Return the crossing map of a job."""
    return build_crossing_map(
        job,
        (*job.marks, *job.spare_marks),
        job.layout,
        job.drawings,
        job.order,
        job.steps,
        job.allotment,
        offcuts=job.offcuts,
        cut=cut_record(job.settings.machine, job.settings.pieces.labels),
    )


def cut_record(machine: MachineSettings, labels: str) -> CutRecord:
    """Return what the map says about the files for the cutter."""
    return CutRecord(
        profile=machine.profile,
        preset=machine.preset.name,
        dxf=machine.dxf,
        svg_units=machine.svg_units,
        hairline_mm=machine.line_mm,
        labels=labels,
        layers=tuple(
            LayerRecord(layer=layer.value, colour=entry.colour, aci=entry.aci)
            for layer, entry in machine.preset.colours.items()
        ),
    )


def write_plan(
    job: Job, directory: Path, progress: Progress = no_progress, *, start: Start = at_once
) -> tuple[Preflight, WasteReport]:
    """Write what is cut, the model and the plan into an existing empty folder.

    Returns
    -------
    (Preflight, WasteReport)
        Which rules its pieces break, and its accounts.

    Raises
    ------
    CannotMakeError
        If they break any, and the settings are strict.
    """
    progress("files", 0, len(job.drawings))
    machine, woven = job.settings.machine, job.woven
    folders = [(directory / "sheets", job.drawings), (directory / CUT_FOLDER, job.kerfed)]
    for sheets in job.beside:
        folders.append((directory / sheets.folder, sheets.drawings))
        folders.append((directory / CUT_FOLDER, sheets.kerfed))
    written = []
    for folder, drawings in folders:
        if drawings:
            folder.mkdir(exist_ok=True)
        written += [start(write_cuts, folder, drawing, machine) for drawing in drawings]
    if job.base is not None:
        written.append(start(write_cuts, directory, job.base.drawing, machine))
    for sheets in job.beside:
        named = directory / sheets.folder / sheets.folder
        write_text(named.with_suffix(".json"), json_text(sheets.record))
        write_text(named.with_suffix(".txt"), sheets.text)
    if machine.profile == "service":
        kinds = job.kinds[job.origins].tolist()
        materials = [job.allotment.of_thread(piece.thread).material for piece in job.to_cut]
        write_service(directory / "service", job.to_cut, kinds, materials, machine)
    offcuts = offcut_records(job.offcuts, job.layout, job.allotment)
    written += _write_offcuts(job, offcuts, directory / OFFCUT_FOLDER, start)
    report = waste_report(
        job.to_cut,
        splitting_record(job.split_plan, job.piece_set.pieces, woven.labels),
        machine,
        job.layout,
        job.drawings,
        job.allotment,
        notes=job.notes,
        offcuts=offcuts,
        costs=job.costs,
        bill=job.bill,
        engrave_seen_mm=job.engrave_seen_mm,
        beside=job.beside,
    )
    check = _write_tables(job, report, directory)
    for number, finish in enumerate(written):
        progress("files", number, len(written))
        finish()
    return check, report


def write_cuts(folder: Path, drawing: SheetDrawing, machine: MachineSettings) -> None:
    """Write one sheet as DXF and SVG."""
    _write_dxf(folder, drawing, machine)
    svg = svg_text(
        drawing,
        colours=machine.preset,
        units=machine.svg_units,
        stroke_width_mm=machine.line_mm,
    )
    write_text(folder / f"{drawing.name}.svg", svg)


def _write_dxf(folder: Path, drawing: SheetDrawing, machine: MachineSettings) -> None:
    """Write one drawing as DXF."""
    dxf = dxf_bytes(drawing, version=machine.dxf, colours=machine.preset)
    (folder / f"{drawing.name}.dxf").write_bytes(dxf)


def offcut_entries(job: Job) -> list[str]:
    """Return what is worth keeping, as entries of a list of stock."""
    return stock_entries(
        job.offcuts,
        job.layout,
        job.allotment,
        title=job.woven.title,
        mirrored=job.settings.pieces.mirrored,
    )


def _write_offcuts(
    job: Job, records: Sequence[KeptOffcut], directory: Path, start: Start
) -> list[Callable[[], Any]]:
    """Begin to draw what is worth keeping, if anything is, and list it as stock."""
    if not job.offcuts:
        return []
    directory.mkdir()
    write_text(directory / OFFCUT_STOCK, stock_text(records, offcut_entries(job)))
    drawings = [draw_offcut(offcut, job.layout.sheets[offcut.sheet]) for offcut in job.offcuts]
    return [start(_write_dxf, directory, drawing, job.settings.machine) for drawing in drawings]


def _write_tables(job: Job, report: WasteReport, directory: Path) -> Preflight:
    """Write the model, the plan and its tables; see ``write_plan``."""
    from fabweave.picture.model_files import woven_glb  # noqa: PLC0415 - it takes long to import

    woven = job.woven
    crossing_map = job_map(job)
    write_text(
        directory / "verdict.json", json_text(verdict_json(job.verdict, job.grade, job.form))
    )
    sizes = [rule.hole_mm for rule in job.piece_set.rules]
    like, openings = woven.source.likeness, woven.source.openings
    outcome = {
        "verdict": job.verdict.level,
        "grade": job.grade.score,
        "threads": job.weave.threads.n_threads,
        "crossings": job.weave.threads.n_crossings,
        "pieces": len(job.piece_set.pieces),
        **({"spares": len(job.spared)} if len(job.spared) else {}),
        "joints": len(job.piece_set.joints),
        "sheets": len(job.drawings),
        "utilisation": report.totals.sums.utilisation,
        # None has none: the sum of nothing.
        "hole_mm": sizes if len(sizes) > 1 else sum(sizes),
        "fasten": job.fasten,
        "costs": costs_text(job.costs),
        **({"likeness_mm": round(like.greatest_mm, 3)} if like is not None else {}),
        **({"taken": taken.record()} if (taken := woven.source.taken) is not None else {}),
        **({"openings": [opening.record() for opening in openings]} if openings else {}),
        "notes": list(job.notes),
    }
    write_text(directory / "job.toml", job_toml(job.settings, outcome))
    (directory / "woven_mesh.obj").write_bytes(obj_bytes(woven.mesh))
    if woven.aim is not None:
        (directory / "aimed_mesh.obj").write_bytes(obj_bytes(woven.aim.mesh))
    if job.given_mesh is not None:
        kept = directory / job.settings.mesh.source
        kept.write_bytes(obj_bytes(job.given_mesh))
    findings = (*job.check.findings, *job.holes)
    (directory / "model.glb").write_bytes(
        woven_glb(woven.ribbons, woven.labels, job.colours, findings)
    )
    if job.let_go is not None:
        off_mm = None
        if (bands := job.let_go.bands) is not None:
            model = woven_glb(bands, woven.labels, job.colours, parts=PARTS)
            (directory / "model_relaxed.glb").write_bytes(model)
            off_mm = off_crossings_mm(bands, job.weave)
        form = form_record(job.let_go.settled, off_mm)
        write_text(directory / "form.json", json_text(to_json(form)))
    write_text(directory / "crossing_map.json", json_text(crossing_map.to_json()))
    write_text(directory / "crossing_map.csv", crossing_table(crossing_map))
    write_text(directory / "stations.csv", station_table(crossing_map))
    if woven.straight:
        write_text(directory / "sticks.csv", stick_table(crossing_map))
    cuts = cut_list(crossing_map) if woven.straight else None
    if cuts is not None:
        write_text(directory / "cut_list.csv", cuts)
    write_text(
        directory / "pieces.csv",
        piece_table(job.to_cut, job.origins, job.kinds, woven.labels, job.layout, job.allotment),
    )
    ribbons = ribbon_report(job.check, woven.ribbons, woven.labels, job.holes)
    write_text(directory / "ribbons.json", json_text(to_json(ribbons)))
    check = _preflight(job, crossing_map, ribbons)
    write_text(directory / "preflight.json", json_text(check.record))
    write_text(directory / "waste.json", json_text(to_json(report)))
    return check


def _preflight(job: Job, crossing_map: CrossingMap, ribbons: RibbonReport) -> Preflight:
    """Check the pieces against the rules of those who cut them."""
    target = target_named(job.settings.machine.target, job.settings.machine.rules)
    supplies = job.supplies
    materials = [supplies.materials[index] for index in job.allotment.threads.tolist()]
    check = Preflight(
        supplies,
        target,
        preflight(
            crossing_map,
            ribbons.findings,
            materials,
            target,
            common=job.settings.common_cuts,
        ),
    )
    broken = finding_lines(check.findings)
    broken += [reason.told for reason in job.verdict.reasons if reason.rule == "ids"]
    if job.settings.machine.strict and broken:
        lines = "\n".join(f"  {line}" for line in broken)
        raise CannotMakeError(f"with --strict, no job is written that breaks rules:\n{lines}")
    return check


def write_proof(directory: Path, proof: VerifyReport) -> None:
    """Write what was proved about a job's files beside them."""
    write_text(directory / "verify.json", json_text(proof.to_json()))


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


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8 with plain line ends on every system."""
    path.write_text(text, encoding="utf-8", newline="")
