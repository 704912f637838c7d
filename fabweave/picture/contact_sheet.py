"""Put pictures together on a contact sheet, each with its caption."""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from PIL import Image, ImageDraw, ImageFont

from fabweave.core.errors import InputError

_Font: TypeAlias = ImageFont.FreeTypeFont | ImageFont.ImageFont

#: Space between tiles, and around.
_GAP_PX = 12
_INK, _PALE_INK = (38, 43, 51), (98, 106, 118)
#: Where captions may be broken besides at spaces: before these.
_BREAKS = "&?/"
#: Signs that Pillow's own font lacks.
_PLAINER = str.maketrans(
    {"×": "x", "²": "^2", "³": "^3", "–": "-", "—": "-", "…": "...", "√": "sqrt "}
)


class _Line(NamedTuple):
    """A line of a caption."""

    text: str
    height: int
    font: _Font
    ink: tuple[int, int, int]


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
    room = max(sum(line.height for line in lines) for lines in written) + _GAP_PX
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
        for line in lines:
            middle = (left + wide / 2, y + line.height / 2)
            draw.text(middle, line.text, fill=line.ink, font=line.font, anchor="mm")
            y += line.height
    return sheet


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
    """Put pictures beside one another, from the top."""
    wide, high = sum(p.width for p in pictures), max(p.height for p in pictures)
    whole = Image.new("RGB", (wide, high), (255, 255, 255))
    left = 0
    for picture in pictures:
        whole.paste(picture, (left, 0))
        left += picture.width
    return whole


def _broken(caption: str, wide: float, size: int) -> list[_Line]:
    """Break a caption to lines that fit."""
    lines: list[_Line] = []
    for number, line in enumerate(caption.translate(_PLAINER).split("\n")):
        points = size if number == 0 else max(round(0.8 * size), 10)
        font = ImageFont.load_default(size=points)
        ink = _PALE_INK if number else _INK
        text = ""
        for word in _words(line):
            if text and font.getlength(text + word) > wide:
                lines.append(_Line(text.strip(), round(1.35 * points), font, ink))
                text = ""
            text += word
        lines.append(_Line(text.strip(), round(1.35 * points), font, ink))
    return lines


def _words(line: str) -> list[str]:
    """Cut a line where it may be broken: after spaces, and before signs that join parameters."""
    words = [""]
    for sign in line:
        if sign in _BREAKS or words[-1].endswith(" "):
            words.append("")
        words[-1] += sign
    return words
