"""Turn the text of mesh files into rows of numbers, in bulk, and name the line that is wrong."""

import re
import warnings
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fabweave.arrays import FloatArray, IntArray, frozen, offsets_of
from fabweave.errors import InputError

_Number = TypeVar("_Number", np.float64, np.int64)

_BLANK, _NEWLINE, _HASH, _SLASH, _DOT = b" \n#/."
#: How Microsoft's C library used to print values that are no numbers.
_NOT_NUMBERS = {"#IND": "nan", "#QNAN": "nan", "#SNAN": "nan", "#INF": "inf"}


@dataclass(frozen=True, eq=False)
class Rows:
    """The lines of a text file that hold something.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    data : bytes
        The text, comments blanked out, rows ended by line feeds.
    starts, ends : (R,) int arrays
        Where the tokens of each row start and end in the text.
    counts : (R,) int array
        Number of tokens in each row.
    lines : (R,) int array
        Line of the file at which each row starts, counted from 1.
    """

    name: str
    data: bytes
    starts: IntArray
    ends: IntArray
    counts: IntArray
    lines: IntArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("starts", "ends", "counts", "lines"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.counts)

    def fault(self, row: int, what: str) -> InputError:
        """Return the error for one row; past the last row, for the end of the file."""
        if row < len(self):
            return InputError(f"{self.name}, line {self.lines[row]}: {what}")
        last = f", line {self.lines[-1]}" if len(self) else ""
        return InputError(f"{self.name}{last}, at the end of the file: {what}")

    def tokens(self, row: int) -> list[str]:
        """Return the tokens of one row."""
        return self.data[self.starts[row] : self.ends[row]].decode("latin-1").split()

    def cut(self, first: int, last: int | None = None) -> "Rows":
        """Return the rows from ``first`` up to ``last``."""
        part = slice(first, last)
        return Rows(
            self.name,
            self.data,
            self.starts[part],
            self.ends[part],
            self.counts[part],
            self.lines[part],
        )


def text_rows(data: bytes, name: str, *, continued: bool = False, first_line: int = 1) -> Rows:
    r"""Split a text file into rows, whatever its line ends and encoding.

    A comment runs from ``#`` to the end of the line; ``1.#IND``, which is how some programs
    write "not a number", starts none.

    Parameters
    ----------
    data : bytes
        The file, or the rest of it.
    name : str
        Its name, for messages.
    continued : bool
        Whether a backslash at the end of a line joins it with the next one.
    first_line : int
        Line number of the first line of the data.

    Returns
    -------
    Rows
        The rows that hold at least one token.

    Examples
    --------
    >>> rows = text_rows(b"# head\r\n 1 2 # two\r\n\r\n3\r\n", "a.off")
    >>> rows.lines.tolist(), rows.counts.tolist(), rows.tokens(0)
    ([2, 4], [2, 1], ['1', '2'])
    """
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    feeds = None
    if continued and b"\\\n" in data:
        feeds = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == _NEWLINE)
        # A comment does not continue: some systems' paths hold backslashes.
        data = re.sub(rb"^([ \t]*#.*)\\$", rb"\1 ", data, flags=re.MULTILINE)
        data = data.replace(b"\\\n", b"\v\v")
    text = np.frombuffer(data + b"\n", dtype=np.uint8)
    ends = np.flatnonzero(text == _NEWLINE)
    if b"#" in data:
        text = _without_comments(text, ends)
        data = text[:-1].tobytes()
    blank = text <= _BLANK
    starting = ~blank
    starting[1:] &= blank[:-1]
    token_starts = np.flatnonzero(starting)
    line_of_token = np.searchsorted(ends, token_starts)
    counts = np.bincount(line_of_token, minlength=len(ends))
    used = np.flatnonzero(counts)
    first_token = offsets_of(counts)[used]
    starts = token_starts[first_token]
    lines = used if feeds is None else np.searchsorted(feeds, starts)
    return Rows(name, data, starts, ends[used], counts[used], lines + first_line)


def _without_comments(text: npt.NDArray[np.uint8], ends: IntArray) -> npt.NDArray[np.uint8]:
    """Blank out each line from its first comment sign on."""
    signs = np.flatnonzero(text == _HASH)
    before, after = text[signs - 1], text[signs + 1]
    signs = signs[~((signs > 0) & (before == _DOT) & np.isin(after, list(b"IQSiqs")))]
    line = np.searchsorted(ends, signs)
    first = np.concatenate(([True], line[1:] != line[:-1])) if len(line) else line.astype(bool)
    change = np.zeros(len(text) + 1, dtype=np.int8)
    change[signs[first]] = 1
    change[ends[line[first]]] = -1
    result = text.copy()
    result[np.cumsum(change[:-1], dtype=np.int8).astype(bool)] = _BLANK
    return result


def keyword_rows(rows: Rows, keyword: str) -> tuple[Rows, IntArray]:
    r"""Return the rows whose first token is a keyword of one letter, without that token.

    Returns
    -------
    rows : Rows
        What follows the keyword in each row; a row may have no tokens left.
    at : (N,) int array
        The numbers of these rows among all.

    Examples
    --------
    >>> part, at = keyword_rows(text_rows(b"v 1 2\nvn 5\nv 3\n", "a.obj"), "v")
    >>> part.tokens(1), at.tolist()
    (['3'], [0, 2])
    """
    text = np.frombuffer(rows.data + b"\n\n", dtype=np.uint8)
    chosen = (text[rows.starts] == ord(keyword)) & (text[rows.starts + 1] <= _BLANK)
    at = np.flatnonzero(chosen)
    lengths = rows.ends[at] - rows.starts[at]  # the keyword gives its place to the line feed
    change = np.zeros(len(text) + 1, dtype=np.int8)
    change[rows.starts[at] + 1] = 1
    change[rows.ends[at] + 1] = -1
    data = text[np.cumsum(change[:-1], dtype=np.int8).astype(bool)].tobytes()
    bounds = offsets_of(lengths)
    part = Rows(rows.name, data, bounds[:-1], bounds[1:], rows.counts[at] - 1, rows.lines[at])
    return part, at


def without_slashes(rows: Rows) -> Rows:
    r"""Blank out every token from its first slash on.

    Examples
    --------
    >>> without_slashes(text_rows(b"1/2/3 4//5 6\n", "a.obj")).tokens(0)
    ['1', '4', '6']
    """
    if b"/" not in rows.data:
        return rows
    text = np.frombuffer(rows.data, dtype=np.uint8)
    blank = text <= _BLANK
    slashes = np.cumsum(text == _SLASH, dtype=np.int32)
    # How many slashes came before the token that a byte belongs to.
    before = np.maximum.accumulate(np.where(blank, slashes, 0))
    result = text.copy()
    result[(slashes > before) & ~blank] = _BLANK
    return Rows(rows.name, result.tobytes(), rows.starts, rows.ends, rows.counts, rows.lines)


def parse_float(token: str) -> float:
    """Return the number that a token writes.

    Raises
    ------
    ValueError
        If the token is no number; ``1_000``, which Python would take, is none.

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
    """Return the whole number that a token writes, if 64 bits hold it.

    Raises
    ------
    ValueError
        If the token is no whole number.

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
        If a token is no number; the message names its line.

    Examples
    --------
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
        If a token is no whole number; the message names its line.

    Examples
    --------
    >>> int_numbers(text_rows(b"1 2\n-3\n", "a.off")).tolist()
    [1, 2, -3]
    """
    values = _in_bulk(rows, np.dtype(np.int64))
    if values is None:
        values = np.array([n for row in _carefully(rows, whole=True) for n in row], dtype=np.int64)
    return values


def mixed_numbers(rows: Rows) -> FloatArray | IntArray:
    """Return all numbers of the rows as whole numbers if they are, else as floats."""
    values: FloatArray | IntArray | None = _in_bulk(rows, np.dtype(np.int64))
    return float_numbers(rows) if values is None else values


def _in_bulk(rows: Rows, kind: np.dtype[_Number]) -> npt.NDArray[_Number] | None:
    """Parse all rows at once, or return None if anything in them is no such number."""
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
    # It takes "1-2" and "1.5.5" for two numbers each; counting tells.
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
                raise rows.fault(row, f"{shown!r} where {wanted} is expected") from None
        if len(numbers) != rows.counts[row]:
            raise rows.fault(row, "control characters stand between the numbers")
        values.append(numbers)
    return values


def first_columns(rows: Rows, count: int) -> FloatArray:
    r"""Return the first numbers of each row, (R, count).

    Raises
    ------
    InputError
        If a row has fewer, or holds anything that is no number.

    Examples
    --------
    >>> first_columns(text_rows(b"1 2 9\n3 4\n", "a.off"), 2).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    short = np.flatnonzero(rows.counts < count)
    if len(short):
        raise rows.fault(
            int(short[0]), f"{rows.counts[short[0]]} numbers where at least {count} are expected"
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
    >>> sizes, items = row_lists(text_rows(b"2 7 8 0.5\n1 9\n", "a.off"), np.array([0, 0]))
    >>> sizes.tolist(), items.tolist()
    ([2, 1], [7, 8, 9])
    """
    values = mixed_numbers(rows)
    base = offsets_of(rows.counts)[:-1]
    room = rows.counts - starts - 1
    short = np.flatnonzero(room < 0)
    if len(short):
        raise rows.fault(int(short[0]), "the row ends before its list of vertices")
    sizes = _as_whole(values[base + starts], rows, np.arange(len(rows)))
    short = np.flatnonzero((sizes < 0) | (sizes > room))
    if len(short):
        row = int(short[0])
        raise rows.fault(row, f"{sizes[row]} numbers are announced and {room[row]} follow")
    offsets = offsets_of(sizes)
    places = np.arange(offsets[-1]) + np.repeat(base + starts + 1 - offsets[:-1], sizes)
    return sizes, _as_whole(values[places], rows, np.repeat(np.arange(len(rows)), sizes))


def _as_whole(values: FloatArray | IntArray, rows: Rows, row_of: IntArray) -> IntArray:
    """Return whole numbers, or name the row of the first that is none."""
    if values.dtype.kind == "i":
        return values.astype(np.int64, copy=False)
    wrong = np.flatnonzero(~((np.abs(values) < 2**53) & (values == np.floor(values))))
    if len(wrong):
        first = int(wrong[0])
        raise rows.fault(int(row_of[first]), f"{values[first]:g} where a whole number is expected")
    return values.astype(np.int64)
