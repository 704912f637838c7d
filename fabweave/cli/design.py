"""The command that tries designs of a model side by side."""

import os
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
)
from fabweave.cli.terminal import VERDICT_STYLES, progress_bar
from fabweave.core.parallel.interrupt import held_back

if TYPE_CHECKING:
    from fabweave.design.candidate import Candidate
    from fabweave.design.search import Search


@click.command(cls=SectionedCommand)
@folder_option("Folder for the designs. A search that was stopped goes on there.")
@job_options(making=True)
@click.option(
    "--tries",
    type=click.IntRange(1, 1000),
    default=24,
    show_default=True,
    help="How many designs to try at most.",
)
@json_option
@quiet_option
def design(
    output: Path,
    tries: int,
    as_json: bool,
    quiet: bool,
    mesh: str | None,
    **options: Any,
) -> None:
    """Try designs of MESH from coarse to fine, and show which can be built and what they take.

    It plans the pieces of each design: on meshes of quads and of triangles, in plain weave and
    twill, with wider and narrower ribbons. All of them keep the options that you give. Where few
    can be built, it tries others near these. Where none can, it says why, and what would help. The
    page design.html shows pictures, figures and the exact fabweave make command of each.

    \b
    Examples:
      fabweave design spot.obj --size 400mm --material card -o designs
      fabweave design scan.stl --size 50cm --material birch-veneer --tries 100 -o designs
    """
    with held_back():
        from fabweave.core.parallel.executors import processes
        from fabweave.design.candidate import told_design
        from fabweave.design.page import best_of, design_json, run_design
        from fabweave.design.search import Trials
        from fabweave.mesh.shapes.catalogue import object_title

    settings = job_settings(mesh, options)
    executors = processes(os.cpu_count() or 1)
    with progress_bar(quiet or as_json) as progress:

        def tell(candidate: "Candidate") -> None:
            """Print what a design came to."""
            if not (quiet or as_json):
                progress.say(told_design(candidate))

        found = run_design(Trials(settings, progress, executors, told=tell), output, tries)
    if as_json:
        click.echo(
            design_json(object_title(settings.mesh.source, settings.mesh.title), found), nl=False
        )
    elif not quiet:
        _tell(found, best_of(found.candidates), output)


def _tell(found: "Search", best: list[bool], output: Path) -> None:
    """Print the designs that no other is better than, and where all are shown."""
    from rich.console import Console

    from fabweave.design.candidate import told_design, words
    from fabweave.design.page import lying_note

    console = Console(highlight=False, soft_wrap=True)
    if any(best):
        console.print("\nNo other is better in every way than one of these:", markup=False)
    for candidate, good in zip(found.candidates, best, strict=True):
        if good and candidate.figures is not None:
            console.print(
                f"{candidate.name}: {words(candidate.figures)}; {candidate.verdict.headline}",
                style=VERDICT_STYLES[candidate.verdict.level],
                markup=False,
            )
            console.print(f"  {candidate.command}", markup=False)
    if found.why:
        console.print(found.why, style="yellow", markup=False)
        for helps in found.helps:
            console.print(f"  {told_design(helps.candidate)}", markup=False)
    same = f" ({found.same} more came to the same as one of these)" if found.same else ""
    console.print(
        f"{found.makeable} of {len(found.tried)} designs can be built{same}. All with "
        f"pictures: {output / 'design.html'}.{lying_note(found)}",
        markup=False,
    )
