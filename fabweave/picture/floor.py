"""Let an object stand on a floor that is seen only by the object's shadow."""

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFilter

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.picture.camera import Frame, View
from fabweave.picture.shading import key_direction
from fabweave.picture.zbuffer import nearest_triangles

#: Light that the shadow of the key light and that of the sky take away at most.
_KEY_SHADE, _SKY_SHADE = 0.22, 0.42
#: The key light is no point: from so many places around it, this far aside, its shadow is soft
#: where what casts it is high, and sharp where it stands.
_KEY_PLACES, _KEY_ASIDE = 8, 0.10
#: The sky: directions around the vertical, and how far they lean.
_SKY_TURNS, _SKY_LEAN_DEG = 6, 38.0
#: Soft shadows are painted this many times smaller.
_KEY_COARSER, _SKY_COARSER = 2, 4
#: Softness of both shadows, as shares of the picture's smaller side.
_KEY_BLUR, _SKY_BLUR = 0.006, 0.022
#: Shadows end nowhere: from this share of the way from the middle to the border on they fade, with
#: round corners, so that no straight edge is seen.
_FADE, _ROUND = 0.72, 4.0
#: The picture has room for this share of the key light's shadow; the rest is faint.
_ROOM = 0.5
#: Seen from lower than this, a floor would be a line, or hide the object.
_LOWEST_DEG = 4.0


def has_floor(view: View) -> bool:
    """Return whether a floor can be seen in a view."""
    return view.elevation_deg >= _LOWEST_DEG


def floor_points(vertices: FloatArray, view: View) -> FloatArray:
    """Return the places on the floor, (V, 3), that a picture shows with an object.

    They lie on the way from the foot of each vertex to where the key light's shadow of it falls.
    The floor touches the lowest vertex.

    Examples
    --------
    >>> points = floor_points(np.array([[0.0, 0, 0], [0, 0, 1]]), View())
    >>> points[0].tolist(), float(points[1, 2])
    ([0.0, 0.0, 0.0], 0.0)
    """
    foot = _fallen(vertices, np.array([0.0, 0.0, 1.0]))
    fallen = _fallen(vertices, key_direction() @ view.axes())
    return np.asarray(foot + _ROOM * (fallen - foot), dtype=np.float64)


def floor_light(
    vertices: FloatArray, triangles: IntArray, view: View, frame: Frame
) -> npt.NDArray[np.float32]:
    """Return the light on the floor at each pixel, 0 to 1, were the object not in front.

    Parameters
    ----------
    vertices : (V, 3) float array
        Positions; only those of triangles are looked at.
    triangles : (T, 3) int array
        Corners.
    view : View
        From where.
    frame : Frame
        The picture.

    Returns
    -------
    (height, width) float array
        1 outside every shadow.
    """
    used, corners = np.unique(triangles, return_inverse=True)
    points, corners = vertices[used], corners.reshape(-1, 3)
    small = min(frame.width_px, frame.height_px)
    key, lean = key_direction() @ view.axes(), np.radians(_SKY_LEAN_DEG)
    up = np.array([0.0, 0.0, np.cos(lean)])
    shadow = np.zeros((frame.height_px, frame.width_px))
    for middle, aside, count, coarser, blur, shade in (
        (key, _KEY_ASIDE, _KEY_PLACES, _KEY_COARSER, _KEY_BLUR, _KEY_SHADE),
        (up, np.sin(lean), _SKY_TURNS, _SKY_COARSER, _SKY_BLUR, _SKY_SHADE),
    ):
        turns = 2.0 * np.pi * np.arange(count) / count
        around = np.stack((np.cos(turns), np.sin(turns), np.zeros(count)), axis=1)
        covered = [
            _covered(frame.pixels(_fallen(points, towards)), corners, frame, coarser)
            for towards in middle + aside * around
        ]
        shadow += shade * _blurred(np.mean(covered, axis=0), blur * small / coarser, frame)
    return np.asarray(1.0 - shadow * _faded(frame), dtype=np.float32)


def _faded(frame: Frame) -> FloatArray:
    """Return a share for each pixel that falls to 0 on a round shape that touches the borders."""
    down, across = (
        (2.0 * np.arange(size) + 1.0) / size - 1.0 for size in (frame.height_px, frame.width_px)
    )
    away = (np.abs(down[:, np.newaxis]) ** _ROUND + np.abs(across) ** _ROUND) ** (1.0 / _ROUND)
    return _eased((1.0 - away) / (1.0 - _FADE))


def _eased(shares: FloatArray) -> FloatArray:
    """Return shares, kept between 0 and 1, that set out and arrive without a corner."""
    kept = np.clip(shares, 0.0, 1.0)
    return np.asarray(kept * kept * (3.0 - 2.0 * kept), dtype=np.float64)


def _fallen(points: FloatArray, towards: FloatArray) -> FloatArray:
    """Return where shadows of points fall, with the light in this direction."""
    high = points[:, 2]
    return points - np.outer((high - high.min(initial=np.inf)) / towards[2], towards)


def _covered(
    pixels: FloatArray, triangles: IntArray, frame: Frame, coarser: int
) -> npt.NDArray[np.float32]:
    """Return 1 where a pixel of a coarser picture is covered, else 0."""
    seen, _ = nearest_triangles(
        pixels / coarser,
        triangles,
        width=-(-frame.width_px // coarser),
        height=-(-frame.height_px // coarser),
    )
    return (seen >= 0).astype(np.float32)


def _blurred(
    shares: npt.NDArray[np.float32], radius: float, frame: Frame
) -> npt.NDArray[np.float32]:
    """Blur a picture of shares, and bring it to the size of the frame."""
    image = Image.fromarray(np.round(255.0 * shares).astype(np.uint8))
    image = image.filter(ImageFilter.GaussianBlur(radius))
    coarser = -(-frame.width_px // image.width)
    if coarser > 1:
        image = image.resize(
            (image.width * coarser, image.height * coarser), Image.Resampling.BICUBIC
        )
    whole = np.asarray(image, dtype=np.float32) / np.float32(255.0)
    return whole[: frame.height_px, : frame.width_px]
