"""Check how the use of the material is compared with the best there could be, and with naive ways.

The two naive ways were packed by the maker. Here their areas are measured, and that so many sheets
can hold them and no more are said than rectangles; what whole threads take is not in the files, but
it is no less than their pieces.
"""

from collections.abc import Mapping
from math import ceil
from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.areas import least_rectangle, polygon_area, sum_areas
from fabweave.verify.read.job_files import Job
from fabweave.verify.statement import Place

_AREA_MM2, _SHARE = 0.05, 1e-6
_UTILISATION = 2e-6
#: Arcs of half a gap, by chords, take less than this share of what is around a piece.
_ARCS = 2e-3
#: Pieces lap on one another, so those of a thread may be this much larger than the thread.
_LAPPED = 0.5


def check_comparison(plan: CrossingMap, job: Job, waste: Mapping[str, Any], place: Place) -> None:
    """Recompute the shares, the bound and the rectangles of the comparison."""
    told = waste["comparison"]
    whole = sum(sheet.area_mm2 for sheet in plan.sheets)
    used = sum_areas(job.areas.values()).piece_mm2
    kept = sum(offcut["area_mm2"] for offcut in waste.get("offcuts", []))
    place.number("kept_mm2", told["kept_mm2"], kept, within=_AREA_MM2 + _SHARE * kept)
    place.number("gross", told["gross"], used / whole, within=_UTILISATION)
    place.number("net", told["net"], used / (whole - kept), within=_UTILISATION)
    outlines = [piece.outline for piece in plan.pieces]
    around = sum(float(np.prod(least_rectangle(outline))) for outline in outlines)
    rectangles = told["rectangles"]
    place.at("rectangles").number(
        "area_mm2", rectangles["area_mm2"], around, within=_AREA_MM2 + _SHARE * around
    )
    area = sum(polygon_area(outline) for outline in outlines)
    place.at("strips").expect(
        told["strips"]["area_mm2"] >= _LAPPED * area,
        f"whole threads take {told['strips']['area_mm2']} mm², but their pieces {area:.1f} mm²",
    )
    for name, most in (("rectangles", len(plan.pieces)), ("strips", len(plan.threads))):
        _check_way(told[name], most, used, max(s.area_mm2 for s in plan.sheets), place.at(name))
    place.expect(
        told["bound_mm2"] >= area and told["gross"] <= told["best"] + _UTILISATION,
        "a layout is said to be better than the best",
    )
    if len({(sheet.material, sheet.thickness_mm) for sheet in plan.sheets}) == 1:
        _check_bound(plan, told, used, place)


def _check_bound(plan: CrossingMap, told: Mapping[str, Any], used: float, place: Place) -> None:
    """Check what pieces take with half the gap around, and how many sheets that is."""
    gap = plan.gap_mm
    room = sum(
        float(shapely.Polygon(piece.outline).buffer(gap / 2, quad_segs=32).area)
        for piece in plan.pieces
    )
    place.number("bound_mm2", told["bound_mm2"], room, within=_ARCS * room)
    sheet = max(plan.sheets, key=lambda one: one.area_mm2)
    usable = [side - 2 * plan.margin_mm + gap for side in (sheet.width_mm, sheet.height_mm)]
    needed = told["bound_mm2"] / (usable[0] * usable[1])
    place.number("bound_sheets", told["bound_sheets"], ceil(needed - 1e-7))
    share = used / (told["bound_sheets"] * sheet.area_mm2) if told["bound_sheets"] else 0.0
    place.number("best", told["best"], share, within=_UTILISATION)


def _check_way(
    way: Mapping[str, Any], most: int, used: float, sheet_mm2: float, place: Place
) -> None:
    """Check that a naive way says a use where all fits, one that its sheets come to."""
    sheets, too_large = way["sheets"], way["too_large"]
    place.expect(
        0 <= too_large <= most and 0 <= sheets <= most - too_large,
        f"{sheets} sheets and {too_large} that fit on none are not of {most} rectangles",
    )
    share = way["utilisation"]
    if too_large or share is None:
        place.expect(
            bool(too_large) and share is None, "it has a use, but not all fits; or the other way"
        )
        return
    place.expect(
        sheets * sheet_mm2 * (1.0 + _SHARE) >= way["area_mm2"],
        f"{sheets} sheets cannot hold {way['area_mm2']} mm² of rectangles",
    )
    place.expect(
        used / (sheets * sheet_mm2) <= share * (1.0 + 1e-5) + _UTILISATION,
        f"it says a use of {share}, less than {sheets} of the largest sheets come to",
    )
