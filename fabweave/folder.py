"""Write a finished job's folder: all of it, or nothing."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.arrays import Progress, no_progress
from fabweave.assembly.crossing_map import crossing_map, crossing_table
from fabweave.assembly.manual import write_manual
from fabweave.assembly.manual_cover import Facts
from fabweave.assembly.stations import station_table
from fabweave.assembly.viewer import viewer_page
from fabweave.assembly.viewer_space import space_record
from fabweave.cut.code import code_of
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.dxf import write_dxf
from fabweave.cut.preflight import flaw_lines, preflight, preflight_record
from fabweave.cut.preview import write_png
from fabweave.cut.ready import READY_FOLDER
from fabweave.cut.service import Stuff, kind_files, write_kind_files
from fabweave.cut.stock_notes import draw_offcut
from fabweave.cut.svg import write_svg
from fabweave.cut.targets import target_named
from fabweave.cut.template import write_template
from fabweave.errors import CannotMakeError, InputError
from fabweave.executors import Executors, processes
from fabweave.job import Job, make_job
from fabweave.mesh.files import write_mesh
from fabweave.report.bom import bill_of_materials
from fabweave.report.ribbons import ribbon_report
from fabweave.report.splitting import splitting_record
from fabweave.report.surfaces import ribbon_triangles
from fabweave.report.view import choose_view
from fabweave.report.waste import offcut_file, piece_table, waste_page, waste_report
from fabweave.ribbon.export import woven_glb
from fabweave.settings import JobSettings, job_toml
from fabweave.verify import VerifyReport, verify_job
from fabweave.workers import Start, at_once, side_workers

#: More processes than these find nothing to do in most jobs.
_MOST_WORKERS = 4


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
    if any(directory.iterdir()) and not (directory / "job.toml").is_file():
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
    temporary = Path(tempfile.mkdtemp(prefix=f".{directory.name}.", dir=directory.parent))
    try:
        fresh = temporary / "new"
        fresh.mkdir()
        yield fresh
        if directory.exists():
            directory.rename(temporary / "old")
        try:
            fresh.rename(directory)
        except BaseException:
            if (temporary / "old").exists():
                (temporary / "old").rename(directory)
            raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def run_job(
    settings: JobSettings,
    directory: Path,
    progress: Progress = no_progress,
    *,
    workers: int = 0,
    executors: Executors | None = None,
) -> tuple[Job, VerifyReport]:
    """Make a job, write its folder, and prove the written files.

    Parameters
    ----------
    settings : JobSettings
    directory : Path
        New, empty, or an older job's folder, which is replaced when the new one is proved.
    progress : callable
    workers : int
        Processes beside this one; the same bytes are written with any number.
    executors : callable, optional
        Opens the executor that nests very many pieces, in place of these processes.

    Returns
    -------
    job : Job
    proof : VerifyReport
        Every check holds; it stands in ``verify.json`` too.

    Raises
    ------
    InputError
        For bad input or settings, or a folder with anything else in it.
    CannotMakeError
        For what cannot be made as asked, or if a check objects to the written files.
    """
    check_destination(directory)
    with side_workers(min(workers, _MOST_WORKERS)) as start:
        job = make_job(settings, progress, start=start, executors=executors or processes(workers))
        return job, _write_proved(job, directory, progress, start)


def _write_proved(job: Job, directory: Path, progress: Progress, start: Start) -> VerifyReport:
    """Write a job's folder, and keep it if every check of it holds."""
    with finished_folder(directory) as folder:
        write_job(job, folder, progress, start=start)
        progress("verify", 0, 1)
        proof = verify_job(folder)
        if not proof.ok:
            raise CannotMakeError(_disproved(proof))
        _write(folder / "verify.json", json_text(proof.to_json()))
    return proof


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


def write_job(
    job: Job, directory: Path, progress: Progress = no_progress, *, start: Start = at_once
) -> None:
    """Write every file of a job into an existing empty folder, all but ``verify.json``."""
    progress("files", 0, len(job.drawings))
    sheets = directory / "sheets"
    sheets.mkdir()
    written = [start(_write_sheet, sheets, drawing, job.settings) for drawing in job.drawings]
    if job.ready:
        (directory / READY_FOLDER).mkdir()
    written += [
        start(_write_cuts, directory / READY_FOLDER, drawing, job.settings) for drawing in job.ready
    ]
    if job.offcut is not None:
        (directory / offcut_file()).parent.mkdir()
        drawing = draw_offcut(job.offcut, job.layout.sheets[job.offcut.sheet])
        write_dxf(directory / offcut_file(), drawing, version=job.settings.dxf)
    plan = job_plan(job)
    written.append(
        start(
            write_manual,
            directory / "assembly.pdf",
            plan,
            job_facts(job),
            job.drawings,
            (job.object.ribbons, job.weave, job.made.pieces),
            job.settings.paper,
        )
    )
    if job.settings.profile == "service":
        _write_service(job, plan, directory / "service")
    _write_tables(job, plan, directory)
    for number, finish in enumerate(written):
        progress("files", number, len(written))
        finish()
    (directory / "render.png").write_bytes(job.portrait())


def _write_sheet(folder: Path, drawing: SheetDrawing, settings: JobSettings) -> None:
    """Write one sheet as DXF, SVG, picture, and PDF at full size."""
    _write_cuts(folder, drawing, settings)
    if settings.template != "none":
        write_template(folder / f"{drawing.name}.pdf", drawing, settings.template)
    write_png(folder / f"{drawing.name}.png", drawing, colours=settings.preset)


def _write_cuts(folder: Path, drawing: SheetDrawing, settings: JobSettings) -> None:
    """Write one sheet as DXF and SVG."""
    colours = settings.preset
    write_dxf(folder / f"{drawing.name}.dxf", drawing, version=settings.dxf, colours=colours)
    write_svg(
        folder / f"{drawing.name}.svg",
        drawing,
        colours=colours,
        units=settings.svg_units,
        stroke_width_mm=settings.line_mm,
    )


def _write_service(job: Job, plan: dict[str, Any], directory: Path) -> None:
    """Write a file for each distinct piece, and the table of quantities."""
    each = [Stuff(one.name, one.thickness_mm) for one in job.supplies.materials]
    stuff = [each[index] for index in job.allotment.of_pieces(job.made.pieces)]
    kinds = [piece["kind"] for piece in plan["pieces"]]
    write_kind_files(
        directory,
        kind_files(job.made.pieces, kinds, stuff),
        version=job.settings.dxf,
        colours=job.settings.preset,
        units=job.settings.svg_units,
        stroke_width_mm=job.settings.line_mm,
    )


def _write_tables(job: Job, plan: dict[str, Any], directory: Path) -> None:
    """Write every file but the sheets, the manual and the picture."""
    thing = job.object
    names = [drawing.name for drawing in job.drawings]
    bill = bill_of_materials(job.made)
    report = waste_report(
        job.made.pieces, job.layout, job.drawings, job.allotment, job.notes, job.offcut
    )
    report |= bill
    report["kerf_mm"] = job.settings.kerf_mm
    report["splitting"] = splitting_record(job.plan, job.made.pieces, thing.labels)
    outcome = {
        "threads": job.weave.threads.n_threads,
        "crossings": job.weave.threads.n_crossings,
        "pieces": len(job.made.pieces),
        "joints": len(job.made.joints),
        "sheets": len(names),
        "utilisation": report["totals"]["utilisation"],
        "hole_mm": job.made.rule.hole_mm if job.made.rule else 0.0,
        "notes": list(job.notes),
    }
    _write(directory / "job.toml", job_toml(job.settings, outcome))
    write_mesh(directory / "woven_mesh.obj", thing.woven.mesh)
    found = (*job.check.findings, *job.holes)
    (directory / "model.glb").write_bytes(
        woven_glb(thing.ribbons, thing.labels, job.colours, found)
    )
    _write(directory / "crossing_map.json", json_text(plan))
    _write(directory / "crossing_map.csv", crossing_table(plan))
    _write(directory / "stations.csv", station_table(plan))
    _write(directory / "assembly.html", job_viewer(job, plan))
    _write(
        directory / "pieces.csv",
        piece_table(job.made.pieces, job.layout, thing.labels, job.allotment),
    )
    ribbons = ribbon_report(job.check, thing.ribbons, thing.labels, job.holes)
    _write(directory / "ribbons.json", json_text(ribbons))
    target = target_named(job.settings.target)
    supplies = job.supplies
    materials = [supplies.materials[index] for index in job.allotment.threads.tolist()]
    flaws = preflight(plan, ribbons, materials, target)
    if job.settings.strict and flaws:
        lines = "\n".join(f"  {line}" for line in flaw_lines(flaws))
        raise CannotMakeError(f"rules are broken, and --strict was asked for:\n{lines}")
    record = preflight_record(flaws, supplies.materials, target)
    _write(directory / "preflight.json", json_text(record))
    _write(directory / "waste.json", json_text(report))
    _write(
        directory / "waste.html",
        waste_page(report, title=thing.woven.title, supplies=supplies, sheet_names=names),
    )


def job_plan(job: Job) -> dict[str, Any]:
    """Return the crossing map of a job."""
    thing = job.object
    plan = crossing_map(
        thing.woven.halfedges,
        thing.chosen,
        thing.bunches,
        thing.labels,
        thing.ribbons,
        job.made,
        job.marks,
        job.layout,
        [drawing.name for drawing in job.drawings],
        job.order,
        job.allotment,
        mirrored=job.settings.label_side == "inside",
        cut=cut_record(job.settings) | {"code": job.code},
    )
    for sheet, drawing in zip(plan["sheets"], job.drawings, strict=True):
        code = code_of(drawing)
        sheet["code"] = None if code is None else code._asdict()
    return plan


def cut_record(settings: JobSettings) -> dict[str, Any]:
    """Return what the map says about the files for the cutter."""
    return {
        "profile": settings.profile,
        "preset": settings.preset.name,
        "dxf": settings.dxf,
        "svg_units": settings.svg_units,
        "hairline_mm": settings.line_mm,
        "layers": [
            {"layer": layer.value, "colour": entry.colour, "aci": entry.aci}
            for layer, entry in settings.preset.colours.items()
        ],
    }


def job_facts(job: Job) -> Facts:
    """Return what the manual tells of a job besides its plan."""
    return Facts(
        title=job.object.woven.title,
        size_mm=tuple(np.ptp(job.object.woven.mesh.vertices, axis=0).tolist()),
        material=job.supplies.told,
        bill=bill_of_materials(job.made),
        colours=job.colours,
        portrait=job.portrait(),
    )


def job_viewer(job: Job, plan: dict[str, Any]) -> str:
    """Return the page that shows a job's object, pieces, sheets and steps."""
    ribbons = job.object.ribbons
    vertices, triangles, _ = ribbon_triangles(ribbons)
    view = choose_view(vertices, triangles)
    thickness = job.supplies.thickness_mm(job.object.bunches).tolist()
    layer = thickness if job.supplies.several else thickness[0]
    return viewer_page(
        plan,
        space_record(ribbons, job.weave, job.made.pieces, layer_mm=layer),
        title=job.object.woven.title,
        colours=job.colours,
        view_deg=(view.azimuth_deg, view.elevation_deg),
    )


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


def folder_is_readable(directory: Path) -> None:
    """Raise InputError unless the folder is there and can be listed."""
    if not directory.is_dir() or not os.access(directory, os.R_OK):
        raise InputError(f"{directory} is no folder that can be read; name a finished job's folder")
