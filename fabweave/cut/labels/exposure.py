"""Measure how much of what is engraved is seen when the object is woven."""

from collections.abc import Sequence

import numpy as np
import shapely

from fabweave.cut.labels.marks import Marks
from fabweave.cut.labels.placement import covers_of
from fabweave.flat.piece import Piece


def seen_mm(pieces: Sequence[Piece], marks: Sequence[Marks]) -> float:
    """Return the length of all strokes that no strand covers.

    Parameters
    ----------
    pieces : sequence of Piece
    marks : sequence of Marks
        What is engraved on the outer face of each.

    Returns
    -------
    float
        Millimetres; 0.0 if everything is covered.
    """
    # What is hidden is covered by its making; only the rest is to be measured.
    return sum(
        _seen_of_piece(piece, [*(stroke for label in one.seen for stroke in label.strokes)])
        + _seen_of_piece(piece, one.ticks)
        for piece, one in zip(pieces, marks, strict=True)
    )


def _seen_of_piece(piece: Piece, strokes: Sequence[np.ndarray]) -> float:
    """Return how much of some strokes is outside all covers of their piece."""
    if not strokes:
        return 0.0
    lines = shapely.multilinestrings([shapely.linestrings(stroke) for stroke in strokes])
    covers = shapely.union_all(covers_of(piece))
    return float(shapely.length(shapely.difference(lines, covers)))
