"""Check the sheets at full size: their pages show every piece, in millimetres as drawn."""

import numpy as np
from scipy.spatial import KDTree

from fabweave.verify.crossing_map import CrossingMap, Piece, Sheet
from fabweave.verify.drawing import Flags, Floats
from fabweave.verify.measure.words import PAPERS_MM
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.template import Template
from fabweave.verify.statement import Place, Tally

#: PDF counts in points; six decimals of them are much less than this.
_SAME_MM = 0.01
#: Sizes of paper are told in hundredths of points.
_PAPER_MM = 0.1
#: Printers leave so much of the paper white: on the left, at the foot, in all across, in all up.
_LEFT_MM, _FOOT_MM, _ACROSS_MM, _UP_MM = 5.0, 9.0, 10.0, 14.0
#: Around a piece so much is shown, and around each place of a piece that no page holds.
_AROUND_MM, _NEAR_MM = 0.9, 4.9
#: Places of outlines are looked at so far apart.
_APART_MM = 2.0


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
        pieces = plan.on_sheet(sheet.number)
        _check_pages(sheet, pieces, template, place, whole=paper == "sheet")
        _check_points(pieces, plan, template, place)


def _check_paper(sheet: Sheet, template: Template, paper: str, place: Place) -> None:
    """Check that pages have the size that was asked for: that of the sheet, or of some paper."""
    size = (sheet.width_mm, sheet.height_mm) if paper == "sheet" else PAPERS_MM.get(paper)
    if not place.expect(size is not None, f"there is no paper {paper!r}") or size is None:
        return
    off = np.abs(np.sort(template.pages, axis=1) - sorted(size)).max()
    place.expect(off < _PAPER_MM, f"a page has not the size of {paper!r}")


def _check_pages(
    sheet: Sheet, pieces: list[Piece], template: Template, place: Place, *, whole: bool
) -> None:
    """Check that one page is the sheet, or that all together show every piece, and how."""
    size = np.array([sheet.width_mm, sheet.height_mm])
    corner = np.zeros(2) if whole else np.array([_LEFT_MM, _FOOT_MM])
    spent = np.zeros(2) if whole else np.array([_ACROSS_MM, _UP_MM])
    seen = np.column_stack([np.tile(corner, (len(template.pages), 1)), template.pages - spent])
    place.at_most(
        "window_mm",
        float(np.abs(template.windows - seen).max()),
        _SAME_MM,
        "a page shows the sheet through a window that is off by {}",
    )
    if whole:
        off = float(np.abs(np.concatenate([template.pages - size, template.origins])).max())
        place.at_most("page_mm", off, _SAME_MM, "its page and the sheet differ by {}")
        place.equal("the number of pages", len(template.pages), 1)
        return
    low = corner - template.origins
    high = low + template.pages - spent
    for piece in pieces:
        outline = _followed(piece.placed(piece.outline))
        box = np.concatenate([outline.min(axis=0) - _AROUND_MM, outline.max(axis=0) + _AROUND_MM])
        if _on_one(box[None], low, high).all():
            continue
        # All that is near a place of its outline is on one page, so that there is a lap.
        near = np.concatenate(
            [
                np.maximum(outline - _NEAR_MM, box[:2]),
                np.minimum(outline + _NEAR_MM, box[2:]),
            ],
            axis=1,
        )
        place.expect(
            _on_one(near, low, high).all(), f"its pages do not show all of piece {piece.id}"
        )


def _followed(outline: Floats) -> Floats:
    """Return places along an outline."""
    ends = np.roll(outline, -1, axis=0)
    counts = np.ceil(np.hypot(*(ends - outline).T) / _APART_MM).astype(np.int64) + 1
    return np.concatenate(
        [
            start + (end - start) * np.linspace(0.0, 1.0, count, endpoint=False)[:, None]
            for start, end, count in zip(outline, ends, counts.tolist(), strict=True)
        ]
    )


def _on_one(boxes: Floats, low: Floats, high: Floats) -> Flags:
    """Return which boxes are within the window of some page."""
    inside = (low[:, None] <= boxes[:, :2] + _SAME_MM) & (boxes[:, 2:] - _SAME_MM <= high[:, None])
    return np.asarray(inside.all(axis=2).any(axis=0))


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
