"""The command that lists targets."""

import click

from fabweave.cli.options import table_option
from fabweave.core.parallel.interrupt import held_back


@click.command()
@table_option("targets")
def targets(targets: tuple[str, ...]) -> None:
    """List those who cut, and what they ask of the pieces; t is the thickness.

    Your own are in files such as examples/targets.toml: in those that --targets names, and in
    targets.toml in the configuration folder.
    """
    with held_back():
        from fabweave.app.options.user_files import OURS, all_entries, user_file
        from fabweave.cut.preflight.targets import targets as our_targets

    for target, source in all_entries("targets", our_targets(), targets):
        click.echo(target.name + ("" if source == OURS else f"  (from {source})"))
        click.echo(f"    {target.title}")
        for line in target.rules:
            click.echo(f"      {line}")
    click.echo(f"Your own: --targets FILE, or {user_file('targets')}")
