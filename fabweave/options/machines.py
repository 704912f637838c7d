"""Find machine profiles: what a shop's laser wants, said once and used in every job."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from fabweave.core.entries import read_toml
from fabweave.core.errors import InputError
from fabweave.core.files import write_files
from fabweave.core.messages import closest_first, shown
from fabweave.options.option import MACHINE, Option
from fabweave.options.table import OPTIONS, still_known
from fabweave.options.user_files import user_folder

#: Programs that read an SVG in pixels of 1/96 inch.
_IN_PIXELS = ("glowforge",)


def machine_options() -> tuple[Option, ...]:
    """Return the options that a machine profile may set."""
    return tuple(option for option in OPTIONS if option.section == MACHINE)


def shipped_profiles() -> dict[str, dict[str, Any]]:
    """Return the profiles that come with fabweave: one for each program with colours of its own.

    Examples
    --------
    >>> shipped_profiles()["trotec"]
    {'preset': 'trotec'}
    """
    from fabweave.sheet.presets import preset_names  # noqa: PLC0415 - not needed for help

    return {
        name: {"preset": name} | ({"svg_units": "px96"} if name in _IN_PIXELS else {})
        for name in preset_names()
    }


def own_profiles() -> dict[str, Path]:
    """Return the user's own profiles by name: the files in ``machines`` of their configuration."""
    return {path.stem: path for path in sorted((user_folder() / "machines").glob("*.toml"))}


def machine_profile(name: str) -> dict[str, Any]:
    """Return the options that a machine profile sets, checked.

    Parameters
    ----------
    name : str
        A file that ends in .toml, one of the user's own profiles, or one that comes with fabweave.

    Raises
    ------
    InputError
        If there is no such profile, or it sets what is no option of a machine, or sets it wrongly.

    Examples
    --------
    >>> machine_profile("glowforge")
    {'preset': 'glowforge', 'svg_units': 'px96'}
    """
    own, ours = own_profiles(), shipped_profiles()
    path = Path(name) if name.lower().endswith(".toml") else own.get(name)
    if path is None and name not in ours:
        known = ", ".join(closest_first(name, [*own, *ours]))
        raise InputError(
            f"there is no machine profile {shown(name)}; there are {known}. fabweave machine new "
            "writes one of your own"
        )
    if path is None:
        return ours[name]
    table = still_known(read_toml(path, "the machine profile"))
    for key, value in table.items():
        # Files that it names lie beside it.
        if isinstance(value, str) and value.lower().endswith(".toml"):
            table[key] = str(path.parent / value)
    check_profile(table, str(path))
    return table


def check_profile(table: Mapping[str, Any], where: str) -> None:
    """Raise InputError unless a table sets options of a machine, to what they take."""
    options = {option.name: option for option in machine_options()}
    strange = [key for key in table if key not in options]
    if strange:
        raise InputError(
            f"{where}: {shown(strange[0])} is no option of a machine, but {', '.join(options)} are"
        )
    for name, value in table.items():
        try:
            options[name].kind.parse(value)
        except InputError as error:
            raise InputError(f"{where}, {name}: {error}") from error


def write_profile(name: str, table: Mapping[str, Any], *, replace: bool = False) -> Path:
    """Write a machine profile into the user's configuration, and return its file.

    Raises
    ------
    InputError
        If the name is no plain word, a profile of that name is there already, or an option does not
        take its value.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}", name):
        raise InputError(f"{shown(name)} is no name for a profile: use letters, digits, - and _")
    path = user_folder() / "machines" / f"{name}.toml"
    if path.exists() and not replace:
        raise InputError(f"{path} exists: choose another name, or add --force")
    kept = {
        key: str(Path(value).absolute())
        if isinstance(value, str) and value.lower().endswith(".toml")
        else value
        for key, value in table.items()
    }
    check_profile(kept, name)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_files({path: tomli_w.dumps(kept).encode()})
    return path
