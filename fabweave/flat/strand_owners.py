"""Find which piece carries each strand of each crossing."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.flat.piece import Piece


@frozen_value
class Owners:
    """The piece and station of each strand of each crossing.

    Column 0 is the strand under, column 1 the strand over. Where a strand has a joint, the piece
    that ends there counts.

    Parameters
    ----------
    piece : (X, 2) int array
    station : (X, 2) int array
    """

    piece: IntArray
    station: IntArray

    def partners(self, piece: Piece) -> IntArray:
        """Return the piece that a piece crosses at each of its stations, (S,)."""
        return self.piece[piece.crossings, 1 - piece.over.astype(np.int64)]


def find_owners(pieces: Sequence[Piece], n_crossings: int) -> Owners:
    """Find the owner of every strand; each is carried by one piece, or by two at a joint."""
    owner = np.zeros((n_crossings, 2), dtype=np.int64)
    station = np.zeros((n_crossings, 2), dtype=np.int64)
    for index, piece in enumerate(pieces):
        first = 1 if piece.start_joint is not None else 0
        crossing, side = piece.crossings[first:], piece.over[first:].astype(np.int64)
        owner[crossing, side] = index
        station[crossing, side] = np.arange(first, len(piece.crossings))
    return Owners(owner, station)
