"""The command that checks a finished job's pieces before they are cut."""

import json
import sys
from pathlib import Path

import click

from fabweave.cli.options import json_option, table_option
from fabweave.core.parallel.interrupt import held_back


@click.command()
@click.argument("directory", type=click.Path(path_type=Path))
@click.option(
    "--target",
    metavar="NAME",
    help="Whose rules for holes, webs, gaps and sizes to check; fabweave targets lists all. "
    "[default: the job's own]",
)
@table_option("rules")
@click.option("--strict", is_flag=True, help="Exit with 1 if any rule is broken.")
@json_option
@click.option(
    "-q", "--quiet", is_flag=True, help="Print nothing; --strict still sets the exit code."
)
def preflight(
    directory: Path,
    target: str | None,
    rules: tuple[str, ...],
    strict: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Check a finished job's pieces against the rules of its material and of who cuts it.

    The rules are about holes, their distance to edges, webs, gaps, sizes, short sides, narrow
    ribbons and tight bends. Each finding names the piece, the place on its sheet, the limit, and
    what would help.
    """
    with held_back():
        from fabweave.core.job_folder import folder_is_readable
        from fabweave.options.user_files import user_entries
        from fabweave.plan.preflight import finding_lines, preflight_job

    folder_is_readable(directory)
    own = () if target is None else user_entries("rules", rules)
    found = preflight_job(directory, target, own)
    if as_json:
        click.echo(json.dumps(found.record, indent=1))
    elif not quiet:
        for line in finding_lines(found.findings):
            click.echo(line)
        if not found.findings:
            click.echo(found.all_clear)
    if strict and found.findings:
        sys.exit(1)
