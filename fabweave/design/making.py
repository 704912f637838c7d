"""Make what is wished for, or say what could be made in place of what cannot."""

from collections.abc import Collection, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, FabweaveError, TooFineError
from fabweave.core.job_folder import check_destination
from fabweave.core.parallel.executors import processes
from fabweave.design.alternatives import of_card
from fabweave.design.candidate import Candidate, words
from fabweave.design.coarser import coarser_meshes, foreseen, is_free, needs, told
from fabweave.design.moves import moves
from fabweave.design.search import Trials, explore, plan_designs
from fabweave.design.variety import NARROW
from fabweave.design.wishes import Wishes, choose, distance
from fabweave.job import FinishedJob, run_job
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.plan.ask import complete_settings, load_asked
from fabweave.plan.verdict import NotMakeableError, judge

#: The last thing to try is so many times the size.
_LARGER = 1.6
#: How many meshes are tried, and how many ways are told.
_MESHES, _TOLD = 4, 3


def buildable_designs(trials: Trials) -> list[Candidate]:
    """Return designs that can be built and are near to one that cannot, that which is asked for.

    Tried are, in the order in which people prefer them: other meshes, from coarse to fine; narrower
    ribbons; a softer material; a larger size.

    Returns
    -------
    list of Candidate
        Three at most; none if nothing that was tried can be built.
    """
    trials = replace(trials, asked=trials.asked.but(effort="quick", layout=None))
    tried = explore(trials, list(_designs(trials)))
    return [one.candidate for one in tried if one.candidate.makeable][:_TOLD]


def buildable_text(ways: list[Candidate]) -> str:
    """Return ways out as lines of a message; nothing where there are none."""
    if not ways:
        return (
            "Coarser and finer meshes, narrower ribbons, card and a larger size were tried, and "
            "did not help. fabweave guide mending says what else may.\n"
        )
    lines = []
    for way in ways:
        told = f": {words(way.figures)}" if way.figures is not None else ""
        lines.append(f"  {way.name}{told}; {way.verdict.level}\n")
    return "These were tried, and can be built:\n" + "".join(lines)


def _designs(trials: Trials) -> Iterator[Settings]:
    """Yield what to try, in the order in which people prefer it.

    Where the mesh was left to fabweave, others were tried already: what else may help is tried on
    these.
    """
    asked = trials.asked
    free = replace(trials, asked=asked.but(remesh=None, refine=None))
    try:
        meshes = plan_designs(free, 3 * _MESHES)
    except FabweaveError:
        meshes = []
    some = [
        one
        for one in meshes
        if one.weave.pattern == asked.weave.pattern and one.ribbons.width == asked.ribbons.width
    ]
    bases = some[:2]
    if not is_free(asked) or not some:
        yield from (one for one in some[:_MESHES] if one != asked)
        bases = [asked, *bases]
    if asked.narrowable:
        yield bases[0].narrower(NARROW)
    yield from of_card(asked, *bases)
    if asked.mesh.size_mm is not None:
        yield bases[0].but(size_mm=float(round(_LARGER * asked.mesh.size_mm)))


#: How many designs are tried for a wish: at first from coarse to fine, then so many at a time
#: beside the nearest, and in all.
_FIRST, _MORE, _TRIES = 9, 4, 24
#: So many of the coarser meshes are made, the best first, until one can be built to its last piece.
_MADE = 4


def meet_wishes(trials: Trials, wishes: Wishes) -> tuple[Settings, str]:
    """Return the settings of the design that comes nearest to what is wished, and why.

    Designs from coarse to fine are tried first, then others beside the nearest: of other density,
    split, faired or refined otherwise, with wider or narrower ribbons.

    Parameters
    ----------
    trials : Trials
        What is asked for there is the same whatever is chosen.
    wishes : Wishes

    Raises
    ------
    InputError
        If the mesh is bad.
    CannotMakeError
        If no design can be built.
    """
    asked, planned = trials.asked, plan_designs(trials, _TRIES)
    designs, more = [], planned[:_FIRST]
    tried: list[Candidate] = []
    while more:
        found = explore(trials, more)
        designs += more
        tried += [one.candidate for one in found]
        near = min(range(len(tried)), key=lambda at: distance(tried[at], wishes))
        further = planned
        if tried[near].makeable:
            further = moves(asked, designs, tried, near, wishes)
        room = min(_MORE, _TRIES - len(designs))
        more = [one for one in further if one not in designs][:room]
    best, why = choose(tried, wishes)
    number = next(at for at, one in enumerate(tried) if one is best)
    return designs[number], why


class Made(NamedTuple):
    """A job that was made, from which settings, and what fabweave chose of them by itself.

    ``chosen`` is empty where all is as it was asked for.
    """

    finished: FinishedJob
    settings: Settings
    chosen: str = ""


def make_or_advise(
    settings: Settings,
    directory: Path,
    progress: Progress = no_progress,
    *,
    mesh: PolyMesh | None = None,
    workers: int = 0,
    replaced: Collection[Path] = (),
) -> Made:
    """Make a job as ``run_job`` does; where it cannot be built, on a coarser mesh, or say what can.

    A coarser mesh is taken where the mesh is left to fabweave (see :func:`is_free`): the best of
    those that are tried. The files are those that its settings make when they are asked for.

    Raises
    ------
    InputError, CannotMakeError
        As :func:`fabweave.job.run_job` does; the message tells what was tried instead, and
        can be built.
    """

    def run(settings: Settings, loaded: LoadedMesh | None = None) -> FinishedJob:
        return run_job(
            settings,
            directory,
            progress,
            mesh=mesh,
            loaded=loaded,
            workers=workers,
            replaced=replaced,
        )

    free = is_free(settings)
    if free:
        check_destination(
            directory, replaced, mesh=None if mesh is not None else settings.mesh.source
        )
        model = load_asked(complete_settings(settings)[0], progress, mesh)
        stops = foreseen(settings, model)
    else:
        model, stops = None, []
    refused: CannotMakeError
    if stops:
        refused, why = NotMakeableError(judge(stops, narrowest_mm=np.inf)), needs(stops[0])
    else:
        try:
            return Made(run(settings, model), settings)
        except (NotMakeableError, TooFineError) as error:
            refused, why = error, f"cannot be built ({_reason(error)})"
    trials = Trials(settings, progress, processes(workers), mesh)
    if model is not None:
        for one in islice(coarser_meshes(trials, model), _MADE):
            try:
                made = run(one.settings, one.loaded)
                return Made(made, one.settings, told(settings, model, one, why))
            except (NotMakeableError, TooFineError):
                continue
    ways = buildable_text(buildable_designs(trials))
    if isinstance(refused, NotMakeableError):
        raise NotMakeableError(refused.verdict, ways)
    raise CannotMakeError(f"{refused}\n{ways.rstrip()}") from None


def _reason(error: CannotMakeError) -> str:
    """Return why something cannot be built, without what would help."""
    if isinstance(error, NotMakeableError):
        return error.verdict.stops[0].text
    return str(error).partition(": use ")[0]
