"""Read the pictures of a job: whole, not blank, and of the shape of what they show."""

import io
from pathlib import Path
from typing import TypeAlias

import numpy as np
from PIL import Image

from fabweave.verify.crossing_map import Sheet
from fabweave.verify.drawing import ReadError
from fabweave.verify.read.content import read_content
from fabweave.verify.statement import Tally

#: Width and height in pixels.
Picture: TypeAlias = tuple[int, int]
#: Around a sheet on its picture there is no more than this, and this share of its longer side.
_ROOM_MM, _ROOM = 60.0, 0.1
#: No picture of a job has more.
_MOST_PIXELS = 1 << 28


def read_png(path: Path) -> Picture:
    """Require a PNG that can be decoded to its end and shows something."""
    data = io.BytesIO(read_content(path))
    try:
        with Image.open(data, formats=["PNG"]) as picture:
            size = picture.size
            if size[0] * size[1] <= _MOST_PIXELS:
                ranges = picture.convert("RGB").getextrema()
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ReadError(f"it is not a complete PNG: {error}") from error
    if size[0] * size[1] > _MOST_PIXELS:
        raise ReadError(f"it has {size[0]} x {size[1]} pixels")
    if not np.ptp(ranges, axis=1).any():
        raise ReadError("it is blank")
    return size


def check_shape(picture: Picture, sheet: Sheet, tally: Tally) -> None:
    """Check that a picture has the shape of its sheet, with some room around it."""
    sides = np.array([sheet.width_mm, sheet.height_mm])
    room = _ROOM_MM + _ROOM * sides.max()
    # There has to be a scale at which neither side lacks anything nor has too much around it.
    least, most = np.max(picture / (sides + room)), np.min(picture / np.maximum(sides, 1e-9))
    tally.at(f"{sheet.name}.png").expect(
        least <= most,
        f"it has {picture[0]} x {picture[1]} pixels, but the sheet {sheet.width_mm:g} x "
        f"{sheet.height_mm:g} mm",
    )
