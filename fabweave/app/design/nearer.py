"""Say what to try where few designs can be built: beside those that can, or that nearly could."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise, zip_longest

from fabweave.app.design.candidate import Candidate
from fabweave.app.design.moves import SCHEME, density
from fabweave.app.design.variety import FAIR, FEWEST, MOST, NARROW, two_digits
from fabweave.app.options.table import option_of_field
from fabweave.app.settings import Settings

#: Meshes with fewer faces than those tried first: they lose more of the shape, but bend less.
_LEAST_FACES = 20
#: Densities nearer to one another than this factor come to much the same.
_APART = 1.15
#: By what factor a mesh that serves gets finer and coarser, to serve once more.
_BESIDE = 1.25
#: By what factor a mesh gets coarser, and one that is refined coarser before that.
_COARSER, _FOLD = 0.6, 4
#: How many of the designs that nearly could be built are looked at.
_NEAREST = 4
#: What narrower ribbons help against, and what a more even or coarser mesh does.
_TOO_WIDE = {"twist", "clearance", "layers", "crease"}
_UNEVEN = {"width", "twist", "crease"}


def nearer(
    asked: Settings,
    designs: Sequence[Settings],
    candidates: Sequence[Candidate],
    *,
    several: bool = False,
) -> list[Settings]:
    """Return designs that were not tried, and may be built where few of those that were can be.

    Parameters
    ----------
    asked : Settings
        What is stated there stays.
    designs : sequence of Settings
        All that were tried,
    candidates : sequence of Candidate
        and what they came to.
    several : bool
        Whether the model has several bodies: those that touch cannot be remeshed apart, nor small
        ones beside a large one.

    Returns
    -------
    list of Settings
        The most promising first: between a mesh that serves and the next that does not; a little
        finer and coarser than what serves, and with narrower ribbons; then beside what misses
        least, by what stands in its way. A twist asks for narrower ribbons, a bend for a coarser
        mesh or for floats, a narrow place for a more even mesh.
    """
    order = [
        at
        for at in sorted(range(len(designs)), key=lambda at: (_far(candidates[at]), at))
        if candidates[at].laid and not candidates[at].makeable
    ]
    mended = [list(_mended(asked, designs[at], candidates[at])) for at in order[:_NEAREST]]
    # The first remedy of each, then the second of each.
    beside = [one for row in zip_longest(*mended) for one in row if one is not None]
    found = [
        *_as_one(asked, designs, candidates, several=several),
        *_between(asked, designs, candidates),
        *_varied(asked, designs, candidates),
        *beside,
    ]
    failed = {
        one.remesh for one, candidate in zip(designs, candidates, strict=True) if not candidate.laid
    }
    new = [one for one in found if one not in designs and not _as_failed(one, failed, asked)]
    return [one for at, one in enumerate(new) if one not in new[:at]]


def _far(candidate: Candidate) -> float:
    """Return by how much a design misses being makeable; infinite where that is not known."""
    return math.inf if candidate.excess is None else candidate.excess


def _as_failed(design: Settings, failed: set[str | None], asked: Settings) -> bool:
    """Return whether a design wants a mesh that could not be made."""
    return design.remesh is not None and design.remesh in failed and design.bodies == asked.bodies


def _between(
    asked: Settings, designs: Sequence[Settings], candidates: Sequence[Candidate]
) -> Iterator[Settings]:
    """Yield meshes between one that serves and the next that does not, and beyond the last."""
    if asked.remesh is not None:
        return
    for kind in ("quads", "triangles"):
        plain = [
            (density(one)[1], one, candidate)
            for one, candidate in zip(designs, candidates, strict=True)
            if density(one)[0] == kind and one.refine is None and one.pattern == asked.pattern
        ]
        row = {count: (one, candidate) for count, one, candidate in reversed(plain)}
        counts = sorted(row)
        for low, high in pairwise(counts):
            if row[low][1].makeable != row[high][1].makeable and high > _APART**2 * low:
                yield replace(row[low][0], remesh=f"{kind}:{two_digits(math.sqrt(low * high))}")
        if counts and not any(row[count][1].makeable for count in counts):
            yield from _coarser(row[counts[0]][0])


def _varied(
    asked: Settings, designs: Sequence[Settings], candidates: Sequence[Candidate]
) -> Iterator[Settings]:
    """Yield what can be built on a mesh that is a little finer or coarser, and narrower."""
    built = [one for one, by in zip(designs, candidates, strict=True) if by.makeable]
    for design in built:
        kind, count = density(design)
        if count and asked.remesh is None:
            for factor in (_BESIDE, 1.0 / _BESIDE):
                number = two_digits(min(max(factor * count, _LEAST_FACES), MOST))
                yield replace(design, remesh=f"{kind}:{number}")
    for design in built:
        yield from _narrower(asked, design)


def _narrower(asked: Settings, design: Settings) -> Iterator[Settings]:
    """Yield the design with narrower ribbons, if their width is left open."""
    if asked.narrowable:
        yield design.narrower(NARROW)


def _coarser(design: Settings) -> Iterator[Settings]:
    """Yield the design on a coarser mesh."""
    kind, count = density(design)
    fewer = max(_LEAST_FACES, two_digits(_COARSER * count)) if count else 0
    if fewer and fewer < count / _APART:
        yield replace(design, remesh=f"{kind}:{fewer}")


def _as_one(
    asked: Settings, designs: Sequence[Settings], candidates: Sequence[Candidate], *, several: bool
) -> Iterator[Settings]:
    """Yield what could not be remeshed as one surface, and of several bodies the largest.

    Of the finest mesh at first, which loses no handle; then, what could be made so, of all.
    """
    default = option_of_field("bodies").default_value
    found = list(zip(designs, candidates, strict=True))
    laid = {design.bodies for design, candidate in found if candidate.laid}
    if asked.bodies != default or (default in laid and not several):
        return
    tried = {design.bodies for design in designs}
    unmade = [
        design
        for design, candidate in reversed(found)
        if design.remesh is not None and design.bodies == default and not candidate.laid
    ]
    for bodies in ("join", "wrap", "largest") if several else ("wrap",):
        if bodies in laid:
            yield from (replace(one, bodies=bodies) for one in unmade)
        elif bodies not in tried and unmade:
            yield replace(unmade[0], bodies=bodies)


def _mended(asked: Settings, design: Settings, candidate: Candidate) -> Iterator[Settings]:
    """Yield what may help against that for which a design cannot be built."""
    rules = {reason.rule for reason in candidate.verdict.stops}
    free = asked.remesh is None and asked.refine is None
    kind, count = density(design)
    if rules & _TOO_WIDE:
        yield from _narrower(asked, design)
    if rules & _UNEVEN and free and kind == "quads" and design.refine is None:
        fewer = two_digits(max(_LEAST_FACES, count / _FOLD))
        yield replace(design, remesh=f"quads:{fewer}", refine=SCHEME)
    if rules - {"twist"} and free:
        yield from _coarser(design)
    if rules & _UNEVEN and not asked.fair and not design.fair:
        yield replace(design, fair=FAIR)
    if "triangles" not in (design.remesh or "") and asked.pattern == "plain" == design.pattern:
        yield replace(design, pattern="twill")
    if free and count and max(FEWEST, count * 2) <= MOST and "width" not in rules:
        yield replace(design, remesh=f"{kind}:{two_digits(2 * count)}")
