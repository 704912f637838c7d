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
    help="Whose rules for holes, webs, gaps and sizes the pieces are checked against; fabweave "
    "targets lists all. [default: the job's own]",
)
@table_option("targets")
@click.option("--strict", is_flag=True, help="Exit with 1 if any rule is broken.")
@json_option
@click.option("-q", "--quiet", is_flag=True, help="Print nothing; with --strict, the code tells.")
def preflight(
    directory: Path,
    target: str | None,
    targets: tuple[str, ...],
    strict: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Check a finished job's pieces against the rules of its material and of who cuts it.

    Least holes, their distance to edges, webs, gaps, sizes, short sides, narrow ribbons and tight
    bends; each finding says on which piece, where on its sheet, what is asked for, and what
    would help.
    """
    with held_back():
        from fabweave.core.job_folder import folder_is_readable
        from fabweave.options.user_files import user_entries
        from fabweave.plan.preflight.preflight_job import preflight_job
        from fabweave.plan.preflight.rules import finding_lines

    folder_is_readable(directory)
    own = () if target is None else user_entries("targets", targets)
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
