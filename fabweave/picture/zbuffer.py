"""Find which triangle each pixel shows: a z-buffer over arrays, without GPU or display."""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of

_Places: TypeAlias = npt.NDArray[np.floating[Any]]

#: Triangles, the pixels that they cover, and how near they are there.
_Covered: TypeAlias = tuple[IntArray, IntArray, FloatArray]

#: Covered pixels are compared in batches of about this many, which bounds the memory.
_BATCH = 1_000_000
#: A triangle with less area is seen edge-on: its slopes would be rounding errors.
_FLAT_PX2 = 1e-6


@frozen_value
class Planes:
    """Functions that are affine over the picture, one for each triangle.

    Parameters
    ----------
    along_x, along_y, start : (T,) float arrays
        Slopes, and the value at the picture's corner.
    """

    along_x: FloatArray
    along_y: FloatArray
    start: FloatArray

    def at(self, triangle: IntArray, x: _Places, y: _Places) -> FloatArray:
        """Return the values of the given triangles' functions at the given places."""
        return self.along_x[triangle] * x + self.along_y[triangle] * y + self.start[triangle]


def planes_through(corners: FloatArray, values: FloatArray) -> Planes:
    """Return the affine functions that take given values at the corners of triangles.

    Parameters
    ----------
    corners : (T, 3, 2 or more) float array
        Corners in pixels; what follows x and y is not looked at.
    values : (T, 3) float array
        The value at each corner.

    Returns
    -------
    Planes
        A triangle that is seen edge-on gets the constant of its first corner.

    Examples
    --------
    >>> planes = planes_through(np.array([[[0, 0], [2, 0], [0, 2]]]), np.array([[1.0, 5.0, 3.0]]))
    >>> planes.at(np.array([0]), np.array([1.0]), np.array([1.0])).tolist()
    [4.0]
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    rise, climb = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    flat = np.abs(area) < _FLAT_PX2
    scale = np.where(flat, 0.0, 1.0 / np.where(flat, 1.0, area))
    along_x = (rise * second[:, 1] - climb * first[:, 1]) * scale
    along_y = (climb * first[:, 0] - rise * second[:, 0]) * scale
    start = values[:, 0] - along_x * corners[:, 0, 0] - along_y * corners[:, 0, 1]
    return Planes(along_x, along_y, start)


def nearest_triangles(
    points: FloatArray, triangles: IntArray, *, width: int, height: int
) -> tuple[IntArray, FloatArray]:
    """Return which triangle is nearest at the centre of each pixel, and how near.

    A pixel belongs to a triangle if its centre lies inside; of two triangles that share a side,
    exactly one has a centre that lies on it, so there are neither cracks nor double pixels.

    Parameters
    ----------
    points : (V, 3) float array
        x to the right and y down in pixels, and nearness: of two, the larger is seen.
    triangles : (T, 3) int array
        Corners; both sides are seen.
    width, height : int
        Size of the picture in pixels.

    Returns
    -------
    triangle : (height, width) int array
        The triangle seen, -1 where there is none; of equally near ones the first.
    nearness : (height, width) float array
        Its nearness, minus infinity where there is none.

    Examples
    --------
    >>> square = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0.0]])
    >>> nearest_triangles(square, np.array([[0, 1, 2], [0, 2, 3]]), width=3, height=2)[0].tolist()
    [[0, 0, -1], [1, 0, -1]]
    """
    triangle, pixel, nearness = nearest_places(points, triangles, width=width, height=height)
    seen = np.full(width * height, -1, dtype=np.int64)
    seen[pixel] = triangle
    return seen.reshape(height, width), nearness.reshape(height, width)


def nearest_places(
    points: FloatArray, triangles: IntArray, *, width: int, height: int
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return what :func:`nearest_triangles` does, with triangles only where there are any.

    Returns
    -------
    triangle, pixel : (N,) int arrays
        Pixels that are covered, and what is seen there. Where triangles are equally near, a pixel
        comes more than once: at last with the first of them.
    nearness : (height * width,) float array
        That of each pixel.
    """
    parts = list(_covered(points, triangles, width, height))
    nearness = _nearness(parts, width * height)
    if not parts:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), nearness
    triangle, pixel, near = _joined(parts)
    wins = np.flatnonzero(near == nearness[pixel])[::-1]
    return triangle[wins], pixel[wins], nearness


def nearness_map(points: FloatArray, triangles: IntArray, *, width: int, height: int) -> FloatArray:
    """Return how near :func:`nearest_triangles` finds each pixel, (height * width,)."""
    return _nearness(_covered(points, triangles, width, height), width * height)


def _nearness(parts: Iterable[_Covered], size: int) -> FloatArray:
    """Return how near what covers each pixel is."""
    nearness = np.full(size, -np.inf)
    for _, pixel, near in parts:
        np.maximum.at(nearness, pixel, near)
    return nearness


def covered_pixels(
    points: FloatArray, triangles: IntArray, *, width: int, height: int
) -> BoolArray:
    """Return which pixels show any triangle, (height, width); as of :func:`nearest_triangles`.

    Examples
    --------
    >>> square = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0.0]])
    >>> covered_pixels(square, np.array([[0, 1, 2]]), width=3, height=2).tolist()
    [[True, True, False], [False, True, False]]
    """
    _, row, start, end = _row_spans(points[triangles], width, height)
    size = width * height + 1
    begun, ended = (np.bincount(row * width + column, minlength=size) for column in (start, end))
    return np.asarray(np.cumsum(begun - ended)[:-1] > 0).reshape(height, width)


def nearest_of_layers(
    points: FloatArray, triangles: IntArray, layer: IntArray, *, width: int, height: int
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return what each layer adds to a picture that shows the layers before it, in one pass.

    Parameters
    ----------
    points, triangles, width, height
        As of :func:`nearest_triangles`.
    layer : (T,) int array
        The layer of each triangle.

    Returns
    -------
    triangle, pixel : (N,) int arrays
        The triangles that are seen of each layer at some pixels, nearer than all layers before it.
    nearness : (N,) float array

    Examples
    --------
    >>> square = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0.0]])
    >>> nearest_of_layers(
    ...     square, np.array([[0, 1, 2], [0, 1, 2]]), np.array([1, 0]), width=2, height=1
    ... )[0].tolist()
    [1, 1]
    """
    parts = list(_covered(points, triangles, width, height))
    if not parts:
        none = np.empty(0, dtype=np.int64)
        return none, none, np.empty(0)
    triangle, pixel, near = _joined(parts)
    # By pixel and layer; in a layer the nearest is first, and of equally near ones the first.
    rank = np.unique(near, return_inverse=True)[1]
    order = np.lexsort((-rank, layer[triangle], pixel))
    triangle, pixel, rank, near = triangle[order], pixel[order], rank[order], near[order]
    # Pixels after one another: what is nearer than all before in its pixel is a new maximum.
    level = pixel * (len(rank) + 1) + rank
    before = np.maximum.accumulate(level)[:-1]
    seen = np.append(True, level[1:] > before)
    return triangle[seen], pixel[seen], near[seen]


def _covered(
    points: FloatArray, triangles: IntArray, width: int, height: int
) -> Iterator[_Covered]:
    """Yield triangles, the pixels that they cover and how near they are there, in batches."""
    corners = points[triangles]
    depth = planes_through(corners, corners[:, :, 2])
    triangle, row, start, end = _row_spans(corners, width, height)
    counts = end - start
    first = row * width + start
    # Along a row, nearness is affine in the number of the pixel.
    slope = depth.along_x[triangle]
    begin = depth.at(triangle, start + 0.5, row + 0.5) - slope * first
    for low, high in _batches(counts):
        spans = slice(low, high)
        count = counts[spans]
        pixel = np.repeat(first[spans] - offsets_of(count)[:-1], count)
        pixel += np.arange(len(pixel))
        near = np.repeat(slope[spans], count) * pixel
        near += np.repeat(begin[spans], count)
        yield np.repeat(triangle[spans], count), pixel, near


def _joined(parts: list[_Covered]) -> _Covered:
    """Return batches of what is covered as one."""
    if len(parts) == 1:
        return parts[0]
    triangle, pixel, near = (np.concatenate(part) for part in zip(*parts, strict=True))
    return triangle, pixel, near


def _batches(counts: IntArray) -> Iterator[tuple[int, int]]:
    """Yield ranges of rows of triangles that have about ``_BATCH`` pixels each."""
    number = offsets_of(counts)[:-1] // _BATCH
    bounds = [*np.flatnonzero(np.diff(number, prepend=-1)).tolist(), len(counts)]
    yield from pairwise(bounds)


def _row_spans(
    corners: FloatArray, width: int, height: int
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Return triangle, row, first column and end column of every row of every triangle.

    A row's span is half open, and so is a triangle's range of rows; sides are always followed
    from their upper end, so two triangles find the same place on the side that they share.
    """
    # From the top: the upper, the middle and the lower corner of each triangle. Of two that are as
    # high, either may be the first: sides are the same.
    x, y = corners[:, :, 0].T.copy(), corners[:, :, 1].T.copy()
    for pair in ([0, 1], [1, 2], [0, 1]):
        low = y[pair[0]] > y[pair[1]]
        for each in (x, y):
            each[pair] = np.where(low, each[pair[::-1]], each[pair])
    first = np.clip(np.ceil(y[0] - 0.5), 0, height).astype(np.int64)
    last = np.clip(np.ceil(y[2] - 0.5), 0, height).astype(np.int64)
    low, high = np.minimum(np.minimum(x[0], x[1]), x[2]), np.maximum(np.maximum(x[0], x[1]), x[2])
    narrow = np.ceil(high - 0.5) <= np.ceil(low - 0.5)
    counts = np.where(narrow, 0, np.maximum(last - first, 0))
    triangle = np.repeat(np.arange(len(corners)), counts)
    row = np.arange(counts.sum()) + np.repeat(first - offsets_of(counts)[:-1], counts)
    middle = row + 0.5
    # The longest side crosses each row, and so does the one beside it that is as high.
    begin, end = np.array([0, 0, 1]), np.array([2, 1, 2])
    tall = y[end] - y[begin]
    slope = (x[end] - x[begin]) / np.where(tall > 0.0, tall, 1.0)
    beside = np.where(middle < y[1][triangle], len(corners), 2 * len(corners)) + triangle
    start_x, start_y, slope = x[begin].ravel(), y[begin].ravel(), slope.ravel()
    one, two = (
        start_x[side] + (middle - start_y[side]) * slope[side] for side in (triangle, beside)
    )
    start, end = (
        np.clip(np.ceil(place - 0.5), 0, width).astype(np.int64)
        for place in (np.minimum(one, two), np.maximum(one, two))
    )
    kept = end > start
    return triangle[kept], row[kept], start[kept], end[kept]
