"""The command that lists machine profiles, and writes one of your own."""

from typing import Any

import click

from fabweave.core.parallel.interrupt import held_back

#: What is asked for a new profile, where nothing is stated: most machines differ in these.
_ASKED = ("preset", "kerf", "svg_units", "dxf", "cut_order", "paper")


@click.group(invoke_without_command=True)
@click.pass_context
def machine(ctx: click.Context) -> None:
    """List machine profiles: what --machine may name, and what each sets."""
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
@click.option(
    "--set",
    "told",
    multiple=True,
    metavar="OPTION=VALUE",
    help="An option of the machine, such as kerf=0.15mm; without any, they are asked for.",
)
@click.option("--force", is_flag=True, help="Replace a profile of that name.")
def new(name: str, told: tuple[str, ...], force: bool) -> None:
    """Write a machine profile NAME of your own, which --machine NAME then uses.

    \b
    Examples:
      fabweave machine new cellar --set preset=lightburn --set kerf=0.15mm
      fabweave make cow.obj --size 400mm --machine cellar -o cow
    """
    with held_back():
        from fabweave.core.errors import InputError
        from fabweave.options.machines import machine_options, write_profile

    table: dict[str, Any] = {}
    for one in told:
        key, equals, value = one.partition("=")
        if not equals:
            raise InputError(f"--set {one}: write OPTION=VALUE, such as kerf=0.15mm")
        table[key.removeprefix("machine.").replace("-", "_")] = value
    if not told:
        for option in machine_options():
            if option.name in _ASKED:
                click.echo(f"\n{option.text}")
                usual = "" if option.default in (None, 0.0) else str(option.default)
                answer = click.prompt(option.name, default=usual)
                if answer and answer != usual:
                    table[option.name] = answer
    click.echo(f"Written: {write_profile(name, table, replace=force)}")
