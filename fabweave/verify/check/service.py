"""Check the files for a service: each holds its piece and no more, and quantities are right."""

import re
from pathlib import PurePosixPath

import msgspec
import numpy as np

from fabweave.verify.check.drawings import SAME_MM, check_piece_drawn
from fabweave.verify.check.tables import check_row, cut_length, net_area
from fabweave.verify.crossing_map import Piece, Placement
from fabweave.verify.drawing import Drawing, ring_points
from fabweave.verify.read.job_files import SERVICE, TABLE, Job, required
from fabweave.verify.report import Place, Tally


def check_service(job: Job, tally: Tally) -> None:
    """Check the folder of a job for a service; of another job that there is none."""
    plan, service = required(job.map), job.service
    asked = plan.cut.profile == "service"
    folder = tally.at(SERVICE)
    if service is None or not asked:
        folder.expect(
            service is None and not asked,
            f"the profile is {plan.cut.profile!r}, and "
            + (f"{TABLE} could not be read" if asked else "there is such a folder"),
        )
        return
    wanted: dict[tuple[str, ...], list[Piece]] = {}
    for piece in plan.to_cut:
        sheet = plan.sheet[piece.sheet]
        key = (str(piece.kind), str(sheet.material), f"{sheet.thickness_mm:g}")
        wanted.setdefault(key, []).append(piece)
    stated = [(row["kind"], row["material"], row["thickness_mm"]) for row in service.rows]
    folder.at(TABLE).same("kinds, each with its material and thickness,", stated, wanted)
    files = {TABLE}
    for row, key in zip(service.rows, stated, strict=True):
        place, pieces = folder.at(row["file"]), wanted.get(key, [])
        listed = folder.at(TABLE, row["file"])
        if pieces:
            _check_sizes(row, pieces[0], listed)
        listed.same("pieces", row["pieces"].split(), [piece.id for piece in pieces])
        kind, material, thickness = key
        name = f"{material.replace(':', '-')}_{thickness}mm/kind_{kind}_qty_{len(pieces)}.dxf"
        listed.equal("its name", re.sub(r"(kind|qty)_0+", r"\1_", row["file"]), name)
        listed.equal("quantity", row["quantity"], str(len(pieces)))
        for suffix, drawings in ((".dxf", service.dxf), (".svg", service.svg)):
            files.add(str(PurePosixPath(row["file"]).with_suffix(suffix)))
            drawing = drawings.get(row["file"])
            if drawing is None:
                place.fail(f"its {suffix[1:]} is not checked, because it could not be read")
            elif pieces:
                _check_drawing(drawing, pieces[0], place.at(suffix[1:]))
    for name in service.files:
        folder.at(name).expect(name in files, "it is no piece's")


def _check_sizes(row: dict[str, str], piece: Piece, place: Place) -> None:
    """Check what the table says of the size of a piece, by which a service reckons its price."""
    length, width = np.ptp(ring_points(piece.path), axis=0).tolist()
    cells = {
        "length_mm": length,
        "width_mm": width,
        "area_mm2": net_area(piece),
        "cut_length_mm": cut_length(piece),
        "holes": len(piece.cutouts),
    }
    check_row(row, cells, place)


def _check_drawing(drawing: Drawing, piece: Piece, place: Place) -> None:
    """Check that a drawing holds the cut-outs and, last, the outline of a piece; nothing else."""
    for problem in drawing.problems:
        place.fail(problem)
    shapes = drawing.shapes
    if not place.expect(
        shapes and not any(one.piece or not (one.closed or one.radius) for one in shapes),
        "it holds nothing, or shapes that are open or named",
    ):
        return
    points = ring_points(piece.path)
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    if drawing.width_mm is not None:
        declared = (drawing.width_mm, drawing.height_mm or 0.0)
        place.expect(
            np.allclose(declared, size, rtol=0, atol=SAME_MM),
            f"it says that it is {declared} mm, and its piece is {size.round(3)} mm",
        )
    # The file's frame is the piece's, shifted to the origin.
    moved = msgspec.structs.replace(
        piece, placement=Placement(0.0, *(-low).tolist()), mirror_mm=None
    )
    outline, cutouts = [shapes[-1]], list(shapes[:-1])
    check_piece_drawn(moved, outline, cutouts, place)
