"""Make what is wished for, or say what could be made in place of what cannot."""

from collections.abc import Collection
from pathlib import Path

from fabweave.app.design.job import plan_designs
from fabweave.app.design.search import explore
from fabweave.app.design.ways_out import ways_out, ways_text
from fabweave.app.design.wishes import Wishes, choose
from fabweave.app.pipeline import FinishedJob, run_job
from fabweave.app.settings import Settings
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.parallel.executors import Executors, here, processes
from fabweave.mesh.polymesh import PolyMesh
from fabweave.report.verdict import NotMakeableError

#: How many designs are tried for a wish.
_TRIES = 18


def meet_wishes(
    asked: Settings,
    wishes: Wishes,
    progress: Progress = no_progress,
    *,
    executors: Executors = here,
    given: PolyMesh | None = None,
) -> tuple[Settings, str]:
    """Return the settings of the design that comes nearest to what is wished, and why.

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
    designs = plan_designs(asked, _TRIES, progress, given)
    tried = explore(asked, designs, None, progress, executors=executors, given=given)
    best, why = choose([one.candidate for one in tried], wishes)
    number = next(at for at, one in enumerate(tried) if one.candidate is best)
    return designs[number], why


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
    except NotMakeableError as error:
        verdict = error.verdict
    ways = ways_out(settings, progress, executors=processes(workers), given=mesh)
    raise NotMakeableError(verdict, ways_text(ways))
