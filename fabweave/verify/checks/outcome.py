"""Check what job.toml and the layout's notes say came out."""

import re
from typing import Any

from fabweave.verify.checks.pieces import areas_of
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.supplies import by_bunch
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

UTILISATION = 6e-5
_ON_SHEETS = re.compile(r"\b(\d+) sheets?\b")
#: What a note of a layout that another run may not find again says.
_MAY_DIFFER = "may give another layout"


def check_outcome(job: Job, tally: Tally) -> None:
    """Check the counts, utilisation and notes of job.toml, and what the layout's notes imply."""
    plan, outcome = job.map, (job.settings or {}).get("outcome")
    if plan is None or not isinstance(outcome, dict):
        return
    _check_figures(plan, outcome, tally)
    notes = outcome.get("notes")
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        tally.fail(f"job.toml, outcome: notes are {notes!r:.80}, not texts")
        return
    if job.waste is not None:
        tally.expect(
            job.waste.get("notes") == notes, "the notes of job.toml and of waste.json differ"
        )
    layout = (job.document or {}).get("layout")
    if job.options and isinstance(layout, dict):
        _check_layout(plan, layout, job.options, notes, tally)


def _check_figures(plan: CrossingMap, outcome: dict[str, Any], tally: Tally) -> None:
    """Check how many there are of everything, and how much of the sheets is used."""
    area = sum(sheet.area_mm2 for sheet in plan.sheets)
    used = sum(areas_of(piece, plan)[0] for piece in plan.pieces)
    for name, value, tolerance in (
        ("threads", len(plan.threads), 0.0),
        ("crossings", len(plan.crossings), 0.0),
        ("pieces", len(plan.pieces), 0.0),
        ("joints", len(plan.joints), 0.0),
        ("sheets", len(plan.sheets), 0.0),
        ("utilisation", used / area if area else 0.0, UTILISATION),
    ):
        stated = outcome.get(name)
        tally.expect(
            # Written so that NaN objects.
            isinstance(stated, int | float)
            and not isinstance(stated, bool)
            and abs(stated - value) <= tolerance,
            f"job.toml, outcome: {name} is {stated!r}, but comes to {value:.6g}",
        )


def _check_layout(
    plan: CrossingMap,
    layout: dict[str, Any],
    options: dict[str, Any],
    notes: list[str],
    tally: Tally,
) -> None:
    """Check that the layout's notes are told, are true, and have the consequence they name."""
    told = [str(note) for note in layout.get("notes", [])]
    for note in told:
        tally.expect(note in notes, f"job.toml does not tell the layout's note {note!r:.60}")
        found = _ON_SHEETS.search(note)
        if found is not None:
            # Of several materials, each has notes of its own.
            own = [
                sheet
                for sheet in plan.sheets
                if note.startswith(f"{sheet.material} {sheet.thickness_mm or 0.0:g} mm: ")
            ]
            count = len(own or plan.sheets)
            tally.expect(int(found[1]) == count, f"a note says {found[0]!r}, and there are {count}")
    recorded = "layout" in options
    tally.expect(
        recorded or not any(_MAY_DIFFER in note for note in told),
        "the settings may give another layout, and job.toml does not take the recorded one",
    )
    for name, stated in (("margin", plan.margin_mm), ("gap", plan.gap_mm)):
        texts = list(by_bunch(options.get(name)).values())
        tally.expect(
            # What all sheets keep is the least of what is asked for.
            f"{stated:.10g}mm" in texts
            and all(stated <= float(text.removesuffix("mm")) for text in texts),
            f"the layout keeps a {name} of {stated:g} mm, and job.toml asks for "
            f"{options.get(name)}",
        )
