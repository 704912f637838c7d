"""Run a search for designs of one model, and write what came of it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fabweave.app.design.candidate import Tried
from fabweave.app.design.page import design_csv, design_json, design_page
from fabweave.app.design.search import CANDIDATES, explore
from fabweave.app.design.variety import variety
from fabweave.app.mesh_source import load_mesh
from fabweave.app.settings import Settings
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.core.output_files import write_files
from fabweave.core.parallel.executors import Executors, here
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.titles import object_title

#: What a search leaves in its folder beside the candidates.
FILES = ("design.html", "design.json", "design.csv")


def run_design(
    asked: Settings,
    folder: Path,
    progress: Progress = no_progress,
    *,
    count: int,
    executors: Executors = here,
    given: PolyMesh | None = None,
) -> list[Tried]:
    """Try designs of a model and write ``design.html``, ``design.json`` and ``design.csv``.

    Parameters
    ----------
    asked : Settings
        The model, its size and material, and whatever is to be the same in all designs.
    folder : Path
        New, empty, or that of an older search: what was tried there is not tried again.
    progress : callable
    count : int
        How many designs at most.
    executors : callable
        Opens the executor that tries them; the files are the same with any.
    given : PolyMesh, optional
        A mesh from memory.

    Raises
    ------
    InputError
        If the folder holds anything else, or the mesh is bad.
    """
    check_folder(folder)
    designs = plan_designs(asked, count, progress, given)
    tried = explore(asked, designs, folder / CANDIDATES, progress, executors=executors, given=given)
    title = object_title(asked.mesh, asked.title)
    texts = (design_page(title, tried), design_json(title, tried), design_csv(tried))
    write_files({folder / name: text.encode() for name, text in zip(FILES, texts, strict=True)})
    return tried


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
    progress("mesh", 0, 1)
    as_it_comes = replace(asked, remesh=None, refine=None, fair=0, pattern="plain")
    mesh = load_mesh(as_it_comes, given_mesh=given).mesh
    return variety(asked, mesh, count)


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
