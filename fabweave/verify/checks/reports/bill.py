"""Check the shopping list: fasteners by diameter and grip, glue and tape."""

import math
from collections import Counter
from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.arcs import ring_area, ring_length
from fabweave.verify.measure.ends import Reach, cut_rungs
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

#: Fewer spares leave a maker short; more are money for nothing.
_FEWEST_SPARES, _MOST_SPARES = 0.05, 0.10
#: Small lists round up.
_ROUND_UP = 2
#: Grips are sums of thicknesses, told to this.
_GRIP_DECIMALS = 5
#: Lengths agree to this, areas to this much along their whole edge.
_SAME_MM = 0.02


def check_bom(job: Job, tally: Tally) -> None:
    """Check the fasteners, glue and tape of waste.json; a report without them is left alone."""
    plan, waste = job.map, job.waste
    if plan is None or waste is None:
        return
    told = [name for name in ("fasteners", "glue", "tape") if name in waste]
    tally.expect(len(told) in (0, 3), f"waste.json tells only of {' and '.join(told)}")
    if "fasteners" not in waste:
        return
    _check_fasteners(job, waste["fasteners"], tally)
    area, edge, length = _laps(plan, job)
    counts = Counter(joint.kind for joint in plan.joints)
    for name, kind, key, value, slack in (
        ("glue", "glue", "area_mm2", area, _SAME_MM * edge),
        ("tape", "none", "length_mm", length, _SAME_MM * counts["none"]),
    ):
        entry = waste.get(name)
        if not isinstance(entry, dict):
            tally.fail(f"waste.json has no {name}")
            continue
        tally.expect(
            entry.get("joints") == counts[kind],
            f"waste.json: {name} for {entry.get('joints')} joints, the map has {counts[kind]}",
        )
        stated = entry.get(key)
        good = isinstance(stated, int | float) and abs(stated - value) <= slack + 1e-3
        tally.expect(good, f"waste.json: {name}.{key} is {stated}, but comes to {value:.3f}")


def _check_fasteners(job: Job, rows: list[dict[str, Any]], tally: Tally) -> None:
    """Check the rows of fasteners against the holes of the pieces."""
    wanted = _fasteners(job)
    # Where no thickness is told, nor can a grip be checked.
    told = all(not math.isnan(thick) for _, thick in job.layers.values())
    stated = {
        (
            round(row["diameter_mm"], 3),
            row["layers"],
            round(row["grip_mm"], _GRIP_DECIMALS) if told else None,
        ): row
        for row in rows
    }
    tally.expect(len(stated) == len(rows), "waste.json lists a kind of fastener twice")
    tally.expect(
        sorted(stated) == sorted(wanted),
        f"waste.json lists fasteners {sorted(stated)}, the pieces have holes for {sorted(wanted)} "
        "(diameter, layers, grip)",
    )
    for key, row in stated.items():
        where = f"waste.json, fasteners of {key[0]:g} mm through {key[1]} layers of {key[2]} mm"
        needed, spare = row["needed"], row["spare"]
        tally.expect(
            needed == wanted[key], f"{where}: {needed} needed, the pieces take {wanted[key]}"
        )
        tally.expect(
            _FEWEST_SPARES * needed <= spare <= _MOST_SPARES * needed + _ROUND_UP,
            f"{where}: {spare} spare for {needed}",
        )
        tally.expect(row["buy"] == needed + spare, f"{where}: buy {row['buy']}")


def _fasteners(job: Job) -> Counter[tuple[float, int, float | None]]:
    """Count fasteners by diameter, layers and grip, from the holes of the uppermost layers."""
    found: Counter[tuple[float, int, float | None]] = Counter()
    for piece in job.map.pieces if job.map is not None else ():
        for one in piece.cutouts or ():
            station = piece.stations[one.station]
            if one.circle is not None and station.over:
                count, thick = job.layers[station.crossing]
                grip = None if math.isnan(thick) else round(thick, _GRIP_DECIMALS)
                found[round(one.circle[2], 3), count, grip] += 1
    return found


def _laps(plan: CrossingMap, job: Job) -> tuple[float, float, float]:
    """Return the area of all glued laps, the length of their edges, and that of all seams."""
    area = edge = length = 0.0
    for joint in plan.joints:
        own = job.developed.get(joint.pieces[0])
        if own is None:
            continue
        panel = own.panels[-1]
        if joint.kind == "glue":
            half = Reach((joint.lap_mm or 0.0) / 2.0)
            entered = int(np.argmin(np.hypot(*(own.window[:, 0] - panel[0]).T)))
            rungs = cut_rungs(own.window, entered, entered, (half, half))
            ring = np.concatenate([rungs[:, 0], rungs[::-1, 1]])
            straight = np.zeros(len(ring))
            area += abs(ring_area(ring, straight))
            edge += ring_length(ring, straight)
        elif joint.kind == "none":
            right, left = (panel[0] + panel[2]) / 2.0, (panel[1] + panel[3]) / 2.0
            way = panel[2] + panel[3] - panel[0] - panel[1]
            across = left - right
            length += abs(float(way[0] * across[1] - way[1] * across[0])) / float(np.hypot(*way))
    return area, edge, length
