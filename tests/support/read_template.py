"""Read a sheet at full size: the pages of a PDF, and the points of the lines drawn on them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from read_pdf import Stream, read_pages, steps_of

from fabweave.verify.drawing import Floats, ReadError

_MM = 25.4 / 72.0
_FORM = b"FormXob.sheet"
#: Lines that are lighter, thinner or wider can be missed, or hide others.
_LIGHTEST, _THINNEST_MM, _WIDEST_MM = 0.6, 0.1, 1.5
#: What a sheet is drawn with, and its pages: nothing that fills, colours or dashes.
_LINES = frozenset(b"n m l c h S w j J G cm BT ET Tf TL".split())
_PAGES = frozenset(b"n m l re W* S w q Q cm Do BT ET Tf TL Tm Tj T*".split())
_UNMOVED = [b"1", b"0", b"0", b"1", b"0", b"0"]


@dataclass(frozen=True, eq=False)
class Template:
    """Sizes of the pages, where on each the sheet's origin stands, and all points drawn of it.

    All in millimetres: (P, 2) sizes, (P, 2) origins, (P, 4) windows through which the sheet is
    seen (left, lower, width, height), (N, 2) points.
    """

    pages: Floats
    origins: Floats
    windows: Floats
    points: Floats


def read_template(path: Path) -> Template:
    """Return what a PDF of a sheet shows; its one form holds the sheet.

    Raises
    ------
    ReadError
        If it is no such PDF, or has anything that may hide a line.
    """
    pages = read_pages(path)
    try:
        shown = [_shown(page) for page in pages]
        points = _points(pages[0].parts[_FORM].content)
    except ReadError:
        raise
    except (ValueError, LookupError) as error:
        raise ReadError(f"a page is not as agreed: {error}") from error
    if any(page.parts[_FORM].content != pages[0].parts[_FORM].content for page in pages):
        raise ReadError("its pages do not show the same sheet")
    sizes = np.array([[page.width, page.height] for page in pages])
    return Template(
        _MM * sizes,
        _MM * np.array([origin for origin, _ in shown]),
        _MM * np.array([window for _, window in shown]),
        _MM * points,
    )


def _shown(page: Stream) -> tuple[list[float], list[float]]:
    """Return where a page has the sheet's origin, and the window through which it is seen."""
    origin, window = [0.0, 0.0], [0.0, 0.0, page.width, page.height]
    drawn, moved = 0, 0
    for operator, values in steps_of(page.content):
        if operator not in _PAGES:
            raise ReadError(f"a page of it has the operator {operator.decode()}")
        if operator == b"re":
            window = [float(value) for value in values]
        elif operator == b"cm" and values != _UNMOVED:
            if values[:4] != _UNMOVED[:4] or drawn or moved:
                raise ReadError("the sheet is scaled or turned on a page, or moved twice")
            moved += 1
            origin = [float(values[4]), float(values[5])]
        elif operator == b"Do":
            if values != [b"/" + _FORM]:
                raise ReadError("a page shows something that is not the sheet")
            drawn += 1
    if drawn != 1 or len(window) != 4:
        raise ReadError(f"a page shows the sheet {drawn} times")
    return origin, window


def _points(content: bytes) -> Floats:
    """Return the ends of all lines and curves that a form draws."""
    ends: list[tuple[float, float]] = []
    for operator, values in steps_of(content):
        if operator not in _LINES:
            raise ReadError(f"the sheet has the operator {operator.decode()}")
        if operator in (b"m", b"l", b"c"):
            ends.append((float(values[-2]), float(values[-1])))
        elif operator == b"G" and float(values[0]) > _LIGHTEST:
            raise ReadError("a line of the sheet is too light to be seen")
        elif operator == b"w" and not _THINNEST_MM <= _MM * float(values[0]) <= _WIDEST_MM:
            raise ReadError("a line of the sheet is too thin or too wide")
        elif operator == b"cm" and values != _UNMOVED:
            raise ReadError("a part of the sheet is moved")
    if not ends:
        raise ReadError("it shows no lines")
    points = np.array(ends)
    if not np.all(np.isfinite(points)):
        raise ReadError("a point of it is not finite")
    return points
