"""Make what is wished for, or say what could be made in place of what cannot."""

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, FabweaveError, TooFineError
from fabweave.core.job_folder import check_destination
from fabweave.core.parallel.executors import processes
from fabweave.design.beside import SOFT
from fabweave.design.candidate import Candidate, told_design
from fabweave.design.coarser import coarser_meshes, foreseen, has_coarser, is_free, needs, told
from fabweave.design.search import Trials, plan_designs, search_designs, tell_nobody
from fabweave.design.wishes import UNBUILT, Wishes, choose, rank
from fabweave.job.ask import complete_settings, load_asked
from fabweave.job.run import FinishedJob, run_job
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.plan.verdict import NotMakeableError, judge

#: How many designs are tried for a wish: at first from coarse to fine, and in all.
_FIRST, _TRIES = 9, 24
#: Of what cannot be built, so many designs are tried at first, and so many that can are told.
_MESHES, _TOLD = 4, 3
#: So many of the coarser meshes are made, the best first, until one can be built to its last piece.
_MADE = 4


def meet_wishes(trials: Trials, wishes: Wishes) -> tuple[Settings, str]:
    """Return the settings of the design that comes nearest to what is wished, and why.

    Designs from coarse to fine are tried first, then others beside the nearest: of other density,
    split, faired or refined otherwise, with wider or narrower ribbons. Ctrl-C ends the search with
    the nearest that was tried, if any can be built.

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
    nearest = UNBUILT

    def tell(candidate: Candidate) -> None:
        nonlocal nearest
        trials.told(candidate)
        if (away := rank(candidate, wishes)) < nearest:
            nearest = away
            trials.better(f"best so far: {told_design(candidate)}")

    if wishes.form_mm is not None and trials.asked.pieces.fasten is None:
        trials = replace(trials, asked=trials.asked.but(fasten=f"form:{wishes.form_mm:g}mm"))
    planned = plan_designs(trials, _TRIES)
    telling = replace(trials, told=tell, partly=True)
    found = search_designs(telling, planned, _TRIES, first=_FIRST, wishes=wishes)
    best, why = choose(found.candidates, wishes)
    return found.designs[found.candidates.index(best)], why


def what_can_be_built(trials: Trials) -> str:
    """Return which designs can be built that are near to one that cannot, as lines of a message.

    Others of its mesh are tried, from coarse to fine, and beside these (see
    :func:`search_designs`); where none can be built, the nearest larger, thinner and from card.
    """
    asked = trials.asked.but(effort="quick", layout=None, remesh=None, refine=None)
    trials = replace(trials, asked=asked)
    try:
        planned = plan_designs(trials, 2 * _MESHES)
        found = search_designs(trials, planned, 2 * _MESHES, first=_MESHES)
    except FabweaveError:
        return ""
    ways = [one for one in found.candidates if one.makeable]
    ways = ways or [one.candidate for one in found.helps]
    if not ways:
        return f"{found.why} fabweave guide mending says what else may help.\n"
    lines = [f"  {told_design(way)}\n" for way in ways[:_TOLD]]
    return "These were tried, and can be built:\n" + "".join(lines)


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
    better: Callable[[str], None] = tell_nobody,
) -> Made:
    """Make a job as ``run_job`` does; where it cannot be built, on a coarser mesh, or say what can.

    A coarser mesh is taken where the mesh is left to fabweave (see :func:`is_free`): the best of
    those that are tried; ``better`` is told each that is better than those before. The files are
    those that its settings make when they are asked for.

    Raises
    ------
    InputError, CannotMakeError
        As :func:`fabweave.job.run.run_job` does; the message tells what was tried instead, and
        can be built.
    """
    run = partial(
        run_job, directory=directory, progress=progress, mesh=mesh, workers=workers,
        replaced=replaced,
    )  # fmt: skip
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
            return Made(run(settings, loaded=model), settings)
        except (NotMakeableError, TooFineError) as error:
            refused, why = error, f"cannot be built ({_reason(error)})"
    trials = Trials(settings, progress, processes(workers), mesh, better=better)
    meshes = model is not None and has_coarser(model)
    if model is not None and meshes:
        for one in islice(coarser_meshes(trials, model), _MADE):
            try:
                made = run(one.settings, loaded=one.loaded)
                return Made(made, one.settings, told(settings, model, one, why))
            except (NotMakeableError, TooFineError):
                continue
    ways = _none_of_them(settings) if meshes else what_can_be_built(trials)
    if isinstance(refused, NotMakeableError):
        raise NotMakeableError(refused.verdict, ways)
    raise CannotMakeError(f"{refused}\n{ways.rstrip()}") from None


def _none_of_them(settings: Settings) -> str:
    """Return what may help where no coarser mesh can be built."""
    softer = "" if settings.stock.material == SOFT else f", or --material {SOFT},"
    return (
        "Coarser meshes of quads, tubes and triangles were tried, and cannot be built either. A "
        f"larger --size{softer} leaves more room.\n"
    )


def _reason(error: CannotMakeError) -> str:
    """Return why something cannot be built, without what would help."""
    if isinstance(error, NotMakeableError):
        return error.verdict.stops[0].text
    return str(error).partition(": use ")[0]
