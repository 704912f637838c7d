"""Check that the verdict is what the findings come to."""

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Tally

CARE, STOP = "with care", "not makeable"
#: Up to this share of its places each rule may be broken, and up to this share by far.
BROKEN = {
    "width": 0.02,
    "bend": 0.10,
    "crease": 0.10,
    "twist": 0.25,
    "layers": 0.10,
    "clearance": 0.10,
}
FAR = 0.005
#: Narrower ribbons want care.
NARROW_MM = 4.0


def check_verdict(job: Job, tally: Tally) -> None:
    """Check verdict.json against the findings, the ribbons, the map and the settings."""
    plan, ribbons, verdict = required(job.map), required(job.ribbons), required(job.verdict)
    place = tally.at("verdict.json").against("ribbons.json")
    found = [(str(finding.get("rule")), _level(finding)) for finding in ribbons["findings"]]
    narrow = [
        width
        for thread in ribbons["threads"]
        if isinstance(width := thread.get("narrowest_mm"), int | float)
    ]
    if narrow and min(narrow) < NARROW_MM and all(rule != "width" for rule, _ in found):
        found.append(("narrow", CARE))
    if _bodies(plan) > 1:
        found.append(("bodies", CARE))
    if any(dropped.kind == "id" for piece in plan.pieces for dropped in piece.dropped):
        found.append(("ids", CARE))
    stated = [(reason.get("rule"), reason.get("level")) for reason in verdict["reasons"]]
    place.same("reasons", map(str, stated), map(str, found))
    levels = [level for _, level in found]
    level = STOP if STOP in levels else CARE if levels else "makeable"
    place.equal("the verdict", verdict.get("level"), level)
    outcome = (job.settings or {}).get("outcome")
    if isinstance(outcome, dict):
        place.against("job.toml").equal("the verdict", verdict.get("level"), outcome.get("verdict"))
    forced = level == STOP
    place.equal("forced", verdict.get("forced"), forced)
    # What cannot be built is made only if that was asked for.
    place.against("job.toml").expect(
        not forced or job.options.get("force") is True, "it is forced, but nobody asked for that"
    )


def _level(finding: dict[str, Any]) -> str:
    """Return what a finding means."""
    rule = finding.get("rule")
    count, far, of = (finding.get(key) for key in ("count", "far", "of"))
    if not (type(count) is int and type(far) is int and type(of) is int):
        return "not known"
    few = count <= max(1, BROKEN.get(str(rule), 1.0) * of)
    near = rule == "hole" or far <= (0 if rule == "width" else max(1, FAR * of))
    return CARE if few and near and finding.get("severity") != "refuse" else STOP


def _bodies(plan: CrossingMap) -> int:
    """Count the parts of the weave that no crossing joins."""
    pairs = np.array([(c.over.thread, c.under.thread) for c in plan.crossings], dtype=np.int64)
    if not len(pairs):
        return 0
    _, pairs = np.unique(pairs, return_inverse=True)
    pairs = pairs.reshape(-1, 2)
    size = int(pairs.max()) + 1
    graph = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(size, size))
    return int(csgraph.connected_components(graph, directed=False)[0])
