"""Check in the model that the strands of each crossing have colours that differ."""

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.colours import lab_of
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Tally

#: With these, each thread has one colour, and one that crosses itself is not told apart.
BY_THREAD = ("hue-circle", "hue-range")
#: CIE L*a*b* differences below 2.3 are not seen; what is to tell strands apart differs by more.
LEAST_SEEN = 5.0


def check_colours(job: Job, tally: Tally) -> None:
    """Check that the strand above differs from the one below on either side of it.

    Within a strip the colour changes along panels only, so that what is seen between two
    crossings is of one colour.
    """
    plan, model = required(job.map), required(job.model)
    ends = _ends(plan, model, tally)
    if job.options.get("colours", "safe") in BY_THREAD:
        return
    for crossing in plan.crossings:
        above, below = ends.get((crossing.id, True)), ends.get((crossing.id, False))
        if above is None or below is None:
            continue  # another check says so
        away = np.linalg.norm(above[:, None] - below[None], axis=-1)
        tally.at(f"crossing {crossing.id}").at_least(
            "colours",
            float(away.min()),
            LEAST_SEEN,
            "its strands differ by {} in colour",
        )


def _ends(
    plan: CrossingMap, model: dict[str, Strip], tally: Tally
) -> dict[tuple[int, bool], Floats]:
    """Return the colours of each strand of each crossing, as it comes and as it leaves."""
    ends: dict[tuple[int, bool], Floats] = {}
    for thread in plan.threads:
        strip = model.get(thread.label)
        if strip is None or len(strip.entry) != len(thread.crossings):
            continue  # another check says so
        place = tally.at(f"thread {thread.label}")
        place.expect(
            bool(np.all(strip.light[:, 0] == strip.light[:, 1])),
            "a rung has not one colour from end to end",
        )
        place.expect(
            bool(np.all(_between(strip))), "its colour changes elsewhere than along a panel"
        )
        lab = lab_of(strip.light[:, 0])
        for at, key in enumerate(zip(thread.crossings, thread.over, strict=True)):
            ends[key] = lab[[strip.entry[at], strip.exit[at]]]
    return ends


def _between(strip: Strip) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Tell for each step between rungs whether its colour stays, or it lies on a panel."""
    count = len(strip.rungs)
    steps = np.arange(count if strip.closed else count - 1)
    stays = np.all(strip.light[steps, 0] == strip.light[(steps + 1) % count, 0], axis=1)
    panel = np.zeros(count, dtype=np.bool_)
    for entry, leave in zip(strip.entry.tolist(), strip.exit.tolist(), strict=True):
        panel[np.arange(entry, leave if leave > entry else leave + count) % count] = True
    return np.asarray(stays | panel[steps])
