"""Check the hours of assembly and its difficulty, counted afresh from the crossing map."""

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.statement import Place

#: Seconds in practised hands, and what they are said to do in these.
ACTIONS = {
    "sort": (5.0, "to take a piece out of its sheet and sort it"),
    "find": (5.0, "to find a piece"),
    "take": (4.5, "to take it up and turn it"),
    "over": (2.5, "to lay a strand over another"),
    "under": (8.5, "to slide one under"),
    "align": (6.0, "to bring holes or ends into line"),
}
#: For each joint that no fastener holds, by its kind.
JOINT_S = {"glue": 15.0, "dovetail": 5.0, "slot": 8.5, "none": 6.0}
#: For each fastener: holes up to a diameter, seconds, the least and greatest price in euros, and
#: what would do.
_FASTENERS = (
    (2.15, 12.0, 0.01, 0.10, "thread, mini brad"),
    (2.9, 10.0, 0.03, 0.15, "M2 screw, 2.4 mm rivet, snap rivet"),
    (3.7, 10.0, 0.02, 0.15, "M3 screw, 3.2 mm rivet, eyelet, snap rivet"),
    (4.8, 9.0, 0.05, 0.15, "4 mm rivet, eyelet, snap rivet"),
    (1e9, 15.0, 0.20, 0.60, "book screw"),
)
_GLUED, _TAPED = 0.01, 0.02
#: Makers take from this to that many times as long.
PACE = 1.5, 3.0
#: Hours, and seconds each, are rounded to less.
_SAME_H = 2e-4
#: Makes a difficulty of half the scale, each for itself: hours, strands under, width.
_HARD_H, _HARD_UNDERS, _HARD_WIDTH_MM = 8.0, 6.0, 4.0
#: The score at which each word begins to be right; nearer to one than that, both are said. Scores
#: are rounded.
_WORDS = ((0.0, "easy"), (3.0, "moderate"), (5.5, "demanding"), (7.5, "very demanding"))
_BETWEEN, _SCORE = 0.25, 0.006


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
    stated, here = estimate["assembly"], place.at("assembly")
    actions = [action for action in _actions(plan, fasteners) if action[1]]
    keys = ("action", "count", "each_s", "words")
    here.same("actions", [tuple(one[key] for key in keys) for one in stated["actions"]], actions)
    hours = sum(count * each_s for _, count, each_s, _ in actions) / 3600.0
    here.number("practised_h", stated["practised_h"], hours, within=_SAME_H)
    for name, one, pace in zip(("quick", "slow"), stated["hours"], PACE, strict=True):
        here.at("hours").number(name, one, pace * hours, within=_SAME_H)
    pieces = sum(step.handled for step in plan.steps)
    under = sum(len(step.under) for step in plan.steps)
    _check_difficulty(estimate["difficulty"], hours, under / max(pieces, 1), place)


def seconds_of_steps(plan: CrossingMap) -> list[float]:
    """Return about how long each step takes a maker, half way from quick to slow.

    All that hands do but sorting, which comes before the steps; a fastener is set when the last
    layer of its crossing has come, or with the ring that it holds.
    """
    idle = {crossing.id for crossing in plan.crossings if crossing.fastened is False}
    holes: dict[int, list[float]] = {}
    for piece in plan.pieces:
        for cutout in piece.cutouts or ():
            station = piece.stations[cutout.station]
            if cutout.circle is not None and station.over and station.crossing not in idle:
                holes.setdefault(station.crossing, []).append(cutout.circle[2])
    found = []
    for step in plan.steps:
        held = [plan.joint[key].kind for key in step.joints if plan.joint[key].kind != "rivet"]
        sizes = [size for key in step.fasten for size in holes.get(key, [])]
        seconds = step.handled * (ACTIONS["find"][0] + ACTIONS["take"][0])
        seconds += len(step.over) * ACTIONS["over"][0] + len(step.under) * ACTIONS["under"][0]
        seconds += (len(sizes) + len(held)) * ACTIONS["align"][0]
        seconds += sum(JOINT_S[kind] for kind in held)
        seconds += sum(fastener_class(size)[1] for size in sizes)
        found.append(math.sqrt(PACE[0] * PACE[1]) * seconds)
    return found


def _actions(
    plan: CrossingMap, fasteners: list[dict[str, Any]]
) -> Iterator[tuple[str, int, float, str]]:
    """Yield what hands do, how often, seconds each, and in words."""
    pieces = sum(step.handled for step in plan.steps)
    held = Counter(joint.kind for joint in plan.joints if joint.kind != "rivet")
    often = Counter(
        sort=pieces,
        find=pieces,
        take=pieces,
        over=sum(len(step.over) for step in plan.steps),
        under=sum(len(step.under) for step in plan.steps),
        align=sum(row["needed"] for row in fasteners) + sum(held.values()),
    )
    for name, (seconds, words) in ACTIONS.items():
        yield name, often[name], seconds, words
    for kind, count in sorted(held.items()):
        yield kind, count, JOINT_S[kind], f"to make a {kind} joint"
    for size in sorted({row["diameter_mm"] for row in fasteners}):
        count = sum(row["needed"] for row in fasteners if row["diameter_mm"] == size)
        words = f"to set a fastener in a hole of {size:g} mm"
        yield f"fasten {size:g} mm", count, fastener_class(size)[1], words


def _check_difficulty(figures: dict[str, Any], hours: float, unders: float, place: Place) -> None:
    """Check the score: of three loads that count alike, x becomes 10 x / (1 + x)."""
    here = place.at("difficulty")
    here.number("unders", figures["unders"], unders, within=1e-4)
    narrow = _HARD_WIDTH_MM / max(figures["width_mm"], 0.1)
    load = hours / _HARD_H + unders / _HARD_UNDERS + narrow
    score = 10.0 - 10.0 / (1.0 + load)
    here.number("score", figures["score"], score, within=0.011)
    fits = {_word(score + by) for by in (-_SCORE, 0.0, _SCORE)}
    here.expect(
        figures["word"] in fits, f"it is said to be {figures['word']!r}, not {_word(score)!r}"
    )


def _word(score: float) -> str:
    """Return the word for a score, or both words where it is near to the border of two.

    Examples
    --------
    >>> _word(1.0), _word(3.1), _word(5.4), _word(9.0)
    ('easy', 'easy to moderate', 'moderate to demanding', 'very demanding')
    """
    words = [word for _, word in _WORDS]
    borders = [border for border, _ in _WORDS[1:]]
    for number, border in enumerate(borders, start=1):
        if abs(score - border) < _BETWEEN:
            return f"{words[number - 1]} to {words[number]}"
    return words[sum(score > border for border in borders)]


def hardware_price(waste: dict[str, Any]) -> dict[str, Any]:
    """Return what fasteners, glue and tape of waste.json cost."""
    joined = _GLUED * waste["glue"]["joints"] + _TAPED * waste["tape"]["joints"]
    low, high = (
        joined
        + sum(row["buy"] * fastener_class(row["diameter_mm"])[end] for row in waste["fasteners"])
        for end in (2, 3)
    )
    return {"low": low, "high": high, "currency": "EUR"}


def fastener_class(hole_mm: float) -> tuple[float, float, float, float, str]:
    """Return what goes through a hole: the row for it."""
    return next(row for row in _FASTENERS if hole_mm <= row[0])
