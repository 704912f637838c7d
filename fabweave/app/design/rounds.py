"""Search designs in rounds: go on where few can be built, and say why where none can."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from fabweave.app.design.candidate import Candidate, Figures, Tried
from fabweave.app.design.instead import Found, closer, farther, instead_text, nearest, slimmed
from fabweave.app.design.nearer import nearer
from fabweave.app.design.search import Meshes, ToldDesign, explore, tell_nobody
from fabweave.app.mesh_source import load_mesh
from fabweave.app.settings import Settings
from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.parallel.executors import Executors, here
from fabweave.mesh.check import check_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.report.verdict import Verdict

#: A search goes on until so many designs can be built.
ENOUGH = 3
#: Of so many designs it is tried what would help, where none can be built.
_ATTEMPTS = 2


@frozen_value
class Search:
    """What a search for designs found.

    Parameters
    ----------
    designs : tuple of Settings
        What was tried, in its order,
    tried : tuple of Tried
        and what it came to. Of those that come to the very same, only the first is kept.
    instead : tuple of Tried
        Where none can be built: the nearest of them larger, thinner, or of card.
    why : str
        Why fewer than two can be built, and what would help, as far as that was tried; else empty.
    same : int
        How many more were tried that came to the same as one of these.
    """

    designs: tuple[Settings, ...]
    tried: tuple[Tried, ...]
    instead: tuple[Tried, ...] = ()
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
    asked: Settings,
    planned: Sequence[Settings],
    most: int,
    folder: Path | None = None,
    progress: Progress = no_progress,
    *,
    first: int | None = None,
    executors: Executors = here,
    given: PolyMesh | None = None,
    meshes: Meshes | None = None,
    told: ToldDesign = tell_nobody,
) -> Search:
    """Try designs, and where fewer than three can be built, others near them, round after round.

    Each round is done before the next is chosen, and chosen from figures alone, so the result is
    the same however many work at it.

    Parameters
    ----------
    asked : Settings
    planned : sequence of Settings
        What to try, those first that tell most.
    most : int
        How many designs to try in all. Where none can be built, some more tell what would help.
    folder, progress, executors, given, meshes, told
        As for :func:`fabweave.app.design.search.explore`.
    first : int, optional
        How many of the planned designs to try before others may be chosen; all if not given.
    """
    meshes = {} if meshes is None else meshes
    designs: list[Settings] = []
    tried: list[Tried] = []
    several: bool | None = None

    def explored(some: Sequence[Settings]) -> list[Tried]:
        return explore(
            asked,
            some,
            folder,
            progress,
            executors=executors,
            given=given,
            meshes=meshes,
            told=told,
        )

    more = list(planned[:first])
    while more:
        designs += more
        tried += explored(more)
        found = [one.candidate for one in tried]
        room = most - len(designs)
        near: list[Settings] = []
        if sum(found[at].makeable for at in _apart(designs, found)) < ENOUGH:
            if several is None and not all(one.laid for one in found):
                several = check_mesh(as_it_comes(asked, progress, given)).n_components > 1
            near = nearer(asked, designs, found, several=bool(several))[: math.ceil(room / 2)]
        more = near or [one for one in planned if one not in designs][:room]
    found = [one.candidate for one in tried]
    helps: list[Tried] = []
    if any(one.makeable for one in found):
        why = instead_text(asked, found, [])
    else:
        helps, why = _otherwise(asked, designs, found, explored)
    kept = _apart(designs, found)
    return Search(
        designs=tuple(designs[at] for at in kept),
        tried=tuple(tried[at] for at in kept),
        instead=tuple(helps),
        why=why,
        same=len(found) - len(kept),
    )


def _otherwise(
    asked: Settings,
    designs: Sequence[Settings],
    found: Sequence[Candidate],
    explored: Callable[[Sequence[Settings]], list[Tried]],
) -> tuple[list[Tried], str]:
    """Try the nearest design larger, thinner and of card; and where nothing helps, the next.

    Returns
    -------
    tried : list of Tried
    why : str
        Why none can be built, and what would help.
    """
    tried: list[Tried] = []
    why = instead_text(asked, found, [])
    left = list(zip(designs, found, strict=True))
    for attempt in range(_ATTEMPTS):
        least = nearest(*zip(*left, strict=True)) if left else None
        if least is None:
            break
        slim = slimmed(asked, least)
        some = farther(asked, slim)
        helps = explored(some)
        more = closer(asked, slim, _pairs(some, helps))
        helps += explored(more)
        tried += helps
        other = least[1].name if attempt else None
        told = instead_text(asked, found, _pairs([*some, *more], helps), other)
        built = any(one.candidate.makeable for one in helps)
        if built or not attempt:
            why = told
        if built:
            break
        # Its mesh is at fault.
        left = [(one, by) for one, by in left if one.remesh != least[0].remesh]
    return tried, why


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
        first.setdefault(at if figures is None else (design.pattern, figures, one.verdict), at)
    return list(first.values())


def _pairs(designs: Sequence[Settings], tried: Sequence[Tried]) -> list[Found]:
    """Return designs, each with what it came to."""
    return [(design, one.candidate) for design, one in zip(designs, tried, strict=True)]


def as_it_comes(
    asked: Settings, progress: Progress = no_progress, given: PolyMesh | None = None
) -> PolyMesh:
    """Return the model as it is loaded, before anything is done to it, at its size.

    Raises
    ------
    InputError
        If the mesh is bad.
    """
    progress("mesh", 0, 1)
    plain = replace(asked, remesh=None, refine=None, fair=0, pattern="plain")
    return load_mesh(plain, given_mesh=given).mesh
