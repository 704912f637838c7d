"""Make what is wished for, or what can be made in place of what cannot."""

from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path
from typing import NamedTuple

from fabweave.core.job_folder import check_destination
from fabweave.core.parallel.executors import Executors, processes
from fabweave.design.beside import near_rounds
from fabweave.design.choice import choose_mesh
from fabweave.design.search import Search, tell_nobody
from fabweave.design.variety import variety
from fabweave.design.wishes import NO_WISHES, Wishes, choose
from fabweave.job.run import FinishedJob, run_job
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings

#: How many designs are tried for a wish: at first from coarse to fine, and in all.
_FIRST, _TRIES = 9, 24


def seek(search: Search, tries: int = _TRIES) -> None:
    """Try designs for what is wished, or from coarse to fine where nothing is.

    Designs from coarse to fine are tried first, then others beside the nearest: of other density,
    split, faired or refined otherwise, with wider or narrower ribbons. Ctrl-C ends the search with
    the nearest that was tried, if any can be built.
    """
    wishes, asked = search.wishes, search.asked
    if wishes.form_mm is not None and asked.pieces.fasten is None:
        search.asked = asked.but(fasten=f"form:{wishes.form_mm:g}mm")
    planned = variety(search.asked, search.model().mesh, tries)
    if wishes:
        search.run(near_rounds(search, planned, tries, first=_FIRST))
    else:
        search.add(planned)


def meet_wishes(search: Search) -> tuple[Settings, str]:
    """Return the settings of the design that comes nearest to what is wished, and why.

    Parameters
    ----------
    search : Search
        What is asked for there is the same whatever is chosen.

    Raises
    ------
    InputError
        If the mesh is bad.
    CannotMakeError
        If no design can be built.
    """
    seek(search)
    best, why = choose(search.tried, search.wishes)
    return best.design, why


class Made(NamedTuple):
    """A job that was made, its stations, and what fabweave chose of them by itself.

    ``chosen`` is empty where all is as it was asked for.
    """

    finished: FinishedJob
    job: Stations
    chosen: str = ""


def make_or_advise(
    job: Stations,
    directory: Path,
    *,
    workers: int = 0,
    executors: Executors | None = None,
    replaced: Collection[Path] = (),
    wishes: Wishes = NO_WISHES,
    better: Callable[[str], None] = tell_nobody,
    chose: Callable[[str], None] = tell_nobody,
) -> Made:
    """Make a job as ``run_job`` does, on the best mesh for it; or say what can be made instead.

    Where something is wished for, the design that comes nearest to it is made. ``better`` is told
    each that is better than those before (see :func:`choose_mesh`), and ``chose`` what was chosen
    and why. The files are those that its settings make when they are asked for.

    Raises
    ------
    InputError, CannotMakeError
        As :func:`fabweave.job.run.run_job` does; the message tells what was tried instead, and
        can be built.
    """
    source = None if job.given is not None else job.asked.mesh.source
    check_destination(directory, replaced, mesh=source)
    searching = partial(
        Search, given=job.given, progress=job.progress, executors=executors or processes(workers),
        better=better, partly=True,
    )  # fmt: skip
    nearest = ""
    if wishes:
        design, nearest = meet_wishes(searching(job.asked, wishes=wishes))
        job = job.instead(design)
    choice = choose_mesh(job, searching(job.asked))
    chosen = "\n".join(filter(None, (nearest, choice.text)))
    if chosen:
        chose(chosen)
    finished = run_job(
        choice.job, directory, workers=workers, executors=executors, replaced=replaced
    )
    return Made(finished, choice.job, chosen)
