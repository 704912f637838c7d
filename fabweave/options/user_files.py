"""Find the user's own materials and targets: in the configuration folder, and in files."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from fabweave.options.table import option_named

#: Names another configuration folder, as tests do.
FOLDER_VARIABLE = "FABWEAVE_CONFIG_DIR"
#: Where the entries that come with fabweave are from.
OURS = "fabweave"


def user_folder() -> Path:
    """Return the folder of the user's own materials, targets and machines; it need not be there.

    It is that of the platform's convention, or the one that ``FOLDER_VARIABLE`` names.
    """
    named = os.environ.get(FOLDER_VARIABLE)
    if named:
        return Path(named)
    import platformdirs  # noqa: PLC0415 - not needed for help

    return platformdirs.user_config_path("fabweave", appauthor=False)


def user_file(name: str) -> Path:
    """Return the file in the configuration folder that an option stands for, there or not."""
    return user_folder() / {"library": "materials.toml", "rules": "targets.toml"}[name]


def user_entries(name: str, files: Sequence[Any] = ()) -> tuple[Any, ...]:
    """Return the user's own materials or targets: those of the configuration folder come first.

    Parameters
    ----------
    name : {"library", "rules"}
    files : sequence
        Further files, or what else the option of that name takes.

    Raises
    ------
    InputError
        If a file cannot be read, or an entry is not what it should be.
    """
    return tuple(entry for _, entries in _sources(name, files) for entry in entries)


def all_entries(
    name: str, known: Iterable[Any], files: Sequence[Any] = ()
) -> list[tuple[Any, str]]:
    """Return materials or targets with where each is from, ours first.

    The user's own stand in the place of those of ours that have the same name.
    """
    found = {entry.name: (entry, OURS) for entry in known}
    for source, entries in _sources(name, files):
        found |= {entry.name: (entry, source) for entry in entries}
    return list(found.values())


def _sources(name: str, files: Sequence[Any]) -> list[tuple[str, tuple[Any, ...]]]:
    """Return each source of the user's own entries, and what it holds."""
    folder = user_file(name)
    places = [*([folder] if os.path.isfile(folder) else []), *files]
    kind = option_named(name).kind
    return [(str(place), kind.parse(place)) for place in places]
