"""Check the sheets at full size: their pages show every piece, in millimetres as drawn."""

import numpy as np
from scipy.spatial import KDTree

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import Floats
from fabweave.verify.read.job_files import Job
from fabweave.verify.read.template import Template
from fabweave.verify.report import Tally

#: PDF counts in points; six decimals of them are much less than this.
_SAME_MM = 0.01
#: Printers leave so much of the paper white.
_BORDER_MM = 10.0


def check_templates(job: Job, tally: Tally) -> None:
    """Check every sheet at full size against the crossing map."""
    plan = job.map
    if plan is None or job.templates is None:
        return
    for sheet in plan.sheets:
        template = job.templates.get(sheet.number)
        if template is None:
            tally.fail(f"{sheet.name}.pdf is not checked, because it could not be read")
            continue
        _check_pages(sheet, template, tally)
        _check_points(sheet, plan, template, tally)


def _check_pages(sheet: Sheet, template: Template, tally: Tally) -> None:
    """Check that one page is the sheet, or that all together show all of it."""
    where, size = f"{sheet.name}.pdf", np.array([sheet.width_mm, sheet.height_mm])
    tally.expect(
        len(template.origins) == len(template.pages),
        f"{where} has {len(template.pages)} pages, of which {len(template.origins)} show the sheet",
    )
    if len(template.pages) == 1 and not np.any(template.origins):
        off = float(np.abs(template.pages[0] - size).max())
        tally.measure("page_mm", off, _SAME_MM, f"{where}: its page is not as large as the sheet")
        return
    low = _BORDER_MM - template.origins
    high = low + template.pages[: len(low)] - 2.0 * _BORDER_MM
    for axis in (0, 1):
        # Between the edges of pages everything has to be on one of them, row by row.
        edges = np.unique(np.concatenate((low[:, axis], high[:, axis])).round(3))
        middles = np.concatenate(([0.0], (edges[1:] + edges[:-1]) / 2.0, [size[axis]]))
        middles = middles[(middles >= 0.0) & (middles <= size[axis])]
        seen = (low[:, axis, None] <= middles + _SAME_MM) & (
            middles - _SAME_MM <= high[:, axis, None]
        )
        tally.expect(seen.any(axis=0).all(), f"{where}: its pages do not show all of the sheet")
    columns, rows = (len(np.unique(template.origins[:, axis].round(3))) for axis in (0, 1))
    tally.expect(columns * rows == len(low), f"{where}: pages are missing from the rows")


def _check_points(sheet: Sheet, plan: CrossingMap, template: Template, tally: Tally) -> None:
    """Check that every corner of every piece and every hole is drawn."""
    tree = KDTree(template.points)
    for piece in plan.pieces:
        if piece.sheet != sheet.number:
            continue
        wanted: list[Floats] = [piece.placed(piece.path[:, :2])]
        wanted += [piece.placed(ring[:, :2]) for ring in piece.slots]
        for hole in plan.holes[piece.id]:
            if hole.diameter is not None:
                # Wherever a circle begins, it has been drawn by quarters.
                side = np.array([[hole.diameter / 2.0, 0.0]])
                wanted.append(piece.placed(np.array([[hole.x, hole.y]])) + side)
        distance = tree.query(np.concatenate(wanted))[0]
        off = float(np.max(distance))
        tally.measure(
            "template_mm",
            off,
            _SAME_MM,
            f"{sheet.name}.pdf: piece {piece.id} is drawn {off:.3f} mm from where it should be",
        )
