"""Check what sheets tell people and nobody cuts: it is on the sheet, off pieces, and legible.

Rules for lines that are cut or engraved do not hold it, however fine its lines are.
"""

import numpy as np
import shapely

from fabweave.verify.check.drawings import lines_of
from fabweave.verify.drawing import NOTES, OUTLINES, Drawing, Floats
from fabweave.verify.read.job_files import Job, sheet_drawings
from fabweave.verify.report import Place, Tally

#: A frame has lost the short sides of its sheet; what is rounded shares less with a piece.
_FRAME_MM, _SHARED_MM = 0.2, 0.05
#: The least height of letters, less what rounding takes; no letter is larger than the second.
_LEGIBLE_MM, _LARGEST_MM = 0.95, 9.0
#: Strokes this near are one sign, and signs this near one text: the largest space between words.
_TOUCH_MM, _SPACE_MM = 2e-4, 2.6
#: Fewer signs than that are not judged: they may be dots and the like.
_FEW = 3


def check_notes(job: Job, tally: Tally) -> None:
    """Check the notes of every sheet as its DXF has them; the SVG draws the same."""
    for sheet, drawing, place in sheet_drawings(job, "dxf", tally):
        _check_sheet(drawing, sheet.outline, place)
    for beside in (one for one in (job.rim, job.former) if one is not None):
        for name in (name for name in beside.dxf if name in beside.svg):
            wide, high = beside.svg[name].width_mm or 0.0, beside.svg[name].height_mm or 0.0
            corners = np.array([[0.0, 0.0], [wide, 0.0], [wide, high], [0.0, high]])
            _check_sheet(beside.dxf[name], corners, tally.at(beside.folder, f"{name}.dxf"))


def _check_sheet(drawing: Drawing, outline: Floats, place: Place) -> None:
    """Check the notes of a sheet: all within it, and what is no frame off its pieces."""
    notes = [shape for shape in drawing.shapes if shape.layer == NOTES]
    lines = lines_of(notes)
    material = shapely.Polygon(outline).buffer(_FRAME_MM, join_style="mitre")
    shapely.prepare(material)
    place.count(len(notes))
    for shape, held in zip(notes, shapely.covers(material, lines).tolist(), strict=True):
        if not held:
            place.fail(f"{shape.where} on {NOTES} is not within the sheet")
    strokes = lines[np.array([not shape.closed for shape in notes], dtype=bool)]
    pieces = np.array(
        [shapely.make_valid(shapely.Polygon(shape.traced)) for shape in drawing.shapes
         if shape.layer == OUTLINES], dtype=object,
    )  # fmt: skip
    which, of = shapely.STRtree(pieces).query(strokes, predicate="intersects")
    over = shapely.length(shapely.intersection(strokes[which], pieces[of]))
    place.at_most("note_mm", float(over.max(initial=0.0)), _SHARED_MM, "a note runs over a piece")
    _check_legible(strokes, place)


def _check_legible(strokes: Floats, place: Place) -> None:
    """Check that each text has a sign as high as letters must be.

    Signs are strokes that touch; straight ones may be dashes, and the longest ones scales.
    """
    signs = shapely.get_parts(shapely.union_all(shapely.buffer(strokes, _TOUCH_MM, quad_segs=1)))
    hulls, size = shapely.convex_hull(signs), 2.0 * shapely.minimum_bounding_radius(signs)
    bent = (shapely.area(hulls) > 3.0 * _TOUCH_MM * size) & (size < _LARGEST_MM)
    hulls, size = hulls[bent], size[bent]
    texts = shapely.get_parts(shapely.union_all(shapely.buffer(hulls, _SPACE_MM / 2.0)))
    text, sign = shapely.STRtree(hulls).query(texts, predicate="intersects")
    for at in range(len(texts)):
        heights = size[sign[text == at]]
        if len(heights) >= _FEW:
            place.at_least("letter_mm", float(heights.max()), _LEGIBLE_MM, "letters are {} high")
