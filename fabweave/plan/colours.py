"""Colour a woven object as its settings say: strands, and the pieces that are cut of them."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray
from fabweave.core.colour_space import Colours
from fabweave.piece.piece import Piece
from fabweave.stock.supplies import Supplies
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.strand_colours import Strategy, strand_colours
from fabweave.weave.weave_mesh import WovenMesh


def woven_colours(
    woven: WovenMesh,
    strategy: Strategy,
    supplies: Supplies,
    pieces: Sequence[Piece] | None = None,
) -> Colours:
    """Return the colours of all passes, as they come and as they leave, (P, 2, 3).

    Parameters
    ----------
    woven, strategy, supplies
        What is coloured, how, and what it is cut from.
    pieces : sequence of Piece, optional
        Its pieces, if they are known: then colours change where pieces meet.
    """
    own = supplies.of(woven.bunches)
    of_supply = np.array([material.rgb for material in supplies.materials], dtype=np.uint8)
    return strand_colours(
        woven.weave,
        woven.bunches,
        strategy,
        breaks=None if pieces is None else _joint_passes(woven.weave, pieces),
        materials=of_supply[own].reshape(-1, 3),
        rows=None if (twill := woven.result.twill) is None else twill.rows,
    )


def piece_colours(weave: Weave, pieces: Sequence[Piece], strands: Colours) -> Colours:
    """Return the one colour by which each piece is shown flat, that of its middle, (N, 3)."""
    number = strand_passes(weave)
    middles = [
        number[piece.crossings[at], int(piece.over[at])]
        for piece in pieces
        for at in [len(piece.crossings) // 2]
    ]
    return np.asarray(strands[np.array(middles, dtype=np.int64), 0])


def _joint_passes(weave: Weave, pieces: Sequence[Piece]) -> BoolArray:
    """Tell at which passes a piece begins that is joined to the one before, (P,)."""
    begins = np.zeros(len(weave.over), dtype=np.bool_)
    number = strand_passes(weave)
    for piece in pieces:
        if piece.start_joint is not None:
            begins[number[piece.crossings[0], int(piece.over[0])]] = True
    return begins
