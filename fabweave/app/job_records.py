"""Put together what a job's files tell: its crossing map, and the facts of manual and viewer."""

from typing import Any

import numpy as np

from fabweave.app.job import Job
from fabweave.app.settings import Settings
from fabweave.assembly.crossing_map import crossing_map
from fabweave.assembly.manual.cover import Facts
from fabweave.assembly.viewer.page import viewer_page
from fabweave.assembly.viewer.space import space_record
from fabweave.cut.notes.qr_code import code_of
from fabweave.picture.camera import choose_view
from fabweave.picture.surfaces import ribbon_triangles


def job_plan(job: Job) -> dict[str, Any]:
    """Return the crossing map of a job."""
    woven = job.woven
    plan = crossing_map(
        woven.halfedges,
        woven.result,
        woven.bunches,
        woven.labels,
        woven.ribbons,
        job.piece_set,
        job.marks,
        job.layout,
        [drawing.name for drawing in job.drawings],
        job.order,
        job.allotment,
        offcuts=job.offcuts,
        mirrored=job.settings.label_side == "inside",
        cut=cut_record(job.settings) | {"code": job.code},
    )
    for sheet, drawing in zip(plan["sheets"], job.drawings, strict=True):
        code = code_of(drawing)
        sheet["code"] = None if code is None else code._asdict()
    return plan


def cut_record(settings: Settings) -> dict[str, Any]:
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


def job_facts(job: Job, bill: dict[str, Any]) -> Facts:
    """Return what the manual tells of a job besides its plan; with what is to be bought."""
    return Facts(
        title=job.woven.title,
        size_mm=tuple(np.ptp(job.woven.mesh.vertices, axis=0).tolist()),
        material=job.supplies.description,
        bill=bill,
        colours=job.colours,
        portrait=job.portrait(),
    )


def job_viewer(job: Job, plan: dict[str, Any]) -> str:
    """Return the page that shows a job's object, pieces, sheets and steps."""
    ribbons = job.woven.ribbons
    vertices, triangles, _ = ribbon_triangles(ribbons)
    view = choose_view(vertices, triangles)
    thickness = job.supplies.thickness_mm(job.woven.bunches).tolist()
    layer = thickness if job.supplies.several else thickness[0]
    return viewer_page(
        plan,
        space_record(ribbons, job.weave, job.piece_set.pieces, layer_mm=layer),
        title=job.woven.title,
        colours=job.colours,
        view_deg=(view.azimuth_deg, view.elevation_deg),
    )
