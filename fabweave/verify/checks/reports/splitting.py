"""Check what waste.json says of the pieces of each thread."""

from typing import Any

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.areas import least_rectangle, polygon_area
from fabweave.verify.statement import Tally

#: Lengths are rounded to a tenth of a millimetre, and shares to four digits.
_LENGTH_MM, _SHARE = 0.06, 2e-4


def check_splitting(plan: CrossingMap, waste: dict[str, Any], tally: Tally) -> None:
    """Check pieces, lengths and fill of every thread; a report without them is left alone."""
    splitting = waste.get("splitting")
    if splitting is None:
        return
    rows = splitting["threads"] if isinstance(splitting, dict) else []
    threads = [thread for thread in plan.threads if thread.pieces]
    place = tally.at("waste.json", "splitting")
    place.equal(
        "the list of threads, each with its number of pieces,",
        [(row.get("thread"), row.get("pieces")) for row in rows],
        [(thread.label, len(thread.pieces)) for thread in threads],
    )
    for row, thread in zip(rows, threads, strict=False):
        outlines = [plan.piece[name].outline for name in thread.pieces]
        area = sum(polygon_area(outline) for outline in outlines)
        around = sum(float(np.prod(least_rectangle(outline))) for outline in outlines)
        longest = max(float(np.ptp(outline[:, 0])) for outline in outlines)
        here = place.at(f"thread {thread.label}")
        here.number("longest_mm", row.get("longest_mm"), longest, within=_LENGTH_MM)
        here.number("fill", row.get("fill"), area / around, within=_SHARE)
