"""Show in colour how far a model is from the surface that stands in for it."""

import textwrap
from functools import partial

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fabweave.core.arrays import FloatArray
from fabweave.core.colour_space import Colours, bytes_of, light_of
from fabweave.mesh.likeness import Likeness, LossMap
from fabweave.picture.camera import View, choose_view
from fabweave.picture.contact_sheet import side_by_side, stacked, titled
from fabweave.picture.object_picture import SIDE_PX, opposite_view, png_bytes
from fabweave.picture.render import render_scene

#: Colours of distances, from none on in equal steps, and dark at the end: each is darker than the
#: one before, so that the order shows without colours, too.
_RAMP: Colours = np.array(
    [(215, 221, 228), (240, 208, 84), (234, 150, 0), (197, 72, 0), (99, 24, 0)], dtype=np.uint8
)
_RAMP.setflags(write=False)
#: The last colour begins at this share of the size: equal colours are equal shares, whatever is
#: shown beside.
_MOST = 0.05
_INK = (38, 43, 51)
#: Room for a line of the legend, and for a letter at the most, in heights of its letters.
_LEADING, _LETTER = 1.6, 0.6


def loss_colours(loss: LossMap) -> Colours:
    """Return the colour of each triangle, (T, 3): from grey, where nothing is lost, to dark red.

    Examples
    --------
    >>> points, row = np.eye(3), np.array([[0, 1, 2]])
    >>> [loss_colours(LossMap(points, row, np.array([lost]), 400.0))[0].tolist()
    ...  for lost in (0.0, 20.0, 90.0)]
    [[215, 221, 228], [99, 24, 0], [99, 24, 0]]
    """
    return _ramp(loss.lost_mm / (_MOST * loss.size_mm))


def _ramp(share: FloatArray) -> Colours:
    """Return colours of numbers from 0 to 1."""
    light, at = light_of(_RAMP), np.linspace(0.0, 1.0, len(_RAMP))
    return bytes_of(np.stack([np.interp(share, at, part) for part in light.T], axis=-1))


def loss_tiles(loss: LossMap, front: View, size_px: tuple[int, int]) -> Image.Image:
    """Make a picture of a model from the front and from behind, coloured by what is lost.

    Parameters
    ----------
    loss : LossMap
    front : View
    size_px : (int, int)
        Width and height of each half.
    """
    colours = loss_colours(loss)
    views = ((front, "from the front"), (opposite_view(front), "from behind"))
    scene = partial(render_scene, loss.points, loss.triangles, colours, size_px=size_px)
    return side_by_side(*(titled(scene(view=view), text) for view, text in views))


def loss_legend(loss: LossMap, wide: int, text: str = "") -> Image.Image:
    """Draw what the colours mean: a bar with lengths in millimetres, and some text below.

    Parameters
    ----------
    loss : LossMap
    wide : int
        Pixels.
    text : str
        Such as the names of what is lost; broken to lines that fit.
    """
    points = max(wide // 64, 10)
    font = ImageFont.load_default(size=points)
    step = round(_LEADING * points)
    lines = textwrap.wrap(text, int(wide / (_LETTER * points)))
    bar = min(wide // 2, 20 * points)
    left, top = (wide - bar) // 2, points // 2
    picture = Image.new("RGB", (wide, top + step * (3 + len(lines))), (255, 255, 255))
    shares = (np.arange(bar) + 0.5) / bar
    strip = np.broadcast_to(_ramp(shares), (points, bar, 3))
    picture.paste(Image.fromarray(np.ascontiguousarray(strip)), (left, top + step))
    draw = ImageDraw.Draw(picture)
    title = "how far the model is from the remeshed surface, mm"
    draw.text((wide / 2, top + step / 2), title, fill=_INK, font=font, anchor="mm")
    most = _MOST * loss.size_mm
    y = top + 2.5 * step - 0.2 * points
    for share in (0.0, 0.5, 1.0):
        length = f"{share * most:.3g}" + " or more" * (share == 1.0)
        draw.text((left + share * bar, y), length, fill=_INK, font=font, anchor="mm")
    for number, line in enumerate(lines):
        y = top + (3.5 + number) * step
        draw.text((wide / 2, y), line, fill=_INK, font=font, anchor="mm")
    return picture


def loss_picture(loss: LossMap, text: str = "") -> Image.Image:
    """Make the picture of what a remeshed model lost: from the front, from behind, and a legend.

    Parameters
    ----------
    loss : LossMap
    text : str
        What is said below, such as the names of lost features.

    Returns
    -------
    Image
        RGB; the same for the same input.
    """
    tiles = loss_tiles(loss, choose_view(loss.points, loss.triangles), SIDE_PX)
    return stacked(tiles, loss_legend(loss, tiles.width, text))


def likeness_png(loss: LossMap | None, like: Likeness | None) -> bytes | None:
    """Return the picture of ``loss_picture`` as a PNG file; None where nothing was remeshed."""
    if loss is None or like is None:
        return None
    return png_bytes(loss_picture(loss, like.lost_text))
