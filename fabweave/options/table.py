"""The table of options: all that the command line, job.toml, the reference and checks know.

An option that is added is on the command line, in its help, in job.toml and on the reference page.
Whoever adds one gives the settings of its section a field, and uses it.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from fabweave.options.cutter_options import CUTTER_OPTIONS
from fabweave.options.cutting_options import CUTTING_OPTIONS
from fabweave.options.object_options import OBJECT_OPTIONS
from fabweave.options.option import Option

#: All options, in the order in which job.toml has them.
OPTIONS: tuple[Option, ...] = (*OBJECT_OPTIONS, *CUTTING_OPTIONS, *CUTTER_OPTIONS)

#: Options that went; files that name one mean the same without it, and are read as if they did not.
GONE = frozenset({"qr"})

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


def still_known(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a file that may be older, without those that went.

    Examples
    --------
    >>> still_known({"mesh": "shape:cube", "qr": "paper"})
    {'mesh': 'shape:cube'}
    """
    return {name: value for name, value in table.items() if name not in GONE}
