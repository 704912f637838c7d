"""Read story sticks with a stranger's reader: the lines on each page, and the tapes they make."""

from types import SimpleNamespace

import numpy as np
from pypdf import PdfReader
from pypdf.generic import ContentStream

MM = 25.4 / 72.0
#: How wide the lines are, in points, of those that cut a strip off, mark it, and join two tapes.
CUT, MARK, JOIN = 1.4, 0.7, 1.0
#: The same of an outline; a level line that is no longer, in points, is the arm of a cross.
EDGE, _SHORT = 0.5, 30.0


def read_pages(file):
    """Return of each page its size in points, its straight lines and its text.

    Lines are (N, 4: from x and y, to x and y); ``widths`` are theirs, and ``dashed`` whether they
    are dashed.
    """
    reader = PdfReader(file, strict=True)
    pages = []
    for page in reader.pages:
        lines, widths, dashed = [], [], []
        start, width, dash = None, 0.0, False
        for values, name in ContentStream(page["/Contents"], reader).operations:
            if name == b"w":
                width = float(values[0])
            elif name == b"d":
                dash = bool(values[0])
            elif name == b"m":
                start = [float(each) for each in values]
            elif name == b"l":
                end = [float(each) for each in values]
                lines.append([*start, *end])
                widths.append(width)
                dashed.append(dash)
                start = end
        pages.append(
            SimpleNamespace(
                size=np.array([float(side) for side in page.mediabox.upper_right]),
                lines=np.array(lines).reshape(-1, 4),
                widths=np.array(widths),
                dashed=np.array(dashed, dtype=bool),
                text=page.extract_text(),
            )
        )
    return pages


def read_tapes(pages):
    """Return the tapes from page to page, from top to foot; what they have is in points.

    ``cuts``, ``marks`` and ``joins`` are the places of their upright lines, which reach from
    ``foot`` to ``top``; ``left`` and ``right`` is where their outline ends.
    """
    tapes = []
    for number, page in enumerate(pages):
        x, low, u, high = page.lines.T
        upright = (x == u) & np.isin(page.widths, (CUT, MARK, JOIN))
        upright &= page.dashed == (page.widths == JOIN)
        ends = np.sort(page.lines[:, [1, 3]], axis=1).round(2)
        spans = {tuple(row) for row in ends[upright & (page.widths != MARK)].tolist()}
        for foot, top in sorted(spans, reverse=True):
            own = upright & (ends == (foot, top)).all(axis=1)
            cuts, marks, joins = (np.sort(x[own & (page.widths == w)]) for w in (CUT, MARK, JOIN))
            outline = (page.widths == EDGE) & (low == high) & (foot < low) & (low < top)
            outline &= np.abs(u - x) > _SHORT
            reach = np.concatenate((x[outline], u[outline]))
            tapes.append(
                SimpleNamespace(
                    page=number, cuts=cuts, marks=marks, joins=joins, foot=foot, top=top,
                    left=float(reach.min()), right=float(reach.max()),
                )
            )  # fmt: skip
    return tapes


def joined(tapes):
    """Glue tapes together as a maker does; return of each whole one where its marks are, in mm.

    Each is (its marks, its end), from its start. What is glued under the next tape has the same
    marks as that one; this is seen to.
    """
    whole, marks, under, begin = [], [], np.zeros(0), None
    for tape in tapes:
        first = begin is None
        assert len(tape.cuts) == (first + (len(tape.joins) < 2 - first))
        origin = (tape.cuts if first else tape.joins)[0]
        shift = (begin or 0.0) - MM * origin
        places = MM * tape.marks + shift
        covered = places[: len(under)]
        assert np.allclose(covered, under, rtol=0, atol=0.01)
        if len(tape.joins) < 2 - first:
            whole.append((np.concatenate([*marks, places]), MM * tape.cuts[-1] + shift))
            marks, under, begin = [], np.zeros(0), None
            continue
        begin = MM * tape.joins[-1] + shift
        marks.append(places[places < begin])
        under = places[places >= begin]
    assert begin is None
    return whole
