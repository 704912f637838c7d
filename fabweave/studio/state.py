"""What a page shows: a mesh and options, as a job.toml says them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.core.errors import InputError
from fabweave.options.settings import (
    Settings,
    settings_from_job,
    settings_from_options,
    settings_table,
)

#: How large models are at first.
SIZE = "300mm"


@dataclass(frozen=True)
class State:
    """A mesh, and the options that were asked for.

    Parameters
    ----------
    mesh : str
        A file, or a built-in shape.
    options : mapping
        By the names and in the form of job.toml.

    Examples
    --------
    >>> State.of({"mesh": "shape:cube", "options": {"size": "200mm", "up": None}})
    State(mesh='shape:cube', options={'size': '200mm'})
    """

    mesh: str
    options: Mapping[str, Any]

    @classmethod
    def of(cls, told: Mapping[str, Any]) -> "State":
        """Return the state that JSON holds; options that are null are not asked for.

        Raises
        ------
        InputError
            If it is none.
        """
        mesh, options = told.get("mesh"), told.get("options")
        if not isinstance(mesh, str) or not isinstance(options, dict):
            raise InputError("a state is a mesh and options, as a job.toml has them")
        return cls(mesh, {str(name): value for name, value in options.items() if value is not None})

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON takes it."""
        return {"mesh": self.mesh, "options": dict(self.options)}


def opened(path: Path) -> State:
    """Return the state that a file means: a mesh, or a job.toml.

    Raises
    ------
    InputError
        If it does not read.
    """
    if path.suffix.lower() == ".toml":
        return state_of_job(path)
    return State(str(path), {"size": SIZE})


def state_of_job(path: Path) -> State:
    """Return the state that a job.toml holds: what differs from what is usual.

    Raises
    ------
    InputError
        As :func:`fabweave.options.settings.settings_from_job` does.
    """
    return state_of(settings_from_job(path))


def state_of(settings: Settings) -> State:
    """Return the state whose options are what settings have beside what is usual.

    Examples
    --------
    >>> state_of(Settings.of("shape:cube", size_mm=200.0, effort="quick"))
    State(mesh='shape:cube', options={'size': '200mm', 'effort': 'quick'})
    """
    usual = settings_table(settings_from_options(settings.mesh.source))
    told = settings_table(settings)
    options = {name: value for name, value in told.items() if usual.get(name) != value}
    return State(options.pop("mesh", settings.mesh.source), options)
