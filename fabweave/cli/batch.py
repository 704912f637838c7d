"""The command that makes many jobs."""

import json
import os
import sys
from pathlib import Path

import click

from fabweave.cli.options import folder_option, json_option, quiet_option
from fabweave.cli.terminal import progress_bar
from fabweave.core.messages import agree
from fabweave.core.parallel.interrupt import held_back


@click.command()
@click.argument("jobs", type=click.Path(path_type=Path))
@folder_option("Folder for the folders of the jobs, and a page of all.")
@click.option(
    "--together",
    is_flag=True,
    help="Nest jobs of one material on shared sheets, too; each piece bears the number of its job.",
)
@json_option
@quiet_option
def batch(jobs: Path, output: Path, together: bool, as_json: bool, quiet: bool) -> None:
    """Make all JOBS of a file: a proved folder for each, and index.html of all.

    JOBS is TOML, with [options] for all and a table [jobs.NAME] for each job; or CSV, with a row
    for each job and a column for each option. Write options without --, as in max-length.
    Run it again to make what is missing.

    \b
    Examples:
      fabweave batch class.csv -o class --together
      fabweave batch jobs.toml -o shop
    """
    with held_back():
        import fabweave as fw

    def told(name: str, why: str) -> None:
        if why:
            progress.say(f"{name}: not made: {why}", err=True)
        elif not (quiet or as_json):
            progress.say(f"{name}: made and proved, in {output / name}")

    with progress_bar(quiet or as_json) as progress:
        try:
            done = fw.batch(
                jobs, output, together=together, told=told, progress=progress,
                workers=os.cpu_count() or 1,
            )  # fmt: skip
        except KeyboardInterrupt:
            progress.say(
                f"stopped; the jobs in {output} are whole, and the same command makes the rest",
                err=True,
            )
            sys.exit(130)
    queues = {
        folder.name: json.loads((folder / "queue.json").read_bytes()) for folder in done.together
    }
    if as_json:
        saved = {
            name: {key: queue[key] for key in ("together", "one_by_one")}
            for name, queue in queues.items()
        }
        record = {"made": done.made, "kept": done.kept, "failed": done.failed, "together": saved}
        click.echo(json.dumps(record, indent=1))
    elif not quiet:
        for name, queue in queues.items():
            one, all_ = queue["one_by_one"], queue["together"]
            click.echo(
                f"{output / 'together' / name}: {agree(all_['sheets'], '{n} sheet[|s]')} for "
                f"{len(queue['jobs'])} jobs; one by one they take {one['sheets']}. Waste is "
                f"{all_['waste_mm2'] / 1e6:.2f} m², and {one['waste_mm2'] / 1e6:.2f} m² one by one"
            )
        click.echo(
            f"{agree(len(done.made), '{n} job[|s]')} made, {len(done.kept)} there already, "
            f"{len(done.failed)} not made. Look first at {output / 'index.html'}"
        )
    if done.failed:
        sys.exit(1)
