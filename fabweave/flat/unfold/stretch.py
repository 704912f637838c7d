"""Find the stretch of ribbon in space that belongs to each piece."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value, offsets_of
from fabweave.flat.piece import Piece
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave, strand_passes


@frozen_value
class Stretches:
    """The rungs of every piece, from the panel of its first crossing to that of its last.

    Where no joint ends a piece, it reaches to the end of its open thread. Two pieces that lap both
    have the panel of their joint.

    Parameters
    ----------
    rung : (N,) int array
        The rungs of all pieces one after another, as numbers of rungs of the ribbons.
    offsets : (P + 1,) int array
        Where the rungs of each piece begin.
    panel : (S,) int array
        For all stations of all pieces, one after another: the rung, from the piece's own first, at
        which the panel of the station begins.
    panel_offsets : (P + 1,) int array
        Where the stations of each piece begin.
    """

    rung: IntArray
    offsets: IntArray
    panel: IntArray
    panel_offsets: IntArray

    def quads(self) -> tuple[IntArray, IntArray]:
        """Return the rungs at which quads of ribbon begin, and the piece that each belongs to.

        A piece's last rung ends its last quad, and begins none.
        """
        begins = np.ones(len(self.rung), dtype=np.bool_)
        begins[self.offsets[1:] - 1] = False
        counts = np.diff(self.offsets) - 1
        return self.rung[begins], np.repeat(np.arange(len(counts)), counts)


def piece_stretches(ribbons: Ribbons, weave: Weave, pieces: Sequence[Piece]) -> Stretches:
    """Find the stretch of ribbon of every piece.

    Parameters
    ----------
    ribbons, weave
        The ribbons in space, and who is on top.
    pieces : sequence of Piece
        All pieces of a job.

    Returns
    -------
    Stretches
        Rungs rise along each piece, and count on from the first one around a ring.
    """
    threads = weave.threads
    passes = strand_passes(weave)
    first = np.array(
        [passes[piece.crossings[0], int(piece.over[0])] for piece in pieces], dtype=np.int64
    )
    thread = threads.thread_of_pass[first]
    panel_offsets = offsets_of(np.array([len(piece.crossings) for piece in pieces], dtype=np.int64))
    stations = np.diff(panel_offsets)
    place = _counted(first - threads.offsets[thread], stations)
    entry = local_entry(ribbons, np.repeat(thread, stations), place)
    size = np.diff(ribbons.offsets)[thread]
    start, last = entry[panel_offsets[:-1]], entry[panel_offsets[1:] - 1] + 1
    start = np.where([piece.start_joint is None for piece in pieces], 0, start)
    last = np.where([piece.end_joint is None for piece in pieces], size - 1, last)
    counts = last - start + 1
    local = _counted(start, counts) % np.repeat(size, counts)
    return Stretches(
        np.repeat(ribbons.offsets[thread], counts) + local,
        offsets_of(counts),
        entry - np.repeat(start, stations),
        panel_offsets,
    )


def _counted(first: IntArray, counts: IntArray) -> IntArray:
    """Count up from each of some numbers, so many times."""
    offsets = offsets_of(counts)
    return np.arange(offsets[-1]) + np.repeat(first - offsets[:-1], counts)
