"""Say what the page on material should show of where threads were cut."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from fabweave.verify.measure.words import counted
from fabweave.verify.read.waste_page import Seen, row

#: What each preference has the least of.
_LEAST = {"balanced": "cost", "work": "work", "waste": "sheet"}
#: Where the chart of the page has its axis: x of the shortest and the longest, y of nothing and of
#: the most.
_SHORT, _LONG, _NOUGHT, _MOST = 90.0, 470.0, 156.0, 34.0


def splitting_shown(splitting: dict[str, Any]) -> Iterator[Seen]:
    """Yield what is seen of ``splitting`` in waste.json: sentences, a chart, and two tables."""
    choices, taken = splitting["choices"], splitting["max_length_mm"]
    yield Seen("h2", "Pieces")
    yield Seen(
        "p",
        f"Pieces are {splitting_reason(splitting)} (--max-length, --prefer). What other lengths "
        "come to, before nesting: shorter pieces waste less but need more work. Hours are those of "
        "handling pieces and joints, of cutting outlines and engraving names; weaving takes the "
        "same. The cost is that of sheets, fasteners and hours, in EUR, at rates that are "
        "estimates.",
    )
    if len(choices) > 1:
        yield from _chart(choices)
    yield from row(
        "--max-length", "pieces", "joints", "sheets", "predicted use", "hours", "cost", tag="th"
    )
    for choice in choices:
        about = "" if choice["exact"] else "about "
        yield from row(
            f"{choice['max_length_mm']:g} mm",
            f"{about}{choice['pieces']}",
            f"{about}{choice['joints']}",
            choice["sheets"],
            f"{choice['utilisation']:.0%}",
            f"{choice['hours']:.1f}",
            f"{choice['cost']:.0f}",
            kind="taken" if choice["max_length_mm"] == taken else "",
        )
    yield Seen("summary", "Thread by thread")
    yield from row("thread", "pieces", "longest", "share of rectangles filled", tag="th")
    for thread in splitting["threads"]:
        longest, fill = f"{thread['longest_mm']:.0f} mm", f"{thread['fill']:.0%}"
        yield from row(thread["thread"], thread["pieces"], longest, fill)


def splitting_reason(splitting: dict[str, Any]) -> str:
    """Return what the length that was taken comes to, and why it was."""
    chosen, prefer = splitting["chosen"], splitting["prefer"]
    said = (
        f"at most {chosen['max_length_mm']:g} mm: {counted(chosen['pieces'], 'piece')}, "
        f"{counted(chosen['joints'], 'joint')}, about {counted(chosen['sheets'], 'sheet')}"
    )
    if longer := chosen["longer"]:
        said += f"; {counted(longer, 'piece is', 'pieces are')} longer, as no cut helps"
    if prefer is None:
        return f"{said}; as asked for"
    lengths = counted(len(splitting["choices"]), "length")
    return f"{said}; the least {_LEAST[prefer]} of {lengths}"


def _chart(choices: list[dict[str, Any]]) -> Iterator[Seen]:
    """Yield the chart: use and joints over the greatest length, each from nothing to its most."""
    length = np.array([choice["max_length_mm"] for choice in choices], dtype=np.float64)
    spread = max(float(np.ptp(length)), 1e-9)
    x = _SHORT + (_LONG - _SHORT) * (length - length[0]) / spread
    yield Seen("svg", "0 0 560 190")
    for key, name, form in (("utilisation", "use", ".0%"), ("joints", "joints", ".0f")):
        value = np.array([choice[key] for choice in choices], dtype=np.float64)
        y = _NOUGHT - (_NOUGHT - _MOST) * value / max(float(value.max()), 1e-9)
        spots = [f"{across:.1f},{up:.1f}" for across, up in zip(x, y, strict=True)]
        yield Seen("polyline", " ".join(spots))
        yield from (Seen("circle", spot) for spot in spots)
        yield from (Seen("text", f"{name} {value[end]:{form}}") for end in (0, -1))
    yield from (Seen("text", f"{length[end]:.0f} mm") for end in (0, -1))
