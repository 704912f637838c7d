"""The command that tells what a mesh is, and what can be woven on it."""

import json
import os
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fabweave.cli.options import (
    SectionedCommand,
    job_options,
    job_settings,
    json_option,
    verbose_option,
)
from fabweave.cli.terminal import progress_bar
from fabweave.core.errors import InputError
from fabweave.core.files import check_file, write_files
from fabweave.core.parallel.interrupt import held_back

if TYPE_CHECKING:
    from fabweave.design.inspection.facts import Inspection
    from fabweave.options.settings import Settings

#: How many designs are tried, from coarse to fine.
_DESIGNS = 3
#: Columns of the topics, so that parts that are printed one by one stand in line.
_TOPIC = 10
#: What can be pasted begins so.
_COMMAND = "fabweave make "


@click.command(cls=SectionedCommand)
@job_options()
@click.option(
    "--png",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write a picture of the mesh with its irregular vertices, the woven object, and designs "
    "from coarse to fine.",
)
@click.option(
    "--edges",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the twist of every edge in lines such as 0,1,-1, which --twists reads.",
)
@click.option(
    "--thorough",
    is_flag=True,
    help="Plan the pieces and look for every remedy, however large the mesh is. Without it, the "
    "answer leaves out what takes long above some thousand crossings, and says so.",
)
@click.option(
    "--designs",
    is_flag=True,
    help="Try designs from coarse to fine, which takes a minute or so. Without it, inspect does so "
    "only where the mesh cannot be built.",
)
@verbose_option
@json_option
def inspect(
    png: Path | None,
    edges: Path | None,
    thorough: bool,
    designs: bool,
    verbose: bool,
    as_json: bool,
    mesh: str | None,
    **options: Any,
) -> None:
    """Tell what MESH is, whether it can be built, what would help, and what can be woven on it.

    The answer takes some seconds; -v prints everything. Try here first the options of fabweave make
    that change the mesh, its weave or its ribbons.

    \b
    Examples:
      fabweave inspect spot.obj --size 400mm --png spot.png
      fabweave inspect scan.stl --size 50cm --remesh quads:800
      fabweave inspect hand.obj --size 400mm --remesh tubes:300
    """
    with held_back():
        from fabweave.core.parallel.executors import processes
        from fabweave.design.inspection.facts import inspect_mesh
        from fabweave.design.inspection.text import (
            answer_rows,
            command_rows,
            first_rows,
            further_rows,
        )
        from fabweave.job.stations import Stations
        from fabweave.mesh.shapes.catalogue import is_shape

    settings = job_settings(mesh, options)
    for path, suffix in ((png, ".png"), (edges, "")):
        if path is not None:
            check_file(path, suffix, source=settings.mesh.source)
    if png and edges and png.resolve() == edges.resolve():
        raise InputError("--png and --edges name the same file; name one for each")
    answer = not (verbose or thorough or as_json)
    parts = iter((first_rows, answer_rows if answer else further_rows))
    with progress_bar(as_json) as progress:

        def tell(facts: dict[str, Any]) -> None:
            """Print what is known now and was not before."""
            if not as_json:
                with progress.aside():
                    _print(next(parts)(facts))

        def say(line: str) -> None:
            if not as_json:
                progress.say(line)

        found = inspect_mesh(
            Stations(settings, progress=progress),
            answer=answer,
            thorough=thorough,
            # A picture shows designs of models; a built-in shape is as it was asked for.
            n_designs=_DESIGNS if designs or (png and not is_shape(settings.mesh.source)) else 0,
            looks=png is not None,
            executors=processes(os.cpu_count() or 1),
            told=tell,
            told_design=lambda tried: say(f"  {tried.text}"),
            better=say,
        )
        if not as_json and found.designs:
            with progress.aside():
                click.echo()
                _print(command_rows(found.facts))
        if png or edges:
            progress("files", 0, 1)
            _write(found, settings, png, edges)
    if as_json:
        click.echo(json.dumps(found.facts, indent=1))


def _write(found: "Inspection", settings: "Settings", png: Path | None, edges: Path | None) -> None:
    """Write the files that were asked for."""
    from fabweave.design.inspection.files import inspection_picture
    from fabweave.picture.object_picture import png_bytes
    from fabweave.weave.weave_pattern import twists_text

    files: dict[Path, bytes] = {}
    if edges is not None:
        files[edges] = twists_text(found.woven.halfedges, found.woven.weave).encode()
    if png is not None:
        files[png] = png_bytes(inspection_picture(found, settings))
    write_files(files)


def _print(rows: Sequence[tuple[str, str]]) -> None:
    """Print topics and sentences in two columns.

    Commands stand in lines of their own that are not broken, so that they can be pasted.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    for command, some in groupby(rows, lambda row: row[1].startswith(_COMMAND)):
        if command:
            for _, text in some:
                console.print(f"    {text}", soft_wrap=True, markup=False)
            continue
        table = Table(box=None, show_header=False, padding=(0, 1))
        table.add_column(min_width=_TOPIC)
        table.add_column()
        for topic, text in some:
            table.add_row(f"[bold]{topic}[/]", Text(text))
        console.print(table)
