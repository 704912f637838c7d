"""Hold what files say as records: frozen values that are written as JSON, and read back by type.

A record is a dataclass whose fields have the names and the order of the keys in the document. Their
types say what a document must hold: numbers, texts, flags, tuples, other records, or None. Reading
checks all of it, so whoever has a record need not look again.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Any,
    Literal,
    TypeAlias,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from fabweave.core.errors import InputError
from fabweave.core.files import MOST_BYTES, read_input
from fabweave.core.messages import shown

_Record = TypeVar("_Record")
_Convert: TypeAlias = Callable[[Any], Any]


def key(name: str) -> Any:
    """Describe a field that has another name in the document, where units are not in names."""
    return field(metadata={"key": name})


def optional(*, default: None = None) -> Any:
    """Describe a field that is left out of the document where it is None."""
    return field(default=default, metadata={"optional": True})


def inline() -> Any:
    """Describe a field whose record has its keys among those of the record that holds it."""
    return field(metadata={"inline": True})


@dataclass_transform(
    frozen_default=True, kw_only_default=True, field_specifiers=(field, key, optional, inline)
)
def record(cls: type[_Record]) -> type[_Record]:
    """Make a class a record: its fields are given by name, and two of equal fields are equal.

    Examples
    --------
    >>> @record
    ... class Hole:
    ...     station: int
    ...     width_mm: float = key("width")
    >>> to_json(Hole(station=2, width_mm=3.5))
    {'station': 2, 'width': 3.5}
    """
    return dataclass(frozen=True, kw_only=True, slots=True)(cls)


def to_json(value: Any) -> dict[str, Any]:
    """Return the document of a record: dicts, lists, numbers, texts, flags and None."""
    hint: Any = type(value)
    document: dict[str, Any] = _writer(hint)(value)
    return document


def from_json(cls: type[_Record], document: object) -> _Record:
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
    ...     at_mm: tuple[float, float] = key("at")
    >>> from_json(Hole, {"at": [1.0, 2.5]})
    Hole(at_mm=(1.0, 2.5))
    >>> from_json(Hole, {"at": [1.0, "2.5"]})
    Traceback (most recent call last):
    fabweave.core.errors.InputError: at[1] is '2.5', not a number
    """
    hint: Any = cls
    try:
        value: _Record = _reader(hint)(document)
    except _MisfitError as misfit:
        place = misfit.place.removeprefix(".") or "the document"
        raise InputError(f"{place} {misfit.problem}") from None
    return value


def read_json(path: Path, read: Callable[[object], _Record], what: str, name: str) -> _Record:
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
        return read(json.loads(data.decode("utf-8")))
    except RecursionError:
        raise InputError(f"{path} is not a {what}: its lists are nested too deeply") from None
    except ValueError as error:
        raise InputError(
            f"{path} is not a {what}: {error}; use the {name} of a finished job, or make the job "
            "again"
        ) from error


# --- writing ------------------------------------------------------------------------------------


@cache
def _writer(hint: Any) -> _Convert:
    """Return what turns a value of a type into JSON."""
    parts = get_args(hint)
    if is_dataclass(hint):
        return _record_writer(hint)
    if get_origin(hint) is tuple:
        return _tuple_writer([_writer(part) for part in parts if part is not Ellipsis], parts)
    if get_origin(hint) in (Union, UnionType):
        writers = {get_origin(part) or part: _writer(part) for part in parts}
        if any(writer is not _as_it_is for writer in writers.values()):
            return lambda value: writers.get(type(value), _as_it_is)(value)
    return _as_it_is


def _as_it_is(value: Any) -> Any:
    return value


def _tuple_writer(writers: list[_Convert], parts: tuple[Any, ...]) -> _Convert:
    """Return what turns a tuple into a list."""
    if all(writer is _as_it_is for writer in writers):
        return list
    if parts[-1] is Ellipsis:
        return lambda values: list(map(writers[0], values))
    return lambda values: [write(value) for write, value in zip(writers, values, strict=True)]


def _record_writer(cls: Any) -> _Convert:
    """Return what turns a record into a dict."""
    hints = get_type_hints(cls)
    parts = [(f.name, _key_of(f), _writer(hints[f.name]), f.metadata) for f in fields(cls)]

    def write(value: Any) -> dict[str, Any]:
        document: dict[str, Any] = {}
        for name, name_in_file, writer, how in parts:
            item = getattr(value, name)
            if "inline" in how:
                document |= writer(item)
            elif item is not None or "optional" not in how:
                document[name_in_file] = writer(item)
        return document

    return write


def _key_of(described: Any) -> str:
    """Return the key of a field in the document."""
    return str(described.metadata.get("key", described.name))


# --- reading ------------------------------------------------------------------------------------


class _MisfitError(Exception):
    """What does not fit a type; the place is completed from the inside out."""

    def __init__(self, problem: str, place: str = "") -> None:
        super().__init__()
        self.problem, self.place = problem, place


def _require(fits: bool, value: Any, wanted: str) -> None:
    """Raise an error unless a value fits."""
    if not fits:
        raise _MisfitError(f"is {shown(value)}, {wanted}")


@cache
def _reader(hint: Any) -> _Convert:
    """Return what reads a value of a type."""
    parts = get_args(hint)
    if is_dataclass(hint):
        return _record_reader(hint)
    if get_origin(hint) is tuple:
        readers = [_reader(part) for part in parts if part is not Ellipsis]
        return _tuple_reader(readers, None if parts[-1] is Ellipsis else len(parts))
    if get_origin(hint) in (Union, UnionType):
        return _union_reader([part for part in parts if part is not NoneType], NoneType in parts)
    if get_origin(hint) is Literal:
        return _scalar_reader(lambda value: value in parts, f"not {_either(parts)}")
    return _scalar_reader(*_SCALARS[hint])


#: Whole numbers are smaller: arrays hold them in 64 bits.
_MOST_WHOLE = 2**63
#: What a scalar of a type must be, and what to say if it is not.
_SCALARS: dict[Any, tuple[Callable[[Any], bool], str]] = {
    bool: (lambda value: type(value) is bool, "neither true nor false"),
    int: (
        lambda value: type(value) is int and abs(value) < _MOST_WHOLE,
        "not a whole number",
    ),
    float: (
        lambda value: (
            (type(value) is float and math.isfinite(value))
            or (type(value) is int and abs(value) < _MOST_WHOLE)
        ),
        "not a number",
    ),
    str: (lambda value: type(value) is str, "not text"),
}


def _scalar_reader(fits: Callable[[Any], bool], wanted: str) -> _Convert:
    """Return what gives back a value that fits."""

    def read(value: Any) -> Any:
        _require(fits(value), value, wanted)
        return value

    return read


def _either(values: Any) -> str:
    """Name values to choose from."""
    return " or ".join(map(repr, values))


def _tuple_reader(readers: list[_Convert], length: int | None) -> _Convert:
    """Return what reads a list: of one type and any length, or of one type for each value."""

    def read(value: Any) -> tuple[Any, ...]:
        _require(isinstance(value, list), value, "not a list")
        if length not in (None, len(value)):
            raise _MisfitError(f"has {len(value)} values, not {length}")
        items: list[Any] = []
        try:
            for at, item in enumerate(value):
                items.append(readers[at if length else 0](item))
        except _MisfitError as misfit:
            raise _MisfitError(misfit.problem, f"[{len(items)}]{misfit.place}") from None
        return tuple(items)

    return read


def _union_reader(kinds: list[Any], or_none: bool) -> _Convert:
    """Return what reads a type or None; or one of several records, by their ``kind``."""
    if len(kinds) == 1:
        reader = _reader(kinds[0])
        return lambda value: None if or_none and value is None else reader(value)
    readers = {get_args(get_type_hints(cls)["kind"])[0]: _reader(cls) for cls in kinds}

    def read(value: Any) -> Any:
        _require(isinstance(value, dict), value, "not an object")
        if "kind" not in value:
            raise _MisfitError("has no 'kind'")
        kind = value["kind"]
        if kind not in tuple(readers):
            raise _MisfitError(f"is {shown(kind)}, not {_either(readers)}", ".kind")
        return readers[kind](value)

    return read


def _record_reader(cls: Any) -> _Convert:
    """Return what reads a record."""
    hints = get_type_hints(cls)
    parts = [(f, _key_of(f), _reader(hints[f.name])) for f in fields(cls)]

    def read(value: Any) -> Any:
        _require(isinstance(value, dict), value, "not an object")
        values: dict[str, Any] = {}
        for described, name_in_file, reader in parts:
            if "inline" in described.metadata:
                values[described.name] = reader(value)
            elif name_in_file in value:
                try:
                    values[described.name] = reader(value[name_in_file])
                except _MisfitError as misfit:
                    place = f".{name_in_file}{misfit.place}"
                    raise _MisfitError(misfit.problem, place) from None
            elif described.default is not None:
                raise _MisfitError(f"has no {name_in_file!r}")
        return cls(**values)

    return read
