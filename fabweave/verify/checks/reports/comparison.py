"""Check how the use of the material is compared with the best there could be, and with naive ways.

Rectangles are measured around the pieces, and around whole threads as the model unfolds; shelves
are filled with them afresh.
"""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.areas import least_rectangle, polygon_area, sum_areas
from fabweave.verify.measure.development import develop_thread, drift
from fabweave.verify.read.job_files import Job
from fabweave.verify.statement import Place

_AREA_MM2, _SHARE = 0.05, 1e-6
_UTILISATION = 2e-6
#: Arcs of half a gap, by chords, take less than this share of what is around a piece.
_ARCS = 2e-3
#: The model is rounded to 32 bits: areas around what it unfolds to agree to this share.
_UNFOLDED = 1e-5
#: Rectangles fit into what is smaller by no more than rounding.
_TINY_MM = 1e-6


def check_comparison(plan: CrossingMap, job: Job, waste: Mapping[str, Any], place: Place) -> None:
    """Recompute the shares, the bound and the rectangles of the comparison."""
    told = waste["comparison"]
    whole = sum(sheet.area_mm2 for sheet in plan.sheets)
    used = sum_areas(job.areas.values()).piece_mm2
    kept = sum(offcut["area_mm2"] for offcut in waste.get("offcuts", []))
    place.number("kept_mm2", told["kept_mm2"], kept, within=_AREA_MM2 + _SHARE * kept)
    place.number("gross", told["gross"], used / whole, within=_UTILISATION)
    place.number("net", told["net"], used / (whole - kept), within=_UTILISATION)
    outlines = [piece.outline for piece in plan.to_cut]
    around = sum(float(np.prod(least_rectangle(outline))) for outline in outlines)
    rectangles = told["rectangles"]
    place.at("rectangles").number(
        "area_mm2", rectangles["area_mm2"], around, within=_AREA_MM2 + _SHARE * around
    )
    area = sum(polygon_area(outline) for outline in outlines)
    boxes = [(piece.thread, least_rectangle(piece.outline)) for piece in plan.to_cut]
    _check_way(plan, job, told["rectangles"], boxes, used, place.at("rectangles"))
    strips = job.model or {}
    whole_threads = [
        (thread.id, least_rectangle(develop_thread(strips[thread.label]).reshape(-1, 2)))
        for thread in plan.threads
        if thread.crossings and thread.label in strips
    ]
    here = place.at("strips")
    around = sum(float(np.prod(sides)) for _, sides in whole_threads)
    doubt = sum(
        float(np.prod(sides)) * (_UNFOLDED + drift(strips[plan.thread[thread].label]))
        for thread, sides in whole_threads
    )
    here.number("area_mm2", told["strips"]["area_mm2"], around, within=_AREA_MM2 + doubt)
    # No whole thread has a spare.
    woven = sum_areas(job.areas[name] for name in plan.piece).piece_mm2
    _check_way(plan, job, told["strips"], whole_threads, woven, here)
    place.expect(
        told["bound_mm2"] >= area and told["gross"] <= told["best"] + _UTILISATION,
        "a layout is said to be better than the best",
    )
    grain = told.get("grain")
    place.expect(
        grain is None or plan.from_grain_deg == 90.0,
        "it is told what lying across the grain costs, and pieces need not",
    )
    for name, way in (grain or {}).items():
        _check_rough(plan, used, way, place.at("grain", name))
    if len({(sheet.material, sheet.thickness_mm) for sheet in plan.sheets}) == 1:
        _check_bound(plan, told, used, place)


def _check_rough(plan: CrossingMap, used: float, way: Mapping[str, Any], place: Place) -> None:
    """Check what is told of a rough nesting, which is not repeated, against what could be.

    Its sheets are of the sizes that there are, and hold the pieces.
    """
    sizes = [sheet.area_mm2 for sheet in plan.sheets]
    place.number("utilisation", way["utilisation"], used / way["area_mm2"], within=_UTILISATION)
    place.expect(
        used <= way["area_mm2"] and way["sheets"] * min(sizes) <= way["area_mm2"] + _AREA_MM2,
        f"{way['sheets']} sheets of {way['area_mm2']:g} mm² would not hold the pieces, or are "
        "smaller than those that are used",
    )


def _check_bound(plan: CrossingMap, told: Mapping[str, Any], used: float, place: Place) -> None:
    """Check what pieces take with half the gap around, and how many sheets that is."""
    gap = plan.gap_mm
    room = sum(
        float(shapely.Polygon(piece.outline).buffer(gap / 2, quad_segs=32).area)
        for piece in plan.to_cut
    )
    place.number("bound_mm2", told["bound_mm2"], room, within=_ARCS * room)
    sheet = max(plan.sheets, key=lambda one: one.area_mm2)
    usable = [side - 2 * plan.margin_mm + gap for side in (sheet.width_mm, sheet.height_mm)]
    needed = told["bound_mm2"] / (usable[0] * usable[1])
    place.number("bound_sheets", told["bound_sheets"], ceil(needed - 1e-7))
    share = used / (told["bound_sheets"] * sheet.area_mm2) if told["bound_sheets"] else 0.0
    place.number("best", told["best"], share, within=_UTILISATION)


def _check_way(
    plan: CrossingMap,
    job: Job,
    way: Mapping[str, Any],
    boxes: Sequence[tuple[int, Floats]],
    used: float,
    place: Place,
) -> None:
    """Fill shelves of the largest sheet of each material with rectangles of threads, naively."""
    sheets, too_large, area = 0, 0, 0.0
    for keys in _nested_apart(plan, job):
        own = [piece.sheet for piece in plan.to_cut if piece.thread in keys]
        sheet = max((plan.sheet[number] for number in own), key=lambda one: one.area_mm2)
        gap = min((job.supplies[key].gap_mm or plan.gap_mm for key in keys), default=plan.gap_mm)
        sides = [side - 2 * plan.margin_mm for side in (sheet.width_mm, sheet.height_mm)]
        count, left = _fill_shelves([box for key, box in boxes if key in keys], sides, gap)
        sheets, too_large, area = sheets + count, too_large + left, area + count * sheet.area_mm2
    place.number("sheets", way["sheets"], sheets)
    place.number("too_large", way["too_large"], too_large)
    share = None if too_large or area == 0.0 else used / area
    place.number("utilisation", way["utilisation"], share, within=_UTILISATION)


def _nested_apart(plan: CrossingMap, job: Job) -> list[set[int]]:
    """Return the threads that share sheets with one another, for each lot of sheets."""
    lots: dict[object, set[int]] = {}
    for piece in plan.to_cut:
        sheet = plan.sheet[piece.sheet]
        key = sheet.material, sheet.thickness_mm, job.supplies[piece.thread].gap_mm
        lots.setdefault(key, set()).add(piece.thread)
    return list(lots.values())


def _fill_shelves(
    boxes: Sequence[Floats], sheet_mm: Sequence[float], gap_mm: float
) -> tuple[int, int]:
    """Return how many sheets rectangles take on shelves along the longer side, and what fits none.

    The highest comes first, of those as high the longest. Each goes on the first shelf with room
    for it, or else opens one, on the first sheet that has the height.

    Examples
    --------
    >>> _fill_shelves([np.array([4.0, 2.0])] * 5 + [np.array([10.0, 1.0])], (9.0, 5.0), 1.0)
    (2, 1)
    """
    long, high = max(sheet_mm) + gap_mm + _TINY_MM, min(sheet_mm) + gap_mm + _TINY_MM
    sides = [(float(box.min()) + gap_mm, float(box.max()) + gap_mm) for box in boxes]
    fitting = [pair for pair in sides if pair[0] <= high and pair[1] <= long]
    room: list[float] = []
    above: list[float] = []
    for rise, length in sorted(fitting, reverse=True):
        shelf = next((at for at, left in enumerate(room) if left >= length), len(room))
        if shelf == len(room):
            sheet = next((at for at, left in enumerate(above) if left >= rise), len(above))
            if sheet == len(above):
                above.append(high)
            above[sheet] -= rise
            room.append(long)
        room[shelf] -= length
    return len(above), len(sides) - len(fitting)
