"""Choose crossings that carry something besides the weave: a cord, a hook, or feet."""

import re
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.core.errors import InputError

_TEXT = re.compile(r"(?P<side>top|bottom)(?::(?P<count>\d{1,2}))?|(?P<number>\d{1,9})", re.ASCII)
#: Of several at one side, none is nearer to the middle than the farthest crossing by this factor.
_SPREAD = 3.0
#: Heights that differ by less are the same, millimetres; and directions, as shares of a turn.
_LEVEL_MM, _SAME_TURN = 1e-3, 1e-6


@dataclass(frozen=True)
class Hanging:
    """Which crossings are wanted: numbers, and how many at the top and at the bottom."""

    numbers: tuple[int, ...]
    top: int = 0
    bottom: int = 0


def parse_hanging(text: str) -> Hanging:
    """Read what is typed for crossings that carry something.

    Raises
    ------
    InputError
        If it reads otherwise, or asks for none of a side.

    Examples
    --------
    >>> parse_hanging("top, bottom:3, 17")
    Hanging(numbers=(17,), top=1, bottom=3)
    """
    numbers, sides = set(), {"top": 0, "bottom": 0}
    for part in "".join(text.lower().split()).split(","):
        match = _TEXT.fullmatch(part)
        if match is None or match["count"] in ("0", "00"):
            raise InputError(
                f"{part[:40]!r} does not say which crossings carry something: write top, "
                "bottom:3 for three feet, or numbers of crossings, with commas between them"
            )
        if match["number"]:
            numbers.add(int(match["number"]))
        else:
            sides[match["side"]] = int(match["count"] or 1)
    return Hanging(tuple(sorted(numbers)), **sides)


def hanging_crossings(hanging: Hanging, centre: FloatArray) -> BoolArray:
    """Say which crossings carry something, (X,).

    One at a side is the topmost or lowest crossing. Of several, each is that of its own sector
    around the middle of the object, of those that stand a third of the farthest out or more.

    Parameters
    ----------
    hanging : Hanging
    centre : (X, 3) float array
        Where the crossings are.

    Raises
    ------
    InputError
        If there is no crossing of a number, or none in a sector.

    Examples
    --------
    >>> places = np.array([[0.0, 0, 9], [3, 0, 5], [3, 1, 4], [-3, 1, 5], [-3, 0, 4]])
    >>> hanging_crossings(parse_hanging("top,bottom:2"), places).tolist()
    [True, False, True, False, True]
    """
    chosen = np.zeros(len(centre), dtype=np.bool_)
    if hanging.numbers and hanging.numbers[-1] >= len(centre):
        raise InputError(
            f"there is no crossing {hanging.numbers[-1]} to carry something; they are numbered "
            f"from 0 to {len(centre) - 1}"
        )
    chosen[list(hanging.numbers)] = True
    offset = centre[:, :2] - (centre[:, :2].min(axis=0) + centre[:, :2].max(axis=0)) / 2.0
    away = np.hypot(*offset.T)
    turns = np.arctan2(offset[:, 1], offset[:, 0]) / (2.0 * np.pi) + _SAME_TURN
    for count, up in ((hanging.top, 1.0), (hanging.bottom, -1.0)):
        height = np.rint(up * centre[:, 2] / _LEVEL_MM)
        sector = np.floor((turns % 1.0) * max(count, 1)).astype(np.int64)
        for number in range(count):
            there = np.ones(len(centre), dtype=np.bool_)
            if count > 1:
                there = (sector == number) & (away >= away.max() / _SPREAD)
            if not there.any():
                raise InputError(
                    f"there are not {count} crossings around the middle to carry something; name "
                    "them by number"
                )
            chosen[np.flatnonzero(there)[np.argmax(height[there])]] = True
    return chosen
