"""Ask an engine to pack sheets anew: with one more piece, or so that their free room is in one."""

from collections.abc import Sequence

from fabweave.core.arrays import FloatArray
from fabweave.nest.engine.engine import packed
from fabweave.nest.separate.arrangement import NOWHERE, Arrangement
from fabweave.nest.separate.emptying import Ground, sheets_to_fill


def squeezed(
    ground: Ground, start: Arrangement, sheet: int, *, tries: int, seconds: int, seed: int
) -> Arrangement:
    """Ask an engine to pack sheets anew together with the pieces that stand nowhere.

    Parameters
    ----------
    ground, start, sheet
        As for `emptied`, which left some pieces standing nowhere.
    tries, seconds : int
        How often to ask, and for how long.
    seed : int
        For the engine.

    Returns
    -------
    Arrangement
        With fewer pieces that stand nowhere, or the same; all others keep the gap, proved.
    """
    state = start.copy()
    asked = 0
    for piece in sorted(state.on(NOWHERE), key=lambda piece: ground.bodies[piece].area_mm2):
        for other in sheets_to_fill(ground, state, sheet):
            if asked == tries:
                return state
            if ground.areas[other].barred is not None:
                continue  # the engine knows rectangles only
            asked += 1
            pieces = [*state.on(other), piece]
            settled = _packed_anew(ground, pieces, other, seconds, seed + asked)
            if settled is not None:
                state.poses[pieces] = settled
                state.where[piece] = other
                break
    return state


def compressed(
    ground: Ground, start: Arrangement, sheet: int, *, tries: int, seconds: int, seed: int
) -> Arrangement:
    """Ask an engine to pack the emptiest sheets anew, so that their free room is at one end.

    Parameters
    ----------
    ground, start, sheet, tries, seconds, seed
        As for `squeezed`.

    Returns
    -------
    Arrangement
        With the same pieces on each sheet; all keep the gap, proved.
    """
    state = start.copy()
    able = [one for one in sheets_to_fill(ground, state, sheet) if ground.areas[one].barred is None]
    for number, other in enumerate(able[:tries]):
        pieces = state.on(other)
        settled = _packed_anew(ground, pieces, other, seconds, seed + number)
        if settled is not None:
            state.poses[pieces] = settled
    return state


def _packed_anew(
    ground: Ground, pieces: Sequence[int], sheet: int, seconds: int, seed: int
) -> FloatArray | None:
    """Return proved poses of pieces on a sheet that an engine found; None if it found none."""
    bodies, area = [ground.bodies[piece] for piece in pieces], ground.areas[sheet]
    poses = packed(
        bodies, area.size_mm, ground.gap_mm, seconds=seconds, seed=seed, turns=area.turns
    )
    return None if poses is None else ground.settled(pieces, poses, sheet, None)
