"""Check that pieces lie across the grain where bends ask for it, and what is said where not."""

from typing import Any

import numpy as np

from fabweave.verify.checks.model.clearance import finding_about
from fabweave.verify.checks.model.ribbons import measure_strip
from fabweave.verify.drawing import Flags, Floats
from fabweave.verify.measure.bending import measure_bending
from fabweave.verify.measure.threads import station_run
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally, as_number, stated_number

#: A strip bends as it does across the grain if it is at most so far off.
_ACROSS_DEG = 45.0
#: By how much angles may be off, as stations are rounded; and radii, as the model is, as a share.
_ANGLE_DEG, _SHARE = 0.02, 2e-3


def check_grain(job: Job, tally: Tally) -> None:
    """Check that the better radius is taken only where pieces lie across the grain.

    Bends that are tighter than a strip along the grain takes must lie across it to within 45
    degrees wherever their piece lies as the rotations allow; or a finding says how many do not.
    """
    plan, ribbons = required(job.map), required(job.ribbons)
    place = tally.at("ribbons.json").against("crossing_map.json")
    along = _along_mm(ribbons)
    for label, radius in along.items():
        row = place.at(f"thread {label}" if label else "limits")
        row.expect(
            plan.layout.rotations.from_grain_deg == 90.0,
            "a radius is taken that holds across the grain, and pieces need not lie across it",
        )
        limits = _limits(ribbons, label)
        row.expect(
            stated_number(limits, "bend_mm") < radius,
            "strips along the grain are said to bend more tightly than those across it",
        )
    tight, sure, off = _bends(job, along)
    tally.count(len(off))
    finding = finding_about("grain", ribbons, place)
    worst = float(off[tight].max(initial=0.0))
    fewest = int(np.count_nonzero(sure & (off > _ACROSS_DEG + _ANGLE_DEG)))
    most = int(np.count_nonzero(tight & (off > _ACROSS_DEG - _ANGLE_DEG)))
    if finding is None:
        place.at("grain").expect(
            not fewest,
            f"{fewest} tight bends may lie more than {_ACROSS_DEG:g}° off the line across the "
            "grain, and no finding says so",
        )
        return
    _check_finding(finding, worst, (fewest, most), place.at("grain"))


def _check_finding(
    finding: dict[str, Any], worst: float, counts: tuple[int, int], place: Place
) -> None:
    """Check the finding about the grain."""
    place.number("limit", finding.get("limit"), _ACROSS_DEG)
    place.number("value", finding.get("value"), worst, within=_ANGLE_DEG)
    count = stated_number(finding, "count")
    place.expect(
        counts[0] <= count <= counts[1],
        f"{count:g} bends are said to lie aslant to the grain; {counts[0]} to {counts[1]} do",
    )


def _along_mm(ribbons: dict[str, Any]) -> dict[str, float]:
    """Return the radii of strips along the grain that are stated, by thread; "" is for all."""
    named = [("", ribbons.get("limits") or {})]
    named += [
        (str(record.get("thread")), record.get("limits") or {}) for record in ribbons["threads"]
    ]
    return {
        label: as_number(limits["bend_along_mm"])
        for label, limits in named
        if "bend_along_mm" in limits
    }


def _limits(ribbons: dict[str, Any], label: str) -> Any:
    """Return the limits of a thread, or those of all."""
    own = [record.get("limits") for record in ribbons["threads"] if record.get("thread") == label]
    return own[0] if own and own[0] is not None else ribbons.get("limits")


def _bends(job: Job, along: dict[str, float]) -> tuple[Flags, Flags, Floats]:
    """Return of each way from station to station whether it is tight, surely tight, and its angle.

    The angle is that to the line across the grain, at the worst that the rotations allow.
    """
    plan, model = required(job.map), required(job.model)
    tight, sure, off = [np.zeros(0, bool)], [np.zeros(0, bool)], [np.zeros(0)]
    radii: dict[str, tuple[Floats, Floats]] = {}
    for piece in plan.pieces:
        thread = plan.thread.get(piece.thread)
        strip = model.get(thread.label) if thread is not None else None
        start = station_run(thread, piece) if thread is not None else None
        if thread is None or strip is None or start is None:
            continue  # another check says so
        limit = along.get(thread.label, along.get("", 0.0))
        if not limit:
            continue
        if thread.label not in radii:
            bending = measure_bending(strip, measure_strip(strip)[1])
            radius = bending.span_radius_mm
            slack = 2 * radius**2 * bending.doubt_rad / bending.span_mm + _SHARE * radius
            radii[thread.label] = radius, slack
        radius, slack = radii[thread.label]
        ways = (start + np.arange(len(piece.stations) - 1)) % len(radius)
        tight.append(radius[ways] < limit + slack[ways])
        sure.append(radius[ways] < limit - slack[ways])
        step = np.abs(np.diff(piece.points, axis=0))
        off.append(
            np.degrees(np.arctan2(step[:, 1], step[:, 0])) + plan.layout.rotations.tolerance_deg
        )
    return np.concatenate(tight), np.concatenate(sure), np.concatenate(off)
