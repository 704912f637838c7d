"""Find where a piece overlaps least with what stands on a sheet, by correlation of coarse pixels.

A position need not be free: what overlaps a little is pushed apart afterwards. So pixels may be
coarse, and every sheet can be searched at every angle.
"""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.fft

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.nest.area import Area
from fabweave.nest.item_shape import rotated
from fabweave.nest.place.raster import filled_pixels
from fabweave.nest.separate.item_field import Body
from fabweave.nest.separate.obstacle import Barrier
from fabweave.nest.separate.overlap import Crowd, Stand, distances

_PIXEL_MM = 4.0
_ROTATIONS = 36
_MOST_PIXELS = 60_000
_DEEP_MM = 8.0  # what lies deeper in a piece costs no more
_LOOSE = 0.75  # of a pixel: by how much a position may stand beyond the border
_CACHE_BYTES = 100_000_000

_Cells = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Found:
    """A position of a piece: what it costs, its centroid in millimetres, its angle in radians."""

    cost: float
    x_mm: float
    y_mm: float
    angle: float


@dataclass(frozen=True)
class Pixels:
    """The coarse pixels of a sheet's usable area."""

    area: Area
    pixel_mm: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        width, height = self.area.size_mm
        return int(np.ceil(height / self.pixel_mm)), int(np.ceil(width / self.pixel_mm))


def pixels_of(area: Area) -> Pixels:
    """Return the coarse pixels of a usable area: larger ones where it is very large."""
    wide, high = area.size_mm
    return Pixels(area, max(_PIXEL_MM, float(np.sqrt(wide * high / _MOST_PIXELS))))


@frozen_value
class _Kernel:
    """A body at R angles: how much of each pixel it covers, and where its centroid may stand."""

    angles: FloatArray  # (R,) radians
    cover: _Cells  # (R, 2 m + 1, 2 m + 1), the centroid in the middle of the middle pixel
    least: FloatArray  # (R, 2)
    most: FloatArray  # (R, 2)

    @property
    def nbytes(self) -> int:
        return self.cover.nbytes


class Finder:
    """Finds positions; keeps the pixels of bodies for the next time."""

    def __init__(self) -> None:
        """Start with nothing kept."""
        self._kept: OrderedDict[tuple[int, Pixels], _Kernel] = OrderedDict()
        self._bytes = 0

    def find(
        self, key: int, body: Body, pixels: Pixels, costs: Sequence[_Cells]
    ) -> list[Found | None]:
        """Return the position of least cost in each cost field, None where a body cannot stand.

        Parameters
        ----------
        key : int
            Under which the body's pixels are kept.
        body : Body
            What is placed.
        pixels : Pixels
            Of the sheets.
        costs : sequence of (rows, columns) float arrays
            What it costs to cover each pixel.
        """
        kernel = self._kernel(key, body, pixels)
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
        waves = np.conj(scipy.fft.rfft2(kernel.cover, s=shape))
        x, y = (np.arange(columns) + 0.5) * size, (np.arange(rows) + 0.5) * size
        loose = _LOOSE * size
        least, most = kernel.least, kernel.most
        bad_x = (x < least[:, :1] - loose) | (x > most[:, :1] + loose)
        bad_y = (y < least[:, 1:] - loose) | (y > most[:, 1:] + loose)
        barred = bad_x[:, None, :] | bad_y[:, :, None]
        found: list[Found | None] = []
        for cost in costs:
            total = scipy.fft.irfft2(scipy.fft.rfft2(cost, s=shape) * waves, s=shape)
            # The middle of a kernel is `half` pixels from its corner, and wraps round.
            total = total[:, (np.arange(rows) - half) % shape[0]]
            total = total[:, :, (np.arange(columns) - half) % shape[1]]
            total[barred] = np.inf
            best = int(np.argmin(total))
            if not np.isfinite(total.flat[best]):
                found.append(None)
                continue
            turn, row, column = np.unravel_index(best, total.shape)
            at = np.array([x[column], y[row]])
            at = np.minimum(np.maximum(at, least[turn]), most[turn])
            price = float(total.flat[best]) * size * size
            found.append(Found(price, float(at[0]), float(at[1]), float(kernel.angles[turn])))
        return found

    def _kernel(self, key: int, body: Body, pixels: Pixels) -> _Kernel:
        """Return the pixels of a body, from the cache if they are there."""
        if (key, pixels) in self._kept:
            self._kept.move_to_end((key, pixels))
            return self._kept[key, pixels]
        kernel = _kernel_of(body, pixels)
        self._kept[key, pixels] = kernel
        self._bytes += kernel.nbytes
        while self._bytes > _CACHE_BYTES and len(self._kept) > 1:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return kernel


def _kernel_of(body: Body, pixels: Pixels) -> _Kernel:
    """Return the pixels of a body at evenly spread angles, as far as it fits at them."""
    size = pixels.pixel_mm
    angles = pixels.area.turns.angles_deg(_ROTATIONS)
    outlines = rotated(body.outline, angles)
    low, high = outlines.min(axis=1), outlines.max(axis=1)
    usable = np.array(pixels.area.size_mm)
    fits = (high - low <= usable + 1e-7).all(axis=1)
    angles, outlines, low, high = angles[fits], outlines[fits], low[fits], high[fits]
    half = int(np.ceil(np.sqrt((body.outline**2).sum(axis=1).max()) / size)) + 1
    wide = 2 * half + 1
    moved = outlines + (half + 0.5) * size
    sides = np.stack([moved, np.roll(moved, -1, axis=1)], axis=2)
    fine = filled_pixels(sides, (2 * wide, 2 * wide), size / 2.0)
    cover = fine.reshape(-1, wide, 2, wide, 2).mean(axis=(2, 4), dtype=np.float32)
    return _Kernel(np.deg2rad(angles), cover, -low, np.maximum(usable - high, -low))


@frozen_value
class Terrain:
    """How far each pixel of a sheet is from the nearest body and the second nearest."""

    nearest: FloatArray  # (rows, columns)
    second: FloatArray
    which: npt.NDArray[np.int64]  # the number of the nearest body, or -1
    gap_mm: float

    def cost(self, without: int | None = None) -> _Cells:
        """Return what it costs to cover each pixel, maybe without one of the bodies."""
        distance = self.nearest
        if without is not None:
            distance = np.where(self.which == without, self.second, distance)
        return np.clip(self.gap_mm - distance, 0.0, _DEEP_MM).astype(np.float32)


def terrain_of(
    crowd: Crowd | None,
    stand: Stand | None,
    pixels: Pixels,
    gap_mm: float,
    barrier: Barrier | None = None,
) -> Terrain:
    """Return the terrain of a sheet; ``None`` stands for one without bodies, or without barrier."""
    rows, columns = pixels.shape
    nearest = np.full((rows, columns), 1e9)
    if barrier is not None:
        grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
        nearest = barrier.distances((grid + 0.5).astype(np.float64) * pixels.pixel_mm)[0]
        nearest = nearest.reshape(rows, columns)
    second = nearest.copy()
    which = np.full((rows, columns), -1, dtype=np.int64)
    if crowd is None or stand is None:
        return Terrain(nearest, second, which, gap_mm)
    size = pixels.pixel_mm
    low = np.minimum.reduceat(stand.world, crowd.starts[:-1]) - gap_mm
    high = np.maximum.reduceat(stand.world, crowd.starts[:-1]) + gap_mm
    least = np.maximum(np.floor(low / size).astype(int), 0)
    most = np.ceil(high / size).astype(int)
    for body in range(len(low)):
        window = np.s_[least[body, 1] : most[body, 1], least[body, 0] : most[body, 0]]
        height, width = nearest[window].shape
        if height == 0 or width == 0:
            continue
        grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
        points = (grid + least[body] + 0.5) * size
        found, _ = distances(crowd, stand, points, np.full(len(points), body))
        distance = found.reshape(height, width)
        first = distance < nearest[window]
        second[window] = np.minimum(second[window], np.where(first, nearest[window], distance))
        nearest[window] = np.where(first, distance, nearest[window])
        which[window] = np.where(first, body, which[window])
    return Terrain(nearest, second, which, gap_mm)
