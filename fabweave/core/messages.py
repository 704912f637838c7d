"""Make words agree with a number."""

import difflib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import TypeVar

from fabweave.core.errors import InputError

_Value = TypeVar("_Value")
#: Names resemble one another from so much on, and are meant from so much on.
_RESEMBLES, _MEANT = 0.4, 0.65
#: As Python writes objects that cannot be written: it differs from run to run.
_ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")
_CHOICE = re.compile(r"\[([^|\[\]]*)\|([^|\[\]]*)\]")


def agree(count: int, text: str) -> str:
    """Return a text in which words agree with a number.

    Parameters
    ----------
    count : int
        The number.
    text : str
        ``{n}`` becomes the number, and each ``[one|many]`` the word for one or for any other
        number.

    Examples
    --------
    >>> agree(1, "{n} [face has|faces have] no area"), agree(2, "{n} [face has|faces have] no area")
    ('1 face has no area', '2 faces have no area')
    """
    one = count == 1
    chosen = _CHOICE.sub(lambda found: found[1] if one else found[2], text)
    return chosen.replace("{n}", str(count))


def shown(value: object, most: int = 60, form: Callable[[object], str] = repr) -> str:
    """Return a value as Python writes it, cut off where that is long.

    Numbers of thousands of digits and lists that are nested very deeply cannot be written, and of
    most objects nothing is written but an address: then what sort of value it is.

    Examples
    --------
    >>> shown("12"), shown("o" * 99, 10), shown(10**5000), shown([object()])
    ("'12'", "'oooooo...", 'a value of type int', 'a value of type list')
    """
    text = None
    with suppress(Exception):  # whatever a stranger's object raises
        text = form(value)
    if text is None or (_ADDRESS.search(text) and not isinstance(value, str)):
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def few_of(names: Sequence[object], most: int = 8) -> str:
    """Return the first of some names or numbers, and how many more there are.

    Examples
    --------
    >>> few_of(["A1", "A2", "B1"], 2), few_of(["A1", "A2"], 2)
    ('A1, A2 and 1 more', 'A1, A2')
    """
    return ", ".join(map(str, names[:most])) + (
        f" and {len(names) - most} more" if len(names) > most else ""
    )


def closest_first(wanted: str, names: Iterable[str]) -> list[str]:
    """Return names, those that resemble a wanted one first, the others as they come.

    Examples
    --------
    >>> closest_first("brich", ["card", "birch", "shim"])
    ['birch', 'card', 'shim']
    """
    alike = {name: likeness(wanted, name) for name in names}
    return sorted(alike, key=lambda name: -alike[name] if alike[name] >= _RESEMBLES else 0.0)


def likeness(wanted: str, name: str) -> float:
    """Return how much a name resembles a wanted one, with its words in any order: 1 is the same.

    Examples
    --------
    >>> likeness("m3-screw", "screw-m3"), likeness("m3-screw", "book-screw") < 0.8
    (1.0, True)
    """
    pairs = (wanted, name), ("-".join(sorted(each.split("-"))) for each in (wanted, name))
    return max(difflib.SequenceMatcher(None, *pair).ratio() for pair in pairs)


def one_named(kind: str, name: str, known: Mapping[str, _Value]) -> _Value:
    """Return what has a name, in lower or upper case.

    Parameters
    ----------
    kind : str
        What it is, for the message.
    name : str
    known : mapping
        All there are, by names in lower case.

    Raises
    ------
    InputError
        If there is none; the message lists the names, closest first.

    Examples
    --------
    >>> one_named("material", " Card", {"card": 0.4})
    0.4
    """
    wanted = name.strip().lower()
    if wanted not in known:
        names = closest_first(wanted, known)
        meant = f"; did you mean {names[0]}?" if likeness(wanted, names[0]) >= _MEANT else ""
        raise InputError(f"no {kind} is called {name!r}: choose one of {', '.join(names)}{meant}")
    return known[wanted]
