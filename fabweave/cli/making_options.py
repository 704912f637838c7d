"""The options of the command line that only making a job has: holes, layout and files."""

from pathlib import Path

import click

from fabweave.app.settings import CHOICES, DXF_VERSIONS
from fabweave.cli.option_types import Checked, Hairline, Hole, Length, LengthByBunch, PresetName
from fabweave.cli.options import DEFAULTS, TARGET, TARGET_HELP, Command
from fabweave.cut.presets import DEFAULT_PRESET, preset_names

_MAKING = (
    click.option(
        "--hole",
        type=Hole(),
        metavar="LENGTH|none",
        help="Diameter of the fastener holes. [default: the largest common size that nine "
        "crossings of ten have room for]",
    ),
    click.option(
        "--slots",
        is_flag=True,
        help="Slots in place of holes in the strand that lies under, where it has no joint: they "
        "take up small errors.",
    ),
    click.option(
        "--gap",
        type=LengthByBunch(),
        help="Least distance between pieces, or by bunch: warp=2mm,weft=4mm. [default: the "
        "material's]",
    ),
    click.option(
        "--layout",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Take the layout that the crossing_map.json of a finished job records, not a new one;"
        " the pieces must be the same.",
    ),
    click.option(
        "--dxf",
        type=click.Choice(DXF_VERSIONS),
        default=DEFAULTS.dxf,
        show_default=True,
        help="Version of the DXF files; R12 for very old machines (it cannot carry units).",
    ),
    click.option(
        "--profile",
        type=click.Choice(CHOICES["profile"]),
        default=DEFAULTS.profile,
        show_default=True,
        help="Who cuts: a maker, from the nested sheets; or a service, which wants a file for each"
        " distinct piece with nothing in it but cuts, and a table of quantities: they come "
        "besides the sheets, in the folder service.",
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
        help="Width of the lines in the SVG, e.g. 0.1mm or 0.001in, or as a preset has it: drivers"
        " cut thin lines and take thicker ones for pictures. [default: the preset's, 0.025mm]",
    ),
    click.option(
        "--target",
        type=TARGET,
        default=DEFAULTS.target,
        show_default=True,
        help=TARGET_HELP,
    ),
    click.option(
        "--strict",
        is_flag=True,
        help="Refuse a job that breaks a rule of the material or the target.",
    ),
    click.option(
        "--labels",
        type=click.Choice(CHOICES["labels"]),
        default=DEFAULTS.labels,
        show_default=True,
        help="What is engraved: full (id, arrow, joints, who crosses over or under), numbers (the "
        "pieces' ids alone), or none.",
    ),
    click.option(
        "--label-side",
        type=click.Choice(CHOICES["label_side"]),
        default=DEFAULTS.label_side,
        show_default=True,
        help="Which face is engraved; for the inside, which nobody sees, whole sheets are "
        "mirrored.",
    ),
    click.option(
        "--kerf",
        type=Length(),
        help="Width of the line that the beam burns: the sheets to cut, with outlines moved "
        "outward and holes inward by half of it, go to the folder cut; those in sheets stay "
        "nominal. Leave it out for services, which take it off themselves. [default: none "
        "taken off]",
    ),
    click.option(
        "--micro-joints",
        type=Checked("N[:WIDTH]", "fabweave.cut.micro_joints", "parse_micro_joints"),
        metavar="N[:WIDTH]",
        help="Leave so many bridges in each outline, 0.25 mm wide unless said, so that pieces stay"
        " in the sheet until they are broken out; in the sheets of the folder cut. [default: "
        "none]",
    ),
    click.option(
        "--cut-order",
        type=click.Choice(CHOICES["cut_order"]),
        default=DEFAULTS.cut_order,
        show_default=True,
        help="Order of the pieces on a sheet: with short ways from one to the next, or cool, where"
        " no piece follows its neighbour, for what warps or melts.",
    ),
    click.option(
        "--template",
        type=click.Choice(CHOICES["template"]),
        default=DEFAULTS.template,
        show_default=True,
        help="Sheets at full size as PDF, to cut by hand: on a page as large as the sheet, or "
        "tiled on paper to be pasted together.",
    ),
    click.option(
        "--paper",
        type=click.Choice(CHOICES["paper"]),
        default=DEFAULTS.paper,
        show_default=True,
        help="Paper of the assembly manual.",
    ),
)


def making_options(command: Command) -> Command:
    """Give a command the options that decide holes, layout and files."""
    for option in reversed(_MAKING):
        command = option(command)
    return command
