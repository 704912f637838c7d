"""Check in the model how near ribbons come to one another, against what is said about it."""

from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.nearness import Near, cut_steps, near_parts
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally, stated_number

#: The model is rounded to 32 bits, and figures to a ten-thousandth.
GAP_MM = 0.002


def check_clearance(job: Job, tally: Tally) -> None:
    """Check that no two ribbons are nearer than is said.

    Middle surfaces that do not cross there are to be one thickness (half of either's) and the
    clearance apart, one thickness if they part from the same crossing. If no finding says
    otherwise, all are. If one does, the gap that falls shortest of what is wanted, and how many
    places do, are as it says.
    """
    plan, ribbons = required(job.map), required(job.ribbons)
    place = tally.at("ribbons.json")
    thickness = _thicknesses(plan, ribbons)
    clearance = stated_number(ribbons.get("limits"), "clearance_mm")
    pairs = {(value, job.supplies[key].thickness_mm) for key, value in thickness.items()}
    for name, value, wanted_mm in (
        *(("thickness", *pair) for pair in pairs),
        ("clearance", clearance, job.clearance_mm),
    ):
        place.expect(
            np.isfinite(value) and value >= 0 and wanted_mm in (None, value),
            f"the {name} is {value:g} mm, and in job.toml {wanted_mm} mm",
        )
    if not np.isfinite([*thickness.values(), clearance]).all():
        return
    steps = cut_steps(plan, required(job.model))
    tally.count(len(steps.part))
    near = near_parts(steps, max(thickness.values(), default=0.0) + clearance + GAP_MM)
    layers = np.array([thickness[key] for key in near.parts[:, [0, 2]].ravel().tolist()])
    wanted = layers.reshape(-1, 2).sum(axis=1) / 2.0 + np.where(near.parting, 0.0, clearance)
    if finding := finding_about("clearance", ribbons, place):
        _check_finding(finding, near, wanted, place.at("clearance"))
        return
    for at in np.flatnonzero(near.sure_mm < wanted - GAP_MM).tolist():
        tally.fail(
            f"{_names(plan, near, at)} are {near.gap_mm[at]:.3f} mm apart, middle to middle, "
            f"where {wanted[at]:g} mm are wanted, and ribbons.json does not say so"
        )


def finding_about(rule: str, ribbons: dict[str, Any], place: Place) -> dict[str, Any] | None:
    """Return the finding about a rule, of which there may be one only; None if there is none."""
    findings = [finding for finding in ribbons["findings"] if finding.get("rule") == rule]
    place.expect(len(findings) <= 1, f"there are {len(findings)} findings about {rule}")
    return findings[0] if findings else None


def _thicknesses(plan: CrossingMap, ribbons: dict[str, Any]) -> dict[int, float]:
    """Return the thickness by which each thread was held, as ribbons.json states it.

    One that is stated for a thread by itself counts more than one for all.
    """
    common = stated_number(ribbons.get("limits"), "thickness_mm")
    by_label = {
        str(record.get("thread")): stated_number(record["limits"], "thickness_mm")
        for record in ribbons["threads"]
        if "limits" in record
    }
    return {
        thread.id: by_label.get(thread.label, common) for thread in plan.threads if thread.crossings
    }


def _check_finding(finding: dict[str, Any], near: Near, wanted: Floats, place: Place) -> None:
    """Check a finding about clearance."""
    value, limit, count = (stated_number(finding, key) for key in ("value", "limit", "count"))
    least, sure = (
        limit * float((gap_mm / wanted).min(initial=np.inf))
        for gap_mm in (near.gap_mm, near.sure_mm)
    )
    place.at_most(
        "short_of_mm",
        max(least - value, value - sure),
        GAP_MM,
        f"the nearest ribbons are said to be {value:g} mm apart where {limit:g} mm are wanted; in "
        f"the model they are {least:.4f} mm apart: {{}} off",
    )
    place.expect(
        bool(np.any(np.abs(wanted - limit) < GAP_MM)),
        f"{limit:g} mm are said to be wanted between ribbons where nothing is near",
    )
    fewest = np.count_nonzero(near.sure_mm < wanted - GAP_MM)
    most = np.count_nonzero(near.gap_mm < wanted + GAP_MM)
    place.expect(
        fewest <= count <= most,
        f"ribbons are said to be too near in {count:g} places; in the model they are in {fewest} "
        f"to {most}",
    )


def _names(plan: CrossingMap, near: Near, at: int) -> str:
    """Name the two ribbons of a pair and the places where they are."""
    places = []
    for thread, part in near.parts[at].reshape(2, 2).tolist():
        label, crossings = plan.thread[thread].label, plan.thread[thread].crossings
        places.append(f"thread {label} after crossing {crossings[max(part, 0) // 2]}")
    return " and ".join(places)
