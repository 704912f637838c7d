"""Report where threads were cut: each thread's pieces, and what other lengths would come to."""

import html
from collections.abc import Sequence

import numpy as np
import shapely

from fabweave.core.messages import agree
from fabweave.core.records import record
from fabweave.flat.piece import Piece
from fabweave.flat.split.length_curve import ChoiceRecord
from fabweave.flat.split.split_plan import SplitPlan
from fabweave.stock.machine import CURRENCY

_CHART = (560, 190)  # width and height in pixels
_EDGE = 90
_LOW = 34
#: What each preference has the least of.
_LEAST = {"balanced": "least cost", "work": "least work", "waste": "least sheet"}
_TAKEN = ' class="taken"'


@record
class ThreadSplitting:
    """How a thread is cut; ``fill`` is what its pieces fill of their smallest rectangles."""

    thread: str
    pieces: int
    longest_mm: float
    fill: float


@record
class SplittingRecord:
    """Where threads were cut: the greatest length of a piece, and each thread's pieces.

    ``chosen`` is what the length that was taken comes to, with pieces and joints as they are, and
    ``prefer`` the preference that took it, None if the length was asked for. ``choices`` are
    predictions for several greatest lengths. Sheets, hours and costs are predicted before anything
    is nested; costs are in euros, by the rates of fabweave.
    """

    max_length_mm: float
    prefer: str | None
    chosen: ChoiceRecord
    choices: tuple[ChoiceRecord, ...]
    threads: tuple[ThreadSplitting, ...]


def splitting_record(
    plan: SplitPlan, pieces: Sequence[Piece], labels: Sequence[str]
) -> SplittingRecord:
    """Return what ``waste.json`` holds under ``splitting``.

    Parameters
    ----------
    plan : SplitPlan
    pieces : sequence of Piece
    labels : sequence of str
        The name of each thread.
    """
    polygons = [shapely.Polygon(piece.outline) for piece in pieces]
    area, box = shapely.area(polygons), shapely.area(shapely.oriented_envelope(polygons))
    thread = np.array([piece.thread for piece in pieces], dtype=np.int64)
    count = np.bincount(thread, minlength=len(labels))
    filled, around = (np.bincount(thread, part, len(labels)) for part in (area, box))
    longest = np.zeros(len(labels))
    extent = np.array([float(np.ptp(piece.outline[:, 0])) for piece in pieces])
    np.maximum.at(longest, thread, extent)
    return SplittingRecord(
        max_length_mm=round(plan.length_mm, 1),
        prefer=plan.prefer,
        chosen=plan.chosen.record(),
        choices=tuple(choice.record() for choice in plan.choices),
        threads=tuple(
            ThreadSplitting(
                thread=labels[number],
                pieces=int(count[number]),
                longest_mm=round(float(longest[number]), 1),
                fill=round(float(filled[number] / around[number]), 4),
            )
            for number in np.flatnonzero(count).tolist()
        ),
    )


def splitting_reason(chosen: ChoiceRecord, prefer: str | None, lengths: int) -> str:
    """Say what a length comes to, and why it was taken.

    Parameters
    ----------
    chosen : ChoiceRecord
        What the length comes to.
    prefer : str or None
        The preference that took it; None if it was asked for.
    lengths : int
        How many were compared.

    Examples
    --------
    >>> from fabweave.flat.split.length_curve import Choice
    >>> few = Choice(900.0, 135, 135, 1.0, 2.0, sheets=4, hours=2.1, cost=60.2).record()
    >>> splitting_reason(few, "balanced", 8)
    'at most 900 mm: 135 pieces, 135 joints, about 4 sheets; the least cost of 8 lengths'
    >>> splitting_reason(few, None, 8)
    'at most 900 mm: 135 pieces, 135 joints, about 4 sheets; as asked for'
    """
    counts = (
        f"at most {chosen.max_length_mm:g} mm: {agree(chosen.pieces, '{n} piece[|s]')}, "
        f"{agree(chosen.joints, '{n} joint[|s]')}, about {agree(chosen.sheets, '{n} sheet[|s]')}"
    )
    if chosen.longer:
        counts += agree(chosen.longer, "; {n} piece[ is|s are] longer, as no cut helps")
    if prefer is None:
        return f"{counts}; as asked for"
    return f"{counts}; the {_LEAST[prefer]} of {agree(lengths, '{n} length[|s]')}"


def splitting_section(record: SplittingRecord) -> str:
    """Return the record as a part of a web page: a curve and two tables."""
    rows = "".join(
        f"<tr{_TAKEN if choice.max_length_mm == record.max_length_mm else ''}>"
        f"<td>{choice.max_length_mm:g} mm</td><td>{_count(choice, choice.pieces)}</td>"
        f"<td>{_count(choice, choice.joints)}</td><td>{choice.sheets}</td>"
        f"<td>{choice.utilisation:.0%}</td><td>{choice.hours:.1f}</td><td>{choice.cost:.0f}</td>"
        "</tr>"
        for choice in record.choices
    )
    reason = splitting_reason(record.chosen, record.prefer, len(record.choices))
    threads = "".join(
        f"<tr><td>{html.escape(thread.thread)}</td><td>{thread.pieces}</td>"
        f"<td>{thread.longest_mm:.0f} mm</td><td>{thread.fill:.0%}</td></tr>"
        for thread in record.threads
    )
    return (
        f"<h2>Pieces</h2><p>Pieces are {html.escape(reason)} (--max-length, --prefer). What other "
        "lengths come to, before nesting: shorter pieces waste less but need more work. Hours are "
        "those of handling pieces and joints, of cutting outlines and engraving names; weaving "
        f"takes the same. The cost is that of sheets, fasteners and hours, in {CURRENCY}, at rates "
        "that are estimates.</p>"
        f"{_chart(record.choices)}"
        "<table><tr><th>--max-length</th><th>pieces</th><th>joints</th><th>sheets</th>"
        "<th>predicted use</th><th>hours</th><th>cost</th></tr>"
        f"{rows}</table>"
        "<details><summary>Thread by thread</summary><table><tr><th>thread</th><th>pieces</th>"
        f"<th>longest</th><th>share of rectangles filled</th></tr>{threads}</table></details>"
    )


def _count(choice: ChoiceRecord, count: int) -> str:
    return str(count) if choice.exact else f"about {count}"


def _chart(choices: Sequence[ChoiceRecord]) -> str:
    """Draw predicted use (filled dots) and joints (rings) over the greatest length."""
    if len(choices) < 2:
        return ""
    wide, high = _CHART
    length = np.array([choice.max_length_mm for choice in choices], dtype=np.float64)
    x = _EDGE + (wide - 2 * _EDGE) * (length - length[0]) / max(float(np.ptp(length)), 1e-9)
    parts = []
    for key, fill, name in (("utilisation", "#0072b2", "use"), ("joints", "none", "joints")):
        value = np.array([getattr(choice, key) for choice in choices], dtype=np.float64)
        y = high - _LOW - (high - 2 * _LOW) * value / max(float(value.max()), 1e-9)
        line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        dash = "" if fill != "none" else ' stroke-dasharray="5 4"'
        parts.append(f'<polyline points="{line}" fill="none" stroke="#444"{dash}/>')
        parts += [
            f'<circle cx="{a:.1f}" cy="{b:.1f}" r="4" fill="{fill}" stroke="#444"/>'
            for a, b in zip(x, y, strict=True)
        ]
        for end, side, anchor in ((0, -9, "end"), (-1, 9, "start")):
            figure = f"{value[end]:.0%}" if key == "utilisation" else f"{value[end]:.0f}"
            # Both begin near the top: the names there stand one above the other.
            lift = 4 if end or key == "utilisation" else -10
            parts.append(
                f'<text x="{x[end] + side:.1f}" y="{y[end] + lift:.1f}" font-size="12" '
                f'text-anchor="{anchor}">{name} {figure}</text>'
            )
    axis = high - _LOW
    parts.append(f'<line x1="{_EDGE}" y1="{axis}" x2="{wide - _EDGE}" y2="{axis}" stroke="#999"/>')
    for a, value in ((x[0], length[0]), (x[-1], length[-1])):
        parts.append(
            f'<text x="{a:.1f}" y="{high - 12}" font-size="12" text-anchor="middle">'
            f"{value:.0f} mm</text>"
        )
    return (
        f'<svg width="{wide}" height="{high}" viewBox="0 0 {wide} {high}" role="img" '
        f'aria-label="use and joints against the greatest length">{"".join(parts)}</svg>'
    )
