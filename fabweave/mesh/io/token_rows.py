"""Split the text of mesh files into rows of tokens, in bulk."""

import re

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import IntArray, frozen_value, offsets_of
from fabweave.core.errors import InputError

_BLANK, _NEWLINE, _HASH, _SLASH, _DOT = b" \n#/."


@frozen_value
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
    lengths = rows.ends[at] - rows.starts[at]  # a line feed takes the place of the keyword
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
