"""Measure the areas and cut lengths of pieces."""

from typing import NamedTuple

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.measure.arcs import ring_area, ring_length


class Areas(NamedTuple):
    """What pieces come to: inside their outlines, in holes and slots, and the length of cuts."""

    outline_mm2: float
    holes_mm2: float
    cut_mm: float
    #: How many holes and slots there are.
    cutouts: int

    @property
    def piece_mm2(self) -> float:
        """What is left of the material."""
        return self.outline_mm2 - self.holes_mm2


def areas_of(piece: Piece, plan: CrossingMap) -> Areas:
    """Return what a piece comes to."""
    diameters = np.array([hole.diameter or 0.0 for hole in plan.holes[piece.id]])
    slots = piece.slots
    return Areas(
        abs(ring_area(piece.path)),
        float(np.sum(np.pi * diameters**2 / 4.0)) + sum(abs(ring_area(slot)) for slot in slots),
        ring_length(piece.path)
        + float(np.sum(np.pi * diameters))
        + sum(ring_length(slot) for slot in slots),
        len(diameters) + len(slots),
    )
