"""Put together what a job's files say: its crossing map, and the facts of manual and viewer."""

from collections.abc import Sequence

import numpy as np

from fabweave.app.job import Job
from fabweave.app.settings import Settings
from fabweave.assembly.manual.cover import Facts
from fabweave.assembly.map_builder import build_crossing_map
from fabweave.assembly.viewer.page import viewer_page
from fabweave.assembly.viewer.space import space_record
from fabweave.flat.bill_of_materials import BillOfMaterials
from fabweave.flat.crossing_map import CrossingMap
from fabweave.flat.file_records import CutRecord, LayerRecord
from fabweave.flat.unfold.stretch import piece_stretches
from fabweave.model.rung_colours import rung_colours
from fabweave.picture.camera import View, choose_view
from fabweave.picture.strand_colours import crossing_colours
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.report.costs.assembly_time import step_seconds
from fabweave.report.costs.texts import cost_rows
from fabweave.report.verdict import verdict_words


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
            "seconds": [
                round(seconds, 1) for seconds in step_seconds(crossing_map, job.costs.assembly)
            ],
            "hours": list(job.costs.assembly.hours),
        },
    )
