"""Check that every piece lies on a sheet of its thread's material."""

import re

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.supplies import Supply, by_bunch
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Tally

#: Sizes of sheets agree to this.
_SAME_MM = 0.011
_SIZE = re.compile(r"([\d.]+)x([\d.]+)mm")


def check_materials(job: Job, tally: Tally) -> None:
    """Check the materials of threads, sheets and pieces against the settings and one another.

    Where the settings name materials by bunch, they name every bunch, and threads of one bunch do
    not cross one another.
    """
    plan = required(job.map)
    _check_bunches(job, plan, tally)
    for sheet in plan.sheets:
        for piece in plan.on_sheet(sheet.number):
            if (supply := job.supplies.get(piece.thread)) is not None:
                tally.at(f"piece {piece.id}").expect(
                    _agree(supply, sheet.material, sheet.thickness_mm),
                    f"it is of {supply.material}, {supply.thickness_mm} mm, and lies on "
                    f"{sheet.name} of {sheet.material}, {sheet.thickness_mm} mm",
                )
    _check_sheets_of_bunches(job, plan, tally)
    gaps = [supply.gap_mm for supply in job.supplies.values() if supply.gap_mm is not None]
    least = min(gaps, default=plan.layout.gap_mm)
    place = tally.at("crossing_map.json").against("job.toml")
    place.number("the least gap", plan.layout.gap_mm, least, within=1e-6)


def _agree(supply: Supply, material: object, thickness: object) -> bool:
    """Say whether what is stated is what the settings say, as far as they say it."""
    same = supply.material is None or supply.material == material
    if supply.thickness_mm is None:
        return same
    return (
        same and isinstance(thickness, float | int) and abs(thickness - supply.thickness_mm) < 1e-9
    )


def _check_bunches(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that settings by bunch fit the bunches of the map."""
    bunches = {thread.bunch for thread in plan.threads}
    parted = False
    for key in ("material", "thickness", "gap"):
        named = set(by_bunch(job.options.get(key))) - {None}
        parted = parted or bool(named)
        tally.at("job.toml", key).same("bunches", named or bunches, bunches)
    for crossing in plan.crossings if parted else ():
        one, other = plan.thread[crossing.over.thread], plan.thread[crossing.under.thread]
        tally.at(f"crossing {crossing.id}").expect(
            one is other or one.bunch != other.bunch,
            f"threads {one.label} and {other.label} of bunch {one.bunch} cross there",
        )


def _check_sheets_of_bunches(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that no sheet that the settings keep for one bunch holds pieces of another."""
    kept = []
    for text in job.options.get("sheet", ()):
        # All sizes for one bunch, or for all under None.
        for bunch, size in by_bunch(text).items():
            match = _SIZE.match(size)
            if match is not None:
                kept.append((bunch, float(match[1]), float(match[2])))
    for sheet in plan.sheets if any(bunch is not None for bunch, *_ in kept) else ():
        fits = {
            bunch
            for bunch, width, height in kept
            if abs(width - sheet.width_mm) + abs(height - sheet.height_mm) < _SAME_MM
        }
        there = {plan.thread[piece.thread].bunch for piece in plan.on_sheet(sheet.number)}
        tally.at(sheet.name).expect(
            bool(sheet.stock) or None in fits or there <= fits,
            f"it holds pieces of bunches {sorted(there)}, and in job.toml its size is for bunches "
            f"{sorted(fits, key=str)}",
        )
