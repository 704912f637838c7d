"""Keep what was used last, as much as memory allows."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar


class _Sized(Protocol):
    """What knows how much memory it takes."""

    @property
    def nbytes(self) -> int:
        """Memory, in bytes."""


_Key = TypeVar("_Key", bound=Hashable)
_Value = TypeVar("_Value", bound=_Sized)


class Cache(Generic[_Key, _Value]):
    """The values used last, up to so many bytes together, but always one.

    Examples
    --------
    >>> import numpy as np
    >>> cache = Cache(100)
    >>> [cache.get(key, lambda: np.zeros(6, np.int8)).size for key in (1, 2, 1)]
    [6, 6, 6]
    """

    def __init__(self, most_bytes: int) -> None:
        """Start empty."""
        self._most_bytes = most_bytes
        self._values: OrderedDict[_Key, _Value] = OrderedDict()
        self._bytes = 0

    def get(self, key: _Key, make: Callable[[], _Value]) -> _Value:
        """Return the value that is kept under a key, or make and keep it."""
        if key in self._values:
            self._values.move_to_end(key)
            return self._values[key]
        value = make()
        self._values[key] = value
        self._bytes += value.nbytes
        while self._bytes > self._most_bytes and len(self._values) > 1:
            self._bytes -= self._values.popitem(last=False)[1].nbytes
        return value
