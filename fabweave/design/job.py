"""Run a search for designs of one model, and write what came of it."""

from collections.abc import Sequence
from pathlib import Path

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import InputError
from fabweave.core.files import write_files
from fabweave.core.messages import few_of
from fabweave.core.parallel.executors import Executors, here
from fabweave.design.page import design_csv, design_json, design_page
from fabweave.design.rounds import Search, as_it_comes, search_designs
from fabweave.design.search import CANDIDATES, ToldDesign, tell_nobody
from fabweave.design.variety import variety
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import object_title
from fabweave.options.settings import Settings

#: What a search leaves in its folder beside the candidates.
FILES = ("design.html", "design.json", "design.csv")
#: So many designs are tried before others are looked for near them.
_LEAST_FIRST = 4


def run_design(
    asked: Settings,
    folder: Path,
    progress: Progress = no_progress,
    *,
    count: int,
    executors: Executors = here,
    given: PolyMesh | None = None,
    told: ToldDesign = tell_nobody,
) -> Search:
    """Try designs of a model and write ``design.html``, ``design.json`` and ``design.csv``.

    Parameters
    ----------
    asked : Settings
        The model, its size and material, and whatever is to be the same in all designs.
    folder : Path
        New, empty, or that of an older search: what was tried there is not tried again.
    progress : callable
    count : int
        How many designs at most. Where few of two thirds of them can be built, the rest are
        looked for near these (see :func:`search_designs`).
    executors : callable
        Opens the executor that tries them; the files are the same with any.
    given : PolyMesh, optional
        A mesh from memory.
    told : callable
        Called with each design as it is tried.

    Returns
    -------
    Search
        With the designs of the page.

    Raises
    ------
    InputError
        If the folder holds anything else, or the mesh is bad.
    """
    check_folder(folder)
    planned = plan_designs(asked, count, progress, given)
    found = search_designs(
        asked,
        planned,
        count,
        folder / CANDIDATES,
        progress,
        first=max(_LEAST_FIRST, count - count // 3),
        executors=executors,
        given=given,
        told=told,
    )
    title = object_title(asked.mesh.source, asked.mesh.title)
    texts = (design_page(title, found), design_json(title, found), design_csv(found.tried))
    write_files({folder / name: text.encode() for name, text in zip(FILES, texts, strict=True)})
    return found


def plan_designs(
    asked: Settings,
    count: int,
    progress: Progress = no_progress,
    given: PolyMesh | None = None,
) -> list[Settings]:
    """Return the designs to try, those first that tell most.

    Raises
    ------
    InputError
        If the mesh is bad.
    """
    return variety(asked, as_it_comes(asked, progress, given), count)


def check_folder(folder: Path) -> None:
    """Refuse a folder with files that no search wrote.

    Raises
    ------
    InputError
        That names them.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InputError(f"{folder} is a file; name a folder for the designs with -o")
    known: Sequence[str] = (*FILES, CANDIDATES, ".DS_Store")
    strange = sorted(path.name for path in folder.iterdir() if path.name not in known)
    if strange:
        raise InputError(
            f"{folder} holds what no search for designs wrote: {few_of(strange, 5)}; name a new "
            "folder with -o"
        )
