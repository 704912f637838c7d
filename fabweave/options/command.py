"""Say how a job is made again: the command line that its settings come from."""

import shlex
from pathlib import PurePath

from fabweave.mesh.shapes.catalogue import is_shape
from fabweave.options.settings import Settings, settings_table
from fabweave.options.table import OPTIONS, option_named

#: The material that need not be named.
_UNNAMED = option_named("material").default


def long_command(settings: Settings) -> str:
    """Return the whole command that makes a job, however long it is, into a folder of its name.

    What stands in a file of the user's own (a stock, a library, a preset) is not in it.

    Examples
    --------
    >>> long_command(Settings.of("my cow.obj", size_mm=300.0, remesh="quads:200"))
    "fabweave make 'my cow.obj' --size 300mm --remesh quads:200 -o 'my cow'"
    """
    words = _words(settings, usual_settings(settings))
    name = PurePath(settings.mesh.source).stem
    named = name[:1].isalnum() and not is_shape(settings.mesh.source)
    folder = name if named else "job"
    return shlex.join(["fabweave", "make", settings.mesh.source, *words, "-o", folder])


def changed_options(settings: Settings, asked: Settings) -> str:
    """Return the options in which settings differ from what was asked for, as they are typed.

    Examples
    --------
    >>> changed_options(Settings.of("a.obj", remesh="quads:200"), Settings.of("a.obj"))
    '--remesh quads:200'
    """
    return shlex.join(_words(settings, asked, material=None))


def _words(settings: Settings, usual: Settings, material: str | None = _UNNAMED) -> list[str]:
    """Return the options with what is unusual, but for what only a file can tell."""
    expected = settings_table(usual)
    if material is not None:
        # A material is usual only where it need not be named.
        expected["material"] = material
    words: list[str] = []
    told = settings_table(settings)
    for option in OPTIONS[1:]:
        value = told.get(option.name)
        if value is None or value == expected.get(option.name):
            continue
        if option.kind.flag:
            words.append(option.flag)
            continue
        for one in value if isinstance(value, list) else [value]:
            if not isinstance(one, dict):
                words += [option.flag, str(one)]
    return words


def usual_settings(settings: Settings) -> Settings:
    """Return what settings would be if nothing but the mesh and the material were asked for."""
    return Settings.of(
        settings.mesh.source, material=settings.stock.material, library=settings.stock.library
    )
