"""The table of options: all that the command line, job.toml, the reference and checks know.

An option that is added is on the command line, in its help, in job.toml and on the reference page.
Whoever adds one gives the settings of its section a field, and uses it.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from fabweave.core.errors import InputError
from fabweave.options.cutter_options import CUTTER_OPTIONS
from fabweave.options.cutting_options import CUTTING_OPTIONS
from fabweave.options.object_options import OBJECT_OPTIONS
from fabweave.options.option import Option

#: All options, in the order in which job.toml has them.
OPTIONS: tuple[Option, ...] = (*OBJECT_OPTIONS, *CUTTING_OPTIONS, *CUTTER_OPTIONS)

#: Files that name an option that went, and mean the same without it, are read as if they did not.
LEAVE_OUT = "leave it out"
#: Options that went, and what to do instead.
GONE: Mapping[str, str] = MappingProxyType({"qr": LEAVE_OUT})

#: Options that came later, and what a finished job meant that does not name them.
CAME: Mapping[str, str] = MappingProxyType({"walls": "both"})


def option_named(name: str) -> Option:
    """Return the option with a name.

    Examples
    --------
    >>> option_named("label_side").flag, option_named("kerf").field
    ('--label-side', 'kerf_mm')
    """
    return next(option for option in OPTIONS if option.name == name)


def option_of_field(name: str) -> Option:
    """Return the option that a field of ``Settings`` holds; the first one, of several.

    Examples
    --------
    >>> option_of_field("sheets").name
    'sheet'
    """
    return next(option for option in OPTIONS if option.field == name)


def still_known(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the options of a file that may be older, without those that went and are not missed.

    Raises
    ------
    InputError
        If it sets an option that went; the message says what to write instead.

    Examples
    --------
    >>> still_known({"mesh": "shape:cube", "qr": "paper"}, "job.toml")
    {'mesh': 'shape:cube'}
    """
    for name in table:
        if GONE.get(name, LEAVE_OUT) != LEAVE_OUT:
            raise InputError(f"{where}: there is no option {name!r}; {GONE[name]}")
    return {name: value for name, value in table.items() if name not in GONE}
