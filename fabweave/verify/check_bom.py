"""Check the shopping list: fasteners by diameter and grip, glue and tape."""

from collections import Counter
from typing import Any

import numpy as np

from fabweave.verify.arcs import ring_area, ring_length
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.ends import Reach, cut_rungs
from fabweave.verify.loading import Job
from fabweave.verify.report import Tally

#: Fewer spares leave a maker short; more are money for nothing.
_FEWEST_SPARES, _MOST_SPARES = 0.05, 0.10
#: Small lists round up.
_ROUND_UP = 2
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
    _check_fasteners(plan, waste["fasteners"], job.thickness_mm, tally)
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


def _check_fasteners(
    plan: CrossingMap, rows: list[dict[str, Any]], thickness: float | None, tally: Tally
) -> None:
    """Check the rows of fasteners against the holes of the pieces."""
    wanted = _fasteners(plan)
    stated = {(round(row["diameter_mm"], 3), row["layers"]): row for row in rows}
    tally.expect(len(stated) == len(rows), "waste.json lists a kind of fastener twice")
    tally.expect(
        sorted(stated) == sorted(wanted),
        f"waste.json lists fasteners {sorted(stated)}, the pieces have holes for {sorted(wanted)}",
    )
    for key, row in stated.items():
        where = f"waste.json, fasteners of {key[0]:g} mm through {key[1]} layers"
        needed, spare = row["needed"], row["spare"]
        tally.expect(
            needed == wanted[key], f"{where}: {needed} needed, the pieces take {wanted[key]}"
        )
        tally.expect(
            _FEWEST_SPARES * needed <= spare <= _MOST_SPARES * needed + _ROUND_UP,
            f"{where}: {spare} spare for {needed}",
        )
        tally.expect(row["buy"] == needed + spare, f"{where}: buy {row['buy']}")
        tally.expect(
            thickness is None or abs(row["grip_mm"] - key[1] * thickness) < 1e-6,
            f"{where}: grip {row['grip_mm']} mm in material of {thickness} mm",
        )


def _fasteners(plan: CrossingMap) -> Counter[tuple[float, int]]:
    """Count fasteners by diameter and layers, from the holes of the uppermost layers."""
    layers = Counter(s.crossing for piece in plan.pieces for s in piece.stations)
    found: Counter[tuple[float, int]] = Counter()
    for piece in plan.pieces:
        for one in piece.cutouts or ():
            station = piece.stations[one.station]
            if one.circle is not None and station.over:
                found[round(one.circle[2], 3), layers[station.crossing]] += 1
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
