"""Hold what files say as records: frozen values that are written as JSON, and read back by type.

A record is a dataclass whose fields have the names and the order of the keys in the document. Their
types say what a document must hold: numbers, texts, flags, tuples, other records, or None. Reading
checks all of it (msgspec does), so whoever has a record need not look again.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, dataclass_transform

import msgspec

from fabweave.core.errors import InputError
from fabweave.core.files import MOST_BYTES, read_input

_Record = TypeVar("_Record")


def optional(*, default: None = None) -> Any:
    """Describe a field that is left out of the document where it is None."""
    return field(default=default, metadata={"optional": True})


def inline() -> Any:
    """Describe a field whose record has its keys among those of the record that holds it."""
    return field(metadata={"inline": True})


@dataclass_transform(
    frozen_default=True, kw_only_default=True, field_specifiers=(field, optional, inline)
)
def record(cls: type[_Record]) -> type[_Record]:
    """Make a class a record: its fields are given by name, and two of equal fields are equal.

    Examples
    --------
    >>> @record
    ... class Hole:
    ...     station: int
    ...     width_mm: float | None = optional()
    >>> to_json(Hole(station=2, width_mm=3.5)), to_json(Hole(station=2))
    ({'station': 2, 'width_mm': 3.5}, {'station': 2})
    """
    return dataclass(frozen=True, kw_only=True, slots=True)(cls)


def to_json(value: Any) -> dict[str, Any]:
    """Return the document of a record: dicts, lists, numbers, texts, flags and None."""
    document: dict[str, Any] = {}
    for name, how in _keys(value.__class__):
        item = getattr(value, name)
        if "inline" in how:
            document |= to_json(item)
        elif item is not None or "optional" not in how:
            document[name] = _plain(item)
    return document


@cache
def _keys(cls: type) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the names of a record's fields, and how each is written."""
    return [(each.name, each.metadata) for each in fields(cls)]


#: What stands in a document as it is: nearly all of a large one.
_LEAVES = frozenset({float, int, str, bool})
_LISTS = (tuple, list)


def _plain(value: Any) -> Any:
    """Return a value of a record as JSON has it."""
    if isinstance(value, _LISTS):
        if _LEAVES.issuperset(map(type, value)):
            return list(value)
        return [_plain(item) for item in value]
    return to_json(value) if is_dataclass(value) else value


def fingerprint(document: str) -> str:
    """Return 16 digits that tell JSON documents apart: of the SHA-256 of all values in order.

    Examples
    --------
    >>> fingerprint('{"a": 1}') == fingerprint('{ "a":1.0 }') != fingerprint('{"a": 2}')
    True
    """
    values = json.dumps(json.loads(document, parse_int=float))
    return hashlib.sha256(values.encode()).hexdigest()[:16]


def from_json(cls: type[_Record], text: str | bytes) -> _Record:
    """Read a record from its document.

    A key may be absent if its field is None by default; keys that are not known are passed over, so
    that files of later versions can be read.

    Raises
    ------
    InputError
        If the document does not fit; the message says where and why.

    Examples
    --------
    >>> @record
    ... class Hole:
    ...     at_mm: tuple[float, float]
    >>> from_json(Hole, '{"at_mm": [1.0, 2.5]}')
    Hole(at_mm=(1.0, 2.5))
    >>> from_json(Hole, '{"at_mm": [1.0, "2.5"]}')
    Traceback (most recent call last):
    fabweave.core.errors.InputError: Expected `float`, got `str` - at `$.at_mm[1]`
    """
    try:
        return msgspec.json.decode(text, type=cls)
    except RecursionError:
        raise InputError("its lists are nested too deeply") from None
    except ValueError as error:
        raise InputError(str(error)) from error


def read_json(path: Path, read: Callable[[bytes], _Record], what: str, name: str) -> _Record:
    """Read the JSON file of a finished job.

    Parameters
    ----------
    path : Path
    read : callable
        Makes a value from the document; it raises InputError if that does not fit.
    what : str
        What the file should be, for the message.
    name : str
        What it is called in the folder of a finished job, for the remedy.

    Raises
    ------
    InputError
        If the file cannot be read, or does not hold what it should; the message says why.
    """
    try:
        data = read_input(path, f"the {what}", MOST_BYTES)
    except InputError as error:
        raise InputError(f"{error}; it is one of the files of a finished job") from error
    try:
        return read(data)
    except InputError as error:
        raise InputError(
            f"{path} is not a {what}: {error}; use the {name} of a finished job, or make the job "
            "again"
        ) from error
