"""Render triangles to a picture, from Python alone: no GPU, no display.

A key light with its shadow, the sky, and the dark of narrow places light what is shown.
"""

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFilter

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, unit
from fabweave.core.colour_space import Colours, bytes_of, light_of
from fabweave.core.errors import InputError
from fabweave.picture.camera import Frame, View, choose_view, frame_object
from fabweave.picture.zbuffer import (
    Planes,
    covered_pixels,
    nearest_triangles,
    nearness_map,
    planes_through,
)

#: Where light comes from, as (right, up, towards the eye): over the left shoulder.
_KEY = (-0.36, 0.74, 0.57)
#: Shares of the light on a surface that faces it: what comes from everywhere, from the sky, from
#: the eye, and from the key light.
_EVEN, _SKY, _EYE, _KEY_SHARE = 0.32, 0.22, 0.28, 0.50
#: The key light reaches a little around the edge, so that no side is quite dead.
_WRAP = 0.15
#: Light that comes into a full shadow, and on the inner side of a surface.
_IN_SHADOW, _BEHIND = 0.30, 0.60
#: Pixels of the shadow map across the picture's larger side.
_SHADOW_PX = 1400
#: What a surface may rise inside a pixel of it, on a plane that faces the light and by slope.
_RISE, _RISE_BY_SLOPE, _STEEPEST_IN_LIGHT = 0.8, 1.5, 8.0
#: How narrow places darken: radii as shares of the reach, directions, and the depth of it.
_RADII = (0.4, 1.0)
_DIRECTIONS = 5
_STEEPEST = 2.0
_NARROWNESS = 1.5
_DARKEST = 0.68
_FAR_SHARE = 0.25
#: So many rows of a picture are darkened at a time.
_ROWS = 32
#: Farther than anything in a picture, and small enough for single precision.
_NOWHERE = 1e6


def key_direction() -> FloatArray:
    """Return the unit vector towards the key light as (right, up, towards the eye)."""
    return np.array(_KEY) / np.linalg.norm(_KEY)


def corner_light(corners: FloatArray, normals: FloatArray, up: FloatArray) -> tuple[Planes, Planes]:
    """Return the light on triangles without shadow: from all around, and from the key light.

    They are lit on both sides.

    Parameters
    ----------
    corners : (T, 3, 3) float array
        Corners as ``Frame.pixels`` gives them.
    normals : (T, 3, 3) float array
        Unit normals at the corners as (right, up, towards the eye), outward.
    up : (3,) float array
        The object's upward axis in the same terms.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # y counts from the top, so a triangle that runs counter-clockwise has a negative area.
    behind = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] > 0.0
    facing = np.where(behind[:, None, None], -normals, normals)
    key = np.clip((facing @ key_direction() + _WRAP) / (1.0 + _WRAP), 0.0, 1.0)
    sky, eye = 0.5 + 0.5 * (facing @ up), np.clip(facing[:, :, 2], 0.0, 1.0)
    side = np.where(behind, _BEHIND, 1.0)[:, None]
    return (
        planes_through(corners, side * (_EVEN + _SKY * sky + _EYE * eye)),
        planes_through(corners, side * _KEY_SHARE * key),
    )


def key_shadow(
    points: FloatArray,
    triangles: IntArray,
    triangle: IntArray,
    places: FloatArray,
    *,
    width: int,
    height: int,
) -> FloatArray:
    """Return how much of the key light reaches places on the surface, 0 to 1.

    Parameters
    ----------
    points : (V, 3) float array
        Vertices as ``Frame.pixels`` gives them.
    triangles : (T, 3) int array
        Corners.
    triangle : (N,) int array
        The triangle that each place lies on.
    places : (N, 3) float array
        Places on the surface in the same terms.
    width, height : int
        Size of the picture, which bounds the shadow map's finest pixel.

    Returns
    -------
    (N,) float array
    """
    towards = key_direction() * (1.0, -1.0, 1.0)
    right = np.cross((0.0, 1.0, 0.0), towards)
    right /= np.linalg.norm(right)
    axes = np.stack((right, np.cross(towards, right), towards))
    seen = points @ axes.T
    low = seen.min(axis=0)
    extent = float(np.max(np.ptp(seen[:, :2], axis=0)))
    scale = min(_SHADOW_PX, max(width, height)) / max(extent, 1e-9)
    shift = np.array([2.0, 2.0, 0.0]) - low * scale
    shape = (np.ceil(np.ptp(seen[:, :2], axis=0) * scale) + 5).astype(np.int64)
    nearness = nearness_map(
        seen * scale + shift, triangles, width=int(shape[0]), height=int(shape[1])
    )
    lit = places @ (axes.T * scale) + (shift - (0.5, 0.5, 0.0))
    # One pixel all around the object is free, so the four pixels around a place exist.
    corner = np.floor(lit[:, :2]).astype(np.int32)
    across, down = (lit[:, :2] - corner).T.astype(np.float32)
    pixel = corner[:, 1] * np.int32(shape[0]) + corner[:, 0]
    flat = nearness.astype(np.float32)
    # A surface must not shade itself: it rises by its slope from one pixel of the map to the next.
    normal = facet_normals(seen, triangles)[:, 0]
    steep = np.linalg.norm(normal[:, :2], axis=1) / np.maximum(np.abs(normal[:, 2]), 0.01)
    rise = _RISE + _RISE_BY_SLOPE * np.minimum(steep, _STEEPEST_IN_LIGHT)
    level = (lit[:, 2] + rise[triangle]).astype(np.float32)
    # Between the four pixels around the place: hard steps would show the map's pixels.
    upper = (flat[pixel] <= level) * (1 - across) + (flat[pixel + 1] <= level) * across
    pixel += np.int32(shape[0])
    lower = (flat[pixel] <= level) * (1 - across) + (flat[pixel + 1] <= level) * across
    reached = upper * (1 - down) + lower * down
    return _IN_SHADOW + (1.0 - _IN_SHADOW) * reached


def narrow_places(nearness: FloatArray, reach_px: float) -> npt.NDArray[np.float32]:
    """Return how much light comes into each pixel's surroundings, 0 to 1.

    On each line through a pixel, the surface's rise on one side is added to its rise on the
    other: on a plane, however it slants, they cancel; in a fold, or under an edge, they do not.
    What stands far in front darkens little, as it is no neighbour.

    Parameters
    ----------
    nearness : (H, W) float array
        Nearness in pixels, minus infinity where there is nothing.
    reach_px : float
        How far from a pixel surroundings are looked at.

    Returns
    -------
    (H, W) float array
        1 where the surface is open or there is nothing.
    """
    height, width = nearness.shape
    edge = int(np.ceil(reach_px)) + 1
    # Nothing is as far as can be: it never darkens.
    shown = np.where(np.isfinite(nearness), nearness, -_NOWHERE).astype(np.float32)
    padded = np.pad(shown, edge, constant_values=-_NOWHERE)
    aside = [
        (round(share * reach_px * np.cos(turn)), round(share * reach_px * np.sin(turn)))
        for ring, share in enumerate(_RADII)
        for turn in np.pi * (np.arange(_DIRECTIONS) + ring / len(_RADII)) / _DIRECTIONS
    ]
    aside = [(x, y) for x, y in aside if x or y]
    dark = np.zeros((height, width), dtype=np.float32)
    # A few rows at a time stay in the processor's cache.
    for top in range(0, height, _ROWS):
        own, rows = shown[top : top + _ROWS], dark[top : top + _ROWS]
        for x, y in aside:
            one, other = (
                _rise(
                    padded[
                        edge + top + sign * y : edge + top + sign * y + len(own),
                        edge + sign * x : edge + sign * x + width,
                    ]
                    - own,
                    float(np.hypot(x, y)),
                    reach_px,
                )
                for sign in (1, -1)
            )
            one += other
            rows += np.clip(one, 0.0, 1.0, out=one)
    dark *= _NARROWNESS / max(len(aside), 1)
    return np.asarray(1.0 - _DARKEST * np.minimum(dark, 1.0), dtype=np.float32)


def _rise(above: npt.NDArray[np.float32], away: float, reach_px: float) -> npt.NDArray[np.float32]:
    """Return the slope of a rise, bounded, and little where it is far in front."""
    far = above > 4.0 * reach_px
    above *= np.float32(1.0 / away)
    np.clip(above, -_STEEPEST, _STEEPEST, out=above)
    np.multiply(above, np.float32(_FAR_SHARE), out=above, where=far)
    return above


def facet_normals(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the unit normal of each triangle at its three corners, (T, 3, 3)."""
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.repeat(unit(normal)[:, None, :], 3, axis=1)


def smooth_normals(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return unit normals at the corners of triangles, means over each vertex, (T, 3, 3).

    Triangles count by their area.
    """
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    means = np.zeros_like(points, dtype=np.float64)
    np.add.at(means, triangles.ravel(), np.repeat(normal, 3, axis=0))
    return unit(means)[triangles]


def covered_places(seen: IntArray, nearness: FloatArray) -> tuple[BoolArray, IntArray, FloatArray]:
    """Return which pixels show something, their triangles, and their places in pixels."""
    covered = seen >= 0
    pixel = np.flatnonzero(covered)
    row, column = np.divmod(pixel, seen.shape[1])
    places = np.column_stack((column + 0.5, row + 0.5, nearness.ravel()[pixel]))
    return covered, seen.ravel()[pixel], places


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
#: Seen from lower than this, a floor would be a line, or hide the object.
_LOWEST_DEG = 4.0


def has_floor(view: View) -> bool:
    """Return whether a floor can be seen in a view."""
    return view.elevation_deg >= _LOWEST_DEG


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
        blurred = _blurred(np.mean(covered, axis=0), blur * small / coarser, coarser)
        shadow += shade * blurred[: frame.height_px, : frame.width_px]
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
    return covered_pixels(
        pixels / coarser,
        triangles,
        width=-(-frame.width_px // coarser),
        height=-(-frame.height_px // coarser),
    ).astype(np.float32)


def _blurred(
    shares: npt.NDArray[np.float32], radius: float, coarser: int
) -> npt.NDArray[np.float32]:
    """Blur a picture of shares, and bring it from coarser pixels to those of the frame."""
    image = Image.fromarray(np.round(255.0 * shares).astype(np.uint8))
    image = image.filter(ImageFilter.GaussianBlur(radius))
    image = image.resize((image.width * coarser, image.height * coarser), Image.Resampling.BICUBIC)
    return np.asarray(image, dtype=np.float32) / np.float32(255.0)


#: A picture has no more samples: each takes about 80 bytes of memory.
_MOST_SAMPLES = 50_000_000
#: Steps of light from black to white, for which bytes are looked up.
_LIGHT_STEPS = 4095
#: Lines are this dark, as a share of the surface's own light.
_LINE_SHADE = 0.16
#: How far narrow places are looked for, as a share of the picture's smaller side.
_REACH = 0.014


@frozen_value
class Dots:
    """Round marks on a surface, of one size in the picture; hidden where the surface is.

    Parameters
    ----------
    points : (M, 3) float array
        Where they stand.
    colours : (M, 3) uint8 array
        Their colours.
    radius_px : float
        Their radius in the picture.
    """

    points: FloatArray
    colours: Colours
    radius_px: float = 5.0


def render_scene(
    vertices: FloatArray,
    triangles: IntArray,
    colours: npt.ArrayLike,
    *,
    size_px: tuple[int, int] = (1000, 800),
    view: View | None = None,
    normals: FloatArray | None = None,
    edges: BoolArray | None = None,
    edge_colours: Colours | None = None,
    line_px: float = 1.2,
    reach_px: float | None = None,
    marks: Dots | None = None,
    floor: bool = False,
    lit: bool = True,
    samples: int = 2,
) -> Image.Image:
    """Render triangles that are seen from both sides.

    Nearness is resolved for every sample of every pixel, light and shadow are computed there,
    and the samples are averaged as light, a few of the neighbours' with them, so that edges are
    smooth. Lines lie on the surface and are hidden with it.

    Parameters
    ----------
    vertices : (V, 3) float array
        Positions in millimetres.
    triangles : (T, 3) int array
        Corners, counter-clockwise seen from outside.
    colours : (T, 3) or (3,) uint8 array
        The colour of each triangle, or of all.
    size_px : (int, int)
        Width and height of the picture.
    view : View or None
        From where; None chooses a three-quarter view from above.
    normals : (T, 3, 3) float array or None
        Unit normals at the corners; None makes every triangle flat.
    edges : (T, 3) bool array or None
        Whether side k of a triangle, from its corner k to the next, is drawn as a line.
    edge_colours : (T, 3, 3) uint8 array or None
        The colours of those lines; None darkens the surface.
    line_px : float
        Width of the lines.
    reach_px : float or None
        How far the dark of narrow places reaches; None takes a share of the picture.
    marks : Dots or None
        Marked points.
    floor : bool
        Whether the object stands on a floor, seen by the shadow on it; not in views from below.
    lit : bool
        False leaves out light and shadow: every triangle has exactly its colour.
    samples : int
        A pixel has this number's square of them.

    Returns
    -------
    Image
        RGB; the same for the same input.

    Raises
    ------
    InputError
        If there is nothing to render, or the picture would be empty or too large.

    Examples
    --------
    >>> square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1.0]])
    >>> picture = render_scene(square, np.array([[0, 1, 2], [0, 2, 3]]), (200, 30, 0),
    ...                        size_px=(40, 40), view=View(-90.0, 0.0), lit=False)
    >>> picture.getpixel((20, 20)), picture.getpixel((0, 20))
    ((200, 30, 0), (255, 255, 255))
    """
    if len(triangles) == 0:
        raise InputError("there is no triangle to render; the mesh has no face with an area")
    if samples < 1:
        raise InputError(f"a pixel has {samples} samples; it needs at least one")
    width, height = samples * size_px[0], samples * size_px[1]
    if width * height > _MOST_SAMPLES:
        raise InputError(
            f"a picture of {size_px[0]} x {size_px[1]} pixels of {samples**2} samples "
            f"cannot be made; take at most {_MOST_SAMPLES // 1_000_000} million samples in all"
        )
    view = choose_view(vertices, triangles) if view is None else view
    floor = floor and has_floor(view)
    small = object_frame(vertices, triangles, view, size_px)
    points = samples * small.pixels(vertices)
    seen, nearness = nearest_triangles(points, triangles, width=width, height=height)
    covered, triangle, places = covered_places(seen, nearness)
    shown = np.broadcast_to(np.asarray(colours, dtype=np.uint8), (len(triangles), 3))
    light = np.ones(len(triangle))
    if lit:
        normals = facet_normals(vertices, triangles) if normals is None else normals
        even, key = corner_light(points[triangles], normals @ small.axes.T, small.axes[:, 2])
        shadow = key_shadow(points, triangles, triangle, places, width=width, height=height)
        x, y = places[:, 0], places[:, 1]
        light = np.clip(even.at(triangle, x, y) + key.at(triangle, x, y) * shadow, 0.0, 1.25)
        reach = _REACH * min(size_px) if reach_px is None else reach_px
        light *= narrow_places(nearness, reach * samples)[covered]
    body = _linear(shown)[triangle]
    if edges is not None:
        inks = _inks(points[triangles], edges, triangle, places, line_px * samples)
        if edge_colours is None:
            light *= 1.0 - (1.0 - _LINE_SHADE) * inks.max(axis=1)
        else:
            for side in range(3):
                ink = inks[:, side, None].astype(np.float32)
                body += ink * (_linear(edge_colours[:, side])[triangle] - body)
    # The last channel is the share of the ground that is seen.
    picture = np.zeros((height, width, 4), dtype=np.float32)
    picture[:, :, 3] = 1.0
    picture[covered, :3] = body * light[:, None].astype(np.float32)
    picture[covered, 3] = 0.0
    if marks is not None:
        _mark(picture, nearness, samples * small.pixels(marks.points), marks, samples)
    mean = np.stack([_smaller(picture[:, :, channel], size_px) for channel in range(4)], axis=2)
    below = floor_light(vertices, triangles, view, small) if floor else np.float32(1.0)
    ground = mean[:, :, 3] * below
    return _encoded(mean[:, :, :3] + ground[:, :, None])


def object_frame(
    vertices: FloatArray, triangles: IntArray, view: View, size_px: tuple[int, int]
) -> Frame:
    """Return how ``render_scene`` maps an object to pixels; its shadow may be cut off."""
    return frame_object(vertices[np.unique(triangles)], view, size_px)


def middle_edge_px(
    vertices: FloatArray,
    triangles: IntArray,
    sides: BoolArray,
    view: View,
    size_px: tuple[int, int],
) -> float:
    """Return how long those sides of triangles are in a picture that are edges, in the median."""
    row, side = np.nonzero(sides)
    if not len(row):
        return 1.0
    frame = object_frame(vertices, triangles, view, size_px)
    ends = vertices[triangles[row, side]] - vertices[triangles[row, (side + 1) % 3]]
    return float(np.median(np.linalg.norm(ends, axis=1))) * frame.pixels_per_mm


def _inks(
    corners: FloatArray,
    edges: BoolArray,
    triangle: IntArray,
    places: FloatArray,
    width: float,
) -> FloatArray:
    """Return how much of the line on each side of its triangle covers every sample, (N, 3).

    The distance to a side of one's own triangle is affine, so a line needs no test against the
    surface: it is part of it.
    """
    inks = np.zeros((len(triangle), 3))
    for side in range(3):
        start, end, apex = (corners[:, (side + step) % 3, :2] for step in range(3))
        run = end - start
        length = np.linalg.norm(run, axis=1)
        area = np.abs(run[:, 0] * (apex - start)[:, 1] - run[:, 1] * (apex - start)[:, 0])
        height = np.divide(area, length, out=np.zeros_like(area), where=length > 0.0)
        values = np.zeros((len(corners), 3))
        values[:, (side + 2) % 3] = height
        drawn = np.flatnonzero(edges[triangle, side])
        away = planes_through(corners, values).at(
            triangle[drawn], places[drawn, 0], places[drawn, 1]
        )
        inks[drawn, side] = np.clip(width / 2.0 - away + 0.5, 0.0, 1.0)
    return inks


def _mark(
    picture: npt.NDArray[np.float32],
    nearness: FloatArray,
    places: FloatArray,
    marks: Dots,
    samples: int,
) -> None:
    """Paint the marks that are not hidden, those farther away first."""
    radius, near_by = marks.radius_px * samples, samples
    for index in np.argsort(places[:, 2], kind="stable"):
        x, y, near = places[index]
        left, top = max(int(x - radius), 0), max(int(y - radius), 0)
        right, bottom = int(x + radius) + 2, int(y + radius) + 2
        around = nearness[
            max(int(y) - near_by, 0) : int(y) + near_by + 1,
            max(int(x) - near_by, 0) : int(x) + near_by + 1,
        ]
        # Beside a point of a slanting surface something nearer may be seen, but not all around.
        if around.size and float(around.min()) > near + radius:
            continue
        area = picture[top:bottom, left:right]
        rows, columns = np.ogrid[top : top + area.shape[0], left : left + area.shape[1]]
        away = np.hypot(columns + 0.5 - x, rows + 0.5 - y)
        area[away <= radius] = 0.0
        area[away <= radius - 1.2 * samples, :3] = _linear(marks.colours[index])


def _smaller(shares: npt.NDArray[np.float32], size_px: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Return the samples of a channel averaged to pixels."""
    return np.asarray(Image.fromarray(shares).resize(size_px, Image.Resampling.HAMMING))


def _linear(colours: Colours) -> npt.NDArray[np.float32]:
    """Return light, 0 to 1, of bytes of sRGB."""
    return light_of(np.arange(256)).astype(np.float32)[colours]


def _encoded(light: npt.NDArray[np.float32]) -> Image.Image:
    """Return a picture of linear light in sRGB."""
    table = bytes_of(np.arange(_LIGHT_STEPS + 1) / _LIGHT_STEPS)
    step = np.clip(np.round(light * _LIGHT_STEPS), 0, _LIGHT_STEPS).astype(np.int64)
    return Image.fromarray(table[step])
