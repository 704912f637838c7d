"""Try many designs side by side, keep what is known, and go on where a search was stopped."""

import json
from collections.abc import Callable, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any, TypeAlias

from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.errors import InputError
from fabweave.core.files import write_files
from fabweave.core.parallel.executors import Executors, finished, here
from fabweave.core.records import from_json, to_json
from fabweave.design.candidate import Candidate, Tried, design_key, mesh_digest, try_design
from fabweave.design.variety import name_of, variety
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.options.settings import Settings
from fabweave.options.table import option_of_field
from fabweave.plan.ask import load_asked

#: Where a search keeps what it tried, in its folder.
CANDIDATES = "candidates"
#: What a search changes that comes after the remeshing, each as it is by default.
_LATER: dict[str, Any] = {
    name: option_of_field(name).default_value
    for name in (
        "refine", "fair", "pattern", "material", "thickness_mm", "gap_mm", "width",
        "max_length_mm", "prefer",
    )
}  # fmt: skip

#: What models were remeshed to, by a digest of all that matters for it; None where they were not.
Meshes: TypeAlias = dict[str, Remeshed | None]
#: Told what each design came to.
ToldDesign: TypeAlias = Callable[[Candidate], None]


def tell_nobody(_found: object) -> None:
    """Keep to oneself what was found."""


@frozen_value
class Trials:
    """Where designs of a model are tried, and what those have in common that are.

    Parameters
    ----------
    asked : Settings
        What was asked for.
    progress : callable
    executors : callable
        Opens the executor that tries designs; the result is the same with any.
    given : PolyMesh or None
        A mesh from memory, in place of the file that the settings name.
    folder : Path or None
        Where each design is kept as soon as it is tried. What is there already, of this version and
        the same mesh and settings, is not tried again: a search that was stopped goes on.
    told : callable
        Called with each as soon as it and all before it were tried: in their order, whoever tries
        them.
    meshes : dict
        What the model was remeshed to by designs that were tried before; those of the next come to
        it. It saves time, and changes no result.
    """

    asked: Settings
    progress: Progress = no_progress
    executors: Executors = here
    given: PolyMesh | None = None
    folder: Path | None = None
    told: ToldDesign = tell_nobody
    meshes: Meshes = field(default_factory=dict)

    def model(self) -> PolyMesh:
        """Return the model as it is loaded, before anything is done to it, at its size.

        Raises
        ------
        InputError
            If the mesh is bad.
        """
        self.progress("mesh", 0, 1)
        plain = self.asked.but(remesh=None, refine=None, fair=0, pattern="plain")
        return load_asked(plain, given_mesh=self.given).mesh


def plan_designs(trials: Trials, count: int) -> list[Settings]:
    """Return the designs to try, those first that tell most.

    Raises
    ------
    InputError
        If the mesh is bad.
    """
    return variety(trials.asked, trials.model(), count)


def explore(trials: Trials, designs: Sequence[Settings]) -> list[Tried]:
    """Try designs, each once, and return them in their order."""
    asked, folder, meshes = trials.asked, trials.folder, trials.meshes
    digest = mesh_digest(asked.mesh.source, trials.given)
    keys = [design_key(settings, digest) for settings in designs]
    known: dict[str, Tried] = {}
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        known = {key: tried for key in keys if (tried := _kept(folder, key)) is not None}
    left = {key: one for key, one in zip(keys, designs, strict=True) if key not in known}
    untold = iter(dict.fromkeys(keys))
    following = next(untold, None)

    def tell() -> None:
        """Tell what was not told before, up to the first that is not known yet."""
        nonlocal following
        while following in known:
            trials.told(known[following].candidate)
            following = next(untold, None)

    trials.progress("designs", len(known), len(keys))
    tell()
    with trials.executors() as executor:
        while left:
            now = _one_of_each_mesh(left, digest, meshes)
            tasks = [
                (one, key, name_of(one, asked), trials.given, meshes.get(_mesh_key(one, digest)))
                for key, one in now.items()
            ]
            for _, (tried, remeshed) in finished(executor, try_design, tasks):
                key = tried.candidate.key
                known[key] = tried
                meshes[_mesh_key(left.pop(key), digest)] = remeshed
                if folder is not None:
                    _keep(folder, tried)
                trials.progress("designs", len(known), len(keys))
                tell()
    return [known[key] for key in keys]


def _one_of_each_mesh(
    left: dict[str, Settings], digest: str, meshes: Meshes
) -> dict[str, Settings]:
    """Return the designs, by their keys, whose mesh is known, or that are the first of theirs."""
    first: dict[str, str] = {}
    for key, one in left.items():
        first.setdefault(_mesh_key(one, digest), key)
    return {
        key: one
        for key, one in left.items()
        if one.mesh.remesh is None
        or _mesh_key(one, digest) in meshes
        or first[_mesh_key(one, digest)] == key
    }


def _mesh_key(settings: Settings, digest: str) -> str:
    """Return the key of what a design remeshes its model to: only later steps may differ."""
    return design_key(settings.but(**_LATER), digest)


def _keep(folder: Path, tried: Tried) -> None:
    """Write what was tried; the record last, so that what has one is whole."""
    key, text = tried.candidate.key, json.dumps(to_json(tried.candidate), indent=1)
    files = {} if tried.picture is None else {folder / f"{key}.png": tried.picture}
    write_files({**files, folder / f"{key}.json": f"{text}\n".encode()})


def _kept(folder: Path, key: str) -> Tried | None:
    """Return what was tried before; None where that is not there, or not whole."""
    record, picture = folder / f"{key}.json", folder / f"{key}.png"
    try:
        candidate = from_json(Candidate, record.read_bytes())
        data = None if candidate.figures is None else picture.read_bytes()
    except (OSError, ValueError, InputError):
        return None
    return Tried(candidate=candidate, picture=data) if candidate.key == key else None
