"""What a page shows: a mesh and options, as a job.toml says them."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fabweave.core.errors import InputError
from fabweave.options.settings import settings_from_job, settings_from_options, settings_table
from fabweave.options.table import OPTIONS

#: What a new page shows where nothing else is named, and how large models are at first.
FIRST, SIZE = "shape:torus?m=24&n=12", "300mm"


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
    """Return the state that a file means: a mesh, a job.toml, or the photograph of a code.

    Raises
    ------
    InputError
        If it does not read.
    """
    kind = path.suffix.lower()
    if kind == ".toml":
        return state_of_job(path)
    if kind in (".png", ".jpg", ".jpeg"):
        return state_of_command(_code_in(path))
    return State(str(path), {"size": SIZE})


def state_of_job(path: Path) -> State:
    """Return the state that a job.toml holds: what differs from what is usual.

    Raises
    ------
    InputError
        As :func:`fabweave.options.settings.settings_from_job` does.
    """
    settings = settings_from_job(path)
    usual = settings_table(settings_from_options(settings.mesh.source))
    told = settings_table(settings)
    options = {name: value for name, value in told.items() if usual.get(name) != value}
    return State(options.pop("mesh", settings.mesh.source), options)


def state_of_command(text: str) -> State:
    """Return the state that a command line means, as codes on sheets have it.

    Raises
    ------
    InputError
        If it is no such command, or refers to a job.toml.

    Examples
    --------
    >>> state_of_command("fabweave make shape:cube --size 200mm --weld none -o again")
    State(mesh='shape:cube', options={'size': '200mm', 'weld': 'none'})
    """
    words = shlex.split(text)
    if words[:2] != ["fabweave", "make"] or "--config" in words:
        raise InputError(
            f"the code says {text[:80]!r}, which is not all of a job; drop the job's own job.toml"
        )
    flags = {option.flag: option for option in OPTIONS[1:]}
    mesh, options = "", dict[str, Any]()
    rest = iter(words[2:])
    for word in rest:
        if word in flags:
            option = flags[word]
            value: Any = True if option.kind.flag else next(rest, "")
            if option.kind.repeatable:
                value = [*options.get(option.name, []), value]
            options[option.name] = value
        elif word == "-o":
            next(rest, "")
        else:
            mesh = word
    return State(mesh, options)


def _code_in(path: Path) -> str:
    """Return what the code in a photograph says."""
    import zxingcpp  # noqa: PLC0415 - for photographs only
    from PIL import Image, UnidentifiedImageError  # noqa: PLC0415 - for photographs only

    try:
        with Image.open(path) as photograph:
            found = zxingcpp.read_barcodes(photograph.convert("L"))
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError) as error:
        raise InputError(f"{path.name} cannot be read as a picture: {error}") from error
    if not found:
        raise InputError(f"{path.name} shows no code that can be read; come nearer, and hold still")
    return str(found[0].text)
