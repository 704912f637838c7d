"""The command that proves a finished job."""

import json
import os
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fabweave.cli.options import json_option
from fabweave.cli.terminal import progress_bar
from fabweave.core.messages import few_of
from fabweave.core.parallel.interrupt import held_back

if TYPE_CHECKING:
    from fabweave.job.remake import Remake
    from fabweave.verify.report import VerifyReport


@click.command()
@click.argument("directory", type=click.Path(path_type=Path))
@click.option(
    "--remake",
    is_flag=True,
    help="Also make the job again from its job.toml, and compare every file byte for byte.",
)
@click.option(
    "--papers",
    is_flag=True,
    help="As --remake, but pieces lie as the crossing map says, which is much quicker.",
)
@json_option
@click.option("-q", "--quiet", is_flag=True, help="Print nothing; read the exit code.")
def verify(directory: Path, remake: bool, papers: bool, as_json: bool, quiet: bool) -> None:
    """Read the files of a finished job back and prove that they rebuild the weave.

    The exit code is 0 if every check holds, else 1. Each check that fails says what it found.
    --remake and --papers need the mesh where the job names it.
    """
    with held_back():
        from rich.console import Console
        from rich.table import Table

        from fabweave.core.job_folder import folder_is_readable
        from fabweave.job.remake import remake_job
        from fabweave.verify.proof import verify_job

    folder_is_readable(directory)
    with progress_bar(quiet or as_json) as progress:
        progress("verify", 0, 1)
        proof = verify_job(directory)
        again = None
        if remake or papers:
            workers = os.cpu_count() or 1
            again = remake_job(directory, progress, nest=remake, workers=workers)
    if as_json:
        told = proof.to_json()
        if again is not None:
            told["remake"] = {"ok": again.ok, **again._asdict()}
        click.echo(json.dumps(told, indent=1))
    elif not quiet:
        console = Console(highlight=False)
        table = Table("check", "", "checked", "nearest its limit", "what it proves", box=None)
        for check in proof.checks:
            mark = "[green]ok[/]" if check.ok else "[red]FAILS[/]"
            table.add_row(check.name, mark, str(check.count), check.nearest, check.meaning)
        console.print(table)
        # What several checks find, as a file that none can read, stands once.
        found: dict[str, list[str]] = {}
        for check in proof.checks:
            for finding in check.findings:
                found.setdefault(finding, []).append(check.name)
        for finding, names in found.items():
            console.print(f"{few_of(names)}: {finding}", markup=False, soft_wrap=True)
        console.print(_outcome(proof), markup=False, soft_wrap=True)
    faults = [fault for check in proof.checks for fault in check.faults]
    if faults:
        handle, name = tempfile.mkstemp(prefix="fabweave-verify-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="replace") as file:
            file.write("\n\n".join(faults))
        click.echo(
            f"fabweave: the verifier itself failed {len(faults)} times. That says nothing about "
            f"the job. Please report it with {name} and, if you may share it, the job",
            err=True,
        )
    if again is not None and not quiet and not as_json:
        click.echo(_remade(again))
    if not proof.ok or (again is not None and not again.ok):
        sys.exit(1)


def _outcome(proof: "VerifyReport") -> str:
    """Say how many checks passed, and the names of those that did not."""
    count, failed = len(proof.checks), proof.failed
    if not failed:
        return f"all {count} checks passed"
    return f"{len(failed)} of {count} checks failed: {', '.join(failed)}"


def _remade(again: "Remake") -> str:
    """Say what came of making the job again."""
    if again.ok:
        return f"remake: job.toml gives the same {len(again.same)} files, byte for byte"
    parts = (
        ("differ", again.differing),
        ("are not made again", again.only_there),
        ("are made now, and are not there", again.only_again),
    )
    return "remake: not the same job: " + "; ".join(
        f"{few_of(names)} {what}" for what, names in parts if names
    )
