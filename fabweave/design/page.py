"""Run a design, and show the designs side by side: pictures, figures and tables."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.core.errors import InputError
from fabweave.core.files import write_files
from fabweave.core.messages import few_of
from fabweave.core.records import to_json
from fabweave.design.candidate import Candidate, words
from fabweave.design.search import CANDIDATES, Search, Trials, plan_designs, search_designs
from fabweave.mesh.io.files import states_up
from fabweave.mesh.shapes.catalogue import is_shape, object_title
from fabweave.show.pages import render

#: What a search leaves in its folder beside the candidates.
FILES = ("design.html", "design.json")
#: So many designs are tried before others are looked for near them.
_LEAST_FIRST = 4


def run_design(trials: Trials, folder: Path, count: int) -> Search:
    """Try designs of a model and write ``design.html`` and ``design.json``.

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
    texts = (design_page(title, found), design_json(title, found))
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


def objectives(candidates: Sequence[Candidate]) -> FloatArray:
    """Return what is to be little, of each candidate, (N, 4): work, unlikeness, narrowness, sheets.

    Work is counted in pieces and crossings; where the likeness was not measured, the mesh is the
    model itself. What cannot be built is infinitely bad.
    """
    rows = np.full((len(candidates), 4), np.inf)
    for at, candidate in enumerate(candidates):
        figures = candidate.figures
        if figures is None or not candidate.makeable:
            continue
        rows[at] = (
            figures.hours[1] if figures.hours is not None else figures.pieces,
            figures.likeness_mean_mm or 0.0,
            -figures.narrowest_mm,
            figures.sheets,
        )
    return rows


def pareto_front(values: FloatArray) -> BoolArray:
    """Return which rows no other row is better than: as good in all, and better in one.

    Parameters
    ----------
    values : (N, K) float array
        The less, the better; rows that are not finite are on no front.

    Returns
    -------
    (N,) bool array

    Examples
    --------
    >>> pareto_front(np.array([[1.0, 9.0], [2.0, 2.0], [3.0, 3.0], [np.inf, 0.0]])).tolist()
    [True, True, False, False]
    """
    no_worse = np.all(values[:, None] <= values[None], axis=2)
    better = np.any(values[:, None] < values[None], axis=2)
    return np.asarray(
        ~np.any(no_worse & better, axis=0) & np.all(np.isfinite(values), axis=1), dtype=np.bool_
    )


SCHEMA = "fabweave.design/1"

#: Columns of the tables: key, heading, digits.
_COLUMNS = (
    ("pieces", "pieces", 0),
    ("kinds", "kinds", 0),
    ("crossings", "crossings", 0),
    ("sheets", "sheets", 0),
    ("use", "used", 2),
    ("narrowest_mm", "narrowest, mm", 1),
    ("median_mm", "ribbons, mm", 1),
    ("longest_mm", "longest piece, mm", 0),
    ("likeness_mm", "off the model, mm", 1),
    ("form_mm", "out of form, mm", 1),
    ("broken", "broken conditions", 0),
    ("hours", "assembly, h", 1),
    ("cutting_h", "machine, h", 1),
    ("price", "price", 0),
)


def best_of(candidates: Sequence[Candidate]) -> list[bool]:
    """Return which designs no other is better than in every way."""
    return pareto_front(objectives(candidates)).tolist() if candidates else []


def design_page(title: str, found: Search) -> str:
    """Return a page that opens by itself: a card for each design, and a table.

    Parameters
    ----------
    title : str
        What is woven.
    found : Search

    Returns
    -------
    str
        HTML, with the pictures in it.
    """
    tried, candidates = found.tried, found.candidates
    best = best_of(candidates)
    # The best first, then the others that can be built, from few pieces to many.
    order = sorted(
        range(len(tried)),
        key=lambda at: (
            not best[at],
            not candidates[at].makeable,
            np.inf if (figures := candidates[at].figures) is None else figures.pieces,
        ),
    )
    names = {at: f"D{number}" for number, at in enumerate(order, start=1)}
    return render(
        "design.html",
        title=title,
        found=found,
        lying=lying_note(found),
        designs=[(names[at], tried[at], best[at]) for at in order],
        helps=found.helps,
        heads=[head for _, head, _ in _COLUMNS],
        rows=[_row(candidates[at], names[at]) for at in order],
        words=words,
    )


def lying_note(found: Search) -> str:
    """Say what to do where pictures show the model lying; nothing where its up axis is known."""
    model = found.designs[0]
    if is_shape(model.mesh.source) or states_up(model.mesh.source) or model.mesh.up is not None:
        return ""
    return " If the pictures show it lying, add --up y or --up x."


def _row(candidate: Candidate, name: str) -> tuple[str, list[str]]:
    """Return the row of a design in the table, after what its verdict is."""
    cells = []
    for key, _, digits in _COLUMNS:
        value = None if candidate.figures is None else getattr(candidate.figures, key)
        # One number, the ends of a range, or nothing where it is not known.
        ends = () if value is None else value if isinstance(value, tuple) else (value,)
        falls = key == "form_mm" and candidate.figures is not None and candidate.figures.collapses
        cells.append("collapses" if falls else " to ".join(f"{end:.{digits}f}" for end in ends))
    return candidate.verdict.level, [f"{name}: {candidate.name}", *cells]


def design_json(title: str, found: Search) -> str:
    """Return what ``design.json`` holds: every design with its figures, and whether it is best.

    Where fewer than two can be built, ``why`` says why; where none can, ``instead`` holds what was
    tried otherwise.
    """
    candidates = found.candidates
    rows: list[dict[str, Any]] = [
        {**to_json(candidate), "best": best}
        for candidate, best in zip(candidates, best_of(candidates), strict=True)
    ]
    document: dict[str, Any] = {"schema": SCHEMA, "units": "mm", "title": title, "designs": rows}
    if found.why:
        document["why"] = found.why
        document["instead"] = [to_json(one.candidate) for one in found.otherwise]
    return json.dumps(document, indent=1) + "\n"
