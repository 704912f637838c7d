"""Check in the model how near ribbons come to one another, against what is said about it."""

from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.nearness import Near, cut_steps, near_parts
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

#: The model is rounded to 32 bits, and figures to a ten-thousandth.
GAP_MM = 0.002


def check_clearance(job: Job, tally: Tally) -> None:
    """Check that no two ribbons are nearer than is said.

    Middle surfaces that do not cross there are to be one thickness (half of either's) and the
    clearance apart, one thickness if they part from the same crossing. If no finding says
    otherwise, all are. If one does, the gap that falls shortest of what is wanted, and how many
    places do, are as it says.
    """
    if job.map is None or job.model is None or job.ribbons is None:
        return
    thickness, clearance = (
        _thicknesses(job),
        stated_number(job.ribbons.get("limits"), "clearance_mm"),
    )
    stated = {(value, job.supplies[key].thickness_mm) for key, value in thickness.items()}
    for name, value, told_mm in (
        *(("thickness", *pair) for pair in stated),
        ("clearance", clearance, job.clearance_mm),
    ):
        tally.expect(
            np.isfinite(value) and value >= 0 and told_mm in (None, value),
            f"ribbons.json states a {name} of {value:g} mm, and job.toml {told_mm} mm",
        )
    if not np.isfinite([*thickness.values(), clearance]).all():
        return
    steps = cut_steps(job.map, job.model)
    tally.count(len(steps.part))
    near = near_parts(steps, max(thickness.values(), default=0.0) + clearance + GAP_MM)
    layers = np.array([thickness[key] for key in near.parts[:, [0, 2]].ravel().tolist()])
    wanted = layers.reshape(-1, 2).sum(axis=1) / 2.0 + np.where(near.parting, 0.0, clearance)
    told = [one for one in job.ribbons["findings"] if one.get("rule") == "clearance"]
    tally.expect(len(told) <= 1, f"ribbons.json has {len(told)} findings about clearance")
    if told:
        _check_told(told[0], near, wanted, tally)
        return
    for at in np.flatnonzero(near.gap_mm < wanted - GAP_MM).tolist():
        tally.fail(
            f"{_names(job.map, near, at)} are {near.gap_mm[at]:.3f} mm apart, middle to middle, "
            f"where {wanted[at]:g} mm are wanted, and ribbons.json does not say so"
        )


def _thicknesses(job: Job) -> dict[int, float]:
    """Return the thickness by which each thread was held, as ribbons.json states it.

    One that is stated for a thread by itself counts more than one for all.
    """
    if job.map is None or job.ribbons is None:
        return {}
    common = stated_number(job.ribbons.get("limits"), "thickness_mm")
    own = {
        str(record.get("thread")): stated_number(record["limits"], "thickness_mm")
        for record in job.ribbons["threads"]
        if "limits" in record
    }
    return {
        thread.id: own.get(thread.label, common) for thread in job.map.threads if thread.crossings
    }


def _check_told(found: dict[str, Any], near: Near, wanted: Floats, tally: Tally) -> None:
    """Check a finding about clearance."""
    value, limit, count = (stated_number(found, key) for key in ("value", "limit", "count"))
    share = float((near.gap_mm / wanted).min(initial=np.inf))
    tally.measure(
        "short_of_mm",
        abs(value - share * limit),
        GAP_MM,
        f"ribbons.json says that the nearest ribbons are {value:g} mm apart where {limit:g} mm are "
        f"wanted, and in the model they are {share * limit:.4f} mm apart",
    )
    tally.expect(
        bool(np.any(np.abs(wanted - limit) < GAP_MM)),
        f"ribbons.json says that {limit:g} mm are wanted between ribbons where nothing is near",
    )
    fewest = np.count_nonzero(near.gap_mm < wanted - GAP_MM)
    most = np.count_nonzero(near.gap_mm < wanted + GAP_MM)
    tally.expect(
        fewest <= count <= most,
        f"ribbons.json says that ribbons are too near in {count:g} places, and in the model they "
        f"are in {fewest} to {most}",
    )


def _names(plan: CrossingMap, near: Near, at: int) -> str:
    """Name the two ribbons of a pair and the places where they are."""
    places = []
    for thread, part in near.parts[at].reshape(2, 2).tolist():
        own = plan.thread[thread]
        places.append(f"thread {own.label} after crossing {own.crossings[max(part, 0) // 2]}")
    return " and ".join(places)


def stated_number(record: object, key: str) -> float:
    """Return a number of a record; NaN if it is none."""
    value = record.get(key) if isinstance(record, dict) else None
    good = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if good and value is not None else float("nan")
