"""The command that makes a job."""

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fabweave.cli.options import (
    WISHES,
    SectionedCommand,
    SectionedOption,
    cluster_option,
    folder_option,
    job_options,
    job_settings,
    json_option,
    quiet_option,
    verbose_option,
)
from fabweave.cli.terminal import VERDICT_STYLES, progress_bar
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.core.parallel.interrupt import held_back
from fabweave.core.units import parse_length

if TYPE_CHECKING:
    from fabweave.app.pipeline import FinishedJob


class _Length(click.ParamType[float]):
    """A length with its unit, in millimetres."""

    name = "length"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read what was typed."""
        try:
            found = parse_length(str(value))
        except InputError as error:
            self.fail(str(error), param, ctx)
        if not 0.0 < found <= 1e6:
            self.fail(f"{value} is no length that anybody can wish for", param, ctx)
        return found


_NUMBER = click.FloatRange(0.0, 1e9, min_open=True)
_WHOLE = click.IntRange(1, 10**6)
#: Each wish: the option, the field of ``Wishes``, what it takes, and its help.
_WISHES = (
    ("--pieces", "pieces", _WHOLE, "N", "Look for a design of about so many pieces."),
    ("--ribbon", "ribbon_mm", _Length(), "LENGTH",
     "Look for one with ribbons about so wide, such as 15mm."),
    ("--hours", "hours", _NUMBER, "HOURS",
     "Look for one that is put together in so many hours at most."),
    ("--sheets", "sheets", _WHOLE, "N", "Look for one on so many sheets at most."),
    ("--budget", "budget", _NUMBER, "MONEY",
     "Look for one whose sheets and hardware cost so much at most."),
    ("--likeness", "likeness_mm", _Length(), "LENGTH",
     "Look for one that is nowhere farther from the model."),
)  # fmt: skip


def wish_options(command: Any) -> Any:
    """Give a command the options for wishes."""
    for flag, field, kind, metavar, text in reversed(_WISHES):
        command = click.option(
            flag,
            field,
            cls=SectionedOption,
            section=WISHES,
            type=kind,
            metavar=metavar,
            help=text,
        )(command)
    return command


def wished(options: dict[str, Any]) -> dict[str, Any]:
    """Take the wishes out of what was typed, by the fields of ``Wishes``."""
    return {field: options.pop(field) for _, field, *_ in _WISHES}


#: How notes begin that are for those who ask for them: figures, what the verdict and the totals say
#: again, and advice that changes nothing in the job. Any other note is printed.
_DETAILS = (
    "mesh: ",
    "size: ",
    "the mesh has ",
    "the mesh was remeshed",
    "the model's own ",
    "QuadriFlow made ",
    "Instant Meshes made ",
    "ribbons: ",
    "holes: ",
    "joints: ",
    "buy: ",
    "letters: ",
    "engraving: ",
    "pieces: ",
    "kinds: ",
    "width: ",
    "openings: ",
    "bend: ",
    "twist: ",
    "crease: ",
    "layers: ",
    "clearance: ",
    "grain: ",
    "checks: ",
    "assembly: ",
)
#: What stands in such notes that name nothing at their beginning.
_DETAIL_WORDS = (" irregular vertices (", " irregular vertex (")


def tell_job(made: "FinishedJob", output: Path, *, verbose: bool) -> None:
    """Print what was chosen, what wants care, the verdict, and where to look first.

    Parameters
    ----------
    made : FinishedJob
    output : Path
        Where it is.
    verbose : bool
        Whether to print every note whole; else the first sentence of those that matter. All are in
        ``waste.html`` and ``waste.json``.
    """
    from rich.console import Console

    from fabweave.cut.preflight.violations import flaw_lines
    from fabweave.report.costs.texts import costs_text
    from fabweave.report.verdict import verdict_text

    job, proof, found, missing = made
    console = Console(highlight=False, soft_wrap=True)
    notes = job.notes if verbose else main_notes(job.notes)
    for note in notes:
        console.print(f"  {note}", markup=False, style="dim")
    console.print(
        f"{agree(len(job.piece_set.pieces), '{n} piece[|s]')} of "
        f"{agree(job.piece_set.kinds.count, '{n} kind[|s]')}, "
        f"{agree(len(job.piece_set.joints), '{n} joint[|s]')}, "
        f"{agree(len(job.drawings), '{n} sheet[|s]')}; "
        f"proved by {len(proof.checks)} checks of the written files",
        markup=False,
    )
    if job.settings.effort == "quick" and len(job.drawings) > 1:
        console.print("Leave out --effort quick for fewer or fuller sheets.", markup=False)
    console.print(costs_text(job.costs), markup=False)
    # Widths and bends are among the verdict's reasons already.
    told = [flaw for flaw in found.flaws if flaw.rule not in ("width", "bend")]
    for line in flaw_lines(tuple(told)) if found.flaws else [found.all_clear]:
        console.print(f"preflight: {line}", markup=False)
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
    more = "" if verbose else f" (-v prints all {len(job.notes)} notes; waste.html has them, too)"
    console.print(f"Look first at {output / 'index.html'}{more}", markup=False)


def main_notes(notes: Sequence[str]) -> list[str]:
    """Return the first sentences of the notes that matter to everybody.

    Examples
    --------
    >>> main_notes(["weave: plain, 4 threads", "letters: of 9 names, 3 had no room",
    ...     "fasteners (joints): at 8 of 20 crossings. The weave holds itself"])
    ['weave: plain, 4 threads', 'fasteners (joints): at 8 of 20 crossings']
    """
    return [
        note.partition(". ")[0]
        for note in notes
        if not note.startswith(_DETAILS) and not any(words in note for words in _DETAIL_WORDS)
    ]


@click.command(cls=SectionedCommand)
@job_options(making=True)
@folder_option(
    "Folder for the finished job. An older job there is replaced when the new one is "
    "complete, unless it holds files that were added or changed since."
)
@wish_options
@cluster_option("Nest very many pieces")
@json_option
@quiet_option
@verbose_option
def make(
    output: Path,
    cluster: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    mesh: str | None,
    **options: Any,
) -> None:
    """Weave MESH, a file or a shape:NAME, and write everything that is needed to cut it.

    MESH is an OBJ, OFF, PLY, STL, GLB or 3MF file, or a built-in shape such as
    "shape:torus?m=24&n=12" (fabweave shapes lists them). What can be woven on it,
    fabweave inspect MESH tells first; fabweave design MESH tries many designs of it.
    Where a model is too fine to be built as it is, a coarser mesh is woven, and the
    first line says which; --remesh none keeps the mesh. With a wish such as
    --pieces 150, the mesh, the pattern and the width that come nearest to it are
    looked for.

    \b
    Examples:
      fabweave make "shape:torus?m=24&n=12" --size 400mm --pattern twill -o torus
      fabweave make spot.obj --size 400mm --material card --sheet 600x400mm -o spot
      fabweave make scan.stl --size 50cm --remesh quads:800 --pattern twill -o scan
      fabweave make cow.obj --size 40cm --pieces 150 -o cow
      fabweave make cube.obj --size 300mm --refine catmull-clark:2 -o ball
    """
    # An import that Ctrl-C interrupts may fail oddly, or go on as if nothing had happened.
    with held_back():
        from fabweave.app.design.making import make_or_advise, meet_wishes
        from fabweave.app.design.wishes import Wishes
        from fabweave.app.job_folder import check_destination, clear_abandoned
        from fabweave.core.parallel.cluster import cluster_at
        from fabweave.core.parallel.executors import processes

    wishes = Wishes(**wished(options))
    settings = job_settings(mesh, options)
    config = options["config"]
    executors = None if cluster is None else cluster_at(cluster)
    for note in clear_abandoned(output):
        click.echo(note, err=True)
    workers, replaced = os.cpu_count() or 1, [config] if config is not None else []
    why = ""
    with progress_bar(quiet or as_json) as progress:
        if wishes:
            check_destination(output, replaced, mesh=settings.mesh)
            settings, why = meet_wishes(
                settings, wishes, progress, executors=executors or processes(workers)
            )
        made, _, coarser = make_or_advise(
            settings,
            output,
            progress,
            workers=workers,
            executors=executors,
            replaced=replaced,
        )
    why = "\n".join(filter(None, (why, coarser)))
    if as_json:
        chosen = {"chosen": why} if why else {}
        click.echo(json.dumps(_totals(made, output) | chosen, indent=1))
    elif not quiet:
        if why:
            click.echo(why)
        tell_job(made, output, verbose=verbose)
    if made.missing:
        sys.exit(1)


def _totals(made: "FinishedJob", output: Path) -> dict[str, Any]:
    """Return what was made, as JSON takes it."""
    from fabweave.core.records import to_json
    from fabweave.report.verdict import verdict_json

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
        "verdict": verdict_json(job.verdict),
        "notes": list(job.notes),
        "missing": list(made.missing),
    }
