"""The command that lists materials."""

import click

from fabweave.cli.options import table_option
from fabweave.core.parallel.interrupt import held_back


@click.command()
@table_option("materials")
def materials(materials: tuple[str, ...]) -> None:
    """List the materials that there are: the library, and your own.

    Your own are in files such as examples/materials.toml: in those that --materials names, and in
    materials.toml in the configuration folder.
    """
    with held_back():
        from rich.console import Console
        from rich.table import Column, Table
        from rich.text import Text

        from fabweave.app.options.user_files import OURS, all_entries, user_file
        from fabweave.stock.material import material_library

    name = Column("name", no_wrap=True)
    table = Table(name, "material", "thickness, mm", "gap, mm", "sheet, mm", box=None)
    own: dict[str, list[str]] = {}
    for material, source in all_entries("materials", material_library(), materials):
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
    click.echo(f"Your own: --materials FILE, or {user_file('materials')}")
