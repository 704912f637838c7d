"""Check what waste.json says of the pieces of each thread."""

from typing import Any

import numpy as np

from fabweave.verify.checks.reports.preflight import sides_of
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.report import Tally

#: Lengths are rounded to a tenth of a millimetre, and shares to four digits.
_LENGTH_MM, _SHARE = 0.06, 2e-4


def check_splitting(plan: CrossingMap, waste: dict[str, Any], tally: Tally) -> None:
    """Check pieces, lengths and fill of every thread; a report without them is left alone."""
    told = waste.get("splitting")
    if told is None:
        return
    rows = told["threads"] if isinstance(told, dict) else []
    threads = [thread for thread in plan.threads if thread.pieces]
    tally.expect(
        [(row.get("thread"), row.get("pieces")) for row in rows]
        == [(thread.label, len(thread.pieces)) for thread in threads],
        "waste.json, splitting: its threads or their pieces are not the map's",
    )
    for row, thread in zip(rows, threads, strict=False):
        outlines = [plan.piece[name].outline for name in thread.pieces]
        area = sum(_area(outline) for outline in outlines)
        around = sum(float(np.prod(sides_of(outline))) for outline in outlines)
        longest = max(float(np.ptp(outline[:, 0])) for outline in outlines)
        where = f"waste.json, splitting, thread {thread.label}"
        for name, value, slack in (
            ("longest_mm", longest, _LENGTH_MM), ("fill", area / around, _SHARE),
        ):  # fmt: skip
            stated = row.get(name)
            good = isinstance(stated, int | float) and abs(stated - value) <= slack
            tally.expect(good, f"{where}: {name} is {stated}, but comes to {value:.4f}")


def _area(outline: Floats) -> float:
    """Return the area of a polygon."""
    x, y = (outline - outline[0]).T
    return abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))) / 2
