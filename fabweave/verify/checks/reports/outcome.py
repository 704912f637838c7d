"""Check what job.toml and the layout's notes say came out."""

import re
from typing import Any

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.areas import sum_areas
from fabweave.verify.measure.supplies import by_bunch
from fabweave.verify.read.job_files import Job
from fabweave.verify.statement import Tally

UTILISATION = 6e-5
_ON_SHEETS = re.compile(r"\b(\d+) sheets?\b")
#: What a note of a layout that another run may not find again says.
_MAY_DIFFER = "may give another layout"


def check_outcome(job: Job, tally: Tally) -> None:
    """Check the counts, utilisation and notes of job.toml, and what the layout's notes imply."""
    plan, outcome = job.map, (job.settings or {}).get("outcome")
    if plan is None or not isinstance(outcome, dict):
        return
    place = tally.at("job.toml", "outcome")
    for name in ("threads", "crossings", "pieces", "joints", "sheets"):
        place.number(name, outcome.get(name), len(getattr(plan, name)))
    area = sum(sheet.area_mm2 for sheet in plan.sheets)
    share = sum_areas(job.areas.values()).outline_mm2 / area if area else 0.0
    place.number("utilisation", outcome.get("utilisation"), share, within=UTILISATION)
    notes = outcome.get("notes")
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        place.fail(f"notes are {notes!r:.80}, not texts")
        return
    if job.waste is not None:
        tally.at("waste.json").equal("the list of notes", job.waste.get("notes"), notes)
    layout = (job.document or {}).get("layout")
    if job.options and isinstance(layout, dict):
        _check_layout(plan, layout, job.options, notes, tally)


def _check_layout(
    plan: CrossingMap,
    layout: dict[str, Any],
    options: dict[str, Any],
    notes: list[str],
    tally: Tally,
) -> None:
    """Check that the layout's notes are told, are true, and have the consequence they name."""
    place = tally.at("crossing_map.json", "layout")
    told = [str(note) for note in layout.get("notes", [])]
    for note in told:
        place.expect(note in notes, f"job.toml does not tell the note {note!r:.60}")
        found = _ON_SHEETS.search(note)
        if found is not None:
            # Of several materials, each has notes of its own.
            own = [
                sheet
                for sheet in plan.sheets
                if note.startswith(f"{sheet.material} {sheet.thickness_mm or 0.0:g} mm: ")
            ]
            count = len(own or plan.sheets)
            place.equal("the number of sheets in a note", int(found[1]), count)
    recorded = "layout" in options
    place.expect(
        recorded or not any(_MAY_DIFFER in note for note in told),
        "the settings may give another layout, and job.toml does not take the recorded one",
    )
    for name, stated in (("margin", plan.margin_mm), ("gap", plan.gap_mm)):
        texts = list(by_bunch(options.get(name)).values())
        place.expect(
            # What all sheets keep is the least of what is asked for.
            f"{stated:.10g}mm" in texts
            and all(stated <= float(text.removesuffix("mm")) for text in texts),
            f"{name} is {stated:g} mm, and in job.toml {options.get(name)}",
        )
