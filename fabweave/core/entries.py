"""Read tables of TOML that people write: every entry by its dataclass, with errors that help.

A field that an entry may set is annotated with the ``Key`` that says what it may hold; an entry has
to set those that have no default.
"""

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, get_type_hints

import msgspec

from fabweave.core.errors import InputError
from fabweave.core.files import read_text
from fabweave.core.messages import closest_first, shown

#: Returns a value as it is held, or None if it is not what is expected.
Accept: TypeAlias = Callable[[Any], Any]
#: What cannot stand in a dotted key of TOML, and how many dots none has that is meant.
_BESIDE_KEYS = re.compile(r"[^\w\-.\"' \t]+")
_MOST_DOTS = 200


@dataclass(frozen=True)
class Key:
    """What one key of an entry may hold.

    Parameters
    ----------
    expected : str
        Its value in words.
    accept : callable
        Returns the value as it is held, or None if it is not what is expected.
    """

    expected: str
    accept: Accept


def number_key(least: float, most: float) -> Key:
    """Return a key that takes a number in a range."""
    return Key(f"a number from {least:g} to {most:g}", in_range(least, most))


def pair_key(example: str, least: float, most: float) -> Key:
    """Return a key that takes a list of two numbers in a range."""
    each = in_range(least, most)
    expected = f"a list of two numbers from {least:g} to {most:g}, such as {example}"
    return Key(expected, lambda value: list_of(value, each, count=2))


def line_key(longest: int) -> Key:
    """Return a key that takes a line of text."""

    def accept(value: Any) -> str | None:
        fits = isinstance(value, str) and value.strip() and value.isprintable()
        return value if fits and len(value) <= longest else None

    return Key(f"a line of text of {longest} characters at most", accept)


@cache
def entry_keys(kind: type) -> dict[str, Key]:
    """Return the keys that an entry of a kind may have, by name."""
    hints = get_type_hints(kind, include_extras=True)
    marks = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    return {name: mark for name, found in marks.items() for mark in found if isinstance(mark, Key)}


def in_range(least: float, most: float) -> Accept:
    """Return a function that accepts numbers in a range.

    Examples
    --------
    >>> accept = in_range(0.0, 9.0)
    >>> accept(3), accept(-1.0), accept(float("nan")), accept("3"), accept(True)
    (3.0, None, None, None, None)
    """

    def accept(value: Any) -> float | None:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        return float(value) if least <= value <= most else None

    return accept


def list_of(value: Any, accept: Accept, count: int | None = None) -> tuple[Any, ...] | None:
    """Return a list as a tuple of accepted values; None if any value is not accepted."""
    if not isinstance(value, list | tuple) or (count is not None and len(value) != count):
        return None
    accepted = tuple(map(accept, value))
    return None if None in accepted else accepted


def read_entry(table: Any, where: str, kind: Any) -> dict[str, Any]:
    """Return the values of an entry, as they are held.

    Parameters
    ----------
    table : mapping
        As it was read.
    where : str
        The file and the entry, for errors.
    kind : type
        The dataclass that says what it may have.

    Raises
    ------
    InputError
        If a key is unknown, missing, or has another value than expected; the message says where,
        which, and what is expected.

    Examples
    --------
    >>> from typing import Annotated
    >>> @dataclass
    ... class Shop:
    ...     hole: Annotated[float, number_key(0, 9)]
    >>> read_entry({"hole": "wide"}, "mine.toml, [me]", Shop)
    Traceback (most recent call last):
        ...
    fabweave.core.errors.InputError: mine.toml, [me]: hole is 'wide', but must be a number from 0 \
to 9
    """
    keys = entry_keys(kind)
    if not isinstance(table, Mapping):
        raise InputError(
            f"{where}: this is not a table; write keys such as {next(iter(keys))} in it"
        )
    for name in table:
        if name not in keys:
            raise InputError(
                f"{where}: unknown key {name!r}; the keys are "
                f"{', '.join(closest_first(str(name), keys))}"
            )
    required = {field.name for field in fields(kind) if field.default is MISSING}
    values = {}
    for name, key in keys.items():
        if name in table:
            values[name] = key.accept(table[name])
            if values[name] is None:
                value = shown(table[name])
                raise InputError(f"{where}: {name} is {value}, but must be {key.expected}")
        elif name in required:
            raise InputError(f"{where}: {name} is missing; write {key.expected}")
    return values


def entry_table(value: Any) -> dict[str, Any]:
    """Return the table that :func:`read_entry` reads as a value; what is empty is left out."""

    def plain(part: Any) -> Any:
        return [plain(one) for one in part] if isinstance(part, tuple) else part

    stated = {name: getattr(value, name) for name in entry_keys(value.__class__)}
    return {name: plain(part) for name, part in stated.items() if part not in (None, "", ())}


def check_document(document: Any, where: str) -> None:
    """Raise InputError unless it is made of entries whose names can be typed, and name files.

    Examples
    --------
    >>> check_document({"grey-felt-1.5": {}}, "mine.toml")
    """
    if not isinstance(document, Mapping):
        raise InputError(f"{where}: it has no entries; write one such as [grey-felt]")
    for name in document:
        letters = name.replace("-", "").replace(".", "") if isinstance(name, str) else ""
        fits = letters.isascii() and letters.isalnum() and letters == letters.lower()
        if not (fits and name[0].isalnum() and len(name) <= 40):
            raise InputError(
                f"{where}: {shown(name)} cannot be the name of an entry; use lowercase letters, "
                "digits, hyphens and dots, 40 at most, such as [grey-felt] or ['grey-felt-1.5']"
            )


_Record = TypeVar("_Record")


def shipped_tables(package: str, name: str) -> dict[str, Any]:
    """Return the tables of a file that comes with fabweave."""
    return tomllib.loads(resources.files(package).joinpath(name).read_text("utf-8"))


def shipped_records(package: str, name: str, kind: type[_Record]) -> dict[str, _Record]:
    """Return the entries of a file that comes with fabweave as records, by their names."""
    tables = shipped_tables(package, name)
    return {key: msgspec.convert({"name": key, **entry}, kind) for key, entry in tables.items()}


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Return what a file of TOML holds.

    Raises
    ------
    InputError
        If it cannot be read; the message says what was to be read, from where, and why not.
    """
    return parse_toml(read_text(path, what), f"cannot read {what} in {path}")


def parse_toml(text: str, trouble: str) -> dict[str, Any]:
    """Return what a text of TOML holds.

    Raises
    ------
    InputError
        If it is no TOML, or is nested deeper than anything that fabweave reads; the message begins
        with the trouble.
    """
    # The parser's time grows with the square of a key's length: longer ones are not even tried.
    if max(part.count(".") for part in _BESIDE_KEYS.split(text)) > _MOST_DOTS:
        raise InputError(f"{trouble}: a key has more than {_MOST_DOTS} dots; no key here has")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{trouble}: its lists or tables are nested too deeply") from None
    except ValueError as error:
        raise InputError(f"{trouble}: {error}") from error
