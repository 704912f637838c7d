"""Read text files line by line, and name the line that is wrong."""

import re
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import offsets_of
from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh

_Number = TypeVar("_Number", int, float)

# A comment runs to the end of the line; "1.#IND", Microsoft's "not a number", starts none.
_COMMENT = re.compile(rb"((?<!\.)#|#(?![IQSiqs])).*", re.DOTALL)
_TOO_LARGE = 2**62
_NOT_NUMBER = re.compile(r"([+-]?)\d\.#(?:(INF)|IND|QNAN|SNAN)0*", re.IGNORECASE)


class Line(NamedTuple):
    """A line of a text file that holds something.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    number : int
        The line of the file, counted from 1.
    text : bytes
        What it holds, without comments; never blank.
    """

    name: str
    number: int
    text: bytes

    def fault(self, what: str) -> InputError:
        """Return the error that says what is wrong in this line."""
        return InputError(f"{self.name}, line {self.number}: {what}")

    def floats(self, words: list[bytes]) -> list[float]:
        """Return words of the line as numbers.

        Raises
        ------
        InputError
            If one of them is not a number.

        Examples
        --------
        >>> Line("a.obj", 7, b"").floats([b"-2.5e1", b"-1.#INF"])
        [-25.0, -inf]
        """
        try:
            return [float(word) for word in words]
        except ValueError:
            return self._carefully(words, _float, "a number")

    def integers(self, words: list[bytes]) -> list[int]:
        """Return words of the line as whole numbers of at most 63 bits.

        Raises
        ------
        InputError
            If one of them is not a whole number.

        Examples
        --------
        >>> Line("a.off", 7, b"").integers([b"7", b"-8"])
        [7, -8]
        """
        try:
            numbers = [int(word) for word in words]
        except ValueError:
            numbers = []
        if numbers and max(numbers) < _TOO_LARGE and min(numbers) > -_TOO_LARGE:
            return numbers
        return self._carefully(words, _int, "a whole number")

    def counted(self, words: list[bytes], at: int = 0) -> list[bytes]:
        """Return the words of the list that begins at a word with its length.

        Raises
        ------
        InputError
            If the list ends early.

        Examples
        --------
        >>> Line("a.off", 7, b"").counted(b"2 7 8 0.5".split())
        [b'7', b'8']
        """
        room = len(words) - at - 1
        if room < 0:
            raise self.fault("the line ends before its list of vertices")
        (count,) = self.integers(words[at : at + 1])
        if not 0 <= count <= room:
            raise self.fault(f"the list should have {count} numbers, but {room} follow")
        return words[at + 1 : at + 1 + count]

    def _carefully(
        self, words: list[bytes], convert: Callable[[str], _Number], wanted: str
    ) -> list[_Number]:
        """Convert word by word, so that the first bad one can be named."""
        numbers: list[_Number] = []
        for word in words:
            text = word.decode("latin-1")
            try:
                numbers.append(convert(text))
            except (ValueError, OverflowError):
                shown = text if len(text) <= 40 else text[:37] + "..."
                raise self.fault(f"found {shown!r} instead of {wanted}") from None
        return numbers


def _float(text: str) -> float:
    special = _NOT_NUMBER.fullmatch(text)
    if special is None:
        return float(text)
    return float(special.group(1) + ("inf" if special.group(2) else "nan"))


def _int(text: str) -> int:
    """Return a whole number, which some programs write as 3.0."""
    try:
        number = int(text)
    except ValueError:
        number = int(float(text))
        if number != float(text):
            raise
    if abs(number) >= _TOO_LARGE:
        raise ValueError(text)
    return number


def text_lines(
    data: bytes, name: str, *, continued: bool = False, first: int = 1
) -> Iterator[Line]:
    r"""Split a text file into its lines that hold something, whatever its line ends and encoding.

    Parameters
    ----------
    data : bytes
        The file, or the rest of it; a comment runs from ``#`` to the end of the line.
    name : str
        Its name, for messages.
    continued : bool
        Whether a backslash at the end of a line joins it with the next one.
    first : int
        Line number of the first line of the data.

    Examples
    --------
    >>> [line[1:] for line in text_lines(b"# head\r\n1 2 # two\r\n\r\n3\r\n", "a.off")]
    [(2, b'1 2 '), (4, b'3')]
    """
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    joined, start = b"", first
    for number, text in enumerate(data.removeprefix(b"\xef\xbb\xbf").split(b"\n"), start=first):
        # A comment does not continue: some systems' paths hold backslashes.
        more = continued and text.endswith(b"\\") and not text.lstrip().startswith(b"#")
        joined += text[:-1] + b" " if more else text
        if more:
            continue
        if b"#" in joined:
            joined = _COMMENT.sub(b"", joined)
        if joined and not joined.isspace():
            yield Line(name, start, joined)
        joined, start = b"", number + 1


def checked_mesh(
    name: str,
    vertices: npt.ArrayLike,
    sizes: npt.ArrayLike,
    indices: npt.ArrayLike,
    *,
    lines: Sequence[int] = (),
    counted_from: int = 0,
) -> PolyMesh:
    """Return the mesh that was read, if each vertex that its faces name exists.

    Parameters
    ----------
    name : str
        Name of the file.
    vertices : array-like of float
        Three numbers for each vertex.
    sizes, indices : array-like of int
        Corners of each face, and their vertices, counted from 0.
    lines : sequence of int
        The line of each face, where the file has lines.
    counted_from : {0, 1}
        What the file counts vertices from, for the message.

    Raises
    ------
    InputError
        If a face names a vertex that does not exist; the first is named.
    """
    points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    offsets = offsets_of(np.asarray(sizes, dtype=np.int64))
    corners = np.asarray(indices, dtype=np.int64)
    wrong = np.flatnonzero((corners < 0) | (corners >= len(points)))
    if len(wrong):
        face = int(np.searchsorted(offsets, wrong[0], side="right")) - 1
        raise InputError(
            f"{name}, {f'line {lines[face]}' if lines else f'face {face}'}: a face names vertex "
            f"{corners[wrong[0]] + counted_from}, but there are only {len(points)}, counted from "
            f"{counted_from}"
        )
    return PolyMesh(points, offsets, corners)


def position(line: Line, words: list[bytes]) -> list[float]:
    """Return the three coordinates with which words of a line begin.

    Raises
    ------
    InputError
        If there are fewer, or one is not a number.
    """
    if len(words) < 3:
        raise line.fault(f"found {len(words)} numbers, but expected at least 3")
    return line.floats(words[:3])
