"""Make what is wished for, or say what could be made in place of what cannot."""

from collections.abc import Collection
from pathlib import Path

from fabweave.app.design.candidate import Candidate
from fabweave.app.design.job import plan_designs
from fabweave.app.design.moves import because, moves
from fabweave.app.design.search import explore
from fabweave.app.design.ways_out import ways_out, ways_text
from fabweave.app.design.wishes import Wishes, choose, distance
from fabweave.app.pipeline import FinishedJob, run_job
from fabweave.app.settings import Settings
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, TooFineError
from fabweave.core.parallel.executors import Executors, here, processes
from fabweave.mesh.polymesh import PolyMesh
from fabweave.report.verdict import NotMakeableError

#: How many designs are tried for a wish: at first from coarse to fine, then so many at a time
#: beside the nearest, and in all.
_FIRST, _MORE, _TRIES = 9, 4, 24


def meet_wishes(
    asked: Settings,
    wishes: Wishes,
    progress: Progress = no_progress,
    *,
    executors: Executors = here,
    given: PolyMesh | None = None,
) -> tuple[Settings, str]:
    """Return the settings of the design that comes nearest to what is wished, and why.

    Designs from coarse to fine are tried first, then others beside the nearest: of other density,
    split, faired or refined otherwise, with wider or narrower ribbons.

    Parameters
    ----------
    asked : Settings
        What is to be the same whatever is chosen.
    wishes : Wishes
    progress : callable
    executors : callable
        Opens the executor that tries designs; changes no result.
    given : PolyMesh, optional
        A mesh from memory.

    Raises
    ------
    InputError
        If the mesh is bad.
    CannotMakeError
        If no design can be built.
    """
    planned = plan_designs(asked, _TRIES, progress, given)
    designs, more = [], planned[:_FIRST]
    tried: list[Candidate] = []
    while more:
        found = explore(asked, more, None, progress, executors=executors, given=given)
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
    reasons = because(asked, designs, tried, number, wishes)
    return designs[number], "\n".join([why, *(f"  {reason}" for reason in reasons)])


def make_or_advise(
    settings: Settings,
    directory: Path,
    progress: Progress = no_progress,
    *,
    mesh: PolyMesh | None = None,
    workers: int = 0,
    executors: Executors | None = None,
    replaced: Collection[Path] = (),
) -> FinishedJob:
    """Make a job as ``run_job`` does; where it cannot be built, try what could be.

    Raises
    ------
    InputError, CannotMakeError
        As :func:`fabweave.app.pipeline.run_job` does; the message tells what was tried instead, and
        can be built.
    """
    try:
        return run_job(
            settings,
            directory,
            progress,
            mesh=mesh,
            workers=workers,
            executors=executors,
            replaced=replaced,
        )
    except (NotMakeableError, TooFineError) as error:
        refused = error
    ways = ways_text(ways_out(settings, progress, executors=processes(workers), given=mesh))
    if isinstance(refused, NotMakeableError):
        raise NotMakeableError(refused.verdict, ways)
    raise CannotMakeError(f"{refused}\n{ways.rstrip()}") from None
