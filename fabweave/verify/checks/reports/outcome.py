"""Check what job.toml says came out, and that it makes the same layout again."""

from math import inf, nan
from typing import Any

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.areas import sum_areas
from fabweave.verify.measure.supplies import by_bunch, length_of
from fabweave.verify.measure.words import costs_words
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

UTILISATION = 6e-5


def check_outcome(job: Job, tally: Tally) -> None:
    """Check the counts, utilisation and notes of job.toml, and the settings behind the layout."""
    plan, outcome = job.map, (job.settings or {}).get("outcome")
    if plan is None or not isinstance(outcome, dict):
        return
    place = tally.at("job.toml", "outcome")
    for name in ("threads", "crossings", "pieces", "joints", "sheets"):
        place.number(name, outcome.get(name), len(getattr(plan, name)))
    place.number("spares", outcome.get("spares", 0), len(plan.spare_of))
    area = sum(sheet.area_mm2 for sheet in plan.sheets)
    share = sum_areas(job.areas.values()).piece_mm2 / area if area else 0.0
    place.number("utilisation", outcome.get("utilisation"), share, within=UTILISATION)
    _check_words(job, outcome, place)
    if "likeness_mm" in outcome:
        # Only a mesh that was made anew differs from its model.
        remeshed = job.options.get("remesh", "none") != "none"
        place.expect(remeshed, "it has a likeness, but nothing was remeshed")
        far = outcome["likeness_mm"]
        place.expect(isinstance(far, int | float) and 0 <= far < inf, f"likeness_mm is {far!r}")
    notes = outcome.get("notes")
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        place.fail(f"notes are {notes!r:.80}, not texts")
        return
    if job.waste is not None:
        waste = tally.at("waste.json").against("job.toml")
        waste.equal("the list of notes", job.waste.get("notes"), notes)
    layout = tally.at("crossing_map.json", "layout")
    for note in ((job.document or {}).get("layout") or {}).get("notes", ()):
        layout.expect(note in notes, f"its note {note!r:.60} is not in job.toml")
    if job.options:
        _check_layout(plan, job, layout.against("job.toml"))


def _check_words(job: Job, outcome: dict[str, Any], place: Place) -> None:
    """Check the hole and the line on costs, where they are told."""
    plan = required(job.map)
    if (size := outcome.get("hole_mm")) is not None:
        # Those away from the middle of a crossing, too.
        holes = {hole.diameter for piece in plan.pieces for hole in plan.holes[piece.id]} - {None}
        # Where no crossing has room for one, the one that was looked for is told.
        sizes = set(size) if isinstance(size, list) else {size}
        place.expect(not holes or sizes <= holes, f"no hole is of {size} mm")
    estimate = (job.waste or {}).get("estimate")
    if "costs" in outcome and estimate is not None:
        place.against("waste.json").equal("costs", outcome["costs"], costs_words(estimate))


def _check_layout(plan: CrossingMap, job: Job, place: Place) -> None:
    """Check that the settings say how the layout came about, and make it again."""
    options, recorded = job.options, "layout" in job.options
    # What another run may not find again is taken from here.
    place.equal("recorded", recorded if plan.recorded is None else plan.recorded, recorded)
    for name, stated in (("margin", plan.margin_mm), ("gap", plan.gap_mm)):
        lengths = [length_of(text) for text in by_bunch(options.get(name)).values()]
        # What all sheets keep is the least of what is asked for.
        least = min((nan if length is None else length for length in lengths), default=nan)
        place.number(name, stated, least)
