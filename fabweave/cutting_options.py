"""The options of the command line that decide what the files for the cutter look like."""

from typing import Any

import click

from fabweave.cut.presets import DEFAULT_PRESET, Preset, find_preset, preset_names, read_preset
from fabweave.errors import InputError
from fabweave.options import DEFAULTS, Command, Length
from fabweave.settings import CHOICES


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


_CUTTING = (
    click.option(
        "--profile",
        type=click.Choice(CHOICES["profile"]),
        default=DEFAULTS.profile,
        show_default=True,
        help="Who cuts: a maker, from the nested sheets; or a service, which wants a file for each "
        "distinct piece with nothing in it but cuts, and a table of quantities: they come besides "
        "the sheets, in the folder service.",
    ),
    click.option(
        "--preset",
        type=PresetName(),
        metavar="NAME|FILE.toml",
        default=DEFAULT_PRESET,
        show_default=True,
        help=f"Colours of the layers, as a program knows them: {', '.join(preset_names())}; or a "
        "file of your own (the README shows one), which job.toml then holds.",
    ),
    click.option(
        "--svg-units",
        type=click.Choice(CHOICES["svg_units"]),
        default=DEFAULTS.svg_units,
        show_default=True,
        help="What a coordinate of the SVG counts: millimetres; or pixels of 1/96 inch, for "
        "programs that open the others at a wrong size.",
    ),
    click.option(
        "--hairline",
        type=Hairline(),
        metavar="LENGTH|NAME",
        help="Width of the lines in the SVG, e.g. 0.1mm or 0.001in, or as a preset has it: drivers "
        "cut thin lines and take thicker ones for pictures. [default: the preset's, 0.025mm]",
    ),
)


def cutting_options(command: Command) -> Command:
    """Give a command the options that decide the files for the cutter."""
    for option in reversed(_CUTTING):
        command = option(command)
    return command
