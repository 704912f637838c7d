"""Put pictures together on a contact sheet, each with its caption."""

import re
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fabweave.core.errors import InputError

#: A line of a caption, and the size of its letters.
_Line: TypeAlias = tuple[str, int]

#: Space between tiles, and around.
_GAP_PX = 12
_INK, _PALE_INK = (38, 43, 51), (98, 106, 118)
#: Where captions may be broken: after spaces, and before signs that join parameters.
_BREAKS = re.compile(r"(?<= )(?! )|(?=[&?/])")
#: Signs that Pillow's own font lacks.
_PLAINER = str.maketrans(
    {"×": "x", "²": "^2", "³": "^3", "–": "-", "—": "-", "…": "...", "√": "sqrt "}
)


def contact_sheet(
    tiles: Sequence[Image.Image],
    captions: Sequence[str],
    *,
    columns: int = 4,
) -> Image.Image:
    """Put pictures side by side in rows, each with its caption below.

    Parameters
    ----------
    tiles : sequence of Image
        At least one; smaller ones are centred in the room of the largest.
    captions : sequence of str
        One each. The first line is written larger, and lines that are too long are broken.
    columns : int
        How many stand in a row.

    Returns
    -------
    Image
        RGB.

    Raises
    ------
    InputError
        If there are no tiles, or not as many captions.
    """
    if not tiles or len(tiles) != len(captions) or columns < 1:
        raise InputError(
            f"a contact sheet of {len(tiles)} pictures with {len(captions)} captions in {columns} "
            "columns cannot be made; give one caption a picture, and at least one of each"
        )
    columns = min(columns, len(tiles))
    wide, high = max(tile.width for tile in tiles), max(tile.height for tile in tiles)
    size = max(wide // 24, 11)
    written = [_broken(caption, wide, size) for caption in captions]
    room = max(sum(_high(points) for _, points in lines) for lines in written) + _GAP_PX
    rows = -(-len(tiles) // columns)
    sheet = Image.new(
        "RGB",
        (_GAP_PX + columns * (wide + _GAP_PX), _GAP_PX + rows * (high + room + _GAP_PX)),
        (255, 255, 255),
    )
    draw = ImageDraw.Draw(sheet)
    for index, (tile, lines) in enumerate(zip(tiles, written, strict=True)):
        left = _GAP_PX + index % columns * (wide + _GAP_PX)
        y = _GAP_PX + index // columns * (high + room + _GAP_PX)
        sheet.paste(tile, (left + (wide - tile.width) // 2, y + (high - tile.height) // 2))
        y += high
        for text, points in lines:
            ink, font = _INK if points == size else _PALE_INK, ImageFont.load_default(size=points)
            middle = (left + wide / 2, y + _high(points) / 2)
            draw.text(middle, text, fill=ink, font=font, anchor="mm")
            y += _high(points)
    return sheet


def titled(picture: Image.Image, text: str) -> Image.Image:
    """Return a picture with a text below it, in a band of its own."""
    size = max(picture.width // 24, 11)
    band = round(1.5 * _high(size))
    whole = Image.new("RGB", (picture.width, picture.height + band), (255, 255, 255))
    whole.paste(picture, (0, 0))
    place, font = (whole.width / 2, whole.height - band / 2), ImageFont.load_default(size)
    ImageDraw.Draw(whole).text(place, text, fill=_INK, font=font, anchor="mm")
    return whole


def stacked(*pictures: Image.Image) -> Image.Image:
    """Put pictures below one another, each in the middle."""
    wide, high = max(p.width for p in pictures), sum(p.height for p in pictures)
    whole = Image.new("RGB", (wide, high), (255, 255, 255))
    top = 0
    for picture in pictures:
        whole.paste(picture, ((wide - picture.width) // 2, top))
        top += picture.height
    return whole


def side_by_side(*pictures: Image.Image) -> Image.Image:
    """Put pictures of one height beside one another."""
    return Image.fromarray(np.hstack([np.asarray(picture) for picture in pictures]))


def _high(points: int) -> int:
    """Return the height of a line."""
    return round(1.35 * points)


def _broken(caption: str, wide: float, size: int) -> list[_Line]:
    """Break a caption to lines that fit."""
    lines: list[_Line] = []
    for number, line in enumerate(caption.translate(_PLAINER).split("\n")):
        points = size if number == 0 else max(round(0.8 * size), 10)
        font = ImageFont.load_default(size=points)
        text = ""
        for word in _BREAKS.split(line):
            if text and font.getlength(text + word) > wide:
                lines.append((text.strip(), points))
                text = ""
            text += word
        lines.append((text.strip(), points))
    return lines
