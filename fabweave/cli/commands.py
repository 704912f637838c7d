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
from rich.text import Text

from fabweave import __version__
from fabweave.cli.guide import guide
from fabweave.cli.making_options import making_options
from fabweave.cli.option_types import Direction, Length
from fabweave.cli.options import TARGET, TARGET_HELP, job_settings, weaving_options
from fabweave.cli.sections import SectionedCommand
from fabweave.core.errors import CannotMakeError, FabweaveError
from fabweave.core.messages import agree
from fabweave.core.output_files import check_file, write_files
from fabweave.core.parallel.interrupt import held_back
from fabweave.picture.camera import View


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="fabweave")
def cli() -> None:
    """Turn a polygon mesh into a woven object that a person can cut and assemble.

    Try:  fabweave make "shape:torus?m=24&n=12" --size 300mm -o out
    """


@cli.command(cls=SectionedCommand)
@weaving_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="DIR",
    required=True,
    help="Folder for the finished job. An older job there is replaced, when the new "
    "one is complete; a folder with anything else in it is left alone.",
)
@making_options
@click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Nest very many pieces on the Dask cluster whose scheduler has this address, such as "
    "tcp://192.168.1.20:8786; needs the extra cluster. The files are the same. [default: the "
    "processors of this computer]",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
def make(
    output: Path,
    cluster: str | None,
    as_json: bool,
    quiet: bool,
    mesh: str | None,
    **options: Any,
) -> None:
    """Weave MESH, a file or a shape:NAME, and write everything that is needed to cut it.

    MESH is an OBJ, OFF, PLY, STL, GLB or 3MF file, or a built-in shape such as
    "shape:torus?m=24&n=12" (fabweave shapes lists them). What can be woven on it,
    fabweave inspect MESH tells first.

    \b
    Examples:
      fabweave make "shape:torus?m=24&n=12" --size 400mm --pattern twill -o torus
      fabweave make spot.obj --size 400mm --material card --sheet 600x400mm -o spot
      fabweave make scan.stl --size 50cm --remesh quads:800 --pattern twill -o scan
      fabweave make cube.obj --size 300mm --refine catmull-clark:2 -o ball
    """  # noqa: D301 - click wants a true backspace, and keeps the lines after it apart
    # Here and below, heavy imports wait until there is work to do, so that --help is quick. Some
    # that Ctrl-C interrupts fail in ways of their own, or go on as if nothing had been.
    with held_back():
        from fabweave.app.pipeline import run_job  # noqa: PLC0415
        from fabweave.core.parallel.cluster import cluster_at  # noqa: PLC0415
        from fabweave.cut.preflight.violations import flaw_lines  # noqa: PLC0415

    settings = job_settings(mesh, options)
    executors = None if cluster is None else cluster_at(cluster)
    with _progress(quiet or as_json) as progress:
        job, proof, found = run_job(
            settings, output, progress, workers=os.cpu_count() or 1, executors=executors
        )
    if quiet:
        return
    names = [drawing.name for drawing in job.drawings]
    if as_json:
        totals = {
            "directory": str(output),
            "threads": job.weave.threads.n_threads,
            "crossings": job.weave.threads.n_crossings,
            "pieces": len(job.piece_set.pieces),
            "joints": len(job.piece_set.joints),
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
        f"{agree(len(job.piece_set.pieces), '{n} piece[|s]')}, "
        f"{agree(len(job.piece_set.joints), '{n} joint[|s]')}, "
        f"{agree(len(names), '{n} sheet[|s]')}; "
        f"proved by {len(proof.checks)} checks of the written files",
        markup=False,
    )
    # Widths and bends are among the notes already.
    told = [flaw for flaw in found.flaws if flaw.rule not in ("width", "bend")]
    for line in flaw_lines(tuple(told)) if found.flaws else [found.all_clear]:
        console.print(f"preflight: {line}", markup=False)
    if job.offcuts:
        console.print(
            f"{agree(len(job.offcuts), '{n} offcut[ is|s are]')} worth keeping: --stock "
            f"{output / 'offcuts' / 'stock.toml'} takes them first in a later job",
            markup=False,
        )
    console.print(f"Sheets: {output / 'sheets'}   Material: {output / 'waste.html'}", markup=False)


@cli.command()
@click.argument("directory", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing; the exit code tells.")
def verify(directory: Path, as_json: bool, quiet: bool) -> None:
    """Read the files of a finished job back and prove that they rebuild the weave.

    Exit code 0: every check holds. 1: some do not, and each says what it found.
    """
    with held_back():
        from fabweave.app.job_folder import folder_is_readable  # noqa: PLC0415
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
@click.argument("directory", type=click.Path(path_type=Path))
@click.option(
    "--target", type=TARGET, metavar="NAME", help=f"{TARGET_HELP} [default: the job's own]"
)
@click.option("--strict", is_flag=True, help="Exit with 1 if any rule is broken.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing; with --strict, the code tells.")
def preflight(
    directory: Path, target: str | None, strict: bool, as_json: bool, quiet: bool
) -> None:
    """Check a finished job's pieces against the rules of its material and of who cuts it.

    Least holes, their distance to edges, webs, gaps, sizes, short sides, narrow ribbons and tight
    bends; each finding says on which piece, where on its sheet, what is asked for, and what
    would help.
    """
    with held_back():
        from fabweave.app.job_folder import folder_is_readable  # noqa: PLC0415
        from fabweave.app.preflight_job import preflight_job  # noqa: PLC0415
        from fabweave.cut.preflight.violations import flaw_lines  # noqa: PLC0415

    folder_is_readable(directory)
    found = preflight_job(directory, target)
    if as_json:
        click.echo(json.dumps(found.record, indent=1))
    elif not quiet:
        for line in flaw_lines(found.flaws):
            click.echo(line)
        if not found.flaws:
            click.echo(found.all_clear)
    if strict and found.flaws:
        sys.exit(1)


@cli.command(cls=SectionedCommand)
@weaving_options
@click.option(
    "--png",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write a picture: the mesh with its irregular vertices, and the woven object.",
)
@click.option(
    "--pd",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the link that the threads form as a planar diagram code (PD), for knot theory; "
    "closed meshes of genus 0 only.",
)
@click.option(
    "--gauss",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the signed Gauss code of the threads, a line each, for knot theory; meshes of any "
    "genus.",
)
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def inspect(
    png: Path | None,
    pd: Path | None,
    gauss: Path | None,
    as_json: bool,
    mesh: str | None,
    **options: Any,
) -> None:
    """Tell what MESH is, whether it can be woven in twill, and what would make it so.

    Options that change the mesh, its weave or its ribbons are those of fabweave make, so that each
    can be tried here first.

    \b
    Examples:
      fabweave inspect spot.obj --size 400mm --png spot.png
      fabweave inspect scan.stl --size 50cm --remesh quads:800
      fabweave inspect shape:tetrahedron --pd rings.txt
    """  # noqa: D301 - click wants a true backspace, and keeps the lines after it apart
    with held_back():
        from fabweave.app.inspection import inspect_mesh  # noqa: PLC0415
        from fabweave.app.inspection_files import (  # noqa: PLC0415
            inspection_gauss,
            inspection_link,
            inspection_picture,
        )
        from fabweave.app.inspection_text import inspection_text  # noqa: PLC0415
        from fabweave.picture.object_picture import png_bytes  # noqa: PLC0415

    settings = job_settings(mesh, options)
    for path, suffix in ((png, ".png"), (pd, ""), (gauss, "")):
        if path is not None:
            check_file(path, suffix)
    with _progress(as_json) as progress:
        found = inspect_mesh(settings, progress)
        files: dict[Path, bytes] = {}
        if pd is not None:
            files[pd] = inspection_link(found).encode()
        if gauss is not None:
            files[gauss] = inspection_gauss(found).encode()
        if png is not None:
            progress("picture", 0, 1)
            files[png] = png_bytes(inspection_picture(found, settings.colours))
        write_files(files)
    if as_json:
        click.echo(json.dumps(found.facts, indent=1))
        return
    table = Table(box=None, show_header=False, padding=(0, 1))
    for topic, text in inspection_text(found.facts):
        table.add_row(f"[bold]{topic}[/]", Text(text))
    Console(highlight=False).print(table)


@cli.command(cls=SectionedCommand)
@weaving_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    required=True,
    help="What to write: .glb (metres), .obj, .ply, .stl, .3mf, .3dm (Rhino; needs the extra "
    "rhino) or .png (a picture). All but .glb are in millimetres.",
)
@click.option("--yarn", is_flag=True, help="Round yarns, as thick as they have room, not ribbons.")
@click.option("--yarn-radius", type=Length(), help="One radius for all yarns (implies --yarn).")
@click.option(
    "--sides", type=int, default=12, show_default=True, help="Sides of the yarns' cross-section."
)
@click.option(
    "--view",
    "views",
    type=Direction(),
    multiple=True,
    help="For a picture: from where, in degrees around the upward axis and above the horizon, "
    "e.g. -60,30; repeat it for several side by side. [default: fabweave chooses]",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
def model(
    output: Path,
    yarn: bool,
    yarn_radius: float | None,
    sides: int,
    views: tuple[View, ...],
    as_json: bool,
    quiet: bool,
    mesh: str | None,
    **options: Any,
) -> None:
    """Weave MESH and write the woven object as a 3-D model or a picture; nothing is cut.

    Ribbons are sheets, but in .stl and .3mf, which are for printing, they are solids as thick as
    the material. Yarns are closed tubes that do not touch.

    \b
    Examples:
      fabweave model spot.obj --size 400mm --pattern twill -o spot.glb
      fabweave model "shape:torus?m=24&n=12" --size 120mm --yarn -o torus.3mf
      fabweave model shape:tetrahedron --size 60mm --yarn-radius 3mm --sides 24 -o rings.stl
      fabweave model "shape:slit?genus=2" --size 300mm --view -60,30 --view 95,52 -o slit.png
    """  # noqa: D301 - click wants a true backspace, and keeps the lines after it apart
    with held_back():
        from fabweave.app.model_job import YarnOptions, check_suffix, write_model  # noqa: PLC0415

    check_suffix(output)
    spun = YarnOptions(yarn_radius, sides) if yarn or yarn_radius is not None else None
    settings = job_settings(mesh, options)
    with _progress(quiet or as_json) as progress:
        facts = write_model(settings, output, yarn=spun, views=views, progress=progress)
    if as_json:
        click.echo(json.dumps(facts, indent=1))
    elif not quiet:
        console = Console(highlight=False, soft_wrap=True)
        for note in facts["notes"]:
            console.print(f"  {note}", markup=False)
        console.print(
            f"{facts['threads']} threads, {facts['crossings']} crossings, {facts['kind']}: "
            f"{facts['file']}",
            markup=False,
        )
        if spun is not None:
            radius = facts["radius_mm"]
            console.print(
                f"radius {radius['least']:.3g} to {radius['greatest']:.3g} mm; up to "
                f"{radius['greatest_possible']:.3g} mm has room",
                markup=False,
            )


@cli.command()
@click.option(
    "--png", type=click.Path(path_type=Path), help="Write a picture of all shapes with their names."
)
def shapes(png: Path | None) -> None:
    """List the built-in shapes and their parameters."""
    with held_back():
        from fabweave.mesh.shapes.catalogue import SHAPES  # noqa: PLC0415

    if png is not None:
        check_file(png, ".png")
    for shape in SHAPES:
        click.echo(f"{shape.example}\n    {shape.text}")
        for item in shape.parameters:
            click.echo(f"      {item.name:10} {item.text}")
    if png is not None:
        from fabweave.picture.object_picture import png_bytes, render_shapes  # noqa: PLC0415

        with _progress(False) as progress:
            progress("picture", 0, 1)
            write_files({png: png_bytes(render_shapes())})
        click.echo(f"Picture: {png}")


@cli.command()
@click.argument("directory", required=False, type=click.Path(path_type=Path))
@click.option("--material", metavar="NAME", help="What it is cut from. [default: the job's]")
@click.option("--thickness", type=Length(), help="Measured thickness. [default: the job's]")
@click.option("--hole", type=Length(), help="Hole for the fastener. [default: the job's, or 3.3mm]")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="DIR", required=True,
    help="Folder for coupon.dxf, .svg, .png and .txt; older ones there are replaced.",
)  # fmt: skip
def coupon(
    directory: Path | None,
    material: str | None,
    thickness: float | None,
    hole: float | None,
    output: Path,
) -> None:
    """Draw a test coupon to cut first: holes, kerf, a lap, lettering and a bend.

    With the folder of a finished job, its material, hole, laps, ribbons and tightest bend.
    coupon.txt says what to measure, and which option to set by it.
    """
    with held_back():
        from fabweave.app.coupon_job import coupon_for, write_coupon  # noqa: PLC0415

    planned = coupon_for(directory, material, thickness, hole)
    write_coupon(planned, output)
    click.echo(
        f"coupon: {planned.material.title}, {planned.material.thickness_mm:g} mm; hole "
        f"{planned.hole_mm:g} mm, lap {planned.lap_mm:.1f} mm, ribbon {planned.width_mm:.1f} mm, "
        f"bend radius {planned.bend_mm:.1f} mm"
    )
    click.echo(f"Cut {output / 'coupon.dxf'} or .svg, and read {output / 'coupon.txt'}")


@cli.command()
def materials() -> None:
    """List the material library."""
    with held_back():
        from fabweave.stock.material import material_library  # noqa: PLC0415

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


cli.add_command(guide)


@contextmanager
def _progress(silent: bool) -> Iterator[Callable[[str, int, int], None]]:
    """Show what is being done on the error stream, or nothing."""
    console = Console(stderr=True)
    if silent or not console.is_terminal:  # in a log, a bar would be but an empty line
        yield lambda _what, _done, _total: None
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
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
    except OSError as error:  # what no module foresaw: a full disk, a folder that may not be made
        where = f" {error.filename}" if error.filename else ""
        errors.print(f"fabweave: cannot read or write{where}: {error.strerror}", markup=False)
        sys.exit(2)
