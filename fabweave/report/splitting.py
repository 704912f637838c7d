"""Report where threads were cut: each thread's pieces, and what other lengths would come to."""

from collections.abc import Sequence

import numpy as np
import shapely

from fabweave.core.messages import agree
from fabweave.core.records import record
from fabweave.flat.piece import Piece
from fabweave.flat.split.length_curve import ChoiceRecord
from fabweave.flat.split.split_plan import SplitPlan

#: What each preference has the least of.
_LEAST = {"balanced": "least cost", "work": "least work", "waste": "least sheet"}


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
