"""Name the array types that pass between stations, and freeze them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar, dataclass_transform

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]

#: Called as ``progress(what, done, total)``; never changes a result.
Progress: TypeAlias = Callable[[str, int, int], None]

_Scalar = TypeVar("_Scalar", bound=np.generic)


def frozen(array: npt.NDArray[_Scalar]) -> npt.NDArray[_Scalar]:
    """Return a read-only array with the same values.

    Parameters
    ----------
    array : array
        Any array; an array that owns its data is frozen in place, a view is copied first.

    Returns
    -------
    array
        The values, with ``flags.writeable`` false.

    Examples
    --------
    >>> import numpy as np
    >>> frozen(np.arange(3)).flags.writeable
    False
    """
    if not array.flags.writeable and array.base is None:
        return array
    result = np.array(array, copy=True) if array.base is not None else array
    result.setflags(write=False)
    return result


_Value = TypeVar("_Value")


@dataclass_transform(frozen_default=True, eq_default=False)
def frozen_value(cls: type[_Value]) -> type[_Value]:
    """Make a class a frozen dataclass whose arrays are read-only.

    All values that pass between stations are made so. Two of them are equal if they are the same
    object: arrays have no single answer to ``==``. Arrays are frozen before the class's own
    ``__post_init__`` sees them.

    Examples
    --------
    >>> import numpy as np
    >>> @frozen_value
    ... class Points:
    ...     xy: FloatArray
    >>> Points(np.zeros((3, 2))).xy.flags.writeable
    False
    """
    post_init: Callable[[Any], None] | None = getattr(cls, "__post_init__", None)

    def freeze(self: Any) -> None:
        own = vars(self)
        for name, array in own.items():
            if isinstance(array, np.ndarray):
                own[name] = frozen(array)
        if post_init is not None:
            post_init(self)

    cls.__post_init__ = freeze  # type: ignore[attr-defined]
    return dataclass(frozen=True, eq=False)(cls)


def no_progress(_what: str, _done: int, _total: int) -> None:
    """Ignore a progress report."""


def offsets_of(counts: npt.NDArray[Any]) -> IntArray:
    """Return the CSR offsets of groups with the given sizes.

    Examples
    --------
    >>> import numpy as np
    >>> offsets_of(np.array([2, 0, 3])).tolist()
    [0, 2, 2, 5]
    """
    offsets = np.zeros(len(counts) + 1, dtype=np.int64)
    np.cumsum(counts, out=offsets[1:])
    return offsets


def places_in_groups(counts: npt.NDArray[Any]) -> IntArray:
    """Return 0, 1, … for the members of each group, groups of the given sizes one after another.

    Examples
    --------
    >>> import numpy as np
    >>> places_in_groups(np.array([2, 0, 3])).tolist()
    [0, 1, 0, 1, 2]
    """
    return np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)


def flags(count: int, at: Any) -> BoolArray:
    """Return flags, (count,), that are set at some places and nowhere else.

    Examples
    --------
    >>> import numpy as np
    >>> flags(4, np.array([0, 2, 2])).tolist()
    [True, False, True, False]
    """
    result = np.zeros(count, dtype=np.bool_)
    result[at] = True
    return result


def lengths(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors (..., D) of a few numbers each.

    They are those of ``np.linalg.norm`` to the bit, which takes some times as long for so few.

    Examples
    --------
    >>> import numpy as np
    >>> lengths(np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]])).tolist()
    [5.0, 0.0]
    """
    first, *others = np.moveaxis(vectors, -1, 0)
    square = first * first
    for other in others:
        square = square + other * other
    return np.asarray(np.sqrt(square))


def unit(vectors: FloatArray) -> FloatArray:
    """Return vectors (..., D) at length one; zero stays zero.

    Examples
    --------
    >>> import numpy as np
    >>> unit(np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]])).tolist()
    [[0.0, 0.6, 0.8], [0.0, 0.0, 0.0]]
    """
    length = lengths(vectors)[..., None]
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))


def any_normals(vectors: FloatArray) -> FloatArray:
    """Return some unit vector at right angles to each vector, (N, 3)."""
    axis = np.eye(3)[np.argmin(np.abs(vectors), axis=1)]
    return unit(np.cross(vectors, axis))
