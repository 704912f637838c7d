"""The command that lists the built-in shapes."""

from pathlib import Path

import click

from fabweave.cli.terminal import progress_bar
from fabweave.core.files import check_file, write_files
from fabweave.core.parallel.interrupt import held_back


@click.command()
@click.option(
    "--png", type=click.Path(path_type=Path), help="Write a picture of all shapes with their names."
)
def shapes(png: Path | None) -> None:
    """List the built-in shapes and their parameters."""
    with held_back():
        from fabweave.mesh.shapes.catalogue import SHAPES

    if png is not None:
        check_file(png, ".png")
    for shape in SHAPES:
        click.echo(f"{shape.example}\n    {shape.text}")
        for item in shape.parameters:
            click.echo(f"      {item.name:10} {item.text}")
    if png is not None:
        from fabweave.picture.object_picture import png_bytes, render_shapes

        with progress_bar(False) as progress:
            progress("picture", 0, 1)
            write_files({png: png_bytes(render_shapes())})
        click.echo(f"Picture: {png}")
