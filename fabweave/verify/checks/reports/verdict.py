"""Check that the verdict is what the findings come to."""

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.words import counted
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

CARE, STOP = "with care", "not makeable"
#: Up to this share of its places each rule may be broken, and up to this share by far.
BROKEN = {
    "width": 0.02,
    "bend": 0.10,
    "crease": 0.10,
    "twist": 0.25,
    "layers": 0.10,
    "clearance": 0.10,
    "grain": 0.10,
}
FAR = 0.005
#: Narrower ribbons want care; widths are rounded to a thousandth.
NARROW_MM, _ROUNDED_MM = 4.0, 5e-4
#: What is left out is told from this share of the surface on.
LEFT_OUT = 0.01
#: What is said to do where care is wanted.
CARE_WORDS = {
    "width": "handle them with tweezers",
    "bend": "damp or roll the strip there before it is woven",
    "grain": "damp or roll the strip there before it is woven",
    "crease": "soften the crease by rolling, or score it",
    "twist": "ease the strip in slowly, or narrow it there by hand",
    "layers": "the layers press on one another: do not fasten there before all are in place",
    "clearance": "push the strips aside there, or trim an edge by hand",
    "hole": "leave those crossings without a fastener, or use glue",
    "narrow": "handle these with tweezers; their labels may have no room",
    "bodies": "each is an object of its own; --bodies largest keeps one",
    "left-out": "look at the picture: this is not the whole model; --bodies join makes one surface "
    "of bodies that run into one another",
    "ids": "write the id on as you peel the piece, from the picture of its sheet; a larger --size, "
    "wider ribbons (--width) or --hole none make room for it",
}
#: What parts a finding's text, and where notes tell the size at which all holds.
_MEND = ". To fix it, use "
_BODIES = re.compile(r"\d+ of \d+ bodies w\w+ left out, with .* and (\d+)% of the surface .*")
_SMALLEST = re.compile(r"^checks: .* hold(?:, and would)? at --size (\d+)mm")


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
    if _left_out(job) >= LEFT_OUT:
        found.append(("left-out", CARE))
    if any(dropped.kind == "id" for piece in plan.pieces for dropped in piece.dropped):
        found.append(("ids", CARE))
    stated = [(reason.get("rule"), reason.get("level")) for reason in verdict["reasons"]]
    place.same("reasons", map(str, stated), map(str, found))
    told = [
        *(_told(finding) for finding in ribbons["findings"]),
        *_told_besides(plan, min(narrow, default=NARROW_MM)),
        f"bodies with {_left_out(job):.0%} of the model's surface were left out",
    ]
    for reason in verdict["reasons"]:
        here = place.at(f"reason {reason.get('rule')}")
        advice = CARE_WORDS.get(str(reason.get("rule")), "") if reason.get("level") == CARE else ""
        here.equal("its advice", reason.get("advice"), advice)
        here.expect(
            reason.get("text") in told,
            f"nothing was found of which it is said: {reason.get('text')!r:.100}",
        )
    _check_remedies(job, ribbons, tally.at("ribbons.json"))
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


def _left_out(job: Job) -> float:
    """Return the share of the model's surface whose bodies notes say were left out."""
    notes = (job.waste or {}).get("notes")
    found = [_BODIES.fullmatch(note) for note in notes or () if isinstance(note, str)]
    return next((int(one[1]) / 100 for one in found if one), 0.0)


def _told(finding: dict[str, Any]) -> str:
    """Return what a finding says of what was found, without what would mend it."""
    return str(finding.get("text", "")).partition(_MEND)[0]


def _told_besides(plan: CrossingMap, narrowest_mm: float) -> Iterator[str]:
    """Yield what may be said of other things than rules that the ribbons break."""
    for width in (narrowest_mm - _ROUNDED_MM, narrowest_mm + _ROUNDED_MM):
        yield f"ribbons are as narrow as {width:.1f} mm"
    yield f"there are {_bodies(plan)} bodies that no thread joins"
    unnamed = sum(any(one.kind == "id" for one in piece.dropped) for piece in plan.pieces)
    yield f"{counted(unnamed, 'piece has', 'pieces have')} no room for an id"


def _check_remedies(job: Job, ribbons: dict[str, Any], place: Place) -> None:
    """Check that each finding says in words what its figures say would mend it, and notes do, too.

    Whether it would is not known here: sizes and widths were found by weaving anew.
    """
    notes = (job.waste or {}).get("notes")
    for number, finding in enumerate(ribbons["findings"]):
        here, ways = place.at(f"finding {number}"), []
        if (size := finding.get("size_mm")) is not None:
            ways.append(f"--size {size}mm")
        if (factor := finding.get("width_factor")) is not None:
            ways.append(f"ribbons {round(100 * (1 - factor))} % narrower (--width)")
        if (refine := finding.get("refine")) is not None:
            ways.append(f"--refine {refine}")
        remedy, text = ", or ".join(ways), str(finding.get("text", ""))
        here.equal("its remedy", finding.get("remedy", ""), remedy)
        here.equal("what its text says would mend it", text.partition(_MEND)[2], remedy)
        cause = finding.get("cause")
        here.expect(cause is None or f"({cause})" in text, f"its text does not say why: {cause!r}")
        # Notes tell of holes in other words.
        here.expect(
            notes is None or finding.get("rule") == "hole" or text in notes, "no note says the same"
        )
    if notes is not None:
        smallest = ribbons.get("smallest_size_mm")
        told = [int(size) for note in notes for size in _SMALLEST.findall(note)]
        # The size that the object has is no news.
        known: list[int | None] = [*told] or [None]
        if job.mesh is not None and not told:
            size = float(np.ptp(job.mesh.vertices, axis=0).max())
            known += [math.ceil(size - _ROUNDED_MM), math.ceil(size + _ROUNDED_MM)]
        place.expect(
            smallest in known,
            f"smallest_size_mm is {smallest}, but notes tell {told or 'of none'}",
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
