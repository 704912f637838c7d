"""The command that makes a job."""

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fabweave.cli.job_summary import tell_job
from fabweave.cli.options import (
    SectionedCommand,
    cluster_option,
    folder_option,
    job_options,
    job_settings,
    json_option,
    quiet_option,
    verbose_option,
)
from fabweave.cli.progress import progress_bar
from fabweave.cli.wish_options import wish_options, wished
from fabweave.core.parallel.interrupt import held_back

if TYPE_CHECKING:
    from fabweave.app.pipeline import FinishedJob


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
