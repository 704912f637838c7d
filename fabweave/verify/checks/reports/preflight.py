"""Check what preflight.json states against the pieces on their sheets."""

from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.areas import least_rectangle
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally, as_number, stated_number

#: Places are rounded to a thousandth, and widths of necks found by halving.
PLACE_MM = 0.005
WIDTH_MM = 0.02
#: Values and limits are rounded to so many digits.
_DIGITS = 4
#: What may be stated about a piece, and what about a sheet or the whole object.
_OF_PIECES = ("hole", "hole-edge", "web", "gap", "piece", "segment")
_OF_THE_REST = ("sheet", "width", "bend")
_TOO_LARGE = ("piece", "sheet")
#: What is found about ribbons, and taken over.
_OF_RIBBONS = ("width", "bend")


def check_preflight(job: Job, tally: Tally) -> None:
    """Check that every flaw that is stated is one, of a piece that exists, where it is said.

    What was found about widths and bends of ribbons is stated here too, and nothing else of them.
    """
    plan, preflight = required(job.map), required(job.preflight)
    place = tally.at("preflight.json")
    target = job.options.get("target", "default")
    place.against("job.toml").equal("target", preflight.get("target"), target)
    entry = job.options.get("targets", {}).get(target)
    for number, flaw in enumerate(preflight["flaws"]):
        _check_flaw(plan, flaw, place.at(f"flaw {number}"))
        if entry is not None:
            _check_limit(job, entry, flaw, place.at(f"flaw {number}"))
    if job.ribbons is not None:
        _check_ribbons(preflight["flaws"], job.ribbons["findings"], place)


def _check_ribbons(
    flaws: list[dict[str, Any]], findings: list[dict[str, Any]], place: Place
) -> None:
    """Check that ribbons.json and this file say the same about ribbons."""

    def said(records: list[dict[str, Any]], value: str, limit: str) -> list[tuple[object, ...]]:
        return [
            (
                record.get("rule"),
                round(stated_number(record, value), _DIGITS),
                round(stated_number(record, limit), _DIGITS),
                record.get("count"),
                # Of what mends it, ribbons.json may know nothing.
                record.get("remedy") if remedies.get(record.get("rule")) else None,
            )
            for record in records
            if record.get("rule") in _OF_RIBBONS
        ]

    remedies = {finding.get("rule"): finding.get("remedy") for finding in findings}
    place.same(
        "flaws of ribbons, which ribbons.json tells,",
        said(flaws, "value_mm", "limit_mm"),
        said(findings, "value", "limit"),
    )


def _check_limit(job: Job, target: dict[str, Any], flaw: dict[str, Any], place: Place) -> None:
    """Check a limit against the entry that job.toml has of a target of the user's own."""
    rule, limit = flaw.get("rule"), stated_number(flaw, "limit_mm")
    piece = required(job.map).cut_piece.get(flaw.get("piece", ""))
    thick = job.supplies[piece.thread].thickness_mm if piece is not None else None

    def least(what: str) -> float:
        return max(target[f"{what}_t"] * as_number(thick), target[f"{what}_mm"])

    if rule in ("piece", "sheet"):
        fits = any(abs(limit - side) < PLACE_MM for side in target[f"{rule}_mm"])
    elif rule == "hole-edge":  # the material may ask for more
        fits = limit > least("edge") - PLACE_MM
    elif rule in ("hole", "web"):
        fits = abs(limit - least(str(rule))) < PLACE_MM
    else:
        fits = rule != "gap" or abs(limit - target["gap_mm"]) < PLACE_MM
    place.expect(fits, f"{limit} mm is not what job.toml's entry of the target asks for")


def _check_flaw(plan: CrossingMap, flaw: dict[str, Any], place: Place) -> None:
    """Check one flaw."""
    rule, name = flaw.get("rule"), flaw.get("piece")
    value, limit = stated_number(flaw, "value_mm"), stated_number(flaw, "limit_mm")
    place.expect(rule in _OF_PIECES + _OF_THE_REST, f"there is no rule {rule}")
    place.expect(
        value > limit if rule in _TOO_LARGE else value < limit,
        f"{value} keeps the limit {limit} of rule {rule}",
    )
    if rule not in _OF_PIECES:
        place.equal(
            f"its piece and place, with rule {rule},", (name, flaw.get("place")), (None,) * 2
        )
        sheet = plan.sheet.get(flaw.get("sheet", 0))
        known = () if sheet is None else (sheet.width_mm, sheet.height_mm)
        place.expect(
            any(abs(side - value) < PLACE_MM for side in known)
            if rule == "sheet"
            else flaw.get("sheet") is None,
            f"sheet {flaw.get('sheet')} has no side of {value} mm",
        )
        return
    piece = plan.cut_piece.get(name or "")
    if piece is None or piece.sheet != flaw.get("sheet"):
        place.fail(f"there is no piece {name} on sheet {flaw.get('sheet')}")
        return
    spot = np.array([as_number(part) for part in flaw.get("place") or (None, None)])
    if rule == "piece":
        sides = least_rectangle(piece.outline)
        measured = float(sides[np.argmin(np.abs(sides - value))])
    else:
        measured = _measured(plan, piece, str(rule), spot)
    place.at_most(
        "preflight_mm",
        abs(measured - value),
        # A neck is measured twice from its middle to its edge, so an error counts twice.
        WIDTH_MM * (2.0 if rule == "web" else 1.0),
        f"{value} mm are stated for rule {rule} at {spot}, and {measured:.3f} mm found: {{}} off",
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


def _edge_distance(place: Floats, outline: Floats) -> float:
    """Return the distance of a place from the nearest side of an outline."""
    side = np.roll(outline, -1, axis=0) - outline
    square = np.maximum(np.einsum("nd,nd->n", side, side), 1e-300)
    share = np.clip(np.einsum("nd,nd->n", place - outline, side) / square, 0.0, 1.0)
    return float(np.hypot(*(outline + share[:, None] * side - place).T).min())
