"""Find what can be built in place of what cannot, by trying it."""

from collections.abc import Iterator
from dataclasses import replace

from fabweave.app.design.candidate import Candidate
from fabweave.app.design.coarser import is_free
from fabweave.app.design.instead import SOFT
from fabweave.app.design.job import plan_designs
from fabweave.app.design.page import words
from fabweave.app.design.search import explore
from fabweave.app.design.variety import NARROW
from fabweave.app.settings import Settings
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import FabweaveError
from fabweave.core.parallel.executors import Executors, here
from fabweave.mesh.polymesh import PolyMesh

#: The last thing to try is so many times the size.
_LARGER = 1.6
#: How many meshes are tried, and how many ways are told.
_MESHES, _TOLD = 4, 3


def ways_out(
    settings: Settings,
    progress: Progress = no_progress,
    *,
    executors: Executors = here,
    given: PolyMesh | None = None,
) -> list[Candidate]:
    """Return designs that can be built and are near to one that cannot.

    Tried are, in the order in which people prefer them: other meshes, from coarse to fine; narrower
    ribbons; a softer material; a larger size.

    Parameters
    ----------
    settings : Settings
        What cannot be built.
    progress : callable
    executors : callable
        Opens the executor that tries them.
    given : PolyMesh, optional
        A mesh from memory.

    Returns
    -------
    list of Candidate
        Three at most; none if nothing that was tried can be built.
    """
    asked = replace(settings, effort="quick", layout=None)
    designs = list(_designs(asked, progress, given))
    tried = explore(asked, designs, None, progress, executors=executors, given=given)
    return [one.candidate for one in tried if one.candidate.makeable][:_TOLD]


def ways_text(ways: list[Candidate]) -> str:
    """Return ways out as lines of a message; nothing where there are none."""
    if not ways:
        return (
            "Coarser and finer meshes, narrower ribbons, card and a larger size were tried, and "
            "did not help. fabweave guide troubleshooting says what else may.\n"
        )
    lines = []
    for way in ways:
        told = f": {words(way.figures)}" if way.figures is not None else ""
        lines.append(f"  {way.name}{told}; {way.verdict.level}\n")
    return "These were tried, and can be built:\n" + "".join(lines)


def _designs(asked: Settings, progress: Progress, given: PolyMesh | None) -> Iterator[Settings]:
    """Yield what to try, in the order in which people prefer it.

    Where the mesh was left to fabweave, others were tried already: what else may help is tried on
    these.
    """
    free = replace(asked, remesh=None, refine=None)
    try:
        meshes = plan_designs(free, 3 * _MESHES, progress, given)
    except FabweaveError:
        meshes = []
    some = [one for one in meshes if one.pattern == asked.pattern and one.width == asked.width]
    bases = some[:2]
    if not is_free(asked) or not some:
        yield from (one for one in some[:_MESHES] if one != asked)
        bases = [asked, *bases]
    if asked.narrowable:
        yield bases[0].narrower(NARROW)
    if asked.material != SOFT and "=" not in asked.material:
        plain = {"material": SOFT, "thickness_mm": None, "gap_mm": None}
        yield from (replace(one, **plain) for one in bases)  # type: ignore[arg-type]
    if asked.size_mm is not None:
        yield replace(bases[0], size_mm=float(round(_LARGER * asked.size_mm)))
