"""The command that lists machine profiles, and writes one of your own."""

from typing import Any

import click

from fabweave.cli.options import table_options
from fabweave.core.parallel.interrupt import held_back
from fabweave.options.machines import machine_options


@click.group(invoke_without_command=True)
@click.pass_context
def machine(ctx: click.Context) -> None:
    """List machine profiles: what --machine takes, and what each sets."""
    if ctx.invoked_subcommand is not None:
        return
    with held_back():
        from fabweave.options.machines import machine_profile, own_profiles, shipped_profiles

    own = own_profiles()
    for name in [*own, *(name for name in shipped_profiles() if name not in own)]:
        told = ", ".join(f"{key} = {_told(value)}" for key, value in machine_profile(name).items())
        click.echo(f"{name}{' *' if name in own else ''}\n    {told}")
    click.echo("* your own; fabweave machine new NAME writes one")


def _told(value: Any) -> str:
    """Return a value as a line has room for it."""
    return str(value.get("name", "...")) if isinstance(value, dict) else str(value)


@machine.command()
@click.argument("name")
@table_options(machine_options())
@click.option("--force", is_flag=True, help="Replace a profile of that name.")
def new(name: str, force: bool, **options: Any) -> None:
    """Write a machine profile NAME of your own, which --machine NAME then uses.

    Without options, it asks for what differs most from machine to machine.

    \b
    Examples:
      fabweave machine new cellar --preset lightburn --kerf 0.15mm --bed 600x400mm
      fabweave make cow.obj --size 400mm --machine cellar -o cow
    """
    with held_back():
        from fabweave.options.machines import write_profile

    table = {key: value for key, value in options.items() if value not in (None, False, ())}
    for option in machine_options() if not table else ():
        if option.brief:
            click.echo(f"\n{option.brief}")
            usual = "" if option.default in (None, 0.0) else str(option.default)
            answer = click.prompt(option.shown, default=usual, show_default=bool(usual))
            if answer and answer != usual:
                table[option.name] = answer
    click.echo(f"Written: {write_profile(name, table, replace=force)}")
