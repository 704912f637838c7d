"""The command line. This is the only module that prints."""

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from fabweave import __version__
from fabweave.errors import CannotMakeError, FabweaveError, InputError
from fabweave.settings import (
    BOUNDARIES,
    DXF_VERSIONS,
    EFFORTS,
    PATTERNS,
    JobSettings,
    read_job_options,
)
from fabweave.sheet.stock import parse_stock
from fabweave.units import parse_length


class _Length(click.ParamType[float]):
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


class _Hole(_Length):
    """A length, or the word none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read what was typed; none is 0."""
        return 0.0 if value == "none" else super().convert(value, param, ctx)


class _Stock(click.ParamType[Any]):
    """A sheet size with a quantity."""

    name = "WxH[:n]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read what was typed."""
        try:
            return parse_stock(value) if isinstance(value, str) else value
        except InputError as error:
            self.fail(str(error), param, ctx)


_MAY_BE_ZERO = ("margin", "gap", "clearance")
_DEFAULTS = JobSettings(mesh="")


def _load_config(ctx: click.Context, _param: click.Parameter, value: Path | None) -> Path | None:
    """Take defaults from a job.toml; what is typed wins."""
    if value is not None:
        options = read_job_options(value)
        known = {param.name for param in ctx.command.params}
        unknown = sorted(set(options) - known)
        if unknown:
            raise InputError(
                f"{value} sets {len(unknown)} unknown options: {', '.join(unknown)}; "
                f"known are {', '.join(sorted(name for name in known if name))}"
            )
        ctx.default_map = options
    return value


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="fabweave")
def cli() -> None:
    """Turn a polygon mesh into a woven object that a person can cut and assemble.

    Try:  fabweave make "shape:torus?m=24&n=12" --size 300mm -o out
    """


@cli.command()
@click.argument("mesh", required=False)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    required=True,
    help="Folder for the finished job. An older job there is replaced, when the new "
    "one is complete; a folder with anything else in it is left alone.",
)
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    is_eager=True,
    callback=_load_config,
    help="Take the settings of a finished job's job.toml; other options win over it.",
)
@click.option(
    "--size",
    type=_Length(),
    help="Scale the mesh so that its largest dimension is "
    "this, e.g. 400mm or 16in. Without it the mesh's numbers are millimetres.",
)
@click.option("--scale", type=float, help="Multiply the mesh by this instead of using --size.")
@click.option(
    "--pattern",
    type=click.Choice(PATTERNS),
    default=_DEFAULTS.pattern,
    show_default=True,
    help="How strands go over and under.",
)
@click.option(
    "--boundary",
    type=click.Choice(BOUNDARIES),
    default=_DEFAULTS.boundary,
    show_default=True,
    help="What threads do at the boundary of an open mesh: end there, or turn back as in a "
    "plaited mat, which then has no loose ends.",
)
@click.option(
    "--material",
    default=_DEFAULTS.material,
    show_default=True,
    help="What it is cut from; fabweave materials lists them.",
)
@click.option(
    "--thickness",
    type=_Length(),
    help="Measured thickness, where it is not the material's nominal one.",
)
@click.option(
    "--width",
    type=float,
    default=_DEFAULTS.width,
    show_default=True,
    help="Width of the ribbons relative to the room they have, between 0 and 1: "
    "smaller leaves larger gaps, larger leaves more room for holes.",
)
@click.option(
    "--crossing",
    type=float,
    default=_DEFAULTS.crossing,
    show_default=True,
    help="Length of the flat panel at each crossing relative to the room it has; "
    "at least the width.",
)
@click.option(
    "--clearance",
    type=_Length(),
    default=_DEFAULTS.clearance_mm,
    show_default=True,
    help="Air between two layers at a crossing, mm.",
)
@click.option(
    "--max-length",
    type=_Length(),
    help="No piece is longer along its middle. [default: half of the sheet's longer usable side]",
)
@click.option(
    "--hole",
    type=_Hole(),
    metavar="LENGTH|none",
    help="Diameter of the fastener "
    "holes. [default: the largest common size that nine crossings of ten have room for]",
)
@click.option(
    "--sheet",
    type=_Stock(),
    multiple=True,
    help="Sheet stock, e.g. 600x400mm, or "
    "24x18in:3 for three of them; repeat it for several sizes. [default: the material's]",
)
@click.option(
    "--margin",
    type=_Length(),
    default=_DEFAULTS.margin_mm,
    show_default=True,
    help="Border of each sheet that stays empty, mm.",
)
@click.option(
    "--gap", type=_Length(), help="Least distance between pieces. [default: the material's]"
)
@click.option(
    "--effort",
    type=click.Choice(EFFORTS),
    default=_DEFAULTS.effort,
    show_default=True,
    help="How hard to try to save material.",
)
@click.option(
    "--seed",
    type=int,
    default=_DEFAULTS.seed,
    show_default=True,
    help="Same seed, same settings, same files.",
)
@click.option(
    "--dxf",
    type=click.Choice(DXF_VERSIONS),
    default=_DEFAULTS.dxf,
    show_default=True,
    help="Version of the DXF files; R12 for very old machines (it cannot carry units).",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
def make(output: Path, as_json: bool, quiet: bool, mesh: str | None, **options: Any) -> None:
    r"""Weave MESH, a file or a shape:NAME, and write everything that is needed to cut it.

    \b
    MESH  an OBJ, OFF, PLY, STL, GLB or 3MF file, or a built-in shape such as
          "shape:torus?m=24&n=12" (fabweave shapes lists them)

    \b
    Example:
      fabweave make spot.obj --size 400mm --material card --sheet 600x400mm -o out
    """
    # Heavy imports wait until there is work to do, so that --help is quick.
    from fabweave.folder import run_job  # noqa: PLC0415

    settings = _settings(mesh, options)
    with _progress(quiet or as_json) as progress:
        job, proof = run_job(settings, output, progress, workers=os.cpu_count() or 1)
    if quiet:
        return
    names = [drawing.name for drawing in job.drawings]
    if as_json:
        totals = {
            "directory": str(output),
            "threads": job.weave.threads.n_threads,
            "crossings": job.weave.threads.n_crossings,
            "pieces": len(job.made.pieces),
            "joints": len(job.made.joints),
            "sheets": names,
            "proved": True,
            "notes": list(job.notes),
        }
        click.echo(json.dumps(totals, indent=1))
        return
    console = Console(highlight=False, soft_wrap=True)
    for note in job.notes:
        console.print(f"  {note}", markup=False)
    console.print(
        f"{len(job.made.pieces)} pieces, {len(job.made.joints)} joints, {len(names)} sheets; "
        f"proved by {len(proof.checks)} checks of the written files",
        markup=False,
    )
    console.print(f"Sheets: {output / 'sheets'}   Material: {output / 'waste.html'}", markup=False)


def _settings(mesh: str | None, options: dict[str, Any]) -> JobSettings:
    """Turn the options of the command line into settings."""
    config = options.pop("config")
    if not mesh:
        mesh = (click.get_current_context().default_map or {}).get("mesh")
    if not mesh:
        raise InputError("no mesh: name a file, or a shape such as shape:torus?m=24&n=12")
    if config and not mesh.startswith("shape:") and not Path(mesh).exists():
        beside = Path(config).parent / mesh
        mesh = str(beside) if beside.exists() else mesh
    return JobSettings(
        mesh=mesh,
        size_mm=options["size"],
        scale=options["scale"],
        pattern=options["pattern"],
        boundary=options["boundary"],
        material=options["material"],
        thickness_mm=options["thickness"],
        width=options["width"],
        crossing=options["crossing"],
        clearance_mm=options["clearance"],
        max_length_mm=options["max_length"],
        hole_mm=options["hole"],
        sheets=tuple(options["sheet"]),
        margin_mm=options["margin"],
        gap_mm=options["gap"],
        effort=options["effort"],
        seed=options["seed"],
        dxf=options["dxf"],
    )


@cli.command()
@click.argument("directory", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing; the exit code tells.")
def verify(directory: Path, as_json: bool, quiet: bool) -> None:
    """Read the files of a finished job back and prove that they rebuild the weave.

    Exit code 0: every check holds. 1: some do not, and each says what it found.
    """
    from fabweave.folder import folder_is_readable  # noqa: PLC0415
    from fabweave.verify import verify_job  # noqa: PLC0415

    folder_is_readable(directory)
    with _progress(quiet or as_json) as progress:
        progress("verify", 0, 1)
        proof = verify_job(directory)
    if as_json:
        click.echo(json.dumps(proof.to_json(), indent=1))
    elif not quiet:
        console = Console(highlight=False)
        table = Table("check", "", "checked", "worst", "what it proves", box=None)
        for check in proof.checks:
            worst = "" if check.worst is None else f"{check.worst:.2g}"
            mark = "[green]ok[/]" if check.ok else "[red]FAILS[/]"
            table.add_row(check.name, mark, str(check.count), worst, check.meaning)
        console.print(table)
        for check in proof.checks:
            for finding in check.findings:
                console.print(f"{check.name}: {finding}", markup=False, soft_wrap=True)
    if not proof.ok:
        sys.exit(1)


@cli.command()
def shapes() -> None:
    """List the built-in shapes and their parameters."""
    from fabweave.mesh.shapes import SHAPES  # noqa: PLC0415

    for shape in SHAPES:
        click.echo(f"{shape.example}\n    {shape.text}")


@cli.command()
def materials() -> None:
    """List the material library."""
    from fabweave.sheet.material import material_library  # noqa: PLC0415

    table = Table("name", "material", "thickness, mm", "gap, mm", "sheet, mm", box=None)
    for material in material_library():
        wide, high = material.sheet_mm
        table.add_row(
            material.name,
            material.title,
            f"{material.thickness_mm:g}",
            f"{material.gap_mm:g}",
            f"{wide:g} × {high:g}",
        )
    Console(highlight=False).print(table)


@contextmanager
def _progress(silent: bool) -> Iterator[Callable[[str, int, int], None]]:
    """Show what is being done on the error stream, or nothing."""
    if silent:
        yield lambda _what, _done, _total: None
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("start", total=1)

        def report(what: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=max(total, 1))

        yield report


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exit with 0, 1 (cannot be made) or 2 (wrong usage or input)."""
    errors = Console(stderr=True, highlight=False, soft_wrap=True)
    try:
        cli.main(arguments, standalone_mode=False)
    except click.exceptions.Abort:
        errors.print("stopped; nothing was written", markup=False)
        sys.exit(130)
    except KeyboardInterrupt:
        errors.print("stopped; nothing was written", markup=False)
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except FabweaveError as error:
        errors.print(f"fabweave: {error}", markup=False)
        sys.exit(1 if isinstance(error, CannotMakeError) else 2)
