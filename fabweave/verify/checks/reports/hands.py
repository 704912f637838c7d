"""Check the hours of assembly and its difficulty, counted afresh from the crossing map."""

from collections import Counter
from typing import Any

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.statement import Place

#: Seconds in practised hands, for each piece, strand, and line of holes or ends.
_SORT_FIND_TAKE_S, _OVER_S, _UNDER_S, _ALIGN_S = 5.0 + 5.0 + 4.5, 2.5, 8.5, 6.0
#: For each joint that no fastener holds, by its kind.
_JOINT_S = {"glue": 15.0, "dovetail": 5.0, "slot": 8.5, "none": 6.0}
#: For each fastener: holes up to a diameter, seconds, and the least and greatest price in euros.
_FASTENERS = (
    (2.15, 12.0, 0.01, 0.10),
    (2.9, 10.0, 0.03, 0.15),
    (3.7, 10.0, 0.02, 0.15),
    (4.8, 9.0, 0.05, 0.15),
    (1e9, 15.0, 0.20, 0.60),
)
_GLUED, _TAPED = 0.01, 0.02
#: Makers take from this to that many times as long.
_QUICK, _SLOW = 1.5, 3.0
#: Hours, and seconds each, are rounded to less.
_SAME_H = 2e-4
#: Makes a difficulty of half the scale, each for itself: hours, strands under, width.
_HARD_H, _HARD_UNDERS, _HARD_WIDTH_MM = 8.0, 6.0, 4.0


def check_hands(
    plan: CrossingMap, estimate: dict[str, Any], fasteners: list[dict[str, Any]], place: Place
) -> None:
    """Check practised hours, makers' hours, each action, and the score of difficulty.

    Parameters
    ----------
    plan : CrossingMap
    estimate : dict
        Of waste.json.
    fasteners : list of dict
        Those to buy, which another check counts.
    place : Place
    """
    pieces = sum(len(step.pieces) for step in plan.steps)
    over = sum(len(step.over) for step in plan.steps)
    under = sum(len(step.under) for step in plan.steps)
    held = Counter(joint.kind for joint in plan.joints if joint.kind != "rivet")
    set_s = sum(row["needed"] * _fastener(row["diameter_mm"])[1] for row in fasteners)
    lined_up = sum(row["needed"] for row in fasteners) + sum(held.values())
    seconds = (
        pieces * _SORT_FIND_TAKE_S
        + over * _OVER_S
        + under * _UNDER_S
        + lined_up * _ALIGN_S
        + sum(count * _JOINT_S[kind] for kind, count in held.items())
        + set_s
    )
    stated, here = estimate["assembly"], place.at("assembly")
    hours = seconds / 3600.0
    here.number("practised_h", stated["practised_h"], hours, within=_SAME_H)
    wanted = (_QUICK * hours, _SLOW * hours)
    for name, one, value in zip(("quick", "slow"), stated["hours"], wanted, strict=True):
        here.at("hours").number(name, one, value, within=_SAME_H)
    actions = sum(action["count"] * action["each_s"] for action in stated["actions"])
    here.number("the sum of actions", actions, seconds, within=0.5)
    counts = {action["action"]: action["count"] for action in stated["actions"]}
    for name, count in (("find", pieces), ("over", over), ("under", under)):
        here.number(name, counts.get(name, 0), count)
    _check_difficulty(estimate["difficulty"], hours, under / max(pieces, 1), place)


def _check_difficulty(figures: dict[str, Any], hours: float, unders: float, place: Place) -> None:
    """Check the score: of three loads that count alike, x becomes 10 x / (1 + x)."""
    here = place.at("difficulty")
    here.number("unders", figures["unders"], unders, within=1e-4)
    narrow = _HARD_WIDTH_MM / max(figures["width_mm"], 0.1)
    load = hours / _HARD_H + unders / _HARD_UNDERS + narrow
    here.number("score", figures["score"], 10.0 - 10.0 / (1.0 + load), within=0.011)


def hardware_price(waste: dict[str, Any]) -> dict[str, Any]:
    """Return what fasteners, glue and tape of waste.json cost."""
    joined = _GLUED * waste["glue"]["joints"] + _TAPED * waste["tape"]["joints"]
    low, high = (
        joined + sum(row["buy"] * _fastener(row["diameter_mm"])[end] for row in waste["fasteners"])
        for end in (2, 3)
    )
    return {"low": low, "high": high, "currency": "EUR"}


def _fastener(hole_mm: float) -> tuple[float, float, float, float]:
    """Return the row for a hole."""
    return next(row for row in _FASTENERS if hole_mm <= row[0])
