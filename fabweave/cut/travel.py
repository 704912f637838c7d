"""Order pieces on a sheet so that the tool travels little between them."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray

#: Runs of so many pieces are improved at a time: every pair of links of a run is looked at.
_WINDOW = 500
#: A run is improved so many times at most; most are at rest after a dozen.
_ROUNDS = 25
#: What shortens the way by less is not done, or rounding might go on for ever.
_GAIN_MM = 1e-3


def short_route(ends: FloatArray) -> tuple[IntArray, BoolArray]:
    """Return an order of pieces, and which are walked backwards, with little way between them.

    Each piece is entered at one of its two ends and left at the other. The way begins at the
    origin and ends anywhere. It goes to the nearest end of a piece that is left, and is then
    shortened: whatever run of pieces is shorter backwards is turned round (2-opt).

    Parameters
    ----------
    ends : (N, 2, 2) float array
        Both ends of each piece, millimetres.

    Returns
    -------
    order : (N,) int array
        The pieces one after another.
    backwards : (N,) bool array
        In that order, whether each is entered at its second end.

    Examples
    --------
    >>> ends = np.array([[[9.0, 0.0], [6.0, 0.0]], [[1.0, 0.0], [5.0, 0.0]]])
    >>> order, backwards = short_route(ends)
    >>> order.tolist(), backwards.tolist()
    ([1, 0], [False, True])
    """
    order, backwards = _nearest_next(ends)
    for start in range(0, len(order), _WINDOW // 2):
        stop = min(start + _WINDOW, len(order))
        for _ in range(_ROUNDS):
            if not _shorten(ends, order, backwards, start, stop):
                break
    return order, backwards


def spread_heat(order: IntArray, backwards: BoolArray) -> tuple[IntArray, BoolArray]:
    """Return an order in which no piece follows its neighbour: every second one, then back.

    The material round a cut has cooled when the piece beside it is cut. The tool travels about
    twice as far as in the order that is given.

    Parameters
    ----------
    order : (N,) int array
    backwards : (N,) bool array
        As ``short_route`` returns them.

    Examples
    --------
    >>> order, backwards = spread_heat(np.arange(5), np.zeros(5, dtype=bool))
    >>> order.tolist(), backwards.tolist()
    ([0, 2, 4, 3, 1], [False, False, False, True, True])
    """
    way = np.concatenate((np.arange(0, len(order), 2), np.arange(1, len(order), 2)[::-1]))
    return order[way], backwards[way] ^ (way % 2 == 1)


def chained_strokes(groups: Sequence[Sequence[FloatArray]]) -> list[FloatArray]:
    """Return the strokes of all groups, one group after another, with little way between them.

    Within a group the next stroke is always the one with the nearest end, and is drawn from there;
    the first of all is drawn as it is.

    Parameters
    ----------
    groups : sequence of sequences of (N, 2) float arrays
        Strokes, such as those of each label of a piece, millimetres.

    Examples
    --------
    >>> strokes = [np.array([[x, 0.0], [x + 1.0, 0.0]]) for x in (0.0, 5.0, 2.0)]
    >>> [stroke[0, 0].item() for stroke in chained_strokes([strokes])]
    [0.0, 2.0, 5.0]
    """
    chain: list[FloatArray] = []
    for strokes in groups:
        ends = np.array([(stroke[0], stroke[-1]) for stroke in strokes]).reshape(-1, 2, 2)
        for _ in strokes:
            here = chain[-1][-1] if chain else strokes[0][0]
            distance = np.hypot(ends[:, :, 0] - here[0], ends[:, :, 1] - here[1])
            # Rounding makes ties fall the same way on every machine.
            number, side = divmod(int(np.argmin(np.round(distance, 6))), 2)
            chain.append(strokes[number][::-1] if side else strokes[number])
            ends[number] = np.inf
    return chain


def _nearest_next(ends: FloatArray) -> tuple[IntArray, BoolArray]:
    """Go to the nearest end of those left, from the origin on."""
    count = len(ends)
    order = np.empty(count, dtype=np.int64)
    backwards = np.empty(count, dtype=np.bool_)
    left = ends.copy()
    here = np.zeros(2)
    for at in range(count):
        # Rounding makes ties fall the same way on every machine.
        distance = np.round(np.hypot(left[:, :, 0] - here[0], left[:, :, 1] - here[1]), 6)
        piece, side = divmod(int(np.argmin(distance)), 2)
        order[at], backwards[at] = piece, side == 1
        here = ends[piece, 1 - side]
        left[piece] = np.inf
    return order, backwards


def _shorten(
    ends: FloatArray, order: IntArray, backwards: BoolArray, start: int, stop: int
) -> bool:
    """Turn runs round that are shorter so, in place; say whether there were any."""
    window = slice(start, stop)
    sides = backwards[window].astype(np.int64)
    enter, leave = ends[order[window], sides], ends[order[window], 1 - sides]
    before = np.zeros(2) if start == 0 else ends[order[start - 1], 1 - int(backwards[start - 1])]
    come = np.concatenate((before[None], leave[:-1]))  # from where each is entered
    last = stop == len(order)
    beyond = leave[-1] if last else ends[order[stop], int(backwards[stop])]
    go = np.concatenate((enter[1:], beyond[None]))  # to where each is left
    into, out = np.hypot(*(enter - come).T), np.hypot(*(go - leave).T)
    # A run from i to j turned round is entered where j was left, and left where i was entered.
    first = _distances(come, leave)
    second = _distances(enter, go)
    if last:
        second[:, -1] = 0.0
    gain = np.round(into[:, None] + out[None, :] - first - second, 6)
    gain[np.tril_indices(len(gain), -1)] = 0.0
    i, j = np.nonzero(gain > _GAIN_MM)
    taken = np.zeros(len(gain) + 1, dtype=np.bool_)
    for k in np.lexsort((j, i, -gain[i, j]))[: 4 * len(gain)].tolist():
        a, b = int(i[k]), int(j[k])
        # Runs that share no link do not change one another's gain.
        if taken[a : b + 2].any():
            continue
        taken[a : b + 2] = True
        run = slice(start + a, start + b + 1)
        order[run] = order[run][::-1].copy()
        backwards[run] = ~backwards[run][::-1]
    return bool(len(i))


def _distances(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distance of every two points."""
    return np.hypot(first[:, None, 0] - second[None, :, 0], first[:, None, 1] - second[None, :, 1])
