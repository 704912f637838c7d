"""Light a picture: a key light with its shadow, the sky, and the dark of narrow places."""

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, unit
from fabweave.picture.zbuffer import Planes, nearest_triangles, planes_through

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
    _, nearness = nearest_triangles(
        seen * scale + shift, triangles, width=int(shape[0]), height=int(shape[1])
    )
    lit = places @ (axes.T * scale) + (shift - (0.5, 0.5, 0.0))
    # One pixel all around the object is free, so the four pixels around a place exist.
    corner = np.floor(lit[:, :2]).astype(np.int32)
    across, down = (lit[:, :2] - corner).T.astype(np.float32)
    pixel = corner[:, 1] * np.int32(shape[0]) + corner[:, 0]
    flat = nearness.ravel().astype(np.float32)
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
    dark = np.zeros((height, width), dtype=np.float32)
    count = 0
    for ring, share in enumerate(_RADII):
        for step in range(_DIRECTIONS):
            turn = np.pi * (step + ring / len(_RADII)) / _DIRECTIONS
            x, y = round(share * reach_px * np.cos(turn)), round(share * reach_px * np.sin(turn))
            if x == 0 and y == 0:
                continue
            one, other = (
                _rise(
                    padded[
                        edge + sign * y : edge + sign * y + height,
                        edge + sign * x : edge + sign * x + width,
                    ]
                    - shown,
                    float(np.hypot(x, y)),
                    reach_px,
                )
                for sign in (1, -1)
            )
            one += other
            dark += np.clip(one, 0.0, 1.0, out=one)
            count += 1
    dark *= _NARROWNESS / max(count, 1)
    return np.asarray(1.0 - _DARKEST * np.minimum(dark, 1.0), dtype=np.float32)


def _rise(above: npt.NDArray[np.float32], away: float, reach_px: float) -> npt.NDArray[np.float32]:
    """Return the slope of a rise, bounded, and little where it is far in front."""
    far = above > 4.0 * reach_px
    above *= np.float32(1.0 / away)
    np.clip(above, -_STEEPEST, _STEEPEST, out=above)
    above[far] *= _FAR_SHARE
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
    flat = triangles.ravel()
    means = np.stack(
        [
            np.bincount(flat, weights=np.repeat(normal[:, axis], 3), minlength=len(points))
            for axis in range(3)
        ],
        axis=1,
    )
    return unit(means.astype(np.float64))[triangles]


def covered_places(seen: IntArray, nearness: FloatArray) -> tuple[BoolArray, IntArray, FloatArray]:
    """Return which pixels show something, their triangles, and their places in pixels."""
    covered = seen >= 0
    pixel = np.flatnonzero(covered)
    row, column = np.divmod(pixel, seen.shape[1])
    places = np.column_stack((column + 0.5, row + 0.5, nearness.ravel()[pixel]))
    return covered, seen.ravel()[pixel], places
