"""The options of the command line that several commands share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import click
from click.core import ParameterSource

from fabweave.app.settings import (
    BOUNDARIES,
    EFFORTS,
    OPTION_NAMES,
    UPS,
    Settings,
    read_job_options,
)
from fabweave.cli.option_types import Checked, Length, LengthByBunch, LengthOrAuto, Stock, StockList
from fabweave.core.errors import InputError
from fabweave.cut.micro_joints import MicroJoints, parse_micro_joints
from fabweave.picture.thread_colours import STRATEGIES
from fabweave.ribbon.width import parse_width

Command: TypeAlias = Callable[..., Any]


DEFAULTS = Settings(mesh="")


def load_config(ctx: click.Context, _param: click.Parameter, value: Path | None) -> Path | None:
    """Take defaults from a job.toml; what is typed wins."""
    if value is not None:
        options = read_job_options(value)
        unknown = sorted(set(options) - OPTION_NAMES)
        if unknown:
            raise InputError(
                f"{value} sets {len(unknown)} unknown options: {', '.join(unknown)}; "
                f"known are {', '.join(sorted(OPTION_NAMES))}"
            )
        ctx.default_map = options
    return value


TARGET = Checked("NAME", "fabweave.cut.preflight.targets", "target_named")
TARGET_HELP = (
    "Whose rules for holes, webs, gaps and sizes the pieces are checked against: default (rules of "
    "practice), cutitout, cutlasercut, fictiv, gosnapcut or snijlab."
)

#: What decides the mesh, the weave and the ribbons, and so belongs to making and to inspecting.
_WEAVING = (
    click.argument("mesh", required=False),
    click.option(
        "--config",
        type=click.Path(path_type=Path),
        metavar="FILE",
        is_eager=True,
        callback=load_config,
        help="Take the settings of a finished job from its job.toml; what is typed wins.",
    ),
    click.option(
        "--up",
        type=click.Choice(UPS),
        default=DEFAULTS.up,
        show_default=True,
        help="Which axis of the mesh points up; the mesh is turned so that it becomes z. Many "
        "models have y up, and lie on their back in pictures unless that is said.",
    ),
    click.option(
        "--size",
        type=Length(),
        help="Scale the mesh so that its largest dimension is "
        "this, e.g. 400mm or 16in. Without it the mesh's numbers are millimetres.",
    ),
    click.option(
        "--scale",
        type=float,
        metavar="FACTOR",
        help="Multiply the mesh by this instead of using --size.",
    ),
    click.option(
        "--remesh",
        type=Checked("quads[:N]", "fabweave.mesh.remesh.quads", "parse_remesh"),
        metavar="quads[:N]",
        help="Make a mesh of quads first, about N of them; without N as many as the triangles pair "
        "up to, or else half as many as triangles, at most 3000. Twill wants quads.",
    ),
    click.option(
        "--refine",
        type=Checked("SCHEME:STEPS", "fabweave.mesh.subdivide.refine", "parse_refinements"),
        help="Refine the mesh first, e.g. catmull-clark:2, or simplest:1,catmull-clark:1. Schemes "
        "that round the shape: catmull-clark, doo-sabin, simplest, sqrt3, loop; that keep it: "
        "mid-edge, quads.",
    ),
    click.option(
        "--fair",
        type=click.IntRange(0, 1000),
        default=DEFAULTS.fair,
        show_default=True,
        help="Move the vertices along the surface in so many steps, such as 50, so that threads "
        "run straighter and narrow ribbons find room. Sharp edges stay; a coarse mesh loses some "
        "shape, so refine it first.",
    ),
    click.option(
        "--pattern",
        type=Checked("PATTERN", "fabweave.weave.weave_pattern", "parse_pattern"),
        default=DEFAULTS.pattern,
        show_default=True,
        help="How strands go over and under: plain (on every mesh); twill (2/2, exact where one "
        "exists, else as near as can be found); triaxial (exact on every mesh, which is first "
        "subdivided); or, where warp and weft exist, a twill such as 3/1 or 2/2/1 (over, under, "
        "shift) or a satin such as satin:5/2 (repeat, shift).",
    ),
    click.option(
        "--boundary",
        type=click.Choice(BOUNDARIES),
        default=DEFAULTS.boundary,
        show_default=True,
        help="What threads do at the boundary of an open mesh: end there, or turn back as in a "
        "plaited mat, which then has no loose ends.",
    ),
    click.option(
        "--material",
        metavar="NAME",
        default=DEFAULTS.material,
        show_default=True,
        help="What it is cut from; fabweave materials lists all. For each bunch its own: "
        "warp=card,weft=birch-veneer, or by number (0=card,1=card,2=birch-veneer) where there are "
        "more than two. What is equal is nested together; card:red and card:blue are not.",
    ),
    click.option(
        "--thickness",
        type=LengthByBunch(),
        help="Measured thickness, such as 0.5mm, or by bunch: warp=0.5mm,weft=0.8mm. "
        "[default: the material's]",
    ),
    click.option(
        "--width",
        type=Checked("WIDTH", "fabweave.ribbon.width", "parse_width"),
        default=str(DEFAULTS.width),
        show_default=True,
        help="Width of the ribbons: a share of the room they have, such as 0.65 (smaller leaves "
        "larger gaps, larger leaves more room for holes); one width, such as 12mm; or bounds, such "
        "as 6mm..14mm or 0.5,6mm..14mm. auto, alone (then it is 0.65) or before any of them as in "
        "auto,12mm, makes ribbons narrower where they would come too near to one another.",
    ),
    click.option(
        "--smooth",
        type=click.IntRange(0, 50),
        default=DEFAULTS.smooth,
        show_default=True,
        help="Cross-lines between two crossings: more make rounder ribbons and outlines, 0 leaves "
        "two flat triangles there.",
    ),
    click.option(
        "--crossing",
        type=float,
        default=DEFAULTS.crossing,
        show_default=True,
        help="Length of the flat panel at each crossing relative to the room it has; "
        "at least the width.",
    ),
    click.option(
        "--clearance",
        type=Length(),
        default=DEFAULTS.clearance_mm,
        show_default=True,
        help="Air between two layers at a crossing, mm.",
    ),
    click.option(
        "--max-length",
        type=LengthOrAuto(),
        help="No piece is longer along its middle; or auto: what several lengths come to in sheet "
        "and joints is predicted, and the one at the knee of that curve taken. [default: auto]",
    ),
    click.option(
        "--joint",
        type=Checked("KIND", "fabweave.flat.joint.kinds", "parse_joint"),
        default=DEFAULTS.joint,
        show_default=True,
        help="How pieces of one thread are joined: rivet (a lap with a fastener under the strand "
        "above), rivet:2 to rivet:4 (so many), glue (a lap with marks to lay it by), dovetail (a "
        "tongue in a socket, flush), slot (a tab through a slot), or none (end to end, taped).",
    ),
    click.option(
        "--lap",
        type=LengthOrAuto(),
        metavar="LENGTH|auto",
        help="How far joined pieces lap; no farther than to the crossings beside. "
        "[default: auto, the crossing's own panel]",
    ),
    click.option(
        "--sheet",
        type=Stock(),
        metavar="WxH[:N]",
        multiple=True,
        help="Sheet stock, e.g. 600x400mm, or "
        "24x18in:3 for three of them; repeat it for several sizes. For one bunch only: "
        "weft=600x400mm. [default: the material's]",
    ),
    click.option(
        "--stock",
        type=StockList(),
        metavar="FILE",
        help="A list of the stock (stock.toml): sheets with quantity, price, grain, material and "
        "defects, and offcuts with their outlines. Offcuts are used first, the smallest first; "
        "then the sheets that cost least for their area; sheets without a price, and those of "
        "--sheet, come last. The last sheet is exchanged for the cheapest that takes its pieces.",
    ),
    click.option(
        "--rotations",
        type=Checked("RULE", "fabweave.stock.rotations", "parse_rotations"),
        default=DEFAULTS.rotations,
        show_default=True,
        help="At which angles pieces stand on a sheet: free; 90 or 180 (multiples of that, from "
        "the grain on); or grain:5deg (their length along the grain, up to 5 degrees off). Grain "
        "runs along a sheet's width unless the list of stock says otherwise.",
    ),
    click.option(
        "--margin",
        type=Length(),
        default=DEFAULTS.margin_mm,
        show_default=True,
        help="Border of each sheet that stays empty, mm.",
    ),
    click.option(
        "--effort",
        type=click.Choice(EFFORTS),
        default=DEFAULTS.effort,
        show_default=True,
        help="How long to search: for layouts that save material, and for the best twill where "
        "none is exact.",
    ),
    click.option(
        "--seed",
        type=int,
        default=DEFAULTS.seed,
        show_default=True,
        help="Of all random choices: same seed, same settings, same files.",
    ),
    click.option(
        "--colours",
        type=click.Choice(STRATEGIES),
        default=DEFAULTS.colours,
        show_default=True,
        help="Colours of the threads in model.glb and in inspect's picture: safe for the "
        "colour-blind, the whole circle of hues, or a small range of them.",
    ),
)


def weaving_options(command: Command) -> Command:
    """Give a command the mesh and the options that decide its weave."""
    for option in reversed(_WEAVING):
        command = option(command)
    return command


def _layout(options: dict[str, Any]) -> str | None:
    """Return the file that holds the layout: one that a job.toml names lies beside it."""
    path, config = options.get("layout"), options["config"]
    if path is None:
        return None
    source = click.get_current_context().get_parameter_source("layout")
    if config and source is ParameterSource.DEFAULT_MAP:
        path = Path(config).parent / path
    return str(path)


def _micro_joints(text: str | None) -> MicroJoints | None:
    """Return the micro-joints asked for."""
    return None if text is None else parse_micro_joints(text)


def job_settings(mesh: str | None, options: dict[str, Any]) -> Settings:
    """Turn the options of the command line into settings."""
    config = options["config"]
    if not mesh:
        mesh = (click.get_current_context().default_map or {}).get("mesh")
    if not mesh:
        raise InputError("no mesh: name a file, or a shape such as shape:torus?m=24&n=12")
    if config and not mesh.startswith("shape:") and not Path(mesh).exists():
        beside = Path(config).parent / mesh
        mesh = str(beside) if beside.exists() else mesh
    return Settings(
        mesh=mesh,
        up=options["up"],
        size_mm=options["size"],
        scale=options["scale"],
        remesh=options["remesh"],
        refine=options["refine"],
        fair=options["fair"],
        pattern=options["pattern"],
        boundary=options["boundary"],
        material=options["material"],
        thickness_mm=options["thickness"],
        width=parse_width(options["width"]),
        smooth=options["smooth"],
        crossing=options["crossing"],
        clearance_mm=options["clearance"],
        max_length_mm=options["max_length"],
        hole_mm=options.get("hole"),
        joint=options["joint"],
        lap_mm=options["lap"],
        slots=options.get("slots", False),
        sheets=(*(options["stock"] or ()), *options["sheet"]),
        margin_mm=options["margin"],
        gap_mm=options.get("gap"),
        rotations=options["rotations"],
        effort=options["effort"],
        seed=options["seed"],
        layout=_layout(options),
        colours=options["colours"],
        profile=options.get("profile", DEFAULTS.profile),
        preset=options.get("preset", DEFAULTS.preset),
        dxf=options.get("dxf", DEFAULTS.dxf),
        svg_units=options.get("svg_units", DEFAULTS.svg_units),
        hairline_mm=options.get("hairline"),
        target=options.get("target", DEFAULTS.target),
        strict=options.get("strict", DEFAULTS.strict),
        labels=options.get("labels", DEFAULTS.labels),
        label_side=options.get("label_side", DEFAULTS.label_side),
        paper=options.get("paper", DEFAULTS.paper),
        kerf_mm=options.get("kerf") or 0.0,
        micro_joints=_micro_joints(options.get("micro_joints")),
        cut_order=options.get("cut_order", DEFAULTS.cut_order),
        template=options.get("template", DEFAULTS.template),
    )
