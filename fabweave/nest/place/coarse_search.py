"""Find where a piece overlaps least with those on a sheet, by correlation of coarse pixels.

A position need not be free: what overlaps a little is pushed apart afterwards. So pixels may be
coarse, and every sheet can be searched at every angle.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.fft

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.nest.container import Container
from fabweave.nest.item_shape import rotated
from fabweave.nest.place.raster import Cache, filled_pixels
from fabweave.nest.separate.overlap import ItemField, ObstacleField, PlacedItems, distances

#: Side of a pixel, millimetres; more where a sheet has more than so many.
_PIXEL_MM, _MOST_PIXELS = 4.0, 60_000
#: Angles that are tried.
_ANGLES = 36
#: What lies deeper in a piece, millimetres, costs no more.
_DEEP_MM = 8.0
#: By how many pixels a position may be beyond the border.
_LOOSE = 0.75
#: What floating-point rotation may add to a length, millimetres.
_FIT_MM = 1e-7
#: Farther than anything on a sheet, millimetres.
_FAR_MM = 1e9
#: Memory of kernels that are kept for the next search; it does not change the result.
_CACHE_BYTES = 100_000_000

_Cells = npt.NDArray[np.float32]


@dataclass(frozen=True)
class CoarsePosition:
    """A position of a piece: what it costs, its centroid in millimetres, its angle in radians.

    It costs its overlap: the area times the depth, mm³.
    """

    cost: float
    x_mm: float
    y_mm: float
    angle: float


@dataclass(frozen=True)
class CoarsePixels:
    """The coarse pixels of a sheet's usable area."""

    container: Container
    pixel_mm: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        width, height = self.container.size_mm
        return int(np.ceil(height / self.pixel_mm)), int(np.ceil(width / self.pixel_mm))


def coarse_pixels(container: Container) -> CoarsePixels:
    """Return the coarse pixels of a usable area: larger ones where it is very large."""
    wide, high = container.size_mm
    return CoarsePixels(container, max(_PIXEL_MM, float(np.sqrt(wide * high / _MOST_PIXELS))))


@frozen_value
class _Kernel:
    """An item at R angles: how much of each pixel it covers, and where its centroid may be."""

    angles: FloatArray  # (R,) radians
    cover: _Cells  # (R, 2 m + 1, 2 m + 1), the centroid in the middle of the middle pixel
    least: FloatArray  # (R, 2)
    most: FloatArray  # (R, 2)

    @property
    def nbytes(self) -> int:
        return self.cover.nbytes


class CoarseSearch:
    """The search for positions; it keeps the pixels of items for the next time."""

    def __init__(self) -> None:
        """Start with an empty cache."""
        self._kernels: Cache[tuple[int, CoarsePixels], _Kernel] = Cache(_CACHE_BYTES)

    def positions(
        self, key: int, item: ItemField, pixels: CoarsePixels, costs: Sequence[_Cells]
    ) -> list[CoarsePosition | None]:
        """Return the position of least cost in each cost field, None where the item has none.

        Parameters
        ----------
        key : int
            Under which the item's pixels are kept.
        item : ItemField
            What is placed.
        pixels : CoarsePixels
            Of the sheets.
        costs : sequence of (rows, columns) float arrays
            What it costs to cover each pixel.
        """
        kernel = self._kernels.get((key, pixels), lambda: _kernel_of(item, pixels))
        if len(kernel.angles) == 0:
            return [None] * len(costs)
        size = pixels.pixel_mm
        rows, columns = pixels.shape
        half = kernel.cover.shape[1] // 2
        # Wrapping round is harmless beyond half a kernel: there is nothing to cover.
        shape = (
            int(scipy.fft.next_fast_len(rows + half, real=False)),
            int(scipy.fft.next_fast_len(columns + half, real=True)),
        )
        spectrum = np.conj(scipy.fft.rfft2(kernel.cover, s=shape))
        x, y = (np.arange(columns) + 0.5) * size, (np.arange(rows) + 0.5) * size
        loose = _LOOSE * size
        least, most = kernel.least, kernel.most
        beyond_x = (x < least[:, :1] - loose) | (x > most[:, :1] + loose)
        beyond_y = (y < least[:, 1:] - loose) | (y > most[:, 1:] + loose)
        beyond = beyond_x[:, None, :] | beyond_y[:, :, None]
        positions: list[CoarsePosition | None] = []
        for cost in costs:
            total = scipy.fft.irfft2(scipy.fft.rfft2(cost, s=shape) * spectrum, s=shape)
            # The middle of a kernel is `half` pixels from its corner, and wraps round.
            total = total[:, (np.arange(rows) - half) % shape[0]]
            total = total[:, :, (np.arange(columns) - half) % shape[1]]
            total[beyond] = np.inf
            best = int(np.argmin(total))
            if not np.isfinite(total.flat[best]):
                positions.append(None)
                continue
            angle, row, column = np.unravel_index(best, total.shape)
            at = np.array([x[column], y[row]])
            at = np.minimum(np.maximum(at, least[angle]), most[angle])
            mm3 = float(total.flat[best]) * size * size
            radians = float(kernel.angles[angle])
            positions.append(CoarsePosition(mm3, float(at[0]), float(at[1]), radians))
        return positions


def _kernel_of(item: ItemField, pixels: CoarsePixels) -> _Kernel:
    """Return the pixels of an item at evenly spread angles, as far as it fits at them."""
    size = pixels.pixel_mm
    angles = pixels.container.rotations.angles_deg(_ANGLES)
    outlines = rotated(item.outline, angles)
    low, high = outlines.min(axis=1), outlines.max(axis=1)
    usable = np.array(pixels.container.size_mm)
    fits = (high - low <= usable + _FIT_MM).all(axis=1)
    angles, outlines, low, high = angles[fits], outlines[fits], low[fits], high[fits]
    half = int(np.ceil(np.sqrt((item.outline**2).sum(axis=1).max()) / size)) + 1
    wide = 2 * half + 1
    moved = outlines + (half + 0.5) * size
    sides = np.stack([moved, np.roll(moved, -1, axis=1)], axis=2)
    fine = filled_pixels(sides, (2 * wide, 2 * wide), size / 2.0)
    cover = fine.reshape(-1, wide, 2, wide, 2).mean(axis=(2, 4), dtype=np.float32)
    return _Kernel(np.deg2rad(angles), cover, -low, np.maximum(usable - high, -low))


@frozen_value
class PixelDistances:
    """How far each pixel of a sheet is from the nearest item and the second nearest."""

    nearest: FloatArray  # (rows, columns)
    second: FloatArray
    item: IntArray  # the number of the nearest item, or -1
    gap_mm: float

    def cost(self, without: int | None = None) -> _Cells:
        """Return what it costs to cover each pixel, maybe without one of the items."""
        distance = self.nearest
        if without is not None:
            distance = np.where(self.item == without, self.second, distance)
        return np.clip(self.gap_mm - distance, 0.0, _DEEP_MM).astype(np.float32)


def pixel_distances(
    pixels: CoarsePixels,
    gap_mm: float,
    placed: PlacedItems | None,
    obstacle: ObstacleField | None = None,
) -> PixelDistances:
    """Return the distances of a sheet's pixels; None stands for no items, or no obstacle."""
    rows, columns = pixels.shape
    size = pixels.pixel_mm
    nearest = np.full((rows, columns), _FAR_MM)
    if obstacle is not None:
        centres = _cells(columns, rows).astype(np.float64) + 0.5
        nearest = obstacle.distances(centres * size)[0].reshape(rows, columns)
    second = nearest.copy()
    items = np.full((rows, columns), -1, dtype=np.int64)
    if placed is None:
        return PixelDistances(nearest, second, items, gap_mm)
    least = np.maximum(np.floor((placed.low - gap_mm) / size).astype(int), 0)
    most = np.ceil((placed.high + gap_mm) / size).astype(int)
    for item in range(len(least)):
        window = np.s_[least[item, 1] : most[item, 1], least[item, 0] : most[item, 0]]
        height, width = nearest[window].shape
        if height == 0 or width == 0:
            continue
        points = (_cells(width, height) + least[item] + 0.5) * size
        distance, _ = distances(placed, points, np.full(len(points), item))
        distance = distance.reshape(height, width)
        nearer = distance < nearest[window]
        second[window] = np.minimum(second[window], np.where(nearer, nearest[window], distance))
        nearest[window] = np.where(nearer, distance, nearest[window])
        items[window] = np.where(nearer, item, items[window])
    return PixelDistances(nearest, second, items, gap_mm)


def _cells(columns: int, rows: int) -> IntArray:
    """Return column and row of each cell, row by row, (rows * columns, 2)."""
    return np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
