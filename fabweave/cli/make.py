"""The command that makes a job."""

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fabweave.cli.options import (
    SectionedCommand,
    folder_option,
    job_options,
    job_settings,
    json_option,
    quiet_option,
    verbose_option,
)
from fabweave.cli.terminal import VERDICT_STYLES, progress_bar
from fabweave.core.messages import agree
from fabweave.core.parallel.interrupt import held_back

if TYPE_CHECKING:
    from fabweave.job.run import FinishedJob


def tell_job(made: "FinishedJob", output: Path, *, verbose: bool) -> None:
    """Print what was chosen, what wants care, the verdict, and where to look first.

    Parameters
    ----------
    made : FinishedJob
    output : Path
        Where it is.
    verbose : bool
        Whether to print every note whole; else what everybody should read. All are in
        ``waste.html`` and ``waste.json``.
    """
    from rich.console import Console

    from fabweave.estimate.texts import costs_text
    from fabweave.plan.preflight import finding_lines
    from fabweave.plan.verdict import verdict_text

    job, proof, found, missing = made
    console = Console(highlight=False, soft_wrap=True)
    for note in job.notes:
        if verbose or not note.detail:
            console.print(f"  {note if verbose else note.text}", markup=False, style="dim")
    console.print(
        f"{agree(len(job.piece_set.pieces), '{n} piece[|s]')} of "
        f"{agree(job.piece_set.kinds.count, '{n} kind[|s]')}, "
        f"{agree(len(job.piece_set.joints), '{n} joint[|s]')}, "
        f"{agree(len(job.drawings), '{n} roll[|s]' if job.supplies.rolls else '{n} sheet[|s]')}; "
        f"proved by {len(proof.checks)} checks of the written files",
        markup=False,
    )
    if job.settings.search.effort == "quick" and len(job.drawings) > 1:
        console.print("Leave out --effort quick for fewer or fuller sheets.", markup=False)
    console.print(costs_text(job.costs), markup=False)
    # Widths and bends are among the verdict's reasons already.
    told = [one for one in found.findings if one.rule not in ("width", "bend")]
    for line in finding_lines(told) if found.findings else [found.all_clear]:
        console.print(f"preflight: {line}", markup=False)
    if job.laid is not None:
        plates = job.beside[-1]
        console.print(
            f"former: {agree(len(plates.areas_mm2), '{n} plate[|s]')} on "
            f"{agree(len(plates.drawings), '{n} sheet[|s]')} in {output / plates.folder}; "
            f"former.txt says how it goes together{' and comes out' if job.laid.way else ''}",
            markup=False,
        )
    if job.offcuts:
        console.print(
            f"{agree(len(job.offcuts), '{n} offcut[ is|s are]')} worth keeping: --stock "
            f"{output / 'offcuts' / 'stock.toml'} takes them first in a later job",
            markup=False,
        )
    for paper in missing:
        console.print(f"missing: {paper}; please report it", style="bold red", markup=False)
    verdict = job.verdict
    console.print(verdict_text(verdict), style=VERDICT_STYLES[verdict.level], markup=False)
    console.print(job.grade.text, markup=False)
    if job.form_text:
        console.print(f"When you let go, it {job.form_text}", markup=False)
    more = "" if verbose else f" (-v prints all {len(job.notes)} notes; waste.html has them, too)"
    console.print(f"Look first at {output / 'index.html'}{more}", markup=False)


@click.command(cls=SectionedCommand)
@folder_option("Folder for the job; it replaces an older job there.")
@job_options(making=True)
@click.option(
    "--pieces",
    type=click.IntRange(1),
    metavar="N",
    help="About so many pieces: fabweave picks mesh, pattern and width.",
)
@click.option(
    "--goal",
    default="",
    metavar="WISHES",
    help="Wishes to meet: hours=5,ribbon=15mm,sheets=3,budget=40,likeness=5mm,form=2mm; or school.",
)
@json_option
@quiet_option
@verbose_option
def make(
    output: Path,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    pieces: int | None,
    goal: str,
    mesh: str | None,
    **options: Any,
) -> None:
    """Weave MESH, a file or a shape:NAME, and write everything to cut it.

    \b
    Examples:
      fabweave make "shape:torus?m=24&n=12" --size 400mm --pattern twill -o torus
      fabweave make cow.obj --size 40cm --pieces 150 -o cow
      fabweave make scan.stl --size 50cm --material card --sheet 600x400mm -o scan
    """
    # An import that Ctrl-C interrupts may fail oddly, or go on as if nothing had happened.
    with held_back():
        from fabweave.core.job_folder import clear_abandoned
        from fabweave.design.making import make_or_advise
        from fabweave.design.wishes import goal_options, parse_wishes
        from fabweave.job.stations import Stations

    wishes = parse_wishes(goal, pieces)
    settings = job_settings(mesh, options, goal_options(goal))
    config = options["config"]
    for note in clear_abandoned(output):
        click.echo(note, err=True)
    workers, replaced = os.cpu_count() or 1, [config] if config is not None else []
    with progress_bar(quiet or as_json) as progress:

        def better(line: str) -> None:
            """Print what is the best so far."""
            if not (quiet or as_json):
                progress.say(line, err=True)

        def chose(text: str) -> None:
            """Print what was chosen, before it is made."""
            if not (quiet or as_json):
                progress.say(text)

        job = Stations(settings, progress=progress)
        made, _, chosen = make_or_advise(
            job, output, workers=workers, replaced=replaced, wishes=wishes,
            better=better, chose=chose,
        )  # fmt: skip
    if as_json:
        told = {"chosen": chosen} if chosen else {}
        click.echo(json.dumps(_totals(made, output) | told, indent=1))
    elif not quiet:
        tell_job(made, output, verbose=verbose)
    if made.missing:
        sys.exit(1)


def _totals(made: "FinishedJob", output: Path) -> dict[str, Any]:
    """Return what was made, as JSON takes it."""
    from fabweave.core.records import to_json
    from fabweave.plan.grade import verdict_json

    job = made.job
    return {
        "directory": str(output),
        "threads": job.weave.threads.n_threads,
        "crossings": job.weave.threads.n_crossings,
        "pieces": len(job.piece_set.pieces),
        "kinds": job.piece_set.kinds.count,
        "spares": len(job.spared),
        "joints": len(job.piece_set.joints),
        "sheets": [drawing.name for drawing in job.drawings],
        "costs": to_json(job.costs),
        "proved": True,
        "verdict": verdict_json(job.verdict, job.grade, job.form),
        "notes": list(job.notes),
        "missing": list(made.missing),
    }
