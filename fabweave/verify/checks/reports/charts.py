"""Say what the charts of the page that opens a job have to show."""

from collections.abc import Iterator
from typing import Any

from fabweave.verify.measure.words import time_words
from fabweave.verify.read.waste_page import Seen

_WIDE, _ROW, _TOP, _FOOT = 300.0, 42.0, 22.0, 36.0


def charts_shown(waste: dict[str, Any]) -> Iterator[Seen]:
    """Yield the texts and bars of the charts, as waste.json has their figures.

    Parameters
    ----------
    waste : dict
    """
    told, estimate = waste["comparison"], waste["estimate"]
    used, kept = told["gross"], told["kept_mm2"] / waste["totals"]["area_mm2"]
    rest = 1.0 - used - kept
    yield Seen("div", "charts")
    yield from _chart("What becomes of the sheets", 3)
    yield from _bar(0, f"pieces: {used:.0%}", 0.0, used)
    yield from _bar(1, f"offcuts worth keeping: {kept:.0%}", used, used + kept)
    yield from _bar(2, f"waste, holes too: {rest:.0%}", used + kept, 1.0)
    yield from _chart("How much could be pieces", 4)
    ways = {
        "this job": used,
        "at the very best": told["best"],
        "pieces in rectangles": told["rectangles"]["utilisation"],
        "whole threads, uncut": told["strips"]["utilisation"],
    }
    for number, (name, share) in enumerate(ways.items()):
        words = "on no sheet" if share is None else f"{share:.0%}"
        yield from _bar(number, f"{name}: {words}", 0.0, share or 0.0)
    yield from _chart("How long it takes", 4)
    spans = {
        "cutting": estimate["cut_s"],
        "engraving": estimate["engrave_s"],
        "moves of the machine": estimate["travel_s"],
        "hands": [3600.0 * end for end in estimate["assembly"]["hours"]],
    }
    longest = max(span[1] for span in spans.values() if span is not None)
    for number, (name, span) in enumerate(spans.items()):
        low, high = span or (0.0, 0.0)
        yield from _bar(number, f"{name}: {time_words(span)}", low / longest, high / longest)


def _chart(head: str, rows: int) -> Iterator[Seen]:
    """Yield the head of a chart, and how much of its plane is shown."""
    yield Seen("div", "")
    yield Seen("h3", head)
    yield Seen("svg", f"0 0 {_WIDE:g} {rows * _ROW:g}")


def _bar(number: int, text: str, start: float, end: float) -> Iterator[Seen]:
    """Yield a row of a chart: its text, and the corners of its bar."""
    left, top, foot = _WIDE * start, _ROW * number + _TOP, _ROW * number + _FOOT
    right = max(_WIDE * end, left + 1.0)
    corners = (left, top), (right, top), (right, foot), (left, foot)
    yield Seen("text", text)
    yield Seen("polyline", " ".join(f"{x:.1f},{y:.1f}" for x, y in corners))
