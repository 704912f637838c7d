"""Print what was made: in about ten lines, or all that is known."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fabweave.cli.terminal import VERDICT_STYLES
from fabweave.core.messages import agree

if TYPE_CHECKING:
    from fabweave.app.pipeline import FinishedJob

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
