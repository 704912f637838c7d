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
        from rich.table import Table

        from fabweave.app.options.user_files import OURS, all_entries, user_file
        from fabweave.stock.material import material_library

    found = all_entries("materials", material_library(), materials)
    own = any(source != OURS for _, source in found)
    heads = (
        "name",
        "material",
        "thickness, mm",
        "gap, mm",
        "sheet, mm",
        *(["from"] if own else []),
    )
    table = Table(*heads, box=None)
    for material, source in found:
        wide, high = material.sheet_mm
        table.add_row(
            material.name,
            material.title,
            f"{material.thickness_mm:g}",
            f"{material.gap_mm:g}",
            f"{wide:g} × {high:g}",
            *([source] if own else []),
        )
    Console(highlight=False).print(table)
    click.echo(f"Your own: --materials FILE, or {user_file('materials')}")
