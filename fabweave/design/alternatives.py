"""Say why no design can be built, and find what would help by trying it: size, thickness, card."""

import math
from collections.abc import Iterator, Sequence
from typing import TypeAlias

from fabweave.core.messages import agree
from fabweave.design.candidate import Candidate
from fabweave.options.settings import Settings
from fabweave.plan.ask import complete_settings

#: A material that bends to almost anything.
SOFT = "card"
#: By what factors a design gets larger, and its material thinner.
_LARGER, _THINNER = (1.25, 1.6, 2.5, 4.0), (0.75, 0.5, 0.25)
#: What stands in the way of a mesh with narrow places, of any size.
_NARROW = {"width", "clearance", "layers"}
#: By what factor ribbons get as narrow as may be, against twist.
_SLIM = 0.55
#: Nobody sells thinner sheet.
_THINNEST_MM = 0.1

#: A design, and what it came to.
Found: TypeAlias = tuple[Settings, Candidate]


def nearest(designs: Sequence[Settings], candidates: Sequence[Candidate]) -> Found | None:
    """Return the design that misses least what could be built; None if nothing was laid.

    Those go first that miss only what a larger object, or thinner sheet, bends to.
    """
    found = [
        (bool(_NARROW & {stop.rule for stop in candidate.verdict.stops}), candidate.excess, at)
        for at, candidate in enumerate(candidates)
        if candidate.excess is not None and not candidate.makeable
    ]
    if not found:
        return None
    at = min(found)[-1]
    return designs[at], candidates[at]


def slimmed(asked: Settings, found: Found) -> Settings:
    """Return a design with narrow ribbons if it twists too much: that is so at any size."""
    design, candidate = found
    twists = any(stop.rule == "twist" for stop in candidate.verdict.stops)
    return design.narrower(_SLIM) if twists and asked.narrowable else design


def alternatives(asked: Settings, design: Settings) -> list[Settings]:
    """Return a design that cannot be built larger, from thinner sheet, and from card.

    Parameters
    ----------
    asked : Settings
        What was asked for.
    design : Settings
        The one that came nearest.
    """
    return [
        *(_sized(design, factor) for factor in _LARGER if asked.mesh.size_mm is not None),
        *_thinner(asked, design),
        *of_card(asked, design),
    ]


def _sized(design: Settings, factor: float) -> Settings:
    """Return a design larger, to whole centimetres."""
    return design.but(size_mm=10.0 * math.ceil(factor * (design.mesh.size_mm or 0.0) / 10.0))


def _plain(asked: Settings) -> bool:
    """Return whether there is one material for all threads."""
    return "=" not in asked.stock.material


def of_card(asked: Settings, *designs: Settings) -> Iterator[Settings]:
    """Yield designs from card, if they are of one other material."""
    if _plain(asked) and asked.stock.material != SOFT:
        for design in designs:
            yield design.but(material=SOFT, thickness_mm=None, gap_mm=None)


def _thinner(asked: Settings, design: Settings) -> Iterator[Settings]:
    """Yield a design from thinner sheets of the same material, if there are such."""
    if not _plain(asked):
        return
    thickness_mm = complete_settings(asked)[1].only.thickness_mm
    for thinner_mm in (round(factor * thickness_mm, 2) for factor in _THINNER):
        if thinner_mm >= _THINNEST_MM:
            yield design.but(thickness_mm=thinner_mm)


def why_text(asked: Settings, candidates: Sequence[Candidate], helps: Sequence[Found]) -> str:
    """Say why fewer than two designs can be built, and what would help; nothing if two can.

    Parameters
    ----------
    asked : Settings
    candidates : sequence of Candidate
        All that were tried.
    helps : sequence of (Settings, Candidate)
        What was tried instead.
    """
    built = sum(one.makeable for one in candidates)
    if built > 1 or not candidates:
        return ""
    supplies = complete_settings(asked)[1]
    size = "" if asked.mesh.size_mm is None else f", at {asked.mesh.size_mm:g} mm"
    whose = f"{agree(len(candidates), '{n} design[|s]')} can be built from {supplies.titles}{size}"
    told = f"Only one of {whose}." if built else f"None of {whose}."
    near = nearest([asked] * len(candidates), candidates)
    failed = near[1] if near is not None else next(one for one in candidates if not one.makeable)
    which = f"{'The' if not built else 'Of the others, the'} nearest, {failed.name}"
    # What was tried says more than the size that a refusal computes.
    reason = failed.verdict.reasons[0].text.partition(": use ")[0]
    told += f" {which}, fails by this: {reason}."
    if built or not helps:
        return told
    ways = list(_ways(asked, helps))
    if not ways:
        tried = " nor ".join(_way(asked, one) for one, _ in helps)
        return f"{told} It was tried otherwise, and cannot be built {tried} either."
    slim = " with narrower ribbons" if helps[0][0].ribbons.width != asked.ribbons.width else ""
    return f"{told} Tried, and can be built: this design{slim} {', or '.join(ways)}."


def _ways(asked: Settings, helps: Sequence[Found]) -> Iterator[str]:
    """Yield what helped: the least larger size, the thickest sheet, and card."""
    built = [one for one, candidate in helps if candidate.makeable]
    larger = [one for one in built if one.mesh.size_mm != asked.mesh.size_mm]
    card = [one for one in built if one.stock.material != asked.stock.material]
    thinner = [
        one
        for one in built
        if one.stock.thickness_mm != asked.stock.thickness_mm and one not in card
    ]
    if larger:
        yield _way(asked, min(larger, key=lambda one: one.mesh.size_mm or 0.0))
    if thinner:
        yield _way(asked, max(thinner, key=_thickness_mm))
    if card:
        yield _way(asked, card[0])


def _thickness_mm(one: Settings) -> float:
    """Return the thickness of the one material of a design that was made thinner."""
    return one.stock.thickness_mm if isinstance(one.stock.thickness_mm, float) else 0.0


def _way(asked: Settings, one: Settings) -> str:
    """Say how a design differs from what was asked for."""
    if one.stock.material != asked.stock.material:
        return f"from {one.stock.material}"
    if one.stock.thickness_mm != asked.stock.thickness_mm:
        return f"from sheet of {_thickness_mm(one):g} mm"
    return f"at {one.mesh.size_mm:g} mm"
