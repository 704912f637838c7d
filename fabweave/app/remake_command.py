"""Say how a job is made again: the command line that its settings come from."""

import hashlib
import json
import shlex
from typing import Any

from fabweave.app.options.table import OPTIONS, option_named
from fabweave.app.settings import Settings, settings_table

#: A longer command becomes a code of dots too small, millimetres; its settings' digest is coded.
MOST_BYTES = 170
_PROGRAM = ("fabweave", "make")
_AGAIN = ("-o", "again")


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
    >>> settings = Settings("shape:torus?m=8&n=4", size_mm=300.0, slots=True)
    >>> command_text(settings, usual_settings(settings))
    "fabweave make 'shape:torus?m=8&n=4' --size 300mm --slots -o again"
    """
    told, expected = settings_table(settings), settings_table(usual)
    # The material is usual only where it need not be named; a material of the user's own is not.
    expected |= {"material": option_named("material").default, "materials": None}
    words, embedded = [*_PROGRAM, settings.mesh], "layout" in told
    for option in OPTIONS[1:]:
        value = told.get(option.name)
        if value is None or value == expected.get(option.name):
            continue
        if option.kind.flag:
            words.append(option.flag if value else option.denial)
        else:
            for one in value if isinstance(value, list) else [value]:
                words += [option.flag, str(one)]
                embedded |= isinstance(one, dict)
    text = shlex.join([*words, *_AGAIN])
    if not embedded and text.isprintable() and len(text.encode()) <= MOST_BYTES:
        return text
    again = shlex.join([*_PROGRAM, "--config", "job.toml", *_AGAIN])
    return f"{again} # sha256 {settings_digest(told)[:16]}"


def usual_settings(settings: Settings) -> Settings:
    """Return what settings would be if nothing but the mesh and the material were asked for."""
    return Settings(settings.mesh, material=settings.material, materials=settings.materials)


def settings_digest(table: dict[str, Any]) -> str:
    """Return the SHA-256 digest of the table ``[job]`` of a job.toml, as JSON with sorted keys.

    Examples
    --------
    >>> settings_digest({"mesh": "shape:cube"})[:16]
    'f9ef7b4cfe15a959'
    """
    return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()
