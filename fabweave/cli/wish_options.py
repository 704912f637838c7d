"""The options with which a person says what a design should come to."""

from collections.abc import Callable
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


LENGTH = _Length()
NUMBER = click.FloatRange(0.0, 1e9, min_open=True)
WHOLE = click.IntRange(1, 10**6)


def wish(name: str, kind: Any, metavar: str, text: str) -> Callable[[Any], Any]:
    """Return what gives a command an option for a wish."""
    return click.option(
        name, cls=SectionedOption, section=WISHES, type=kind, metavar=metavar, help=text
    )
