"""Read the manual as its reader sees it: the texts of each page in order, and closed figures."""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fabweave.verify.drawing import Floats, ReadError
from fabweave.verify.read.pdf import Stream, read_pages, steps_of

_ESCAPED = re.compile(rb"\\([0-7]{1,3}|.)", re.DOTALL)
_SIGNS = {b"n": b"\n", b"r": b"\r", b"t": b"\t", b"b": b"\b", b"f": b"\f"}
#: In that alphabet, PDF shows the codes without a letter as discs.
_UNUSED = str.maketrans({"\x7f": "•", "\ufffd": "•"})
_SMALLEST_POINTS = 4.0
#: A lighter text, of black 0 and white 1, is read only on a figure that is filled with darkness.
_FAINT = 0.6


#: Signs are read as letters: small regular polygons, by their corners, filled with black or not.
_SIGNED = {(24, True): "●", (24, False): "○", (20, False): "⊕"}
_LARGEST_SIGN = 10.0


@dataclass(frozen=True, eq=False)
class ManualPage:
    """What is seen on a page: every text in order, and the corners of closed figures, in points."""

    texts: tuple[str, ...]
    figures: tuple[Floats, ...]
    #: Width and height of the page, in points.
    size: tuple[float, float] = (0.0, 0.0)


def read_manual(path: Path) -> tuple[ManualPage, ...]:
    """Return the pages of a PDF whose fonts have the Latin alphabet of Windows.

    Raises
    ------
    ReadError
        If it is no complete PDF as ours are, there is no text, or there is one that cannot be seen.
    """
    pages = tuple(_read(page) for page in read_pages(path))
    if not any(page.texts for page in pages):
        raise ReadError("it has no text")
    return pages


class _Drawing:
    """Follow what a page draws, operator by operator."""

    def __init__(self, page: Stream) -> None:
        self._page = page
        self._place, self._size = np.eye(3), 0.0
        self._fill: float | None = 0.0
        self._kept: list[tuple[Floats, float | None]] = []
        self._path: list[list[float]] = []
        self._closed = False
        #: The least and greatest corner of the last figure that was filled with darkness.
        self._dark: tuple[Floats, Floats] | None = None
        self.texts: list[str] = []
        self.figures: list[Floats] = []

    def do(self, operator: bytes, values: list[bytes]) -> None:
        """Follow one operator."""
        if operator == b"q":
            self._kept.append((self._place, self._fill))
        elif operator == b"Q":
            self._place, self._fill = self._kept.pop()
        elif operator == b"cm":
            self._place = _matrix(values) @ self._place
        elif operator in (b"g", b"rg"):
            self._fill = float(values[0]) if operator == b"g" else None
        elif operator in (b"m", b"l", b"n"):
            if operator != b"l":
                self._path, self._closed = [], False
            if operator != b"n":
                self._path.append([float(value) for value in values])
        elif operator == b"h":
            self._closed = True
        elif operator in (b"S", b"B", b"B*", b"f", b"f*"):
            self._paint(filled=operator != b"S")
        else:
            self._write(operator, values)

    def _paint(self, *, filled: bool) -> None:
        """Keep a figure that is drawn, if it is closed."""
        if not self._closed or not self._path:
            return
        corners = np.column_stack([np.array(self._path), np.ones(len(self._path))])
        figure = (corners @ self._place)[:, :2]
        sign = _SIGNED.get((len(figure), filled and self._fill == 0.0))
        if sign is not None and _is_sign(figure):
            self.texts.append(sign)
            return
        self.figures.append(figure)
        if filled and self._fill is not None and self._fill < 1.0 - _FAINT:
            self._dark = figure.min(axis=0), figure.max(axis=0)
        elif filled:
            self._dark = None

    def _write(self, operator: bytes, values: list[bytes]) -> None:
        """Follow what is of texts."""
        if operator == b"Tf":
            self._size = float(values[1])
        elif operator == b"Tm":
            self._require_legible(_matrix(values) @ self._place)
        elif operator == b"Tj":
            self.texts.append(_plain(values[0][1:-1]))

    def _require_legible(self, place: Floats) -> None:
        """Refuse a text at a place where it cannot be read."""
        area = float(np.linalg.det(place))
        at = place[2, :2]
        inside = np.all((at >= 0.0) & (at <= (self._page.width, self._page.height)))
        if not (inside and area > 0.0 and math.sqrt(area) * self._size >= _SMALLEST_POINTS):
            raise ReadError("a text is beyond its page, mirrored, or too small to be read")
        if self._fill is not None and self._fill <= _FAINT:
            return
        if self._dark is None or not np.all((self._dark[0] <= at) & (at <= self._dark[1])):
            raise ReadError("a text is too faint to be read, or in colour")


def _is_sign(figure: Floats) -> bool:
    """Return whether a polygon is small, and all its corners are equally far from its middle."""
    away = np.linalg.norm(figure - figure.mean(axis=0), axis=1)
    return bool(np.ptp(away) < 0.01 and away.max() < _LARGEST_SIGN / 2.0)


def _read(page: Stream) -> ManualPage:
    """Return what is seen on a page; refuse text that nobody can read."""
    drawing = _Drawing(page)
    try:
        for operator, values in steps_of(page.content):
            drawing.do(operator, values)
    except ReadError:
        raise
    except (IndexError, ValueError) as error:
        raise ReadError(f"a text or a line has no place or size: {error}") from error
    size = page.width, page.height
    return ManualPage(tuple(drawing.texts), tuple(drawing.figures), size)


def _matrix(values: list[bytes]) -> Floats:
    """Return a matrix by which rows of points are multiplied."""
    a, b, c, d, e, f = map(float, values)
    return np.array([[a, b, 0.0], [c, d, 0.0], [e, f, 1.0]])


def _plain(shown: bytes) -> str:
    """Return a text without escapes."""

    def sign(match: re.Match[bytes]) -> bytes:
        name = match[1]
        return bytes([int(name, 8) % 256]) if name.isdigit() else _SIGNS.get(name, name)

    text = _ESCAPED.sub(sign, shown).decode("cp1252", "replace")
    return text.translate(_UNUSED)
