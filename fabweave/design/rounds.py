"""Search designs in rounds, each beside those of the last, until some serve, or say why none."""

import math
from collections.abc import Sequence
from dataclasses import replace

from fabweave.core.arrays import frozen_value
from fabweave.core.messages import agree
from fabweave.design.beside import Found, beside, otherwise
from fabweave.design.candidate import Candidate, Figures, Tried
from fabweave.design.search import Trials, explore
from fabweave.design.wishes import Wishes
from fabweave.mesh.check import check_mesh
from fabweave.options.settings import Settings
from fabweave.plan.ask import complete_settings
from fabweave.plan.verdict import Verdict

#: A search goes on until so many designs can be built.
ENOUGH = 3
#: Where something is wished for, so many are tried at a time beside the nearest.
_AT_A_TIME = 4
#: What stands in the way of a mesh with narrow places, of any size.
_NARROW = {"width", "clearance", "layers"}
#: By what factor ribbons get as narrow as may be, against twist: that is so at any size.
_SLIM = 0.55


@frozen_value
class Search:
    """What a search for designs found.

    Parameters
    ----------
    designs : tuple of Settings
        What was tried, in its order,
    tried : tuple of Tried
        and what it came to. Of those that come to the very same, only the first is kept.
    otherwise : tuple of Tried
        Where none can be built: the nearest of them larger, thinner, or of card.
    why : str
        Why fewer than two can be built, and what would help, as far as that was tried; else empty.
    same : int
        How many more were tried that came to the same as one of these.
    """

    designs: tuple[Settings, ...]
    tried: tuple[Tried, ...]
    otherwise: tuple[Tried, ...] = ()
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

    @property
    def helps(self) -> list[Tried]:
        """What can be built of those that were tried otherwise."""
        return [one for one in self.otherwise if one.candidate.makeable]


def search_designs(
    trials: Trials,
    planned: Sequence[Settings],
    most: int,
    *,
    first: int | None = None,
    wishes: Wishes | None = None,
) -> Search:
    """Try designs, and others beside them, round after round.

    They are tried until three can be built, or as long as others may come nearer to what is wished.
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
    wishes : Wishes, optional
    """
    asked, wishes = trials.asked, wishes or Wishes()
    designs: list[Settings] = []
    tried: list[Tried] = []
    several: bool | None = None

    more = list(planned[:first])
    while more:
        designs += more
        tried += explore(trials, more)
        found = [one.candidate for one in tried]
        pairs = list(zip(designs, found, strict=True))
        room = most - len(designs)
        more = [one for one in planned if one not in designs][:room]
        if wishes or sum(found[at].makeable for at in _apart(designs, found)) < ENOUGH:
            if several is None and not all(one.laid for one in found):
                several = check_mesh(trials.model()).n_components > 1
            near = beside(asked, pairs, wishes, several=bool(several))
            at_a_time = min(_AT_A_TIME, room) if wishes else math.ceil(room / 2)
            # Where a wish is met as well as may be, nothing more is tried.
            met = wishes and any(one.makeable for one in found)
            more = near[:at_a_time] or ([] if met else more)
    helps: list[Tried] = []
    failed = None if any(one.makeable for one in found) else nearest(pairs)
    if failed is not None:
        helps = explore(trials, list(otherwise(asked, slimmed(asked, failed))))
    kept = _apart(designs, found)
    return Search(
        designs=tuple(designs[at] for at in kept),
        tried=tuple(tried[at] for at in kept),
        otherwise=tuple(helps),
        why=why_text(asked, pairs, [one.candidate for one in helps]),
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


def nearest(tried: Sequence[Found]) -> Found | None:
    """Return the design that misses least what could be built; None if nothing was laid.

    Those go first that miss only what a larger object, or thinner sheet, bends to.
    """
    found = [
        (bool(_NARROW & {stop.rule for stop in one.verdict.stops}), one.excess, at)
        for at, (_, one) in enumerate(tried)
        if one.excess is not None and not one.makeable
    ]
    return tried[min(found)[-1]] if found else None


def slimmed(asked: Settings, found: Found) -> Settings:
    """Return a design with narrow ribbons if it twists too much: that is so at any size."""
    design, candidate = found
    twists = any(stop.rule == "twist" for stop in candidate.verdict.stops)
    return design.narrower(_SLIM) if twists and asked.narrowable else design


def why_text(asked: Settings, tried: Sequence[Found], helps: Sequence[Candidate]) -> str:
    """Say why fewer than two designs can be built, and what would help; nothing if two can.

    Parameters
    ----------
    asked : Settings
    tried : sequence of (Settings, Candidate)
    helps : sequence of Candidate
        What was tried otherwise.
    """
    built = sum(one.makeable for _, one in tried)
    if built > 1 or not tried:
        return ""
    supplies = complete_settings(asked)[1]
    size = "" if asked.mesh.size_mm is None else f", at {asked.mesh.size_mm:g} mm"
    whose = f"{agree(len(tried), '{n} design[|s]')} can be built from {supplies.titles}{size}"
    told = f"Only one of {whose}." if built else f"None of {whose}."
    near = nearest(tried)
    failed = near[1] if near is not None else next(one for _, one in tried if not one.makeable)
    which = f"{'The' if not built else 'Of the others, the'} nearest, {failed.name}"
    # What was tried says more than the size that a refusal computes.
    reason = failed.verdict.reasons[0].text.partition(": use ")[0]
    told += f" {which}, fails by this: {reason}."
    if not helps:
        return told
    ways = [one.name for one in helps if one.makeable]
    if not ways:
        return f"{told} Larger, thinner and from card it was tried, and cannot be built either."
    return f"{told} Tried, and can be built: {', or '.join(ways)}."
