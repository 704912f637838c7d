"""Try many designs side by side, keep what is known, and go on where a search was stopped."""

import json
import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from fabweave.app.design.candidate import Candidate, Tried, design_key, mesh_digest, try_design
from fabweave.app.design.variety import name_of
from fabweave.app.settings import Settings
from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import InputError
from fabweave.core.parallel.executors import Executors, finished, here
from fabweave.core.records import from_json, to_json
from fabweave.mesh.polymesh import PolyMesh

#: Where a search keeps what it tried, in its folder.
CANDIDATES = "candidates"


def explore(
    asked: Settings,
    designs: Sequence[Settings],
    folder: Path | None = None,
    progress: Progress = no_progress,
    *,
    executors: Executors = here,
    given: PolyMesh | None = None,
    nested: bool = True,
) -> list[Tried]:
    """Try designs, each once.

    Parameters
    ----------
    asked : Settings
        What was asked for.
    designs : sequence of Settings
        What to try.
    folder : Path, optional
        Where each is kept as soon as it is tried. What is there already, of this version and the
        same mesh and settings, is not tried again: a search that was stopped goes on.
    progress : callable
    executors : callable
        Opens the executor that tries them; the result is the same with any.
    given : PolyMesh, optional
        A mesh from memory, in place of the file that the settings name.
    nested : bool
        Whether pieces are nested, or sheets predicted; the same for all that is kept in a folder.

    Returns
    -------
    list of Tried
        In the order of the designs.
    """
    digest = mesh_digest(asked.mesh, given)
    keys = [design_key(settings, digest) for settings in designs]
    known: dict[str, Tried] = {}
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        known = {key: tried for key in keys if (tried := _kept(folder, key)) is not None}
    tasks = [
        (settings, key, name_of(settings, asked), given)
        for settings, key in zip(designs, keys, strict=True)
        if key not in known
    ]
    progress("designs", len(known), len(keys))
    with executors() as executor:
        for _, tried in finished(executor, partial(try_design, nested=nested), tasks):
            known[tried.candidate.key] = tried
            if folder is not None:
                _keep(folder, tried)
            progress("designs", len(known), len(keys))
    return [known[key] for key in keys]


def _keep(folder: Path, tried: Tried) -> None:
    """Write what was tried; the record last, so that what has one is whole."""
    key = tried.candidate.key
    if tried.picture is not None:
        _write(folder / f"{key}.png", tried.picture)
    text = json.dumps(to_json(tried.candidate), indent=1)
    _write(folder / f"{key}.json", f"{text}\n".encode())


def _write(path: Path, data: bytes) -> None:
    """Write a file so that it is there as a whole or not at all."""
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(data)
    os.replace(part, path)


def _kept(folder: Path, key: str) -> Tried | None:
    """Return what was tried before; None where that is not there, or not whole."""
    record, picture = folder / f"{key}.json", folder / f"{key}.png"
    try:
        candidate = from_json(Candidate, json.loads(record.read_text("utf-8")))
        data = None if candidate.figures is None else picture.read_bytes()
    except (OSError, ValueError, InputError):
        return None
    return Tried(candidate=candidate, picture=data) if candidate.key == key else None
