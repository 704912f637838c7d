"""Read what jobs a batch asks for: a table of TOML, or a row of a CSV file for each."""

import csv
import io
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.core.errors import InputError
from fabweave.core.files import read_text
from fabweave.core.messages import few_of, shown

#: What a job is called is the name of its folder.
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_. -]{0,79}")
#: What Windows takes for a device, whatever follows a dot.
_DEVICE = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")
#: What a batch writes beside the folders of its jobs.
PAGE, RECORD, TOGETHER = "index.html", "batch.json", "together"
#: In a cell of a table, values of an option that may be given several times.
_BETWEEN = ";"
_FLAGS = {"true": True, "yes": True, "false": False, "no": False}


@dataclass(frozen=True)
class Asked:
    """A job of a batch: its name, its mesh, its options as on the command line, and its wishes."""

    name: str
    mesh: Any
    options: Mapping[str, Any]
    pieces: int | None = None
    goal: str = ""


@dataclass(frozen=True)
class Batch:
    """The jobs of a batch, and whether those of one material share sheets."""

    jobs: tuple[Asked, ...]
    together: bool = False


def batch_of(jobs: Mapping[str, Mapping[str, Any]], *, together: bool = False) -> Batch:
    """Return the batch of some jobs by their names: each a mesh, and options.

    Raises
    ------
    InputError
        If a name can be no folder's, two differ in case alone, or a job has no mesh.

    Examples
    --------
    >>> batch_of({"cow": {"mesh": "cow.obj", "size": "400mm", "max-length": 200}}).jobs[0].options
    {'size': '400mm', 'max_length': 200}
    """
    if not jobs:
        raise InputError("there are no jobs in the batch; write one, as [jobs.cow]")
    taken = {PAGE, RECORD, TOGETHER}
    asked = []
    for name, told in jobs.items():
        if not (isinstance(name, str) and _NAME.fullmatch(name)) or name[-1] in ". ":
            raise InputError(
                f"a job is called {shown(name)}, and so would be its folder; use letters, digits, "
                "spaces and - _ ."
            )
        if name.lower() in taken or _DEVICE.fullmatch(name):
            raise InputError(f"the name {name!r} is taken; call the job something else")
        taken.add(name.lower())
        if not isinstance(told, Mapping) or "mesh" not in told:
            raise InputError(f"job {name}: there is no mesh; write mesh = 'cow.obj'")
        options = {key.replace("-", "_"): value for key, value in told.items()}
        asked.append(
            Asked(name, options.pop("mesh"), pieces=options.pop("pieces", None),
                  goal=options.pop("goal", ""), options=options)
        )  # fmt: skip
    return Batch(tuple(asked), together)


def read_batch(path: Path) -> Batch:
    """Read the jobs of a file: ``.csv``, or else TOML.

    Meshes are looked for where they are said to be, and beside the file.

    Raises
    ------
    InputError
        If the file cannot be read, or asks for what is no batch.
    """
    text = read_text(path, "the jobs")
    together = False
    if path.suffix.lower() == ".csv":
        jobs = _rows(path, text)
    else:
        try:
            told = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{path} is not TOML: {error}") from error
        together, common = told.pop("together", False), told.pop("options", {})
        tables = told.pop("jobs", {})
        each = tables.values() if isinstance(tables, dict) else [tables]
        if told or not all(isinstance(one, dict) for one in (common, *each)):
            raise InputError(
                f"{path} has {few_of(list(told)) or 'a value'} where only together = true, "
                "[options] and [jobs.NAME] can stand"
            )
        if not isinstance(together, bool):
            raise InputError(f"{path}: together is true or false")
        jobs = {name: common | table for name, table in tables.items()}
    try:
        batch = batch_of(jobs, together=together)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    found = (Asked(**{**vars(one), "mesh": _found(one.mesh, path.parent)}) for one in batch.jobs)
    return Batch(tuple(found), together)


def _found(mesh: Any, folder: Path) -> str:
    """Return where a mesh is: where it is said to be, or else beside the file, if it is there."""
    beside = folder / str(mesh)
    return str(beside) if not os.path.exists(str(mesh)) and beside.exists() else str(mesh)


def _rows(path: Path, text: str) -> dict[str, dict[str, Any]]:
    """Return the jobs of a table by their names; empty cells say nothing."""
    jobs: dict[str, dict[str, Any]] = {}
    for number, row in enumerate(csv.DictReader(io.StringIO(text)), start=2):
        if None in row:
            raise InputError(f"{path}, line {number}: there are more cells than columns")
        cells = {str(key).strip(): str(cell or "").strip() for key, cell in row.items()}
        told: dict[str, Any] = {key: _cell(cell) for key, cell in cells.items() if cell}
        if not told:
            continue
        name = str(told.pop("name", Path(str(told.get("mesh", "")).partition("?")[0]).stem))
        name = name.removeprefix("shape:")
        if name in jobs:
            raise InputError(f"{path}, line {number}: there is a job {name!r} already; name it so")
        if "pieces" in told:
            if not str(told["pieces"]).isdecimal():
                raise InputError(f"{path}, line {number}: pieces is no number")
            told["pieces"] = int(told["pieces"])
        jobs[name] = told
    return jobs


def _cell(cell: str) -> Any:
    """Return what a cell says: a flag, several values, or one."""
    if cell.lower() in _FLAGS:
        return _FLAGS[cell.lower()]
    parts = [part.strip() for part in cell.split(_BETWEEN)]
    return parts if len(parts) > 1 else cell
