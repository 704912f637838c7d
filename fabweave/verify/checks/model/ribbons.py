"""Check the figures and findings of the ribbons against the map and the model."""

from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

#: Figures are rounded to a thousandth, and the model's coordinates to 32 bits.
FIGURE_MM = 0.01


def check_ribbon_references(plan: CrossingMap, ribbons: dict[str, Any], tally: Tally) -> None:
    """Check that ribbons.json speaks of the map's threads and crossings, and refuses nothing."""
    told = [(one.get("thread"), one.get("crossings")) for one in ribbons["threads"]]
    true = [(one.label, len(one.crossings)) for one in plan.threads if one.crossings]
    tally.expect(told == true, "ribbons.json: its threads or their crossings are not the map's")
    labels = {thread.label: thread for thread in plan.threads}
    for number, found in enumerate(ribbons["findings"]):
        where = f"ribbons.json, finding {number}"
        thread, station = labels.get(found.get("thread")), found.get("station")
        tally.expect(
            thread is not None
            and isinstance(station, int)
            and 0 <= station < len(thread.crossings)
            and thread.crossings[station] == found.get("crossing"),
            f"{where}: thread {found.get('thread')} does not make crossing "
            f"{found.get('crossing')} at its station {station}",
        )
        tally.expect(
            found.get("other") is None or found.get("other") in labels,
            f"{where}: there is no thread {found.get('other')}",
        )
        tally.expect(
            found.get("severity") == "warn",
            f"{where}: its severity is {found.get('severity')!r}; what is refused is not made",
        )


def check_markers(job: Job, tally: Tally) -> None:
    """Check that a ball stands in the model at the place of every finding, and nowhere else."""
    if job.ribbons is None or job.model is None:
        return
    findings = job.ribbons["findings"]
    tally.expect(
        sorted(job.markers) == list(range(1, len(findings) + 1)),
        f"model.glb marks findings {sorted(job.markers)}, and ribbons.json has {len(findings)}",
    )
    for number, found in enumerate(findings, start=1):
        place = found.get("position")
        if number not in job.markers or not isinstance(place, list) or len(place) != 3:
            tally.fail(f"ribbons.json, finding {number - 1}: it has no place, or no ball there")
            continue
        away = float(np.abs(job.markers[number] - np.array(place, dtype=float)).max())
        tally.measure(
            "finding_mm",
            away,
            FIGURE_MM,
            f"model.glb marks finding {number} {away:.3f} mm from its place",
        )


def check_ribbon_figures(job: Job, tally: Tally) -> None:
    """Check lengths and widths of the ribbons, as stated, against the model."""
    if job.ribbons is None or job.model is None:
        return
    for told in job.ribbons["threads"]:
        strip = job.model.get(str(told.get("thread")))
        if strip is None:
            continue  # another check says so
        length, widths = measure_strip(strip)
        for name, value in (
            ("length_mm", length),
            ("narrowest_mm", widths.min()),
            ("widest_mm", widths.max()),
        ):
            stated = told.get(name)
            given = isinstance(stated, int | float) and not isinstance(stated, bool)
            tally.measure(
                "ribbon_figure_mm",
                abs(float(stated) - value) if given else np.nan,
                FIGURE_MM + strip.grain_mm * len(widths),
                f"thread {told.get('thread')}: ribbons.json states {name} {stated}, and the model "
                f"has {value:.3f}",
            )


def measure_strip(strip: Strip) -> tuple[float, Floats]:
    """Return the length along the middle, and the width across it at each rung."""
    middle = strip.rungs.mean(axis=1)
    steps = np.diff(middle, axis=0, append=middle[:1])
    if not strip.closed:
        steps[-1] = 0.0
    size = np.linalg.norm(steps, axis=1)
    way = steps / np.where(size > 0.0, size, 1.0)[:, None]
    way = way + np.roll(way, 1, axis=0)
    way /= np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
    rung = strip.rungs[:, 1] - strip.rungs[:, 0]
    return float(size.sum()), np.linalg.norm(np.cross(rung, way), axis=1)
