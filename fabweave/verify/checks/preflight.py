"""Check what preflight.json states against the pieces on their sheets."""

import math
from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

#: Places are rounded to a thousandth, and widths of necks found by halving.
PLACE_MM = 0.005
WIDTH_MM = 0.02
#: What may be stated about a piece, and what about a sheet or the whole object.
_OF_PIECES = ("hole", "hole-edge", "web", "gap", "piece", "segment")
_OF_THE_REST = ("sheet", "width", "bend")
_TOO_LARGE = ("piece", "sheet")


def check_preflight(job: Job, tally: Tally) -> None:
    """Check that every flaw that is stated is one, of a piece that exists, where it is said."""
    plan, told = job.map, job.preflight
    if plan is None or told is None:
        return
    stated = job.options.get("target", "default")
    tally.expect(
        told.get("target") == stated,
        f"preflight.json is for target {told.get('target')!r}, and job.toml for {stated!r}",
    )
    own = job.options.get("targets", {}).get(stated)
    for number, flaw in enumerate(told["flaws"]):
        where = f"preflight.json, flaw {number}"
        _check_flaw(plan, flaw, where, tally)
        if own is not None:
            _check_limit(job, own, flaw, where, tally)


def _check_limit(
    job: Job, target: dict[str, Any], flaw: dict[str, Any], where: str, tally: Tally
) -> None:
    """Check a limit against the entry that job.toml has of a target of the user's own."""
    rule, limit = flaw.get("rule"), _float(flaw.get("limit_mm"))
    piece = job.map.piece.get(flaw.get("piece", "")) if job.map is not None else None
    thick = job.supplies[piece.thread].thickness_mm if piece is not None else None

    def least(what: str) -> float:
        return max(target[f"{what}_t"] * _float(thick), target[f"{what}_mm"])

    if rule in ("piece", "sheet"):
        fits = any(abs(limit - side) < PLACE_MM for side in target[f"{rule}_mm"])
    elif rule == "hole-edge":  # the material may ask for more
        fits = limit > least("edge") - PLACE_MM
    elif rule in ("hole", "web"):
        fits = abs(limit - least(str(rule))) < PLACE_MM
    else:
        fits = rule != "gap" or abs(limit - target["gap_mm"]) < PLACE_MM
    tally.expect(fits, f"{where}: {limit} mm is not what job.toml's entry of the target asks for")


def _check_flaw(plan: CrossingMap, flaw: dict[str, Any], where: str, tally: Tally) -> None:
    """Check one flaw."""
    rule, value, limit = (
        flaw.get("rule"),
        _float(flaw.get("value_mm")),
        _float(flaw.get("limit_mm")),
    )
    tally.expect(rule in _OF_PIECES + _OF_THE_REST, f"{where}: there is no rule {rule}")
    tally.expect(
        value > limit if rule in _TOO_LARGE else value < limit,
        f"{where}: {value} keeps the limit {limit} of rule {rule}",
    )
    if rule not in _OF_PIECES:
        tally.expect(flaw.get("piece") is None, f"{where}: rule {rule} is not about one piece")
        return
    piece = plan.piece.get(flaw.get("piece", ""))
    if piece is None or piece.sheet != flaw.get("sheet"):
        tally.fail(f"{where}: there is no piece {flaw.get('piece')} on sheet {flaw.get('sheet')}")
        return
    place = np.array([_float(part) for part in flaw.get("place") or (None, None)])
    if rule == "piece":
        measured = min(sides_of(piece.outline), key=lambda side: abs(side - value))
    else:
        measured = _measured(plan, piece, str(rule), place)
    tally.measure(
        "preflight_mm",
        abs(measured - value),
        WIDTH_MM,
        f"{where}: {value} mm are stated for rule {rule} at {place}, and {measured:.3f} mm found",
    )


def _measured(plan: CrossingMap, piece: Piece, rule: str, place: Floats) -> float:
    """Return what a rule is about, measured at a place of a sheet."""
    outline = piece.placed(piece.outline)
    if rule == "segment":
        sides = np.roll(outline, -1, axis=0) - outline
        nearest = int(np.argmin(np.hypot(*(outline + sides / 2 - place).T)))
        return float(np.hypot(*sides[nearest]))
    holes = plan.holes[piece.id]
    centres = piece.placed(np.array([(hole.x, hole.y) for hole in holes]).reshape(-1, 2))
    away = np.hypot(*(centres - place).T)
    radius = np.array([hole.diameter or 0.0 for hole in holes]) / 2
    if rule == "hole":
        return float(2 * radius[np.argmin(away)]) if away.min(initial=np.inf) < PLACE_MM else np.nan
    edge = _edge_distance(place, outline)
    if rule == "hole-edge":
        return edge if away.min(initial=np.inf) < PLACE_MM else np.nan
    if rule == "gap":
        return 2 * edge
    # The place of a web lies midway between two holes, or in the middle of a neck.
    rims = np.sort(away - radius)[:2]
    return float(rims.sum()) if len(rims) == 2 and rims.sum() < 2 * edge else 2 * edge


def sides_of(outline: Floats) -> tuple[float, float]:
    """Return the sides of the smallest rectangle around an outline."""
    best = (math.inf, math.nan, math.nan)
    # The smallest rectangle lies along a side of the convex hull.
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(outline)))
    for side in np.diff(hull, axis=0):
        along = side / max(float(np.hypot(*side)), 1e-300)
        wide, high = (float(np.ptp(outline @ way)) for way in (along, along[::-1] * [-1, 1]))
        best = min(best, (wide * high, wide, high))
    return best[1], best[2]


def _edge_distance(place: Floats, outline: Floats) -> float:
    """Return the distance of a place from the nearest side of an outline."""
    side = np.roll(outline, -1, axis=0) - outline
    square = np.maximum(np.einsum("nd,nd->n", side, side), 1e-300)
    share = np.clip(np.einsum("nd,nd->n", place - outline, side) / square, 0.0, 1.0)
    return float(np.hypot(*(outline + share[:, None] * side - place).T).min())


def _float(value: object) -> float:
    """Return a number; NaN for anything else, which fails every comparison."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return math.nan
