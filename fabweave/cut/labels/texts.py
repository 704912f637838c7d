"""Say what is to be lettered on pieces: the texts, and how each may be shortened.

In the order of their importance a piece tells its id, the way of its thread (an arrow), its joints
with the pieces that lap there (their mates), and its partners: whom it crosses, and how. A text is
made smaller where there is no room for it, then shortened, and dropped at last.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.flat.piece import Piece

#: How much is lettered: everything, the pieces' ids alone, or nothing.
LABELS = ("full", "numbers", "none")
#: The face that is engraved: the one that is seen, or the hidden one.
SIDES = ("outside", "inside")
#: What labels tell, the most important first; the last is the first to be dropped.
KINDS = ("id", "arrow", "joint", "mate", "partner", "sign")

#: Heights of letters that are tried, the preferred first; nothing lower is engraved.
ID_HEIGHTS_MM = (4.0, 3.5, 3.0)
TEXT_HEIGHTS_MM = (2.5, 2.0)
ARROW_HEIGHTS_MM = (3.0, 2.5, 2.0)
#: Letters lower than this are reported: readable on the bench, but small.
WANTED_HEIGHT_MM = 2.5

#: Along the thread.
ARROW = "→"
#: Pictures of a crossing: the strand along the text, the piece's own, passes over or under.
OVER_SIGN, UNDER_SIGN = "╪", "╫"


class Choice(NamedTuple):
    """A way to letter a wish: a text, how high, and which of the wish's kinds it tells."""

    text: str
    height_mm: float
    kinds: tuple[str, ...]


class Wish(NamedTuple):
    """A fact to letter on a piece: each kind with its words, and ways to letter it.

    ``station`` is the place along the piece that it is about, None for the whole piece.
    """

    words: dict[str, str]
    station: int | None
    choices: tuple[Choice, ...]


class Missing(NamedTuple):
    """A fact that found no room: its kind, its words, and the station it is about."""

    kind: str
    text: str
    station: int | None


@frozen_value
class Label:
    """A lettered text.

    Parameters
    ----------
    text : str
    kinds : tuple of str
        What it tells, of ``KINDS``; the first names it.
    station : int or None
        The station it is about.
    height_mm : float
        Height of a capital.
    centre : (2,) float array
        Middle of its box, in the piece's coordinates.
    rotation_deg : float
        Reading direction.
    box_mm : (float, float)
        Length along the reading direction, and height, underlines included.
    strokes : tuple of (N, 2) float arrays
        Polylines in the piece's coordinates.
    """

    text: str
    kinds: tuple[str, ...]
    station: int | None
    height_mm: float
    centre: FloatArray
    rotation_deg: float
    box_mm: tuple[float, float]
    strokes: tuple[FloatArray, ...]


def wishes(
    piece: Piece,
    partners: Sequence[str],
    mates: tuple[str | None, str | None],
    labels: str,
) -> Iterator[Wish]:
    """Yield what a piece is to tell, the most important first.

    Parameters
    ----------
    piece : Piece
    partners : sequence of str
        The id of the piece crossed at each station.
    mates : (str or None, str or None)
        The ids of the pieces that lap at its first and its last station.
    labels : str
        One of ``LABELS``.

    Yields
    ------
    Wish
        The arrow comes twice: with the id, and alone, for when the id is lettered without it.
    """
    if labels == "none":
        return
    full = labels == "full"
    yield _id_wish(piece.id, arrow=full)
    if not full:
        return
    yield Wish(
        {"arrow": ARROW},
        None,
        tuple(Choice(ARROW, height, ("arrow",)) for height in ARROW_HEIGHTS_MM),
    )
    last = len(piece.crossings) - 1
    ends = ((0, piece.start_joint, mates[0]), (last, piece.end_joint, mates[1]))
    for station, joint, mate in ends:
        if joint is not None:
            yield _pair_wish({"joint": f"#{joint}", "mate": f">{mate}"}, station)
    for station, partner in enumerate(partners):
        sign = OVER_SIGN if piece.over[station] else UNDER_SIGN
        yield _pair_wish({"partner": partner, "sign": sign}, station)


def _id_wish(name: str, *, arrow: bool) -> Wish:
    """Return the wish for a piece's id: large, or with the arrow, or else in brackets."""
    words = {"id": name, "arrow": ARROW} if arrow else {"id": name}
    choices = []
    # With the arrow, which no other label has, or large, an id needs no brackets.
    for alone, heights in ((name, ID_HEIGHTS_MM), (f"[{name}]", TEXT_HEIGHTS_MM)):
        if arrow:
            choices += [Choice(name + ARROW, height, ("id", "arrow")) for height in heights]
        choices += [Choice(alone, height, ("id",)) for height in heights]
    return Wish(words, None, tuple(choices))


def _pair_wish(words: dict[str, str], station: int) -> Wish:
    """Return a wish for two words in one text, or the first of them alone."""
    first, second = words
    # The sign of a crossing stands before the partner, as a picture before its caption.
    text = words[second] + words[first] if second == "sign" else words[first] + words[second]
    whole = [Choice(text, height, (first, second)) for height in TEXT_HEIGHTS_MM]
    part = [Choice(words[first], height, (first,)) for height in TEXT_HEIGHTS_MM]
    return Wish(words, station, (*whole, *part))
