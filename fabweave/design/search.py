"""Search designs in rounds, each beside those of the last, and keep what is known of each."""

import math
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from itertools import takewhile
from typing import Any, TypeAlias

from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.messages import agree
from fabweave.core.parallel.executors import Executors, finished, here
from fabweave.design.beside import Found, beside, otherwise
from fabweave.design.candidate import Candidate, Figures, Tried, design_key, mesh_digest, try_design
from fabweave.design.variety import name_of, variety
from fabweave.design.wishes import Wishes
from fabweave.job.ask import complete_settings, load_asked
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.options.settings import Settings
from fabweave.options.table import option_of_field
from fabweave.plan.verdict import Verdict

#: What a search changes that comes after the remeshing, each as it is by default.
_LATER: dict[str, Any] = {
    name: option_of_field(name).default_value
    for name in (
        "refine", "fair", "pattern", "material", "thickness_mm", "gap_mm", "width",
        "max_length_mm", "prefer",
    )
}  # fmt: skip

#: What models were remeshed to, by a digest of all that matters for it; None where they were not.
Meshes: TypeAlias = dict[str, Remeshed | None]
#: Told what each design came to.
ToldDesign: TypeAlias = Callable[[Candidate], None]


#: Said where Ctrl-C ends a search that has something to go on with.
STOPPED = "stopped searching; going on with the best so far (Ctrl-C again ends it all)"


def tell_nobody(_found: object) -> None:
    """Keep to oneself what was found."""


@frozen_value
class Trials:
    """Where designs of a model are tried, and what those have in common that are.

    Parameters
    ----------
    asked : Settings
        What was asked for.
    progress : callable
    executors : callable
        Opens the executor that tries designs; the result is the same with any.
    given : PolyMesh or None
        A mesh from memory, in place of the file that the settings name.
    told : callable
        Called with each as soon as it and all before it were tried: in their order, whoever tries
        them.
    better : callable
        Called with a line for each try that is better than all before it.
    partly : bool
        Whether Ctrl-C ends a search with what it has, where any of that can be built.
    meshes : dict
        What the model was remeshed to by designs that were tried before; those of the next come to
        it. It saves time, and changes no result.
    """

    asked: Settings
    progress: Progress = no_progress
    executors: Executors = here
    given: PolyMesh | None = None
    told: ToldDesign = tell_nobody
    better: Callable[[str], None] = tell_nobody
    partly: bool = False
    meshes: Meshes = field(default_factory=dict)

    def model(self) -> PolyMesh:
        """Return the model as it is loaded, before anything is done to it, at its size.

        Raises
        ------
        InputError
            If the mesh is bad.
        """
        self.progress("mesh", 0, 1)
        plain = self.asked.but(remesh=None, refine=None, fair=0, pattern="plain")
        return load_asked(plain, given_mesh=self.given).mesh


def plan_designs(trials: Trials, count: int) -> list[Settings]:
    """Return the designs to try, those first that tell most.

    Raises
    ------
    InputError
        If the mesh is bad.
    """
    return variety(trials.asked, trials.model(), count)


def explore(trials: Trials, designs: Sequence[Settings]) -> list[Tried]:
    """Try designs, each once, and return them in their order.

    Where something is sought for and Ctrl-C comes, those before the first that is not done yet.
    """
    asked, meshes = trials.asked, trials.meshes
    digest = mesh_digest(asked.mesh.source, trials.given)
    keys = [design_key(settings, digest) for settings in designs]
    known: dict[str, Tried] = {}
    left = dict(zip(keys, designs, strict=True))
    mesh_keys = {key: _mesh_key(one, digest) for key, one in left.items()}
    untold = iter(dict.fromkeys(keys))
    following = next(untold, None)

    def tell() -> None:
        """Tell what was not told before, up to the first that is not known yet."""
        nonlocal following
        while following in known:
            trials.told(known[following].candidate)
            following = next(untold, None)

    trials.progress("designs", 0, len(keys))
    try:
        with trials.executors() as executor:
            while left:
                now = _one_of_each_mesh(left, mesh_keys, meshes)
                tasks = [
                    (
                        one,
                        key,
                        name_of(one, asked),
                        trials.given,
                        meshes.get(_mesh_key(one, digest)),
                    )
                    for key, one in now.items()
                ]
                for _, (tried, remeshed) in finished(executor, try_design, tasks):
                    key = tried.candidate.key
                    known[key] = tried
                    del left[key]
                    meshes[mesh_keys[key]] = remeshed
                    trials.progress("designs", len(known), len(keys))
                    tell()
    except KeyboardInterrupt:
        if not trials.partly:
            raise
    return [known[key] for key in takewhile(known.__contains__, keys)]


def _one_of_each_mesh(
    left: dict[str, Settings], mesh_keys: dict[str, str], meshes: Meshes
) -> dict[str, Settings]:
    """Return the designs, by their keys, whose mesh is known, or that are the first of theirs."""
    first: dict[str, str] = {}
    for key in left:
        first.setdefault(mesh_keys[key], key)
    return {
        key: one
        for key, one in left.items()
        if one.mesh.remesh is None or mesh_keys[key] in meshes or first[mesh_keys[key]] == key
    }


def _mesh_key(settings: Settings, digest: str) -> str:
    """Return the key of what a design remeshes its model to: only later steps may differ."""
    return design_key(settings.but(**_LATER), digest)


#: A search goes on until so many designs can be built.
ENOUGH = 3
#: Where something is wished for, so many are tried at a time beside the nearest.
_AT_A_TIME = 4
#: What stands in the way of a mesh with narrow places, of any size.
_NARROW = {"width", "clearance", "layers"}


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
    """

    designs: tuple[Settings, ...]
    tried: tuple[Tried, ...]
    otherwise: tuple[Tried, ...] = ()
    why: str = ""

    @property
    def candidates(self) -> list[Candidate]:
        """What was tried, without the pictures."""
        return [one.candidate for one in self.tried]

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

    more = list(planned[:first])
    while more:
        tried += explore(trials, more)
        stopped = len(tried) < len(designs) + len(more)
        designs = [*designs, *more][: len(tried)]
        found = [one.candidate for one in tried]
        if stopped:
            if not any(one.makeable for one in found):
                raise KeyboardInterrupt
            trials.better(STOPPED)
        pairs = list(zip(designs, found, strict=True))
        room = most - len(designs)
        more = [one for one in planned if one not in designs][:room]
        if wishes or sum(found[at].makeable for at in _apart(designs, found)) < ENOUGH:
            near = beside(asked, pairs, wishes)
            at_a_time = min(_AT_A_TIME, room) if wishes else math.ceil(room / 2)
            # Where a wish is met as well as may be, nothing more is tried.
            met = wishes and any(one.makeable for one in found)
            more = near[:at_a_time] or ([] if met else more)
        more = [] if stopped else more
    helps: list[Tried] = []
    failed = None if any(one.makeable for one in found) else nearest(pairs)
    # Who wishes for something is not asked whether another size or material would do.
    if failed is not None and not wishes:
        helps = explore(trials, list(otherwise(asked, failed[0])))
    kept = _apart(designs, found)
    return Search(
        designs=tuple(designs[at] for at in kept),
        tried=tuple(tried[at] for at in kept),
        otherwise=tuple(helps),
        why=why_text(asked, pairs, [one.candidate for one in helps]),
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
