"""Check the sheets at full size: their pages show every piece, in millimetres as drawn."""

import numpy as np
from scipy.spatial import KDTree

from fabweave.verify.crossing_map import CrossingMap, Piece, Sheet
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.words import PAPERS_MM
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.template import Template
from fabweave.verify.statement import Place, Tally

#: PDF counts in points; six decimals of them are much less than this.
_SAME_MM = 0.01
#: Sizes of paper are told in hundredths of points.
_PAPER_MM = 0.1
#: Printers leave so much of the paper white.
_BORDER_MM = 10.0


def check_templates(job: Job, tally: Tally) -> None:
    """Check every sheet at full size against the crossing map."""
    plan = required(job.map)
    if job.templates is None:
        return
    paper = str(job.options.get("template"))
    for sheet in plan.sheets:
        template = job.templates.get(sheet.number)
        if template is None:
            tally.fail(f"{sheet.name}.pdf is not checked, because it could not be read")
            continue
        place = tally.at(f"{sheet.name}.pdf")
        _check_paper(sheet, template, paper, place.against("job.toml"))
        _check_pages(sheet, template, place)
        _check_points(plan.on_sheet(sheet.number), plan, template, place)


def _check_paper(sheet: Sheet, template: Template, paper: str, place: Place) -> None:
    """Check that pages have the size that was asked for: that of the sheet, or of some paper."""
    size = (sheet.width_mm, sheet.height_mm) if paper == "sheet" else PAPERS_MM.get(paper)
    if not place.expect(size is not None, f"there is no paper {paper!r}") or size is None:
        return
    off = np.abs(np.sort(template.pages, axis=1) - sorted(size)).max()
    place.expect(off < _PAPER_MM, f"a page has not the size of {paper!r}")


def _check_pages(sheet: Sheet, template: Template, place: Place) -> None:
    """Check that one page is the sheet, or that all together show all of it."""
    size = np.array([sheet.width_mm, sheet.height_mm])
    whole = len(template.pages) == 1 and not np.any(template.origins)
    border = 0.0 if whole else _BORDER_MM
    seen = np.column_stack([np.full_like(template.pages, border), template.pages - 2.0 * border])
    place.at_most(
        "window_mm",
        float(np.abs(template.windows - seen).max()),
        _SAME_MM,
        "a page shows the sheet through a window that is off by {}",
    )
    if whole:
        off = float(np.abs(template.pages[0] - size).max())
        place.at_most("page_mm", off, _SAME_MM, "its page and the sheet differ by {} in size")
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
        place.expect(seen.any(axis=0).all(), "its pages do not show all of the sheet")
    columns, rows = (len(np.unique(template.origins[:, axis].round(3))) for axis in (0, 1))
    place.equal("the number of pages in all rows", len(low), columns * rows)


def _check_points(pieces: list[Piece], plan: CrossingMap, template: Template, place: Place) -> None:
    """Check that every corner of every piece and every hole is drawn."""
    tree = KDTree(template.points)
    for piece in pieces:
        wanted: list[Floats] = [piece.placed(piece.path[:, :2])]
        wanted += [piece.placed(ring[:, :2]) for ring in piece.slots]
        for hole in plan.holes[piece.id]:
            if hole.diameter is not None:
                # Wherever a circle begins, it has been drawn by quarters.
                side = np.array([[hole.diameter / 2.0, 0.0]])
                wanted.append(piece.placed(np.array([[hole.x, hole.y]])) + side)
        distance = tree.query(np.concatenate(wanted))[0]
        place.at_most(
            "template_mm",
            float(np.max(distance)),
            _SAME_MM,
            f"piece {piece.id} is drawn {{}} from where it should be",
        )
