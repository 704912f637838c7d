"""Draw bars that print: inline SVG, whose areas no printer leaves out."""

import html
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from fabweave.report.costs.texts import time_text
from fabweave.report.waste import WasteReport
from fabweave.stock.machine import Span

#: Width of a chart, height of a row, and where in it stand the foot of the text, and the bar.
_WIDE, _ROW, _FOOT, _BAR = 300.0, 42.0, 15.0, (22.0, 36.0)
_SECONDS_PER_HOUR = 3600.0


class Bar(NamedTuple):
    """A row of a chart: what it says, and from where to where its bar goes, of 1 in all."""

    text: str
    start: float
    end: float


def bar_chart(name: str, bars: Sequence[Bar]) -> str:
    """Return a chart as an element of a page.

    Parameters
    ----------
    name : str
        What the chart shows, for those who hear it.
    bars : sequence of Bar

    Examples
    --------
    >>> chart = bar_chart("use", [Bar("pieces: 25%", 0.0, 0.25)])
    >>> '<polyline points="0.0,22.0 75.0,22.0 75.0,36.0 0.0,36.0" fill="#0072b2"/>' in chart
    True
    """
    parts = []
    for number, bar in enumerate(bars):
        left, right = _WIDE * bar.start, _WIDE * bar.end
        top, foot = (number * _ROW + edge for edge in _BAR)
        # A thread of ink is left of what is next to nothing.
        right = max(right, left + 1.0)
        corners = " ".join(
            f"{x:.1f},{y:.1f}" for x, y in ((left, top), (right, top), (right, foot), (left, foot))
        )
        parts.append(f'<text x="0" y="{number * _ROW + _FOOT:g}">{html.escape(bar.text)}</text>')
        parts.append(f'<polyline points="{corners}" fill="#0072b2"/>')
    return (
        f'<svg viewBox="0 0 {_WIDE:g} {len(bars) * _ROW:g}" role="img" aria-label="'
        f'{html.escape(name)}">{"".join(parts)}</svg>'
    )


def charts(report: WasteReport) -> Iterator[str]:
    """Yield what becomes of the sheets, how well that is, and what it takes, each as a chart.

    Parameters
    ----------
    report : WasteReport
    """
    told = report.comparison
    yield '<div class="charts">'
    kept = told.kept_mm2 / report.totals.sums.area_mm2
    yield "<div><h3>What becomes of the sheets</h3>"
    yield bar_chart(
        "what becomes of the sheets",
        [
            Bar(f"pieces: {told.gross:.0%}", 0.0, told.gross),
            Bar(f"offcuts worth keeping: {kept:.0%}", told.gross, told.gross + kept),
            Bar(f"waste, holes too: {1.0 - told.gross - kept:.0%}", told.gross + kept, 1.0),
        ],
    )
    yield "</div>"
    yield "<div><h3>How much could be pieces</h3>"
    ways = (
        ("this job", told.gross),
        ("at the very best", told.best),
        ("pieces in rectangles", told.rectangles.utilisation),
        ("whole threads, uncut", told.strips.utilisation),
    )
    yield bar_chart(
        "how much of the sheets could be pieces",
        [
            Bar(f"{name}: on no sheet", 0.0, 0.0)
            if share is None
            else Bar(f"{name}: {share:.0%}", 0.0, share)
            for name, share in ways
        ],
    )
    yield "</div>"
    yield "<div><h3>How long it takes</h3>"
    costs = report.estimate
    hands = [_SECONDS_PER_HOUR * end for end in costs.assembly.hours]
    spans: tuple[tuple[str, Span | None], ...] = (
        ("cutting", costs.machine.cut_s),
        ("engraving", costs.machine.engrave_s),
        ("moves of the machine", costs.machine.travel_s),
        ("hands", (hands[0], hands[1])),
    )
    most = max(span[1] for _, span in spans if span is not None)
    yield bar_chart(
        "how long it takes",
        [
            Bar(f"{name}: {time_text(span)}", *((end / most for end in span) if span else (0, 0)))
            for name, span in spans
        ],
    )
    yield "</div></div>"
