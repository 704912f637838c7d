"""Read settings that may differ from bunch to bunch, such as ``warp=card,weft=birch-veneer``."""

from collections.abc import Callable
from typing import TypeAlias, TypeVar

from fabweave.core.errors import InputError

_Value = TypeVar("_Value")
_Plain = TypeVar("_Plain", float, float | None)

#: Names of bunches with a value each; one value for all has the name "".
ByBunch: TypeAlias = tuple[tuple[str, _Value], ...]

#: Names of the two bunches where there are two; a number does as well.
NAMED = ("warp", "weft")


def bunch_number(name: str) -> int:
    """Return the number of the bunch that a name stands for.

    Parameters
    ----------
    name : str
        ``warp``, ``weft``, or a number as in ``crossing_map.json``.

    Returns
    -------
    int
        From 0.

    Raises
    ------
    InputError
        If it is not one of these.

    Examples
    --------
    >>> bunch_number("weft"), bunch_number("2")
    (1, 2)
    """
    if name in NAMED:
        return NAMED.index(name)
    if not (name.isascii() and name.isdigit() and len(name) <= 9):
        raise InputError(
            f"{name[:40]!r} is not a bunch: write {' or '.join(NAMED)}, or the number of a bunch, "
            "counted from 0"
        )
    return int(name)


def by_bunch(value: _Plain | ByBunch[_Plain]) -> ByBunch[_Plain]:
    """Return a setting as pairs of a bunch and its value; one value for all has no name.

    Examples
    --------
    >>> by_bunch(0.5)
    (('', 0.5),)
    """
    return value if isinstance(value, tuple) else (("", value),)


def split_by_bunch(text: str, *, what: str) -> ByBunch[str]:
    """Split what is typed into one value for all bunches, or one for each.

    Parameters
    ----------
    text : str
        A value, or ``name=value`` for each bunch with commas between.
    what : str
        What is typed, for messages.

    Raises
    ------
    InputError
        If a name is not one of a bunch, comes twice or has no value.

    Examples
    --------
    >>> split_by_bunch("card", what="material")
    (('', 'card'),)
    >>> split_by_bunch("warp=card, weft=birch-veneer", what="material")
    (('warp', 'card'), ('weft', 'birch-veneer'))
    """
    if "=" not in text:
        return (("", text.strip()),)
    pairs = []
    for part in text.split(","):
        name, equals, value = (word.strip() for word in part.partition("="))
        if not (equals and name and value):
            raise InputError(
                f"{what} {text[:80]!r} must be NAME=VALUE for each bunch, such as "
                "warp=0.5mm,weft=0.8mm"
            )
        pairs.append((name.lower(), value))
    numbers = [bunch_number(name) for name, _ in pairs]
    twice = sorted({number for number in numbers if numbers.count(number) > 1})
    if twice:
        raise InputError(f"{what} {text[:80]!r} names bunch {twice[0]} twice; name it once")
    return tuple(pairs)


def format_by_bunch(values: ByBunch[_Value], write: Callable[[_Value], str]) -> str:
    """Return the text that :func:`split_by_bunch` reads as these values.

    Examples
    --------
    >>> format_by_bunch((("warp", 0.5), ("weft", 0.8)), lambda value: f"{value:g}mm")
    'warp=0.5mm,weft=0.8mm'
    """
    return ",".join(f"{name}={write(value)}" if name else write(value) for name, value in values)
