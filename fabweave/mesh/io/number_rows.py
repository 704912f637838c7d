"""Turn rows of text into numbers, in bulk, and name the line that is wrong."""

import warnings
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import FloatArray, IntArray, offsets_of
from fabweave.mesh.io.token_rows import Rows

_Number = TypeVar("_Number", np.float64, np.int64)
#: How Microsoft's C library used to print values that are not numbers.
_NOT_NUMBERS = {"#IND": "nan", "#QNAN": "nan", "#SNAN": "nan", "#INF": "inf"}


def parse_float(token: str) -> float:
    """Return the number that a token stands for.

    Raises
    ------
    ValueError
        If the token is not a number; ``1_000``, which Python would accept, is not one.

    Examples
    --------
    >>> parse_float("-2.5e1"), parse_float("-1.#INF")
    (-25.0, -inf)
    """
    if "_" in token:
        raise ValueError(token)
    before, mark, after = token.partition("#")
    if mark:
        sign = "-" if before.startswith("-") else ""
        return float(sign + _NOT_NUMBERS.get("#" + after.rstrip("0").upper(), token))
    return float(token)


def parse_int(token: str) -> int:
    """Return the whole number that a token stands for, if it fits into 64 bits.

    Raises
    ------
    ValueError
        If the token is not a whole number.

    Examples
    --------
    >>> parse_int("-12")
    -12
    """
    value = int(token)
    if "_" in token or not -(2**63) <= value < 2**63:
        raise ValueError(token)
    return value


def float_numbers(rows: Rows) -> FloatArray:
    r"""Return all numbers of the rows as one flat array.

    Raises
    ------
    InputError
        If a token is not a number; the message names its line.

    Examples
    --------
    >>> from fabweave.mesh.io.token_rows import text_rows
    >>> float_numbers(text_rows(b"1 2\n3\n", "a.off")).tolist()
    [1.0, 2.0, 3.0]
    """
    values = _in_bulk(rows, np.dtype(np.float64))
    if values is None:
        values = np.array([n for row in _carefully(rows, whole=False) for n in row], dtype=float)
    return values


def int_numbers(rows: Rows) -> IntArray:
    r"""Return all numbers of the rows as one flat array of whole numbers.

    Raises
    ------
    InputError
        If a token is not a whole number; the message names its line.

    Examples
    --------
    >>> from fabweave.mesh.io.token_rows import text_rows
    >>> int_numbers(text_rows(b"1 2\n-3\n", "a.off")).tolist()
    [1, 2, -3]
    """
    values = _in_bulk(rows, np.dtype(np.int64))
    if values is None:
        values = np.array([n for row in _carefully(rows, whole=True) for n in row], dtype=np.int64)
    return values


def mixed_numbers(rows: Rows) -> FloatArray | IntArray:
    """Return all numbers of the rows as whole numbers if they all are, else as floats."""
    values: FloatArray | IntArray | None = _in_bulk(rows, np.dtype(np.int64))
    return float_numbers(rows) if values is None else values


def _in_bulk(rows: Rows, kind: np.dtype[_Number]) -> npt.NDArray[_Number] | None:
    """Parse all rows at once, or return None if anything in them is not such a number."""
    if not len(rows):
        return np.zeros(0, dtype=kind)
    text = rows.data[rows.starts[0] : rows.ends[-1]]
    try:
        with warnings.catch_warnings():
            # Older numpy warns where newer numpy raises; both end up below.
            warnings.simplefilter("error", DeprecationWarning)
            values = np.fromstring(text, dtype=kind, sep=" ")
    except (ValueError, DeprecationWarning):
        return None
    # It takes "1-2" and "1.5.5" for two numbers each; counting shows it.
    return values if len(values) == rows.counts.sum() else None


def _carefully(rows: Rows, *, whole: bool) -> list[list[float]]:
    """Parse token by token, so that the first bad one can be named."""
    convert, wanted = (parse_int, "a whole number") if whole else (parse_float, "a number")
    values = []
    for row in range(len(rows)):
        numbers: list[float] = []
        for token in rows.tokens(row):
            try:
                numbers.append(convert(token))
            except ValueError:
                shown = token if len(token) <= 40 else token[:37] + "..."
                raise rows.fault(row, f"found {shown!r} instead of {wanted}") from None
        if len(numbers) != rows.counts[row]:
            raise rows.fault(row, "there are control characters between the numbers")
        values.append(numbers)
    return values


def first_columns(rows: Rows, count: int) -> FloatArray:
    r"""Return the first numbers of each row, (R, count).

    Raises
    ------
    InputError
        If a row has fewer, or holds anything that is not a number.

    Examples
    --------
    >>> from fabweave.mesh.io.token_rows import text_rows
    >>> first_columns(text_rows(b"1 2 9\n3 4\n", "a.off"), 2).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    short = np.flatnonzero(rows.counts < count)
    if len(short):
        raise rows.fault(
            int(short[0]), f"found {rows.counts[short[0]]} numbers, but expected at least {count}"
        )
    values = float_numbers(rows)
    result: FloatArray = values[offsets_of(rows.counts)[:-1, None] + np.arange(count)]
    return result


def row_lists(rows: Rows, starts: IntArray) -> tuple[IntArray, IntArray]:
    r"""Return the list in each row: a length and that many whole numbers.

    Parameters
    ----------
    rows : Rows
        Rows of numbers.
    starts : (R,) int array
        Token of each row at which its list starts.

    Returns
    -------
    sizes : (R,) int array
        The lengths.
    items : (N,) int array
        All items in one array.

    Raises
    ------
    InputError
        If a list ends early, or one of its numbers is not whole.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.mesh.io.token_rows import text_rows
    >>> sizes, items = row_lists(text_rows(b"2 7 8 0.5\n1 9\n", "a.off"), np.array([0, 0]))
    >>> sizes.tolist(), items.tolist()
    ([2, 1], [7, 8, 9])
    """
    values = mixed_numbers(rows)
    base = offsets_of(rows.counts)[:-1]
    room = rows.counts - starts - 1
    short = np.flatnonzero(room < 0)
    if len(short):
        raise rows.fault(int(short[0]), "the line ends before its list of vertices")
    sizes = _as_whole(values[base + starts], rows, np.arange(len(rows)))
    short = np.flatnonzero((sizes < 0) | (sizes > room))
    if len(short):
        row = int(short[0])
        raise rows.fault(row, f"the list should have {sizes[row]} numbers, but {room[row]} follow")
    offsets = offsets_of(sizes)
    places = np.arange(offsets[-1]) + np.repeat(base + starts + 1 - offsets[:-1], sizes)
    return sizes, _as_whole(values[places], rows, np.repeat(np.arange(len(rows)), sizes))


def _as_whole(values: FloatArray | IntArray, rows: Rows, row_of: IntArray) -> IntArray:
    """Return whole numbers, or name the row of the first that is not."""
    if values.dtype.kind == "i":
        return values.astype(np.int64, copy=False)
    wrong = np.flatnonzero(~((np.abs(values) < 2**53) & (values == np.floor(values))))
    if len(wrong):
        first = int(wrong[0])
        raise rows.fault(int(row_of[first]), f"found {values[first]:g} instead of a whole number")
    return values.astype(np.int64)
