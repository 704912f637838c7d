"""What may be typed as the value of an option that is not in the table."""

from typing import Any

import click

from fabweave.core.errors import InputError
from fabweave.core.messages import shown
from fabweave.core.units import parse_length


class Length(click.ParamType[float]):
    """A length with a unit."""

    name = "length"

    def __init__(self, most_mm: float) -> None:
        self.most_mm = most_mm

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read what was typed."""
        what = param.human_readable_name if param else "length"
        try:
            length = value if isinstance(value, int | float) else parse_length(value, what=what)
            if not 0.001 <= length <= self.most_mm:
                raise InputError(  # noqa: TRY301 -- told as the other
                    f"{what} {shown(value)} is not from 0.001 to {self.most_mm:g} mm"
                )
            return float(length)
        except InputError as error:
            self.fail(str(error), param, ctx)


class Direction(click.ParamType[Any]):
    """From where a picture is taken: two angles."""

    name = "AZIMUTH,ELEVATION"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read what was typed."""
        from fabweave.picture.camera import View

        if not isinstance(value, str):
            return value
        try:
            azimuth, elevation = map(float, value.split(","))
            view = View(azimuth, elevation)
            view.axes()
        except ValueError as error:  # an InputError is a ValueError, too
            told = str(error) if isinstance(error, InputError) else "write it as -60,30 (degrees)"
            self.fail(f"{value[:40]!r} is no view: {told}", param, ctx)
        return view
