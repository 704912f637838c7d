"""The command that lists materials."""

from pathlib import Path

import click

from fabweave.cli.options import table_option
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


@click.command()
@table_option("rules")
def targets(rules: tuple[str, ...]) -> None:
    """List who cuts for you, and what each asks of the pieces; t is the thickness.

    fabweave reads your own from targets.toml in its configuration folder, and from --rules FILE.
    """
    with held_back():
        from fabweave.options.user_files import OURS, all_entries, user_file
        from fabweave.sheet.targets import targets as our_targets

    for target, source in all_entries("rules", our_targets(), rules):
        click.echo(target.name + ("" if source == OURS else f"  (from {source})"))
        click.echo(f"    {target.title}")
        for line in target.rules:
            click.echo(f"      {line}")
    click.echo(f"Your own: {user_file('rules')}, or --rules FILE")


@click.command()
@table_option("library")
def materials(library: tuple[str, ...]) -> None:
    """List the materials: those of fabweave, and your own.

    fabweave reads your own from materials.toml in its configuration folder, and from --library
    FILE.
    """
    with held_back():
        from rich.console import Console
        from rich.table import Column, Table
        from rich.text import Text

        from fabweave.options.user_files import OURS, all_entries, user_file
        from fabweave.stock.material import material_library

    name = Column("name", no_wrap=True)
    table = Table(name, "material", "thickness, mm", "gap, mm", "sheet, mm", box=None)
    own: dict[str, list[str]] = {}
    for material, source in all_entries("library", material_library(), library):
        wide, high = material.sheet_mm
        if source != OURS:
            own.setdefault(source, []).append(material.name)
        table.add_row(
            material.name if source == OURS else f"{material.name} *",
            Text(material.full_title),
            f"{material.thickness_mm:g}",
            f"{material.gap_mm:g}",
            f"{wide:g} × {high:g}",
        )
    Console(highlight=False).print(table)
    for source, names in own.items():
        click.echo(f"* from {source}: {', '.join(names)}")
    click.echo(f"Your own: {user_file('library')}, or --library FILE")
