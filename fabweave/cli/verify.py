"""The command that proves a finished job."""

import json
import os
import sys
import tempfile
from pathlib import Path

import click

from fabweave.cli.progress import progress_bar
from fabweave.core.parallel.interrupt import held_back


@click.command()
@click.argument("directory", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing; the exit code tells.")
def verify(directory: Path, as_json: bool, quiet: bool) -> None:
    """Read the files of a finished job back and prove that they rebuild the weave.

    Exit code 0: every check holds. 1: some do not, and each says what it found.
    """
    with held_back():
        from rich.console import Console
        from rich.table import Table

        from fabweave.app.job_folder import folder_is_readable
        from fabweave.verify import verify_job

    folder_is_readable(directory)
    with progress_bar(quiet or as_json) as progress:
        progress("verify", 0, 1)
        proof = verify_job(directory)
    if as_json:
        click.echo(json.dumps(proof.to_json(), indent=1))
    elif not quiet:
        console = Console(highlight=False)
        table = Table("check", "", "checked", "worst", "what it proves", box=None)
        for check in proof.checks:
            worst = "" if check.worst is None else f"{check.worst:.2g}"
            mark = "[green]ok[/]" if check.ok else "[red]FAILS[/]"
            table.add_row(check.name, mark, str(check.count), worst, check.meaning)
        console.print(table)
        for check in proof.checks:
            for finding in check.findings:
                console.print(f"{check.name}: {finding}", markup=False, soft_wrap=True)
    faults = [fault for check in proof.checks for fault in check.faults]
    if faults:
        handle, name = tempfile.mkstemp(prefix="fabweave-verify-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="replace") as file:
            file.write("\n\n".join(faults))
        click.echo(
            f"fabweave: the verifier itself failed {len(faults)} times, which says nothing about "
            f"the job; please report it with {name} and, if you may share it, the job",
            err=True,
        )
    if not proof.ok:
        sys.exit(1)
