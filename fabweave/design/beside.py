"""Say what to try beside designs that were tried: what comes nearer to a wish, or can be built."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, zip_longest
from typing import Any

from fabweave.core.messages import agree
from fabweave.design.search import Search
from fabweave.design.tried import Tried
from fabweave.design.variety import MOST, NARROW, fairable, two_digits
from fabweave.design.wishes import Wishes, come_to, misses, rank
from fabweave.job.ask import complete_settings
from fabweave.job.figures import Figures
from fabweave.mesh.fair.fairing import STEPS
from fabweave.mesh.remesh.request import parse_remesh
from fabweave.options.settings import Settings
from fabweave.options.table import option_named, option_of_field

#: Meshes with fewer faces than those tried first: they lose more of the shape, but bend less.
_LEAST_FACES = 20
#: By what factors a mesh that serves gets finer and coarser, to serve once more.
_BESIDE = (1.25, 0.8)
#: By what factor a mesh gets coarser or finer that does not serve, and one that is refined by this
#: scheme coarser before that: one step of it makes four quads of one.
_COARSER, _FINER, _FOLD, _SCHEME = 0.6, 2.0, 4, "catmull-clark:1"
#: How many of the designs that nearly could be built are looked at.
_NEAREST = 4
#: What narrower ribbons help against, and what a more even or coarser mesh does.
_TOO_WIDE = {"twist", "clearance", "layers", "crease"}
_UNEVEN = {"width", "twist", "crease"}

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

#: By what factors a design that cannot be built gets larger, and its material thinner; nobody sells
#: thinner sheet than that. Card bends to almost anything.
_LARGER, _THINNER, _THINNEST_MM = (1.25, 1.6, 2.5, 4.0), (0.75, 0.5, 0.25), 0.1
SOFT = "card"


def beside(asked: Settings, tried: Sequence[Tried], wishes: Wishes) -> list[Settings]:
    """Return designs that were not tried, and may serve better than those that were.

    Parameters
    ----------
    asked : Settings
        What is stated there stays.
    tried : sequence of Tried
    wishes : Wishes
        What a design should come to; with none it is to be built, however it comes out.

    Returns
    -------
    list of Settings
        Each differs from one that was tried in one thing, the most promising first. Where a wish is
        stated: how wide the ribbons of the nearest are, the density of its mesh, where its threads
        are split; none where the wish is met and nothing wants care. Else a little finer and
        coarser than what serves; then beside what misses least, by what stands in its way. A twist
        asks for narrower ribbons, a bend for a coarser mesh or for floats, a narrow place for a
        more even mesh.
    """
    built = [one for one in tried if one.makeable]
    if wishes and built:
        near = min(built, key=lambda one: rank(one, wishes))
        found = list(_nearer(asked, near, tried, wishes))
    else:
        missed = [one for one in tried if one.laid and not one.makeable]
        missed.sort(key=lambda one: math.inf if one.excess is None else one.excess)
        mended = [list(_mended(asked, one)) for one in missed[:_NEAREST]]
        found = [
            *_wrapped(asked, tried),
            *(one for good in built for one in denser(asked, good.design, _BESIDE)),
            *(one for good in built for one in _narrower(asked, good.design)),
            # The first remedy of each, then the second of each.
            *filter(None, chain.from_iterable(zip_longest(*mended))),
        ]
    known = [one.design for one in tried]
    failed = {one.design.mesh.remesh for one in tried if not one.laid} - {None}
    new = [
        one
        for one in found
        if one not in known
        and (one.mesh.remesh not in failed or one.mesh.bodies != asked.mesh.bodies)
    ]
    return [one for at, one in enumerate(new) if one not in new[:at]]


def density(design: Settings) -> tuple[str, int]:
    """Return of what a design is remeshed, and to how many faces; 0 where that is not stated.

    Examples
    --------
    >>> density(Settings.of("a.obj", remesh="tubes:90")), density(Settings.of("a.obj"))
    (('tubes', 90), ('', 0))
    """
    if design.mesh.remesh is None:
        return "", 0
    wanted = parse_remesh(design.mesh.remesh)
    return wanted.kind, wanted.count or 0


def denser(asked: Settings, design: Settings, factors: Sequence[float]) -> Iterator[Settings]:
    """Yield a design on meshes with so many times the faces, if their number is left open."""
    kind, count = density(design)
    if asked.mesh.remesh is None and asked.mesh.refine is None and count:
        for factor in factors:
            number = two_digits(min(max(factor * count, _LEAST_FACES), MOST))
            if number != count:
                yield design.but(remesh=f"{kind}:{number}")


def _narrower(asked: Settings, design: Settings, factor: float = NARROW) -> Iterator[Settings]:
    """Yield the design with narrower ribbons, if their width is left open."""
    if asked.narrowable:
        yield design.narrower(factor)


def _rounder(asked: Settings, design: Settings) -> Iterator[Settings]:
    """Yield the mesh faired, and a coarser one that is refined to about as many faces."""
    if fairable(asked, design):
        yield design.but(fair=STEPS)
    kind, count = density(design)
    if kind == "quads" and design.mesh.refine is None and count >= _FOLD * _LEAST_FACES:
        for coarse in denser(asked, design, [1.0 / _FOLD]):
            yield coarse.but(refine=_SCHEME)


def _mended(asked: Settings, tried: Tried) -> Iterator[Settings]:
    """Yield what may help against that for which a design cannot be built."""
    design, rules = tried.design, {reason.rule for reason in tried.verdict.stops}
    if rules & _TOO_WIDE:
        yield from _narrower(asked, design)
    if rules & _UNEVEN:
        yield from _rounder(asked, design)
    if rules - {"twist"}:
        yield from denser(asked, design, [_COARSER])
    if density(design)[0] != "triangles" and asked.weave.pattern == design.weave.pattern == "plain":
        yield design.but(pattern="twill")
    if "width" not in rules:
        yield from denser(asked, design, [_FINER])


def _wrapped(asked: Settings, tried: Sequence[Tried]) -> Iterator[Settings]:
    """Yield what could not be remeshed as it is, wrapped in one surface.

    Of the finest mesh at first, which loses no handle; then, if that could be made, of all.
    """
    default = option_of_field("bodies").default_value
    laid = {one.design.mesh.bodies for one in tried if one.laid}
    if asked.mesh.bodies != default or default in laid:
        return
    unmade = [
        one.design for one in reversed(tried) if one.design.mesh.remesh is not None and not one.laid
    ]
    for design in unmade if "wrap" in laid else unmade[:1]:
        yield design.but(bodies="wrap")


def _nearer(
    asked: Settings, near: Tried, tried: Sequence[Tried], wishes: Wishes
) -> Iterator[Settings]:
    """Yield what may come nearer to what is wished than the design that is nearest."""
    best, figures = near.design, near.figures
    if figures is None:
        return
    off = {name: by for name, by in misses(figures, wishes).items() if abs(by) > _CLOSE}
    values = [(one.design, come_to(one.figures)) for one in tried if one.figures is not None]
    # A width is met on the mesh there is before another one is made.
    if asked.ribbons.width is None:
        yield from _wider(asked, best, figures, off)
    if density(best)[1]:
        others = [
            (density(one)[1], value)
            for one, value in values
            if one.but(remesh=best.mesh.remesh) == best and density(one)[0] == density(best)[0]
        ]
        factors = [
            _step(density(best)[1], name, off[name], others, _POWER[name])
            for name in off
            if name in _POWER
        ]
        yield from denser(asked, best, factors)
    if asked.pieces.max_length_mm is None:
        yield from _split(asked, best, figures, off, values)
    if off or near.verdict.reasons:
        yield from _rounder(asked, best)


def _wider(
    asked: Settings, best: Settings, figures: Figures, off: dict[str, float]
) -> Iterator[Settings]:
    """Yield wider or narrower ribbons on the same mesh."""
    rule = best.width_rule
    if "ribbon_mm" in off:
        factor = min(max(math.exp(-off["ribbon_mm"]), _NARROWEST), _WIDEST)
        if rule.even:
            width = float(two_digits(10.0 * factor * figures.median_mm)) / 10.0
            yield best.but(width=replace(rule, most_mm=width))
        else:
            yield best.narrower(factor)
    if "sheets" in off or "budget" in off:
        yield from _narrower(asked, best, _NARROWER)


def _split(
    asked: Settings,
    best: Settings,
    figures: Figures,
    off: dict[str, float],
    values: Sequence[tuple[Settings, dict[str, float | None]]],
) -> Iterator[Settings]:
    """Yield threads cut to other lengths, or with another preference."""
    now = best.pieces.max_length_mm or figures.longest_mm
    if "pieces" in off:
        others = [
            (design.pieces.max_length_mm or now, value)
            for design, value in values
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


def otherwise(asked: Settings, design: Settings) -> Iterator[Settings]:
    """Yield a design that cannot be built larger, from thinner sheet, and from card.

    Parameters
    ----------
    asked : Settings
        What was asked for.
    design : Settings
        The one that came nearest.
    """
    if asked.mesh.size_mm is not None:
        # To whole centimetres.
        sizes = (math.ceil(factor * (design.mesh.size_mm or 0.0) / 10.0) for factor in _LARGER)
        yield from (design.but(size_mm=10.0 * size) for size in sizes)
    if "=" in asked.stock.material:
        return
    thickness_mm = complete_settings(asked)[1].only.thickness_mm
    for thinner_mm in (round(factor * thickness_mm, 2) for factor in _THINNER):
        if thinner_mm >= _THINNEST_MM:
            yield design.but(thickness_mm=thinner_mm)
    if asked.stock.material != SOFT:
        yield design.but(material=SOFT, thickness_mm=None, gap_mm=None)


#: A search goes on until so many designs can be built.
ENOUGH = 3
#: Where something is wished for, so many are tried at a time beside the nearest.
_AT_A_TIME = 4
#: What stands in the way of a mesh with narrow places, of any size.
_NARROW = {"width", "clearance", "layers"}


def near_rounds(
    search: Search,
    planned: Sequence[Settings],
    most: int,
    *,
    first: int | None = None,
    enough: float = math.inf,
) -> Iterator[list[Settings]]:
    """Yield designs to try, and others beside them, round after round.

    Until three can be built, or as long as others may come nearer to what is wished.

    Parameters
    ----------
    search : Search
    planned : sequence of Settings
        What to try, those first that tell most.
    most : int
        How many designs to try in all.
    first : int, optional
        How many of the planned designs to try before others may be chosen; all if not given.
    enough : float
        Once so many can be built, nothing more is tried.
    """
    wishes, more = search.wishes, list(planned[:first])
    designs: list[Settings] = []
    while more:
        yield more
        designs += more
        tried, room = search.tried, most - len(designs)
        more = [one for one in planned if one not in designs][:room]
        built = sum(one.makeable for one in apart(tried))
        if built >= enough:
            break
        if wishes or built < ENOUGH:
            near = beside(search.asked, tried, wishes)
            at_a_time = min(_AT_A_TIME, room) if wishes else math.ceil(room / 2)
            # Where a wish is met as well as may be, nothing more is tried.
            met = wishes and any(one.makeable for one in tried)
            more = near[:at_a_time] or ([] if met else more)


def apart(tried: Sequence[Tried]) -> list[Tried]:
    """Return designs without those that come to the same as one before.

    Of the same pattern: others look different, whatever their figures are.

    A mesh that has as many faces as are asked for is kept as it is by remeshing, and ribbons may
    be as narrow by themselves as they are asked to be.
    """
    first: dict[Any, Tried] = {}
    for one in tried:
        figures = one.figures
        if figures is not None and figures.likeness_mm == 0.0:
            figures = replace(figures, likeness_mm=None, likeness_mean_mm=None)
        same = one.name if figures is None else (one.design.weave.pattern, figures, one.verdict)
        first.setdefault(same, one)
    return list(first.values())


def nearest(tried: Sequence[Tried]) -> Tried | None:
    """Return the design that misses least what could be built; None if nothing was laid.

    Those go first that miss only what a larger object, or thinner sheet, bends to.
    """
    found = [
        (bool(_NARROW & {stop.rule for stop in one.verdict.stops}), one.excess, at)
        for at, one in enumerate(tried)
        if one.excess is not None and not one.makeable
    ]
    return tried[min(found)[-1]] if found else None


def why_few(search: Search) -> str:
    """Say why fewer than two designs can be built, and what would help; nothing if two can.

    Where none can, the nearest is tried larger, thinner and from card.
    """
    asked, tried = search.asked, search.tried
    built = sum(one.makeable for one in tried)
    if built > 1 or not tried:
        return ""
    near = nearest(tried)
    helps = search.add(otherwise(asked, near.design)) if near is not None and not built else []
    supplies = complete_settings(asked)[1]
    size = "" if asked.mesh.size_mm is None else f", at {asked.mesh.size_mm:g} mm"
    whose = f"{agree(len(tried), '{n} design[|s]')} can be built from {supplies.titles}{size}"
    told = f"Only one of {whose}." if built else f"None of {whose}."
    failed = near or next(one for one in tried if not one.makeable)
    which = f"{'The' if not built else 'Of the others, the'} nearest, {failed.name}"
    told += f" {which}, fails by this: {failed.verdict.reasons[0].text}."
    if not helps:
        return told
    ways = [one.name for one in helps if one.makeable]
    if not ways:
        return f"{told} Larger, thinner and from card it was tried, and cannot be built either."
    return f"{told} Tried, and can be built: {', or '.join(ways)}."
