"""Read a sheet at full size with a stranger's reader: its pages, and the lines drawn on them."""

from types import SimpleNamespace

import numpy as np
import pytest
from pypdf import PdfReader
from pypdf.generic import ContentStream

_MM = 25.4 / 72.0
#: Lines that are lighter, thinner or wider can be missed, or hide others.
_LIGHTEST, _THINNEST_MM, _WIDEST_MM = 0.6, 0.1, 1.5


def read_template(path):
    """Return what a PDF of a sheet shows; its one form holds the sheet.

    All in millimetres: the sizes of the ``pages``, (P, 2), where on each the sheet's origin stands
    (``origins``), the ``windows`` through which the sheet is seen, (P, 4: left, lower, width,
    height), and all ``points`` that are drawn of it, (N, 2). For each page its own ``lines``,
    (L, 2, 2), and the places on the sheet of its ``crosses``, by their number: {number: (C, 2)}.
    """
    reader = PdfReader(path, strict=True)
    sizes = [[float(side) for side in page.mediabox.upper_right] for page in reader.pages]
    origins, windows, lines, crosses = [], [], [], []
    for page, size in zip(reader.pages, sizes, strict=True):
        steps = ContentStream(page["/Contents"], reader).operations
        moves = [tuple(map(float, values)) for values, name in steps if name == b"cm"]
        moves = [move for move in moves if move != (1, 0, 0, 1, 0, 0)]
        assert len(moves) <= 1
        assert all(move[:4] == (1, 0, 0, 1) for move in moves)
        assert [values[0] for values, name in steps if name == b"Do"] == ["/FormXob.sheet"]
        origins.append(moves[0][4:] if moves else (0.0, 0.0))
        seen = [[float(each) for each in values] for values, name in steps if name == b"re"]
        windows.append(seen[0] if seen else [0.0, 0.0, *size])
        drawn, numbered = _marks(steps)
        lines.append(drawn)
        crosses.append({name: at - _MM * np.array(origins[-1]) for name, at in numbered.items()})
    form = reader.pages[0]["/Resources"]["/XObject"]["/FormXob.sheet"]
    points = []
    for values, name in ContentStream(form, reader).operations:
        if name in (b"m", b"l", b"c"):
            points.append([float(each) for each in values[-2:]])
        assert name != b"G" or float(values[0]) <= _LIGHTEST
        assert name != b"w" or _THINNEST_MM <= _MM * float(values[0]) <= _WIDEST_MM
        assert name not in (b"f", b"f*", b"B", b"B*", b"d"), "nothing fills, nothing is dashed"
    return SimpleNamespace(
        pages=_MM * np.array(sizes),
        origins=_MM * np.array(origins),
        windows=_MM * np.array(windows),
        points=_MM * np.array(points),
        lines=lines,
        crosses=crosses,
    )


def _marks(steps):
    """Return the lines of a page, and where its crosses are: two lines, and then their number."""
    lines, crosses = [], {}
    for values, name in steps:
        if name in (b"m", b"l"):
            lines.append([_MM * float(each) for each in values])
        if name == b"Tj" and values[0].isdigit():
            level, upright = np.array(lines[-4:]).reshape(2, 2, 2)
            assert level.mean(axis=0) == pytest.approx(upright.mean(axis=0), abs=1e-3)
            assert abs(np.diff(level, axis=0)[0] @ np.diff(upright, axis=0)[0]) < 1e-3
            crosses.setdefault(int(values[0]), []).append(level.mean(axis=0))
    return np.array(lines).reshape(-1, 2, 2), {n: np.array(at) for n, at in crosses.items()}
