"""Run a search for designs of one model, and write what came of it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fabweave.core.errors import InputError
from fabweave.core.files import write_files
from fabweave.core.messages import few_of
from fabweave.design.page import design_csv, design_json, design_page
from fabweave.design.rounds import Search, search_designs
from fabweave.design.search import CANDIDATES, Trials, plan_designs
from fabweave.mesh.shapes.catalogue import object_title

#: What a search leaves in its folder beside the candidates.
FILES = ("design.html", "design.json", "design.csv")
#: So many designs are tried before others are looked for near them.
_LEAST_FIRST = 4


def run_design(trials: Trials, folder: Path, count: int) -> Search:
    """Try designs of a model and write ``design.html``, ``design.json`` and ``design.csv``.

    Parameters
    ----------
    trials : Trials
        What is asked for there is to be the same in all designs.
    folder : Path
        New, empty, or that of an older search: what was tried there is not tried again.
    count : int
        How many designs at most. Where few of two thirds of them can be built, the rest are
        looked for near these (see :func:`search_designs`).

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
    trials = replace(trials, folder=folder / CANDIDATES)
    planned = plan_designs(trials, count)
    found = search_designs(trials, planned, count, first=max(_LEAST_FIRST, count - count // 3))
    title = object_title(trials.asked.mesh.source, trials.asked.mesh.title)
    texts = (design_page(title, found), design_json(title, found), design_csv(found.tried))
    write_files({folder / name: text.encode() for name, text in zip(FILES, texts, strict=True)})
    return found


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
