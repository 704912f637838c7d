"""Paint the object as far as it is woven: new pieces solid, what is in place pale.

Every tone is as light as its meaning asks, whatever its hue: a grey print tells what is new, what
is in place and where pieces end as the colours do.
"""

import zlib

import numpy as np
from PIL import Image

from fabweave.assembly.manual.scene import Scene
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.colour_space import Colours, bytes_of, light_of
from fabweave.picture.camera import Frame
from fabweave.picture.zbuffer import nearest_triangles

#: Pixels in a millimetre of a picture, 200 in an inch: where pieces end, lines are one and three of
#: them wide, 0.13 and 0.38 mm, and the gap beside what is beneath is two.
PX_MM = 200.0 / 25.4
#: Points of a page in a pixel.
POINTS_PX = 72.0 / 25.4 / PX_MM
#: Relative luminance of what is in place, seen from inside and from outside in three lights, and
#: of what is new: their contrast is 3 at least, ( 0.62 + 0.05 ) / ( 0.17 + 0.05 ).
THERE, NEW = (0.62, 0.66, 0.72, 0.78), (0.08, 0.11, 0.14, 0.17)
_LEVELS = len(THERE) + len(NEW)
#: The first colours of every picture: paper, the outline of what is in place (4.5 against white),
#: black, and what is still to come.
PAPER, OUTLINE, BLACK, COMING = range(4)
FIXED = ((255, 255, 255), (119, 119, 119), (0, 0, 0), (242, 242, 242))
#: No more colours are in one picture.
_MOST_COLOURS = 256
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_KEY = (-0.42, 0.62, 0.66)


@frozen_value
class Painted:
    """A picture of few colours, packed.

    Parameters
    ----------
    width_px, height_px : int
    colours : (C, 3) uint8 array
        At most 256.
    packed : bytes
        The number of the colour of each pixel, row after row from the top, deflated.
    """

    width_px: int
    height_px: int
    colours: Colours
    packed: bytes

    @property
    def image(self) -> Image.Image:
        """The picture in RGB."""
        number = np.frombuffer(zlib.decompress(self.packed), dtype=np.uint8)
        return Image.fromarray(self.colours[number.reshape(self.height_px, self.width_px)])


@frozen_value
class Palette:
    """The colours of all pictures of a job.

    Parameters
    ----------
    own : (P,) int array
        The number of each piece's own colour.
    tones : (C, 8, 3) uint8 array
        Each own colour as it is shown in place and new, from dark to light.
    """

    own: IntArray
    tones: Colours


def make_palette(colours: Colours) -> Palette:
    """Return the tones of pieces that have given colours, (P, 3)."""
    own, number = np.unique(colours, axis=0, return_inverse=True)
    light = light_of(own)
    tones = [_toned(light, luminance) for luminance in (*THERE, *NEW)]
    return Palette(number.ravel().astype(np.int64), bytes_of(np.stack(tones, axis=1)))


def _toned(light: FloatArray, luminance: float) -> FloatArray:
    """Mix each colour, (C, 3) of linear light, with white or black to a luminance.

    Examples
    --------
    >>> _toned(np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), 0.5).round(3).tolist()
    [[1.0, 0.365, 0.365], [0.5, 0.5, 0.5]]
    """
    own = light @ _LUMINANCE
    dark = light * np.minimum(1.0, luminance / np.maximum(own, 1e-9))[:, None]
    white = np.clip((luminance - own) / np.maximum(1.0 - own, 1e-9), 0.0, 1.0)[:, None]
    return np.asarray(dark + (1.0 - dark) * white)


def paint(
    scene: Scene, palette: Palette, frame: Frame, step: int, first_new: int, *, coming: bool
) -> tuple[Painted, FloatArray, IntArray]:
    """Paint what is in place after a step.

    Parameters
    ----------
    scene : Scene
    palette : Palette
    frame : Frame
        What is beyond it is not painted.
    step, first_new : int
        What came in steps from the one to the other is new.
    coming : bool
        Whether what is still to come is a faint ground.

    Returns
    -------
    painted : Painted
    nearness : (height, width) float array
        How near what is seen is, in pixels; minus infinity where there is nothing.
    piece : (height, width) int array
        What piece it is; -1 where there is none.
    """
    points = frame.pixels(scene.points)
    inside = _in_frame(points[:, :2][scene.triangles], frame)
    placed = np.flatnonzero(inside & (scene.step <= step))
    # Where two pieces lap, they lie in one place: the new one is seen.
    placed = placed[np.argsort(-scene.step[placed], kind="stable")]
    seen, near = nearest_triangles(
        points, scene.triangles[placed], width=frame.width_px, height=frame.height_px
    )
    there = seen >= 0
    triangle = placed[seen[there]]
    code = np.full(seen.shape, PAPER, dtype=np.int64)
    if coming:
        later = np.flatnonzero(inside & (scene.step > step))
        ahead, _ = nearest_triangles(
            points, scene.triangles[later], width=frame.width_px, height=frame.height_px
        )
        code[ahead >= 0] = COMING
    levels = _levels(scene, frame, first_new)
    code[there] = (len(FIXED) + palette.own[scene.piece] * _LEVELS + levels)[triangle]
    piece = np.full(seen.shape, -1, dtype=np.int64)
    piece[there] = scene.piece[triangle]
    new = np.zeros(seen.shape, dtype=bool)
    new[there] = scene.step[triangle] >= first_new
    _draw_ends(code, piece, near, new)
    return _packed(code, palette), near, piece


def _in_frame(corners: FloatArray, frame: Frame) -> BoolArray:
    """Return which triangles may be seen in a frame, by the boxes around them."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    return np.asarray(
        (high > 0.0).all(axis=1) & (low < (frame.width_px, frame.height_px)).all(axis=1)
    )


def _levels(scene: Scene, frame: Frame, first_new: int) -> IntArray:
    """Return which tone of its own colour each triangle has, (T,)."""
    key = np.array(_KEY)
    light = scene.normals @ (key / np.linalg.norm(key) @ frame.axes)
    back = scene.normals @ frame.axes[2] < 0.0
    steps = np.clip(np.floor(3.0 * light), 0, 2).astype(np.int64)
    level = np.where(back, 0, 1 + steps)
    return np.asarray(level + len(THERE) * (scene.step >= first_new))


def _draw_ends(code: IntArray, piece: IntArray, near: FloatArray, new: BoolArray) -> None:
    """Draw lines along the ends of all pieces, and a white gap beside them on what is beneath.

    So at each crossing the rails of the upper strand go through, and the lower one's are broken.
    """
    upper = np.zeros(piece.shape, dtype=bool)
    lower = np.zeros(piece.shape, dtype=bool)
    for axis in (0, 1):
        one = tuple(slice(None, -1) if at == axis else slice(None) for at in (0, 1))
        two = tuple(slice(1, None) if at == axis else slice(None) for at in (0, 1))
        differ = piece[one] != piece[two]
        first = differ & (near[one] >= near[two])
        second = differ & ~first
        upper[one] |= first
        upper[two] |= second
        lower[two] |= first
        lower[one] |= second
    upper &= piece >= 0
    gap = (grown(lower) | lower) & ~upper & (piece >= 0)
    code[gap] = PAPER
    code[upper] = OUTLINE
    ends = upper & new
    heavy = (grown(grown(ends)) | ends) & new & ~gap
    code[heavy] = BLACK


def grown(area: BoolArray) -> BoolArray:
    """Return an area with the pixels beside it."""
    larger = area.copy()
    larger[:, :-1] |= area[:, 1:]
    larger[:, 1:] |= area[:, :-1]
    larger[:-1] |= area[1:]
    larger[1:] |= area[:-1]
    return larger


def _packed(code: IntArray, palette: Palette) -> Painted:
    """Return a picture with the colours that are in it; in grey, if those are too many."""
    used = np.flatnonzero(np.bincount(code.ravel()))
    tones = np.concatenate((np.array(FIXED, dtype=np.uint8), palette.tones.reshape(-1, 3)))
    colours = tones[used]
    if len(used) > _MOST_COLOURS:
        rest = np.maximum(used - len(FIXED), 0) % _LEVELS
        used_as = np.where(used < len(FIXED), used, len(FIXED) + rest)
        tones = np.concatenate((np.array(FIXED), _greys()))
        lookup = np.zeros(int(used[-1]) + 1, dtype=np.uint8)
        lookup[used] = used_as
        colours = tones.astype(np.uint8)
    else:
        lookup = np.zeros(int(used[-1]) + 1, dtype=np.uint8)
        lookup[used] = np.arange(len(used))
    height, width = code.shape
    return Painted(width, height, colours, zlib.compress(lookup[code].tobytes(), level=4))


def _greys() -> Colours:
    """Return the tones without hue."""
    return bytes_of(np.repeat(np.array((*THERE, *NEW))[:, None], 3, axis=1))
