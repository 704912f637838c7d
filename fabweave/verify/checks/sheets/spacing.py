"""Check that pieces keep inside the margins of their sheets, apart, and off defects."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: Rounding in the files may bring pieces this much nearer.
ROUNDING_MM = 1e-3


def check_sheets(job: Job, tally: Tally) -> None:
    """Check that placed pieces keep the margin and the gap, by exact distances."""
    plan = required(job.map)
    for piece in plan.to_cut:
        tally.at(f"piece {piece.id}").expect(piece.sheet in plan.sheet, "it is on no sheet")
    for sheet in plan.sheets:
        pieces = plan.on_sheet(sheet.number)
        if not pieces:
            continue
        place = tally.at(sheet.name)
        placed = [piece.placed(piece.outline) for piece in pieces]
        for piece, points in zip(pieces, placed, strict=True):
            border = min(
                float(points.min()),
                float(sheet.width_mm - points[:, 0].max()),
                float(sheet.height_mm - points[:, 1].max()),
            )
            place.at(f"piece {piece.id}").at_least(
                "margin_mm", border, plan.layout.margin_mm - ROUNDING_MM, "it is {} from the border"
            )
        names = [piece.id for piece in pieces]
        polygons = shapely.make_valid(np.array([shapely.Polygon(points) for points in placed]))
        _check_room(sheet, names, polygons, plan, place)
        gaps = [job.supplies[piece.thread].gap_mm for piece in pieces]
        gap = min((gap for gap in gaps if gap is not None), default=plan.layout.gap_mm)
        _check_gaps(names, polygons, max(gap - ROUNDING_MM, 0.0), place)


def _check_gaps(
    names: Sequence[str], polygons: npt.NDArray[np.object_], gap_mm: float, place: Place
) -> None:
    """Check that pieces keep a gap from one another."""
    # A little beyond the gap, so that the narrowest kept gap is reported too.
    first, second = shapely.STRtree(polygons).query(
        polygons, predicate="dwithin", distance=gap_mm + 1.0
    )
    for a, b in zip(first[first < second].tolist(), second[first < second].tolist(), strict=True):
        pair = place.at(f"pieces {names[a]} and {names[b]}")
        apart = float(shapely.distance(polygons[a], polygons[b]))
        pair.at_least("gap_mm", apart, gap_mm, "they are {} apart")
        overlap = shapely.intersection(polygons[a], polygons[b]).area if apart == 0.0 else 0.0
        if overlap:
            pair.count()
            pair.fail(f"they overlap by {overlap:.3f} mm²")


def _check_room(
    sheet: Sheet,
    names: Sequence[str],
    polygons: npt.NDArray[np.object_],
    plan: CrossingMap,
    place: Place,
) -> None:
    """Check that pieces keep the margin from the sheet's outline, and the gap from its defects."""
    inside = shapely.Polygon(sheet.outline)
    edge = shapely.distance(polygons, inside.exterior)
    edge[~shapely.covers(inside, polygons)] = -1.0
    for name, room in zip(names, edge.tolist(), strict=True):
        place.at(f"piece {name}").at_least(
            "outline_margin_mm",
            room,
            plan.layout.margin_mm - ROUNDING_MM,
            "it is {} from the outline" if room >= 0.0 else "it is not within the outline",
        )
    for number, ring in enumerate(sheet.defects, start=1):
        defect = shapely.make_valid(shapely.Polygon(ring))
        for name, apart in zip(names, shapely.distance(polygons, defect).tolist(), strict=True):
            place.at(f"piece {name}").at_least(
                "defect_mm",
                apart,
                max(plan.layout.gap_mm - ROUNDING_MM, 1e-9),
                f"it is {{}} from defect {number}",
            )
