"""Check where threads are said to be cut, and what other lengths are said to come to.

The length that was taken is measured. What others come to was predicted by cutting all threads
anew, which is not done here: their figures are held to one another, to what the ribbons have to
have at least, and to the prices of the length that was taken. The rest is for ``--remake``.
"""

from collections.abc import Collection
from math import ceil, sqrt
from typing import Any

import numpy as np

from fabweave.verify.checks.reports.hands import ACTIONS, JOINT_S, PACE
from fabweave.verify.checks.reports.page_splitting import splitting_reason
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.areas import least_rectangle, polygon_area
from fabweave.verify.measure.development import develop_thread
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place

_UTILISATION = 6e-5
#: Areas are rounded to a tenth.
_AREA_MM2 = 0.06
#: Of the pieces of a thread: the longest is rounded to a tenth, and the share that they fill.
_LONGEST_MM, _FILL = 0.06, 2e-4
#: Seconds for a piece and for a joint by hand, at a middling pace, and for what is engraved on a
#: piece; what a joint costs besides, and an hour by hand and at the machine, in euros.
_PIECE_S = sqrt(PACE[0] * PACE[1]) * sum(ACTIONS[name][0] for name in ("sort", "find", "take"))
_JOINT_S = sqrt(PACE[0] * PACE[1]) * (ACTIONS["align"][0] + JOINT_S["none"])
_ENGRAVE_S = 12.0
_JOINT_EUR, _HAND_EUR_H, _MACHINE_EUR_H = 0.05, 15.0, 30.0
#: Hours and costs are rounded to a hundredth.
_ROUNDED = 0.0051
#: Outlines of pieces and of their unfolded rails agree to this share.
_RIM = 0.02
#: On meshes with more crossings some threads stand for all.
_ALL_CUT = 5_000
#: So few pieces, in all or on each sheet but never more than the last, are nested roughly.
_FEW_ON_SHEET, _FEW_SHEETS, _MOST_PACKED = 12, 5, 200
#: Cutting speed, and price of a square metre, of a material of which none is known.
_CUT_MM_S, _SHEET_EUR_M2 = 20.0, 10.0


def check_splitting(job: Job, waste: dict[str, Any], place: Place) -> None:
    """Check pieces, lengths and fill of every thread, and what lengths come to.

    Parameters
    ----------
    job : Job
    waste : dict
        waste.json; one without a record of splitting is left alone.
    place : Place
    """
    plan, splitting = required(job.map), waste.get("splitting")
    if splitting is None:
        return
    rows = splitting["threads"] if isinstance(splitting, dict) else []
    threads = [thread for thread in plan.threads if thread.pieces]
    if isinstance(splitting, dict) and "chosen" in splitting:
        _check_chosen(plan, splitting, place)
        _check_choices(job, plan, waste, splitting, place)
        notes = waste.get("notes")
        wanted = f"pieces: {splitting_reason(splitting)}"
        place.expect(notes is None or wanted in notes, f"no note says {wanted!r}")
    place.equal(
        "the list of threads, each with its number of pieces,",
        [(row.get("thread"), row.get("pieces")) for row in rows],
        [(thread.label, len(thread.pieces)) for thread in threads],
    )
    for row, thread in zip(rows, threads, strict=False):
        outlines = [plan.piece[name].outline for name in thread.pieces]
        area = sum(polygon_area(outline) for outline in outlines)
        around = sum(float(np.prod(least_rectangle(outline))) for outline in outlines)
        longest = max(float(np.ptp(outline[:, 0])) for outline in outlines)
        here = place.at(f"thread {thread.label}")
        here.number("longest_mm", row.get("longest_mm"), longest, within=_LONGEST_MM)
        here.number("fill", row.get("fill"), area / around, within=_FILL)


def _check_chosen(plan: CrossingMap, splitting: dict[str, Any], place: Place) -> None:
    """Check that the length that was taken is said to come to what was made.

    It is one of those compared if a preference took it.
    """
    chosen, choices = splitting["chosen"], splitting["choices"]
    here = place.at("chosen")
    here.number("pieces", chosen["pieces"], len(plan.pieces))
    here.number("joints", chosen["joints"], len(plan.joints))
    here.number("max_length_mm", chosen["max_length_mm"], splitting["max_length_mm"])
    here.equal("exact", chosen["exact"], True)
    lengths = [choice["max_length_mm"] for choice in choices]
    place.equal("the row of lengths", lengths, sorted(set(lengths)))
    place.expect(
        splitting["prefer"] is None or chosen["max_length_mm"] in lengths,
        f"{chosen['max_length_mm']} mm was taken, but not compared",
    )
    for choice in choices:
        if choice["max_length_mm"] == chosen["max_length_mm"] and choice["exact"]:
            place.at(f"{choice['max_length_mm']} mm").equal("what it comes to", choice, chosen)


def _check_choices(
    job: Job,
    plan: CrossingMap,
    waste: dict[str, Any],
    splitting: dict[str, Any],
    place: Place,
) -> None:
    """Check what each length is said to come to: counts, use, hours and costs."""
    prefer = splitting["prefer"]
    place.against("job.toml").equal(
        "prefer", prefer, None if "max_length" in job.options else job.options.get("prefer", prefer)
    )
    ends = sum(1 for thread in plan.threads if thread.pieces and not thread.closed)
    rims = _rims(job, plan)
    speed = _speeds(waste)
    for choice in (splitting["chosen"], *splitting["choices"]):
        here = place.at(f"{choice['max_length_mm']} mm")
        pieces, joints = choice["pieces"], choice["joints"]
        share = choice["piece_mm2"] / choice["sheet_mm2"]
        loose = _AREA_MM2 * (1.0 + share) / choice["sheet_mm2"]
        here.number("utilisation", choice["utilisation"], share, within=_UTILISATION + loose)
        small = len(plan.crossings) <= _ALL_CUT
        here.expect(choice["exact"] is True or not small, "not all threads were cut, but few are")
        here.expect(
            0 <= choice["longer"] <= pieces and choice["sheets"] > 0,
            f"{choice['longer']} of {pieces} pieces are longer, on {choice['sheets']} sheets",
        )
        if choice["exact"] is not True:
            continue
        # Each cut of a ring is a joint; an open thread has one piece more than joints.
        here.number("joints", joints, pieces - ends)
        by_hand = (_PIECE_S * pieces + _JOINT_S * joints) / 3600.0
        cut_h = choice["hours"] - by_hand - _ENGRAVE_S * pieces / 3600.0
        low, high = rims[0] / speed[1], (rims[0] + pieces * rims[1]) / speed[0]
        here.expect(
            low / 3600.0 * (1.0 - _RIM) - _ROUNDED
            <= cut_h
            <= high / 3600.0 * (1.0 + _RIM) + _ROUNDED,
            f"{choice['hours']} hours leave {3600.0 * cut_h:.0f} s to cut outlines, which take "
            f"{low:.0f} to {high:.0f} s",
        )
    _check_prices(job, plan, waste, splitting, place)


def _rims(job: Job, plan: CrossingMap) -> tuple[float, float]:
    """Return the length of all rails, and the most that one more piece can add to what is cut.

    A piece has two ends as wide as the widest ribbon, and laps that go no farther beyond the
    longest panel than they are long.
    """
    lap = max((joint.lap_mm or 0.0 for joint in plan.joints), default=0.0)
    rails, across, panel = 0.0, 0.0, 0.0
    model = job.model or {}
    for thread in plan.threads:
        strip = model.get(thread.label)
        if strip is None or not thread.crossings:
            continue
        rungs = develop_thread(strip)
        sides = _lengths(rungs)
        rails += float(sides.sum())
        across = max(across, float(np.hypot(*(rungs[:, 1] - rungs[:, 0]).T).max()))
        place = np.concatenate([[[0.0, 0.0]], np.cumsum(sides, axis=0)])
        # The panel of a ring that runs over its first rung is left out: others are as long.
        passed = strip.exit > strip.entry
        spans = place[strip.exit[passed]] - place[strip.entry[passed]]
        panel = max(panel, float(spans.max(initial=0.0)))
    return rails, 2.0 * across + 4.0 * (panel + lap)


def _lengths(rungs: Floats) -> Floats:
    """Return the length of each step along both rails, (R - 1, 2)."""
    return np.asarray(np.linalg.norm(np.diff(rungs, axis=0), axis=2))


def _speeds(waste: dict[str, Any]) -> tuple[float, float]:
    """Return the least and the greatest of the middle speeds of materials."""
    rates = (waste.get("estimate") or {}).get("materials", ())
    speeds = [float(np.mean(one["speed_mm_s"] or _CUT_MM_S)) for one in rates] or [_CUT_MM_S]
    return min(speeds), max(speeds)


def _sheets_due(choice: dict[str, Any], area: float) -> Collection[int]:
    """Return how many sheets of an area a length may be said to take.

    So many as its area fills; few or large pieces were nested roughly, and may take fewer or more:
    not fewer than the pieces themselves fill, nor more than there are pieces.
    """
    due = {ceil((choice["sheet_mm2"] + by) / area - 1e-9) for by in (-0.1, 0.1)}
    pieces = choice["pieces"]
    if pieces > min(_FEW_ON_SHEET * max(*due, _FEW_SHEETS), _MOST_PACKED):
        return due
    return range(max(ceil((choice["piece_mm2"] - 0.1) / area), 1), pieces + 1)


def _check_prices(
    job: Job, plan: CrossingMap, waste: dict[str, Any], splitting: dict[str, Any], place: Place
) -> None:
    """Check how many sheets each length is said to take, and that its cost is that of all it takes.

    Only where there is one material, in as many sheets of one size as are wanted.
    """
    rates = (waste.get("estimate") or {}).get("materials", ())
    areas = {round(sheet.area_mm2, 3) for sheet in plan.sheets}
    sizes = job.options.get("sheet") or []
    plain = "stock" not in job.options and len(sizes) <= 1 and ":" not in "".join(sizes)
    if len(rates) != 1 or len(areas) != 1 or not plain:
        return
    price, area = rates[0]["price_per_m2"], areas.pop()
    by_area = _SHEET_EUR_M2 if price is None else float(np.mean(price))
    for choice in (splitting["chosen"], *splitting["choices"]):
        if choice["exact"] is not True:
            continue
        here = place.at(f"{choice['max_length_mm']} mm")
        by_hand = (_PIECE_S * choice["pieces"] + _JOINT_S * choice["joints"]) / 3600.0
        here.expect(
            choice["sheets"] in _sheets_due(choice, area),
            f"{choice['sheets']} sheets of {area:.0f} mm² are not what {choice['sheet_mm2']} mm² "
            "take",
        )
        cost = (
            choice["sheets"] * by_area * area * 1e-6
            + _JOINT_EUR * choice["joints"]
            + _HAND_EUR_H * by_hand
            + _MACHINE_EUR_H * (choice["hours"] - by_hand)
        )
        here.number("cost", choice["cost"], cost, within=_ROUNDED * (1.0 + _MACHINE_EUR_H))
