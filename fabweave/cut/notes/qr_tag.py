"""Draw the QR code where it outlives the cut: as a picture for paper, and as a tag to engrave."""

import io

import numpy as np
from PIL import Image

from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.cut.drawing import Circle, Entity, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.cut.labels.lettering import place_text, text_box
from fabweave.cut.notes.qr_code import QUIET_DOTS, code_dots, dark_runs
from fabweave.cut.sheets import lettered

#: The picture of the code in a job's folder, and the folder and the name of the tag.
CODE_FILE, TAG_FOLDER, TAG_NAME = "qr_code.png", "tag", "qr_tag"
#: Pixels of a dot in the picture: sharp at the size of a stamp.
_DOT_PIXELS = 8
#: A dot of the tag, and how far apart the lines are that fill it, about as wide as a beam.
_DOT_MM, _PITCH_MM = 1.0, 0.2
#: Above the code stand a hole for a string and the job's name.
_HEAD_MM, _HOLE_MM, _LETTER_MM = 9.0, 4.0, 3.0
#: Round corners, and what is left beside the code's quiet border, so that they do not cut it.
_CORNER_MM, _RIM_MM = 2.0, 1.5
#: The bulge of a quarter of a circle.
_QUARTER = float(np.tan(np.pi / 8.0))


def code_png(text: str) -> bytes:
    """Return a QR code with its quiet border as a picture, black on white.

    Examples
    --------
    >>> Image.open(io.BytesIO(code_png("HELLO"))).size
    (232, 232)
    """
    light = ~np.pad(code_dots(text), QUIET_DOTS)
    pixels = np.kron(light, np.ones((_DOT_PIXELS, _DOT_PIXELS), dtype=np.bool_))
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", optimize=True)
    return file.getvalue()


def draw_tag(text: str, title: str) -> SheetDrawing:
    """Return a tag to cut from any offcut: the code engraved, a name, a hole for a string.

    Each run of dark dots is one line that goes to and fro; nothing of the tag is wider than a
    beam, so every laser program takes it.

    Parameters
    ----------
    text : str
        What the code says.
    title : str
        Name of the job; cut off where it is too long.

    Examples
    --------
    >>> tag = draw_tag("HELLO", "vase")
    >>> tag.width_mm, tag.height_mm, tag.pieces[0].entities[-1].closed
    (32.0, 41.0, True)
    """
    dots = code_dots(text)
    border = QUIET_DOTS * _DOT_MM + _RIM_MM
    wide = len(dots) * _DOT_MM + 2.0 * border
    high, middle = wide + _HEAD_MM, wide + (_HEAD_MM - _CORNER_MM) / 2.0
    hole = Circle(Layer.CUT_INNER, border + _HOLE_MM / 2.0, middle, _HOLE_MM / 2.0)
    begin = hole.x + _HOLE_MM
    entities: tuple[Entity, ...] = (
        *_name(lettered(title), begin, wide - border, middle),
        *(Polyline(Layer.ENGRAVE_MARK, zigzag) for zigzag in _zigzags(dots, border)),
        hole,
        _rounded(wide, high),
    )
    return SheetDrawing(TAG_NAME, wide, high, (PieceDrawing("QR", entities),), ())


def _name(title: str, begin: float, end: float, y: float) -> tuple[Polyline, ...]:
    """Letter as much of a name as there is room for."""
    while title and text_box(title, _LETTER_MM).width > end - begin:
        title = title[:-1].rstrip()
    box = text_box(title, _LETTER_MM)
    strokes = place_text(title, _LETTER_MM, (begin + box.width / 2.0, y), 0.0) if title else ()
    return tuple(Polyline(Layer.ENGRAVE_LABEL, stroke) for stroke in strokes)


def _zigzags(dots: BoolArray, border: float) -> list[FloatArray]:
    """Return a line to and fro over each run of dark dots, half a pitch within them."""
    row, left, right = dark_runs(dots)
    count = round(_DOT_MM / _PITCH_MM)
    rise = (np.arange(count) + 0.5) * _PITCH_MM
    lines = []
    for low, start, end in zip(len(dots) - 1.0 - row, left, right, strict=True):
        ends = np.array([start, end]) * _DOT_MM + (_PITCH_MM / 2.0, -_PITCH_MM / 2.0)
        x = np.array([ends[:: 1 - 2 * (k % 2)] for k in range(count)])
        points = np.column_stack((x.ravel(), np.repeat(low * _DOT_MM + rise, 2)))
        lines.append(points + border)
    return lines


def _rounded(wide: float, high: float) -> Polyline:
    """Return a rectangle with round corners."""
    r = _CORNER_MM
    points = np.array([
        [r, 0.0], [wide - r, 0.0], [wide, r], [wide, high - r],
        [wide - r, high], [r, high], [0.0, high - r], [0.0, r],
    ])  # fmt: skip
    bulges = np.tile([0.0, _QUARTER], 4)
    return Polyline(Layer.CUT_OUTER, points, closed=True, bulges=bulges)
