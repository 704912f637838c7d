"""What may be typed as the value of an option, beyond the types of click."""

from importlib import import_module
from pathlib import Path
from typing import Any

import click

from fabweave.core.errors import InputError
from fabweave.core.units import parse_length
from fabweave.cut.presets import Preset, find_preset, preset_names, read_preset
from fabweave.picture.camera import View
from fabweave.stock.per_bunch import split_by_bunch
from fabweave.stock.sheet_text import parse_stock

_MAY_BE_ZERO = ("margin", "gap", "clearance", "kerf")


class Length(click.ParamType[float]):
    """A length with a unit."""

    name = "length"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read what was typed."""
        if isinstance(value, int | float):
            return float(value)
        try:
            return parse_length(
                value,
                what=param.human_readable_name if param else "length",
                zero_ok=param is not None and param.name in _MAY_BE_ZERO,
            )
        except InputError as error:
            self.fail(str(error), param, ctx)


class LengthByBunch(Length):
    """A length with a unit, or one for each bunch."""

    name = "length"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read what was typed: a number, or pairs of a bunch's name and a number."""
        if not isinstance(value, str) or "=" not in value:
            return value if isinstance(value, tuple) else super().convert(value, param, ctx)
        try:
            pairs = split_by_bunch(value, what=param.human_readable_name if param else "length")
        except InputError as error:
            self.fail(str(error), param, ctx)
        return tuple(
            (name, super(LengthByBunch, self).convert(one, param, ctx)) for name, one in pairs
        )


class Hole(Length):
    """A length, or the word none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read what was typed; none is 0."""
        return 0.0 if value == "none" else super().convert(value, param, ctx)


class LengthOrAuto(click.ParamType[Any]):
    """A length, or the word auto."""

    name = "length"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read what was typed; auto is None."""
        return None if value == "auto" else Length().convert(value, param, ctx)


class Stock(click.ParamType[Any]):
    """A sheet size with a quantity."""

    name = "WxH[:n]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read what was typed."""
        try:
            return parse_stock(value) if isinstance(value, str) else value
        except InputError as error:
            self.fail(str(error), param, ctx)


class StockList(click.ParamType[Any]):
    """A file that lists stock, or the tables that a job.toml keeps of one."""

    name = "FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read the list."""
        if isinstance(value, tuple):
            return value
        reader = import_module("fabweave.stock.stock_file")
        try:
            if isinstance(value, dict):
                return reader.stock_of(value, "the stock in job.toml")
            return reader.read_stock(Path(value))
        except InputError as error:
            self.fail(str(error), param, ctx)


class Checked(click.ParamType[str]):
    """A text that a parser of the package accepts; the parser is imported when it is needed."""

    def __init__(self, name: str, module: str, parser: str) -> None:
        self.name = name
        self._module, self._parser = module, parser

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Check what was typed."""
        try:
            getattr(import_module(self._module), self._parser)(str(value))
        except InputError as error:
            self.fail(str(error), param, ctx)
        return str(value)


class Direction(click.ParamType[Any]):
    """From where a picture is taken: two angles."""

    name = "AZIMUTH,ELEVATION"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read what was typed."""
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


class PresetName(click.ParamType[Preset]):
    """The name of a preset, a file that ends in .toml, or what a job.toml has embedded."""

    name = "NAME|FILE.toml"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Preset:
        """Read what was typed."""
        if isinstance(value, Preset):
            return value
        try:
            if isinstance(value, dict):
                return read_preset(value, "the preset in job.toml")
            return find_preset(str(value))
        except InputError as error:
            self.fail(str(error), param, ctx)


class Hairline(Length):
    """A length, or the name of a preset whose lines are as wide."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read what was typed."""
        if value in preset_names():
            return find_preset(value).hairline_mm
        return super().convert(value, param, ctx)
