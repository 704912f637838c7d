"""Say how a job is made again: the command line that its settings come from."""

import hashlib
import json
import shlex
from pathlib import PurePath
from typing import Any

from fabweave.mesh.shapes.catalogue import is_shape
from fabweave.options.settings import Settings, settings_table
from fabweave.options.table import OPTIONS, option_named

#: A longer command becomes a code of dots too small, millimetres; its settings' digest is coded.
MOST_BYTES = 170
_PROGRAM = ("fabweave", "make")
_AGAIN = ("-o", "again")
#: The material that need not be named.
_UNNAMED = option_named("material").default


def command_text(settings: Settings, usual: Settings) -> str:
    """Return a command that makes a job again, or one that names its job.toml by a digest.

    Parameters
    ----------
    settings : Settings
        Complete.
    usual : Settings
        Of ``usual_settings``, complete.

    Returns
    -------
    str
        Options with what is unusual. Where that is too long, or holds a preset or a layout, which
        stand in the job's own files: ``fabweave make --config job.toml -o again # sha256 0123…``,
        with the first 16 digits of ``settings_digest``.

    Examples
    --------
    >>> settings = Settings.of("shape:torus?m=8&n=4", size_mm=300.0, joint="rivet,slots")
    >>> command_text(settings, usual_settings(settings))
    "fabweave make 'shape:torus?m=8&n=4' --size 300mm --joint rivet,slots -o again"
    """
    told = settings_table(settings)
    words, embedded = _words(settings, usual)
    text = shlex.join([*_PROGRAM, settings.mesh.source, *words, *_AGAIN])
    whole = not embedded and "layout" not in told and text.isprintable()
    if whole and len(text.encode()) <= MOST_BYTES:
        return text
    again = shlex.join([*_PROGRAM, "--config", "job.toml", *_AGAIN])
    return f"{again} # sha256 {settings_digest(told)[:16]}"


def long_command(settings: Settings) -> str:
    """Return the whole command that makes a job, however long it is, into a folder of its name.

    What stands in a file of the user's own (a stock, a library, a preset) is not in it.

    Examples
    --------
    >>> long_command(Settings.of("my cow.obj", size_mm=300.0, remesh="quads:200"))
    "fabweave make 'my cow.obj' --size 300mm --remesh quads:200 -o 'my cow'"
    """
    words, _ = _words(settings, usual_settings(settings))
    name = PurePath(settings.mesh.source).stem
    named = name[:1].isalnum() and not is_shape(settings.mesh.source)
    return shlex.join([*_PROGRAM, settings.mesh.source, *words, "-o", name if named else "job"])


def changed_options(settings: Settings, asked: Settings) -> str:
    """Return the options in which settings differ from what was asked for, as they are typed.

    Examples
    --------
    >>> changed_options(Settings.of("a.obj", remesh="quads:200"), Settings.of("a.obj"))
    '--remesh quads:200'
    """
    return shlex.join(_words(settings, asked, material=None)[0])


def _words(
    settings: Settings, usual: Settings, material: str | None = _UNNAMED
) -> tuple[list[str], bool]:
    """Return the options with what is unusual, and whether one holds what no option can tell."""
    told, expected = settings_table(settings), settings_table(usual)
    if material is not None:
        # A material is usual only where it need not be named; one of the user's own is not.
        expected |= {"material": material, "library": None}
    words: list[str] = []
    embedded = False
    for option in OPTIONS[1:]:
        value = told.get(option.name)
        if value is None or value == expected.get(option.name):
            continue
        if option.kind.flag:
            words.append(option.flag)
            continue
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict):
                embedded = True
            words += [option.flag, str(one)]
    return words, embedded


def usual_settings(settings: Settings) -> Settings:
    """Return what settings would be if nothing but the mesh and the material were asked for."""
    return Settings.of(
        settings.mesh.source, material=settings.stock.material, library=settings.stock.library
    )


def settings_digest(table: dict[str, Any]) -> str:
    """Return the SHA-256 digest of the table ``[job]`` of a job.toml, as JSON with sorted keys.

    Examples
    --------
    >>> settings_digest({"mesh": "shape:cube"})[:16]
    'f9ef7b4cfe15a959'
    """
    return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()
