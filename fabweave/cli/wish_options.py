"""The options with which a person says what a design should come to."""

from typing import Any

import click

from fabweave.cli.options import WISHES, SectionedOption
from fabweave.core.errors import InputError
from fabweave.core.units import parse_length


class _Length(click.ParamType[float]):
    """A length with its unit, in millimetres."""

    name = "length"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read what was typed."""
        try:
            found = parse_length(str(value))
        except InputError as error:
            self.fail(str(error), param, ctx)
        if not 0.0 < found <= 1e6:
            self.fail(f"{value} is no length that anybody can wish for", param, ctx)
        return found


_NUMBER = click.FloatRange(0.0, 1e9, min_open=True)
_WHOLE = click.IntRange(1, 10**6)
#: Each wish: the option, the field of ``Wishes``, what it takes, and its help.
_WISHES = (
    ("--pieces", "pieces", _WHOLE, "N", "Look for a design of about so many pieces."),
    ("--ribbon", "ribbon_mm", _Length(), "LENGTH",
     "Look for one with ribbons about so wide, such as 15mm."),
    ("--hours", "hours", _NUMBER, "HOURS",
     "Look for one that is put together in so many hours at most."),
    ("--sheets", "sheets", _WHOLE, "N", "Look for one on so many sheets at most."),
    ("--budget", "budget", _NUMBER, "MONEY",
     "Look for one whose sheets and hardware cost so much at most."),
    ("--likeness", "likeness_mm", _Length(), "LENGTH",
     "Look for one that is nowhere farther from the model."),
)  # fmt: skip


def wish_options(command: Any) -> Any:
    """Give a command the options for wishes."""
    for flag, field, kind, metavar, text in reversed(_WISHES):
        command = click.option(
            flag,
            field,
            cls=SectionedOption,
            section=WISHES,
            type=kind,
            metavar=metavar,
            help=text,
        )(command)
    return command


def wished(options: dict[str, Any]) -> dict[str, Any]:
    """Take the wishes out of what was typed, by the fields of ``Wishes``."""
    return {field: options.pop(field) for _, field, *_ in _WISHES}
