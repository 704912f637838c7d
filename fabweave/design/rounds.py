"""Search designs in rounds: beside those that can be built, until enough can, or say why not."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise, zip_longest

from fabweave.core.arrays import frozen_value
from fabweave.design.alternatives import (
    Found,
    alternatives,
    nearest,
    slimmed,
    why_text,
)
from fabweave.design.candidate import Candidate, Figures, Tried
from fabweave.design.moves import SCHEME, density
from fabweave.design.search import Trials, explore
from fabweave.design.variety import FEWEST, MOST, NARROW, fairable, two_digits
from fabweave.mesh.check import check_mesh
from fabweave.mesh.fair.fairing import STEPS
from fabweave.options.settings import Settings
from fabweave.options.table import option_of_field
from fabweave.plan.verdict import Verdict

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


def nearby_designs(
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
    tried = list(zip(designs, candidates, strict=True))
    missed = [pair for pair in tried if pair[1].laid and not pair[1].makeable]
    missed.sort(key=lambda pair: math.inf if pair[1].excess is None else pair[1].excess)
    mended = [list(_mended(asked, *pair)) for pair in missed[:_NEAREST]]
    # The first remedy of each, then the second of each.
    beside = [one for row in zip_longest(*mended) for one in row if one is not None]
    found = [
        *_as_one(asked, tried, several=several),
        *_between(asked, tried),
        *_varied(asked, tried),
        *beside,
    ]
    failed = {one.mesh.remesh for one, candidate in tried if not candidate.laid}
    new = [one for one in found if one not in designs and not _as_failed(one, failed, asked)]
    return [one for at, one in enumerate(new) if one not in new[:at]]


def _as_failed(design: Settings, failed: set[str | None], asked: Settings) -> bool:
    """Return whether a design wants a mesh that could not be made."""
    return (
        design.mesh.remesh is not None
        and design.mesh.remesh in failed
        and design.mesh.bodies == asked.mesh.bodies
    )


def _between(asked: Settings, tried: Sequence[Found]) -> Iterator[Settings]:
    """Yield meshes between one that serves and the next that does not, and beyond the last."""
    if asked.mesh.remesh is not None:
        return
    for kind in ("quads", "triangles"):
        plain = [
            (density(one)[1], one, candidate)
            for one, candidate in tried
            if density(one)[0] == kind
            and one.mesh.refine is None
            and one.weave.pattern == asked.weave.pattern
        ]
        row = {count: (one, candidate) for count, one, candidate in reversed(plain)}
        counts = sorted(row)
        for low, high in pairwise(counts):
            if row[low][1].makeable != row[high][1].makeable and high > _APART**2 * low:
                yield row[low][0].but(remesh=f"{kind}:{two_digits(math.sqrt(low * high))}")
        if counts and not any(row[count][1].makeable for count in counts):
            yield from _coarser(row[counts[0]][0])


def _varied(asked: Settings, tried: Sequence[Found]) -> Iterator[Settings]:
    """Yield what can be built on a mesh that is a little finer or coarser, and narrower."""
    built = [one for one, candidate in tried if candidate.makeable]
    for design in built:
        kind, count = density(design)
        if count and asked.mesh.remesh is None:
            for factor in (_BESIDE, 1.0 / _BESIDE):
                number = two_digits(min(max(factor * count, _LEAST_FACES), MOST))
                yield design.but(remesh=f"{kind}:{number}")
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
        yield design.but(remesh=f"{kind}:{fewer}")


def _as_one(asked: Settings, tried: Sequence[Found], *, several: bool) -> Iterator[Settings]:
    """Yield what could not be remeshed as one surface, and of several bodies the largest.

    Of the finest mesh at first, which loses no handle; then, what could be made so, of all.
    """
    default = option_of_field("bodies").default_value
    laid = {design.mesh.bodies for design, candidate in tried if candidate.laid}
    if asked.mesh.bodies != default or (default in laid and not several):
        return
    known = {design.mesh.bodies for design, _ in tried}
    unmade = [
        design
        for design, candidate in reversed(tried)
        if design.mesh.remesh is not None and design.mesh.bodies == default and not candidate.laid
    ]
    for bodies in ("join", "wrap", "largest") if several else ("wrap",):
        if bodies in laid:
            yield from (one.but(bodies=bodies) for one in unmade)
        elif bodies not in known and unmade:
            yield unmade[0].but(bodies=bodies)


def _mended(asked: Settings, design: Settings, candidate: Candidate) -> Iterator[Settings]:
    """Yield what may help against that for which a design cannot be built."""
    rules = {reason.rule for reason in candidate.verdict.stops}
    free = asked.mesh.remesh is None and asked.mesh.refine is None
    kind, count = density(design)
    if rules & _TOO_WIDE:
        yield from _narrower(asked, design)
    if rules & _UNEVEN and free and kind == "quads" and design.mesh.refine is None:
        fewer = two_digits(max(_LEAST_FACES, count / _FOLD))
        yield design.but(remesh=f"quads:{fewer}", refine=SCHEME)
    if rules - {"twist"} and free:
        yield from _coarser(design)
    if rules & _UNEVEN and fairable(asked, design):
        yield design.but(fair=STEPS)
    if (
        "triangles" not in (design.mesh.remesh or "")
        and asked.weave.pattern == "plain" == design.weave.pattern
    ):
        yield design.but(pattern="twill")
    if free and count and max(FEWEST, count * 2) <= MOST and "width" not in rules:
        yield design.but(remesh=f"{kind}:{two_digits(2 * count)}")


#: A search goes on until so many designs can be built.
ENOUGH = 3


@frozen_value
class Search:
    """What a search for designs found.

    Parameters
    ----------
    designs : tuple of Settings
        What was tried, in its order,
    tried : tuple of Tried
        and what it came to. Of those that come to the very same, only the first is kept.
    alternatives : tuple of Tried
        Where none can be built: the nearest of them larger, thinner, or of card.
    why : str
        Why fewer than two can be built, and what would help, as far as that was tried; else empty.
    same : int
        How many more were tried that came to the same as one of these.
    """

    designs: tuple[Settings, ...]
    tried: tuple[Tried, ...]
    alternatives: tuple[Tried, ...] = ()
    why: str = ""
    same: int = 0

    @property
    def candidates(self) -> list[Candidate]:
        """What was tried, without the pictures."""
        return [one.candidate for one in self.tried]

    @property
    def makeable(self) -> int:
        """How many can be built."""
        return sum(one.makeable for one in self.candidates)


def search_designs(
    trials: Trials, planned: Sequence[Settings], most: int, *, first: int | None = None
) -> Search:
    """Try designs, and where fewer than three can be built, others near them, round after round.

    Each round is done before the next is chosen, and chosen from figures alone, so the result is
    the same however many work at it.

    Parameters
    ----------
    trials : Trials
    planned : sequence of Settings
        What to try, those first that tell most.
    most : int
        How many designs to try in all. Where none can be built, some more tell what would help.
    first : int, optional
        How many of the planned designs to try before others may be chosen; all if not given.
    """
    asked = trials.asked
    designs: list[Settings] = []
    tried: list[Tried] = []
    several: bool | None = None

    more = list(planned[:first])
    while more:
        designs += more
        tried += explore(trials, more)
        found = [one.candidate for one in tried]
        room = most - len(designs)
        near: list[Settings] = []
        if sum(found[at].makeable for at in _apart(designs, found)) < ENOUGH:
            if several is None and not all(one.laid for one in found):
                several = check_mesh(trials.model()).n_components > 1
            near = nearby_designs(asked, designs, found, several=bool(several))[
                : math.ceil(room / 2)
            ]
        more = near or [one for one in planned if one not in designs][:room]
    found = [one.candidate for one in tried]
    failed = None if any(one.makeable for one in found) else nearest(designs, found)
    others = [] if failed is None else alternatives(asked, slimmed(asked, failed))
    helps = explore(trials, others) if others else []
    why = why_text(asked, found, list(zip(others, (one.candidate for one in helps), strict=True)))
    kept = _apart(designs, found)
    return Search(
        designs=tuple(designs[at] for at in kept),
        tried=tuple(tried[at] for at in kept),
        alternatives=tuple(helps),
        why=why,
        same=len(found) - len(kept),
    )


def _apart(designs: Sequence[Settings], found: Sequence[Candidate]) -> list[int]:
    """Return the numbers of the designs without those that come to the same as one before.

    Of the same pattern: others look different, whatever their figures are.

    A mesh that has as many faces as are asked for is kept as it is by remeshing, and ribbons may
    be as narrow by themselves as they are asked to be.
    """
    first: dict[tuple[str, Figures, Verdict] | int, int] = {}
    for at, (design, one) in enumerate(zip(designs, found, strict=True)):
        figures = one.figures
        if figures is not None and figures.likeness_mm == 0.0:
            figures = replace(figures, likeness_mm=None, likeness_mean_mm=None)
        first.setdefault(
            at if figures is None else (design.weave.pattern, figures, one.verdict), at
        )
    return list(first.values())
