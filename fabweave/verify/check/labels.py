"""Check that letters are engraved clear of edges, holes and marks, on the side asked for."""

import numpy as np
import shapely

from fabweave.verify.check.drawings import lines_of
from fabweave.verify.drawing import HOLES, OUTLINES, Drawing, traced
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally

#: Letters keep this far from edges, holes and marks.
CLEAR_MM = 0.2


def check_labels(job: Job, tally: Tally) -> None:
    """Check where letters stand; what they say is held by the seal."""
    plan, side = required(job.map), job.options.get("label_side", "outside")
    tally.at("job.toml").expect(
        side in ("outside", "inside"), f"labels are {side!r}, which is no side of a piece"
    )
    for sheet in plan.sheets:
        place = tally.at(sheet.name)
        place.equal(
            f"whether it is mirrored, with labels {side},", sheet.mirrored, side == "inside"
        )
        # That both formats draw the same is another check.
        drawing = job.dxf.get(sheet.number) or job.svg.get(sheet.number)
        if drawing is None:
            tally.fail(f"the labels on {sheet.name} are not checked: no drawing could be read")
            continue
        for piece in plan.on_sheet(sheet.number):
            _check_clearance(piece.id, drawing, place.at(f"piece {piece.id}"))


def _check_clearance(piece: str, drawing: Drawing, place: Place) -> None:
    """Check that letters are inside their outline, and off it, its holes and its marks."""
    letters, marks = (
        lines_of(drawing.of(layer, piece)) for layer in ("ENGRAVE_LABEL", "ENGRAVE_MARK")
    )
    outlines = drawing.of(OUTLINES, piece)
    if not len(letters) or not outlines:
        return
    outline, *holes = (
        shapely.Polygon(traced(shape)) if shape.radius or len(shape.points) > 2 else None
        for shape in (outlines[0], *drawing.of(HOLES, piece))
    )
    text = shapely.multilinestrings(letters[shapely.is_geometry(letters)])
    inside = shapely.contains(shapely.make_valid(outline), text)
    place.expect(inside, "letters leave it")
    others = np.array([shapely.boundary(outline), *marks, *holes], dtype=object)
    apart = float(np.nanmin(shapely.distance(text, others), initial=np.inf))
    place.at_least("clear_mm", apart, CLEAR_MM, "letters are {} from an edge, a hole or a mark")
