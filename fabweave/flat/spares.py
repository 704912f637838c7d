"""Cut some pieces once more, so that one is at hand for each kind if a piece breaks."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import IntArray
from fabweave.core.errors import InputError
from fabweave.flat.piece import Piece

#: More of a kind than this are no spares, but a slip.
_MOST = 100


def parse_spares(text: str) -> tuple[float, int]:
    """Return how many spares there are of a kind: a share of its pieces, rounded up, and a number.

    Parameters
    ----------
    text : str
        ``"5%"``, a share of the pieces of each kind; or ``"2"``, so many of each kind.

    Returns
    -------
    (float, int)
        Of the two, one is 0.

    Raises
    ------
    InputError
        If it is neither.

    Examples
    --------
    >>> parse_spares("5%"), parse_spares("2")
    ((0.05, 0), (0.0, 2))
    """
    plain = text.strip()
    share = plain.endswith("%")
    try:
        value = float(plain.removesuffix("%"))
    except ValueError:
        value = math.nan
    if share and 0.0 < value <= 100.0:
        return value / 100.0, 0
    if not share and 0.0 < value <= _MOST and value.is_integer():
        return 0.0, int(value)
    raise InputError(
        f"spares are a share of each kind, such as 5%, or 1 to {_MOST} of each, not {text!r}"
    )


def usual_spares(text: str) -> str:
    """Return a text for spares in its usual form.

    Examples
    --------
    >>> usual_spares(" 5.0 %"), usual_spares("2.0")
    ('5%', '2')
    """
    share, number = parse_spares(text)
    return f"{100.0 * share:.10g}%" if share else str(number)


def spared(kinds: IntArray, spares: str | None) -> IntArray:
    """Return which pieces are cut once more, by their numbers; kind by kind.

    It is the first piece of each kind, as often as spares of that kind are wanted: no kind is
    left without any.

    Parameters
    ----------
    kinds : (N,) int array
        The kind of each piece, from 1 in the order of their first piece.
    spares : str, optional
        As :func:`parse_spares` reads it; none by default.

    Returns
    -------
    (S,) int array

    Examples
    --------
    Of 21 pieces of the first kind, a twentieth is a little more than one.

    >>> kinds = np.array([1] * 20 + [2, 1])
    >>> spared(kinds, "5%").tolist(), spared(kinds, "1").tolist(), spared(kinds, None).tolist()
    ([0, 0, 20], [0, 20], [])
    """
    if spares is None:
        return np.zeros(0, dtype=np.int64)
    share, number = parse_spares(spares)
    _, first, counts = np.unique(kinds, return_index=True, return_counts=True)
    # A twentieth of 20 pieces is one, whatever the last bit of the product.
    times = np.ceil(np.round(share * counts, 9)).astype(np.int64) + number
    return np.repeat(first, times)


def spare_pieces(pieces: Sequence[Piece], origins: IntArray) -> tuple[Piece, ...]:
    """Return the spares of some pieces: the same but for their ids, such as ``A3S1``.

    Parameters
    ----------
    pieces : sequence of Piece
    origins : (S,) int array
        Which piece each spare is a copy of, ascending.
    """
    number = np.arange(len(origins)) - np.searchsorted(origins, origins) + 1
    return tuple(
        replace(pieces[origin], id=f"{pieces[origin].id}S{count}")
        for origin, count in zip(origins.tolist(), number.tolist(), strict=True)
    )
