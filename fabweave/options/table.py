"""The table of options: all that the command line, job.toml, the reference and checks know.

An option that is added is on the command line, in its help, in job.toml, in the command of the QR
code and on the reference page. Whoever adds one gives the settings of its section a field, and
uses it.
"""

from fabweave.options.cutter_options import CUTTER_OPTIONS
from fabweave.options.cutting_options import CUTTING_OPTIONS
from fabweave.options.object_options import OBJECT_OPTIONS
from fabweave.options.option import Option

#: All options, in the order in which job.toml has them.
OPTIONS: tuple[Option, ...] = (*OBJECT_OPTIONS, *CUTTING_OPTIONS, *CUTTER_OPTIONS)


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
