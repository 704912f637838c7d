"""Tell how many layers lie on one another at each crossing, and how thick they are together."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.flat.pieces import PieceSet

_DECIMALS = 6


def count_layers(piece_set: PieceSet) -> IntArray:
    """Return how many layers lie on one another at each crossing, (X,): three at a lap.

    Those of rings around openings count, too.
    """
    return np.bincount(
        np.concatenate(
            [
                *(piece.crossings for piece in piece_set.pieces),
                *(ring.crossings for ring in piece_set.rings),
            ]
        ),
        minlength=len(piece_set.room_mm),
    )


def grips_mm(piece_set: PieceSet) -> FloatArray:
    """Return how thick the layers at each crossing are together, (X,): the grip of a fastener.

    Each layer counts with the thickness of its own thread's material.
    """
    stations = [len(piece.crossings) for piece in piece_set.pieces]
    thread = np.repeat([piece.thread for piece in piece_set.pieces], stations)
    crossing = np.concatenate([piece.crossings for piece in piece_set.pieces])
    grip = np.bincount(crossing, piece_set.plan.thickness_mm[thread], len(piece_set.room_mm))
    for ring in piece_set.rings:
        grip = grip + ring.thickness_mm * np.bincount(ring.crossings, minlength=len(grip))
    return np.asarray(np.round(grip, _DECIMALS))
