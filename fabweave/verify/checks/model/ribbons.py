"""Check the figures and findings of the ribbons against the map and the model."""

from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.development import total_turn_deg
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Tally, as_number

#: Figures are rounded to a thousandth, and the model's coordinates to 32 bits.
FIGURE_MM, FIGURE_DEG = 0.01, 0.002


def check_ribbon_references(plan: CrossingMap, ribbons: dict[str, Any], tally: Tally) -> None:
    """Check that ribbons.json speaks of the map's threads and crossings, and refuses nothing."""
    tally.at("ribbons.json").equal(
        "the list of threads, each with its number of crossings,",
        [(record.get("thread"), record.get("crossings")) for record in ribbons["threads"]],
        [(thread.label, len(thread.crossings)) for thread in plan.threads if thread.crossings],
    )
    labels = {thread.label: thread for thread in plan.threads}
    for number, finding in enumerate(ribbons["findings"]):
        place = tally.at("ribbons.json", f"finding {number}")
        thread, station = labels.get(finding.get("thread")), finding.get("station")
        place.expect(
            thread is not None
            and isinstance(station, int)
            and 0 <= station < len(thread.crossings)
            and thread.crossings[station] == finding.get("crossing"),
            f"thread {finding.get('thread')} does not make crossing {finding.get('crossing')} at "
            f"its station {station}",
        )
        other = finding.get("other")
        place.expect(other is None or other in labels, f"there is no thread {other}")
        # What is refused is not made.
        place.equal("severity", finding.get("severity"), "warn")


def check_markers(job: Job, tally: Tally) -> None:
    """Check that a ball stands in the model at the place of every finding, and nowhere else."""
    if job.ribbons is None or job.model is None:
        return
    findings = job.ribbons["findings"]
    model = tally.at("model.glb")
    model.same("markers of findings", job.markers, range(1, len(findings) + 1))
    for number, finding in enumerate(findings, start=1):
        position = finding.get("position")
        if number not in job.markers or not isinstance(position, list) or len(position) != 3:
            tally.fail(f"ribbons.json, finding {number - 1}: it has no place, or no ball there")
            continue
        model.at_most(
            "finding_mm",
            float(np.abs(job.markers[number] - np.array(position, dtype=float)).max()),
            FIGURE_MM,
            f"finding {number} is marked {{}} from its place",
        )


def check_ribbon_figures(job: Job, tally: Tally) -> None:
    """Check lengths, widths and waves of the ribbons, as stated, against the model."""
    model = required(job.model)
    for record in job.ribbons["threads"] if job.ribbons is not None else ():
        label = str(record.get("thread"))
        if (strip := model.get(label)) is None:
            continue  # another check says so
        place = tally.at("ribbons.json", f"thread {label}")
        length, widths = measure_strip(strip)
        for name, value in (
            ("length_mm", length),
            ("narrowest_mm", widths.min()),
            ("widest_mm", widths.max()),
        ):
            place.at_most(
                "ribbon_figure_mm",
                abs(as_number(record.get(name)) - value),
                FIGURE_MM + strip.grain_mm * len(widths),
                f"{name} is {record.get(name)}, and in the model {value:.3f}: {{}} off",
            )
        turn, doubt = total_turn_deg(strip)
        passes = max(len(strip.entry), 1)
        wave = turn / passes
        place.at_most(
            "wave_deg",
            abs(as_number(record.get("wave_deg")) - wave),
            FIGURE_DEG + doubt / passes,
            f"wave_deg is {record.get('wave_deg')}, and in the unfolded model {wave:.3f}: {{}} off",
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
