"""Read a sheet at full size: the pages of a PDF, and the points of the lines drawn on them."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fabweave.verify.drawing import Floats, ReadError
from fabweave.verify.read.pdf import read_contents

_BOX = re.compile(rb"/MediaBox\s*\[([^\]]*)\]")
_STEP = re.compile(rb"([-+.\d][-+.\d\s]*?)\s(m|l|c)(?=\s)")
_SHIFT = re.compile(rb"1 0 0 1 ([-.\d]+) ([-.\d]+) cm\s*(?:q\s*)?/\S+ Do")
_MM = 25.4 / 72.0


@dataclass(frozen=True, eq=False)
class Template:
    """Sizes of the pages, where on each the sheet's origin stands, and all points drawn of it.

    All in millimetres: (P, 2) sizes, (P, 2) origins, (N, 2) points.
    """

    pages: Floats
    origins: Floats
    points: Floats


def read_template(path: Path) -> Template:
    """Return what a PDF of a sheet shows; its one form holds the sheet.

    Raises
    ------
    ReadError
        If it is no such PDF.
    """
    data, contents = read_contents(path)
    try:
        boxes = np.array([[float(word) for word in box[1].split()] for box in _BOX.finditer(data)])
        drawn = max(contents, key=len, default=b"")
        ends = [[float(word) for word in step[1].split()[-2:]] for step in _STEP.finditer(drawn)]
        shifts = [
            [float(match[1]), float(match[2])]
            for content in contents
            for match in [_SHIFT.search(content)]
            if match is not None
        ]
    except ValueError as error:
        raise ReadError(f"it has a number that is none: {error}") from error
    if not ends or any(len(end) != 2 for end in ends) or boxes.ndim != 2 or boxes.shape[1] != 4:
        raise ReadError("it shows no lines")
    pages = boxes[:, 2:] - boxes[:, :2]
    origins = np.array(shifts) if shifts else np.zeros((len(pages), 2))
    return Template(_MM * pages, _MM * origins, _MM * np.array(ends))
