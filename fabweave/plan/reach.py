"""Say what hands reach while an object is put together: clips, and what is set from outside."""

import itertools
import math
from collections.abc import Sequence

from fabweave.piece.pieces import PieceSet
from fabweave.plan.loose import Clip, find_clips, find_holds, ranks
from fabweave.plan.order import Order

#: In a closed surface no hand comes to the inside once such a share of the pieces is in place.
_SHUT = 0.75


def shut_from(order: Order) -> int:
    """Return from which piece of an order on no hand comes to the inside; past all for none."""
    count = len(order.order)
    return math.ceil(_SHUT * count) if order.enclosed else count


def set_outside(piece_set: PieceSet, order: Order) -> set[int]:
    """Return the crossings whose fasteners are set when no hand comes to the inside any more."""
    holds, rank = find_holds(piece_set.pieces, piece_set.fastened), ranks(order.order.tolist())
    from_ = shut_from(order)
    fastened = (crossing for crossing in holds.layers if crossing >= 0)
    return {crossing for crossing in fastened if holds.set_at(crossing, rank) >= from_}


def job_clips(piece_set: PieceSet, order: Order) -> list[Clip]:
    """Return the clips that hold loose ends; what a ring holds is fastened last."""
    fastened = piece_set.fastened.copy()
    for ring in piece_set.rings:
        fastened[ring.crossings] = False
    pieces = piece_set.pieces
    holds, rings = find_holds(pieces, fastened), bool(piece_set.rings)
    return find_clips(pieces, holds, order.order.tolist(), to_the_end=rings)


def most_clips(clips: Sequence[Clip]) -> int:
    """Return how many clips are on at once, at most."""
    changes = sorted([(clip.since, 1) for clip in clips] + [(clip.until, -1) for clip in clips])
    return max(itertools.accumulate(change for _, change in changes), default=0)
