"""Walk a JSON document and say where it breaks its schema."""

import contextlib
import math
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from sys import intern
from types import NoneType, UnionType
from typing import Annotated, Any, TypeAlias, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from fabweave.verify.drawing import Floats, ReadError

_Record = TypeVar("_Record")
_Read: TypeAlias = "Callable[[Node], Any]"


class Node:
    """A JSON value that knows its path, so that errors say where."""

    __slots__ = ("above", "key", "value")

    def __init__(self, value: object, above: "Node | str", key: str | int = "") -> None:
        self.value = value
        self.above = above
        self.key = key

    @property
    def path(self) -> str:
        """The path, put together only where it is asked for."""
        if isinstance(self.above, str):
            return self.above
        return self.above.path + (f".{self.key}" if isinstance(self.key, str) else f"[{self.key}]")

    def __getitem__(self, key: str) -> "Node":
        """Return a member of an object."""
        if not isinstance(self.value, dict):
            raise ReadError(f"{self.path} is not an object")
        if key not in self.value:
            raise ReadError(f"{self.path} has no {key!r}")
        return Node(self.value[key], self, key)

    def items(self, count: int | None = None) -> list["Node"]:
        """Return the items of a list, of a certain length if given."""
        if not isinstance(self.value, list) or (count is not None and len(self.value) != count):
            raise ReadError(f"{self.path} is not a list" + (f" of {count}" if count else ""))
        return [Node(item, self, at) for at, item in enumerate(self.value)]

    def has(self, key: str) -> bool:
        """Return whether this is an object with a member of that name."""
        return isinstance(self.value, dict) and key in self.value

    def items_of(self, key: str) -> list["Node"]:
        """Return the items of a list that may be absent."""
        return self[key].items() if self.has(key) else []

    def integer(self) -> int:
        """Return an integer."""
        if not isinstance(self.value, int) or isinstance(self.value, bool):
            raise ReadError(f"{self.path} is not an integer but {self.value!r:.40}")
        return self.value

    def number(self) -> float:
        """Return a finite number."""
        value = self.value
        if isinstance(value, int | float) and not isinstance(value, bool):
            # A number beyond all floats raises, a huge exponent has become infinite.
            with contextlib.suppress(OverflowError):
                if math.isfinite(value):
                    return float(value)
        raise ReadError(f"{self.path} is not a finite number but {value!r:.40}")

    def flag(self) -> bool:
        """Return true or false."""
        if not isinstance(self.value, bool):
            raise ReadError(f"{self.path} is not true or false but {self.value!r:.40}")
        return self.value

    def text(self) -> str:
        """Return a string."""
        if not isinstance(self.value, str):
            raise ReadError(f"{self.path} is not a string but {self.value!r:.40}")
        # Ids stand in a document many times; one string serves them all.
        return intern(self.value)

    def points(self, *inner: int) -> Floats:
        """Return a list of arrays of numbers as an (n, ...) array."""
        try:
            result = np.array(self.value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ReadError(f"{self.path} is not a list of points: {error}") from error
        result = result.reshape((0, *inner)) if result.size == 0 else result
        if result.shape[1:] != inner or not np.all(np.isfinite(result)):
            raise ReadError(f"{self.path} is not a list of points of shape {inner}")
        return result

    def maybe(self, read: _Read) -> Any:
        """Return null as None, anything else as read."""
        return None if self.value is None else read(self)

    def record(self, kind: Callable[..., _Record], **given: Any) -> _Record:
        """Return an object as a dataclass: its fields by their names, as their types want them.

        What has a default may be absent; what is given is not looked for.
        """
        return kind(
            **given,
            **{
                name: read(self[name])
                for name, read, needed in _readers(kind, frozenset(given))
                if needed or self.has(name)
            },
        )


@cache
def _readers(kind: Any, given: frozenset[str]) -> list[tuple[str, _Read, bool]]:
    """Return name, reader, and whether it is needed of each field of a dataclass, less some."""
    hints = get_type_hints(kind, include_extras=True)
    return [
        (field.name, _reader(hints[field.name]), field.default is MISSING)
        for field in fields(kind)
        if field.name not in given
    ]


def _reader(hint: Any) -> _Read:
    """Return what reads a value of a type; an array is annotated with the shape of its items."""
    simple = {int: Node.integer, float: Node.number, str: Node.text, bool: Node.flag}
    if hint in simple:
        return simple[hint]
    inner = get_args(hint)
    if isinstance(hint, type) and is_dataclass(hint):
        return lambda node: node.record(hint)
    if get_origin(hint) is Annotated:
        return lambda node: node.points(*inner[1])
    if isinstance(hint, UnionType):
        (kind,) = (_reader(part) for part in inner if part is not NoneType)
        return lambda node: node.maybe(kind)
    if inner[-1] is Ellipsis:
        item = _reader(inner[0])
        return lambda node: tuple(item(part) for part in node.items())
    each = [_reader(part) for part in inner]
    return lambda node: tuple(
        read(part) for read, part in zip(each, node.items(len(each)), strict=True)
    )
