"""Say what to try beside a design that comes near to a wish."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

from fabweave.design.candidate import Candidate, Figures
from fabweave.design.variety import FEWEST, MOST, fairable, two_digits
from fabweave.design.wishes import Wishes, come_to, misses
from fabweave.mesh.fair.fairing import STEPS
from fabweave.options.settings import Settings
from fabweave.options.table import option_named

#: A value within this share of what is wished needs no more trying.
_CLOSE = 0.04
#: How what is wished goes with the number of faces: as this power of it, unless what was tried
#: tells better. Ribbons are as wide as faces, and what a surface loses goes with their area.
_POWER = {"pieces": 1.0, "hours": 1.0, "ribbon_mm": -0.5, "likeness_mm": -1.0}
#: A power that was found counts if it is this share of the stated one; no step goes farther, as a
#: logarithm.
_LEAST_POWER, _FARTHEST = 0.15, math.log(3.0)
#: By what factors ribbons get narrower or wider on a mesh: narrower ones hardly hold, and there is
#: no room for wider ones.
_NARROWEST, _WIDEST, _NARROWER = 0.6, 1.25, 0.75
#: Pieces shorter than that carry no weave, and longer ones fit no sheet.
_SHORTEST_MM, _LONGEST_MM = 60.0, 5000.0
#: One step of this refinement makes four quads of one.
SCHEME, _FOLD = "catmull-clark:1", 4
#: A design, and what it comes to by the names of the wishes.
_Tried: TypeAlias = tuple[Settings, dict[str, float | None]]


def moves(
    asked: Settings,
    designs: Sequence[Settings],
    candidates: Sequence[Candidate],
    near: int,
    wishes: Wishes,
) -> list[Settings]:
    """Return designs beside one that may come nearer to what is wished.

    Parameters
    ----------
    asked : Settings
        What is stated there stays.
    designs : sequence of Settings
        All that were tried,
    candidates : sequence of Candidate
        and what they came to.
    near : int
        The nearest of them, which can be built.
    wishes : Wishes

    Returns
    -------
    list of Settings
        Each differs from the nearest in one thing, the most promising first: how wide its ribbons
        are, the density of its mesh, where its threads are split; and where something wants care, a
        coarser mesh that is refined, and fairing. None where the wish is met and nothing does.
    """
    best, candidate = designs[near], candidates[near]
    if candidate.figures is None:
        return []
    off = {
        name: ratio
        for name, ratio in misses(candidate.figures, wishes).items()
        if abs(ratio) > _CLOSE
    }
    tried = [
        (design, come_to(one.figures))
        for design, one in zip(designs, candidates, strict=True)
        if one.figures is not None
    ]
    found: list[Settings] = []
    if off:
        # A width is met on the mesh there is before another one is made.
        found += _wider(asked, best, candidate.figures, off)
        found += _denser(asked, best, off, tried)
        found += _split(asked, best, candidate.figures, off, tried)
    if off or candidate.verdict.reasons:
        found += _rounder(asked, best)
    return [one for at, one in enumerate(found) if one != best and one not in found[:at]]


def _denser(
    asked: Settings, best: Settings, off: dict[str, float], tried: Sequence[_Tried]
) -> Iterator[Settings]:
    """Yield the mesh with more or fewer faces, as many as each thing that is off asks for."""
    kind, count = density(best)
    if asked.mesh.remesh is not None or not count:
        return
    others = [
        (density(design)[1], values)
        for design, values in tried
        if design.but(remesh=best.mesh.remesh) == best and density(design)[0] == kind
    ]
    for name, ratio in off.items():
        if name in _POWER:
            faces = count * _step(count, name, ratio, others, _POWER[name])
            yield best.but(remesh=f"{kind}:{two_digits(min(max(faces, FEWEST), MOST))}")


def density(design: Settings) -> tuple[str, int]:
    """Return of what a design is remeshed, and to how many faces; 0 where that is not stated."""
    kind, _, count = (design.mesh.remesh or "").partition(":")
    return kind, int(count) if kind in ("quads", "triangles") and count else 0


def _step(
    now: float,
    name: str,
    ratio: float,
    others: Sequence[tuple[float, dict[str, float | None]]],
    power: float,
) -> float:
    """Return by what to multiply a number, so that a value no longer misses its wish by a ratio.

    Value over number is a power: that of the two tried designs nearest by number, or where these
    do not tell, a stated one.
    """
    here = next((values[name] for number, values in others if number == now), None)
    apart = sorted(
        (abs(math.log(number / now)), number, values[name])
        for number, values in others
        if number != now and values[name]
    )
    if here and apart:
        _, number, value = apart[0]
        found = math.log((value or here) / here) / math.log(number / now)
        if found * power > 0.0 and abs(found) > _LEAST_POWER * abs(power):
            power = found
    return math.exp(min(max(-ratio / power, -_FARTHEST), _FARTHEST))


def _split(
    asked: Settings,
    best: Settings,
    figures: Figures,
    off: dict[str, float],
    tried: Sequence[_Tried],
) -> Iterator[Settings]:
    """Yield threads cut to other lengths, or with another preference."""
    if asked.pieces.max_length_mm is not None:
        return
    now = figures.longest_mm if best.pieces.max_length_mm is None else best.pieces.max_length_mm
    if "pieces" in off:
        others = [
            (design.pieces.max_length_mm or now, values)
            for design, values in tried
            if design.but(max_length_mm=best.pieces.max_length_mm) == best
        ]
        length = now * _step(now, "pieces", off["pieces"], others, -1.0)
        length = min(max(length, _SHORTEST_MM), _LONGEST_MM)
        yield best.but(max_length_mm=float(two_digits(length)))
    if (
        asked.pieces.prefer != option_named("prefer").default
        or best.pieces.max_length_mm is not None
    ):
        return
    if max(off.get("pieces", 0.0), off.get("hours", 0.0)) > 0.0:
        yield best.but(prefer="work")
    if "sheets" in off or "budget" in off or off.get("pieces", 0.0) < 0.0:
        yield best.but(prefer="waste")


def _wider(
    asked: Settings, best: Settings, figures: Figures, off: dict[str, float]
) -> Iterator[Settings]:
    """Yield wider or narrower ribbons on the same mesh."""
    if asked.ribbons.width is not None:
        return
    rule = best.width_rule
    if "ribbon_mm" in off:
        factor = min(max(math.exp(-off["ribbon_mm"]), _NARROWEST), _WIDEST)
        if rule.even:
            width = float(two_digits(10.0 * factor * figures.median_mm)) / 10.0
            yield best.but(width=replace(rule, most_mm=width))
        else:
            yield best.narrower(factor)
    if "sheets" in off or "budget" in off:
        yield best.narrower(_NARROWER)


def _rounder(asked: Settings, best: Settings) -> Iterator[Settings]:
    """Yield the mesh faired, and a coarser one that is refined to about as many faces."""
    if fairable(asked, best):
        yield best.but(fair=STEPS)
    kind, count = density(best)
    free = asked.mesh.remesh is None and asked.mesh.refine is None and best.mesh.refine is None
    if free and kind == "quads" and count >= _FOLD * FEWEST:
        coarse = two_digits(count / _FOLD)
        yield best.but(remesh=f"quads:{coarse}", refine=SCHEME)
