"""Check the shopping list: fasteners by diameter and grip, glue and tape."""

import math
from collections import Counter
from typing import Any

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.ends import lap_rungs, ring_of_rungs
from fabweave.verify.measure.joint_kinds import kind_of
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: Fewer spares leave a maker short; more are money for nothing.
_FEWEST_SPARES, _MOST_SPARES = 0.05, 0.10
#: Small lists round up.
_ROUND_UP = 2
#: Holes and grips are within what hardware takes to this.
_FIT_MM = 1e-5
#: Grips are sums of thicknesses, told to this.
_GRIP_DECIMALS = 5
#: Lengths agree to this, areas to this much along their whole edge.
_SAME_MM = 0.02


def check_bom(job: Job, tally: Tally) -> None:
    """Check the fasteners, glue and tape of waste.json; a report without them is left alone."""
    plan, waste, place = required(job.map), required(job.waste), tally.at("waste.json")
    listed = [name for name in ("fasteners", "glue", "tape") if name in waste]
    place.expect(len(listed) in (0, 3), f"only {' and '.join(listed)} are listed")
    if "fasteners" not in waste:
        return
    _check_fasteners(job, waste["fasteners"], waste.get("hardware") or [], place)
    area, edge, length = _laps(plan, job)
    counts = Counter(kind_of(joint).bought for joint in plan.joints)
    for name, key, value, slack in (
        ("glue", "area_mm2", area, _SAME_MM * edge),
        ("tape", "length_mm", length, _SAME_MM * counts["tape"]),
    ):
        entry, here = waste.get(name), place.at(name)
        if not isinstance(entry, dict):
            here.fail("it is not listed")
            continue
        here.equal("joints", entry.get("joints"), counts[name])
        here.number(key, entry.get(key), value, within=slack + 1e-3)


def _check_fasteners(
    job: Job, rows: list[dict[str, Any]], sorts: list[dict[str, Any]], place: Place
) -> None:
    """Check the rows of fasteners against the holes of the pieces, and the hardware for them."""
    wanted = _fasteners(job)
    # Where no thickness is stated, nor can a grip be checked.
    gripped = all(not math.isnan(thick) for _, thick in job.layers.values())
    stated = {
        (
            round(row["diameter_mm"], 3),
            row["layers"],
            round(row["grip_mm"], _GRIP_DECIMALS) if gripped else None,
        ): row
        for row in rows
    }
    place.expect(len(stated) == len(rows), "a kind of fastener is listed twice")
    place.same("fasteners (diameter, layers, grip)", stated, wanted)
    for key, row in stated.items():
        here = place.at(f"fasteners of {key[0]:g} mm through {key[1]} layers of {key[2]} mm")
        needed, spare = row["needed"], row["spare"]
        here.equal("needed", needed, wanted[key])
        here.expect(
            _FEWEST_SPARES * needed <= spare <= _MOST_SPARES * needed + _ROUND_UP,
            f"{spare} are spare for {needed}",
        )
        here.equal("buy", row["buy"], needed + spare)
        if "fits" in row:
            _check_hardware(row, sorts, here)


def _check_hardware(row: dict[str, Any], sorts: list[dict[str, Any]], place: Place) -> None:
    """Check that the hardware that is named goes through the hole and holds the stack."""
    fitting = []
    for sort in sorts:
        low, high = sort["hole_mm"]
        holds = any(
            least - _FIT_MM <= row["grip_mm"] <= most + _FIT_MM for least, most in sort["grips_mm"]
        )
        if holds and low - _FIT_MM <= row["diameter_mm"] <= high + _FIT_MM:
            fitting.append(sort["name"])
    place.equal("the hardware that fits", row["fits"], fitting)


def _fasteners(job: Job) -> Counter[tuple[float, int, float | None]]:
    """Count fasteners by diameter, layers and grip, from the holes of the uppermost layers."""
    fasteners: Counter[tuple[float, int, float | None]] = Counter()
    for piece in job.map.pieces if job.map is not None else ():
        for cutout in piece.cutouts or ():
            station = piece.stations[cutout.station]
            crossing = job.map.crossing.get(station.crossing) if job.map is not None else None
            idle = crossing is not None and crossing.fastened is False
            if cutout.circle is not None and station.over and not idle:
                count, thick = job.layers[station.crossing]
                grip = None if math.isnan(thick) else round(thick, _GRIP_DECIMALS)
                fasteners[round(cutout.circle[2], 3), count, grip] += 1
    return fasteners


def _laps(plan: CrossingMap, job: Job) -> tuple[float, float, float]:
    """Return the area of all glued laps, the length of their edges, and that of all seams."""
    area = edge = length = 0.0
    for joint in plan.joints:
        development = job.developments.get(joint.pieces[0])
        if development is None:
            continue
        panel = development.panels[-1]
        bought = kind_of(joint).bought
        if bought == "glue":
            lap = shapely.Polygon(ring_of_rungs(lap_rungs(development.window, panel, joint)))
            area += lap.area
            edge += lap.length
        elif bought == "tape":
            right, left = (panel[0] + panel[2]) / 2.0, (panel[1] + panel[3]) / 2.0
            way = panel[2] + panel[3] - panel[0] - panel[1]
            across = left - right
            length += abs(float(way[0] * across[1] - way[1] * across[0])) / float(np.hypot(*way))
    return area, edge, length
