"""Where an object is in trouble, and how it goes when it is let go, by the rungs of ribbons."""

from typing import Any

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.form.hold import Foretold
from fabweave.form.settle import BOUND
from fabweave.job.planned import PlannedJob
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.broken_rule import FAR

#: A place with so many times what a rule wants is shown as if it had no trouble at all.
_AT_EASE = 1.25


def rungs_of_passes(woven: WovenObject, values: FloatArray) -> FloatArray:
    """Return values of passes for each rung: the same over a crossing, and between evenly."""
    ribbons = woven.ribbons
    panel = np.repeat(ribbons.entry, 2) + np.tile([0, 1], len(ribbons.entry))
    found: FloatArray = np.interp(np.arange(ribbons.n_rungs), panel, np.repeat(values, 2))
    return found


def trouble(
    planned: PlannedJob, foretold: Foretold | None
) -> tuple[dict[str, int], dict[str, np.ndarray[Any, Any]]]:
    """Return in how many places each rule is broken, and how near to it or past it each rung is.

    Arrays hold 0 where all is at ease, 97 where a rule is just kept, and 255 where it is far from
    kept. Beside the rules, ``form`` is how far crossings go when all is let go, and ``moves`` where
    each rung goes, in millimetres.
    """
    woven, n_passes = planned.woven, len(planned.woven.ribbons.entry)
    counts: dict[str, int] = {}
    arrays: dict[str, np.ndarray[Any, Any]] = {}

    def add(rule: str, margins: FloatArray) -> None:
        heat = np.clip((_AT_EASE - margins) / (_AT_EASE - FAR), 0.0, 1.0)
        arrays[f"heat_{rule}"] = rungs_of_passes(woven, 255.0 * heat).round().astype(np.uint8)

    for rule, measured in planned.check.measured.items():
        if not len(measured.value):
            continue
        worst, margins = np.full(n_passes, np.inf), measured.margins
        for passes in (measured.passes, measured.others):
            there = passes >= 0
            np.minimum.at(worst, passes[there], margins[there])
        counts[rule] = int((margins < 1.0).sum())
        add(rule, worst)
    if foretold is not None and foretold.moves is not None:
        crossing = woven.weave.threads.crossing
        # What is made to settle onto the mesh is off it by a part of how far crossings go.
        far = np.linalg.norm(foretold.moves, axis=1)
        far *= foretold.off_mm / max(float(far.max(initial=0.0)), 1e-9)
        margins = BOUND * woven.size_mm / np.maximum(far, 1e-9)
        counts["form"] = int((margins < 1.0).sum())
        add("form", margins[crossing])
        moves = foretold.moves[crossing]
        arrays["moves"] = np.column_stack(
            [rungs_of_passes(woven, moves[:, axis]) for axis in range(3)]
        ).astype("<f4")
    return counts, arrays
