"""Find the best free position of a shape on one sheet, by correlation of pixels.

All free positions of a shape are the zeros of one correlation of its pixels with the sheet's,
and its contact with what is there is a second one (the spectral packing of Cui, Rong, Chen and
Matusik, "Dense, interlocking-free and scalable spectral packing of generic 3D objects",
SIGGRAPH 2023, in the plane). Correlations of pixels are whole numbers, so rounding makes them
exact, and the result depends on neither the order of additions nor the number of workers.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.fft

from fabweave.arrays import BoolArray, FloatArray, IntArray
from fabweave.sheet.area import Area
from fabweave.sheet.effort import Effort
from fabweave.sheet.raster import (
    clear_radius,
    filled_pixels,
    inflated_sides,
    region_sides,
    ring_around,
)
from fabweave.sheet.shape import Shape, fitting_angles, rotated

_SLACK_MM = 1e-4  # congruent pieces and floating-point rotations differ by less
_RING_MM = 4.0  # how near to a shape its neighbours count as contact
#: How much more contact a position at the far end of the sheet must have.
PULL = 0.1
_LEAST_TILE = 48  # positions on a side of the smallest tiles
_LARGEST_TILE = 0.3  # tiles larger than this share of the sheet do not pay: it is searched whole

_Spectrum = npt.NDArray[np.complex64]
_Cells = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Kernels:
    """The pixels of one shape at each of R angles.

    ``pixels`` and ``ring`` are (R, h, w); ``corners`` (R, 2) is the least corner of the rotated
    outline, which stands at pixel (pad, pad); ``sizes`` (R, 2) is its width and height.
    """

    angles_deg: FloatArray
    corners: FloatArray
    sizes: FloatArray
    pixels: BoolArray
    ring: BoolArray
    ring_size: IntArray

    @property
    def nbytes(self) -> int:
        """Memory of the pixels, in bytes."""
        return self.pixels.nbytes + self.ring.nbytes


@dataclass(frozen=True)
class Position:
    """A free position: what angle, at what corner of the grid, and how good."""

    score: float
    rotation: int
    row: int
    column: int


@dataclass(frozen=True)
class Grid:
    """The pixels of a sheet: the usable area and a border of `pad` pixels around it.

    ``ring`` is how many pixels around a shape count as its neighbourhood.
    """

    area: Area
    pixel_mm: float
    radius_mm: float
    pad: int
    ring: int

    @property
    def usable_mm(self) -> tuple[float, float]:
        """Width and height of the usable area."""
        return self.area.size_mm

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, padded to sizes with a fast transform."""
        width, height = (int(np.ceil(side / self.pixel_mm)) for side in self.usable_mm)
        return (
            int(scipy.fft.next_fast_len(height + 2 * self.pad + 1, real=False)),
            int(scipy.fft.next_fast_len(width + 2 * self.pad + 1, real=True)),
        )


def grid_of(area: Area, gap_mm: float, pixel_mm: float) -> Grid:
    """Return the grid of a sheet for a gap.

    Examples
    --------
    >>> grid_of(Area((580.0, 380.0)), 3.0, 2.0).shape
    (200, 300)
    """
    radius = clear_radius(gap_mm, pixel_mm) + _SLACK_MM
    ring = max(1, round(_RING_MM / pixel_mm))
    return Grid(area, pixel_mm, radius, int(np.ceil(radius / pixel_mm)) + ring, ring)


def kernels_of(shape: Shape, grid: Grid, rotations: int) -> Kernels:
    """Return the pixels of a shape at every angle at which it fits the grid's usable area."""
    angles = fitting_angles(shape, grid.usable_mm, rotations, grid.area.turns)
    outlines = rotated(shape.outline, angles)
    corners = outlines.min(axis=1)
    sizes = outlines.max(axis=1) - corners
    sides = rotated(inflated_sides(shape.outline, grid.radius_mm).reshape(-1, 2), angles)
    shift = grid.pad * grid.pixel_mm - corners
    moved = (sides + shift[:, None]).reshape(len(angles), -1, 2, 2)
    extent = np.ceil(sizes.max(axis=0) / grid.pixel_mm).astype(int) + 2 * grid.pad
    pixels = filled_pixels(moved, (int(extent[1]), int(extent[0])), grid.pixel_mm)
    ring = ring_around(pixels, grid.ring)
    return Kernels(angles, corners, sizes, pixels, ring, ring.sum(axis=(1, 2)))


@dataclass(frozen=True, eq=False)
class _Waves:
    """Kernels at all angles, transformed for patches of one size."""

    shape: tuple[int, int]
    pixels: _Spectrum
    ring: _Spectrum


@dataclass(frozen=True)
class _Tile:
    """A square of positions, by its least row and column."""

    row: int
    column: int


class _Tiling:
    """The positions of a sheet in square tiles, from left to right, with what failed in each.

    Part of a search's state: pieces that found no room in a tile are remembered there, as are
    tiles that are full.
    """

    def __init__(self, shape: tuple[int, int], side: int) -> None:
        """Cut the positions of a grid of this shape into tiles."""
        self.side = side
        self.tiles = [
            _Tile(row, column)
            for column in range(0, shape[1], side)
            for row in range(0, shape[0], side)
        ]
        self._failed: list[FloatArray] = [np.empty((0, 2)) for _ in self.tiles]

    def open_to(self, size: FloatArray, same_size: float) -> Iterator[int]:
        """Yield the tiles in which nothing as small as this has failed."""
        for number, failed in enumerate(self._failed):
            if not (len(failed) and (size >= same_size * failed).all(axis=1).any()):
                yield number

    def close(self, number: int, size: FloatArray) -> None:
        """Remember that a piece of this size has no room in a tile."""
        self._failed[number] = np.concatenate((self._failed[number], size[None]))


class SheetPixels:
    """The occupied pixels of one sheet.

    The state of a search, not a value: it changes as pieces are put down.
    """

    def __init__(self, grid: Grid, effort: Effort, *, workers: int, pull: float = PULL) -> None:
        """Start with an empty sheet."""
        self.pull = pull
        self.grid = grid
        self.effort = effort
        self.workers = workers
        self._occupied = np.zeros(grid.shape, dtype=np.float32)
        self._touched = np.ones(grid.shape, dtype=np.float32)
        columns, rows = (int(side / grid.pixel_mm) for side in grid.usable_mm)
        self._touched[grid.pad : grid.pad + rows, grid.pad : grid.pad + columns] = 0.0
        self._tilings: dict[int, _Tiling] = {}
        if grid.area.barred is not None:
            sides = region_sides(grid.area.barred, grid.radius_mm) + grid.pad * grid.pixel_mm
            barred = filled_pixels(sides[None], grid.shape, grid.pixel_mm)[0]
            self._occupied[barred] = self._touched[barred] = 1.0

    def put(self, kernels: Kernels, position: Position) -> None:
        """Occupy the pixels of a shape at a position."""
        pixels = kernels.pixels[position.rotation]
        rows = min(pixels.shape[0], self.grid.shape[0] - position.row)
        columns = min(pixels.shape[1], self.grid.shape[1] - position.column)
        here = np.s_[
            position.row : position.row + rows, position.column : position.column + columns
        ]
        self._occupied[here] = np.maximum(self._occupied[here], pixels[:rows, :columns])
        self._touched[here] = np.maximum(self._touched[here], pixels[:rows, :columns])

    def best_position(self, kernels: Kernels, size: FloatArray) -> Position | None:
        """Return a free position with much contact, or None if there is none.

        The sheet is searched tile by tile from the left; the first few tiles that have room are
        compared. Tiles where a piece of nearly this size (length and width) has failed before
        are passed over.
        """
        tiling = self._tiling(kernels)
        steps = np.floor(
            (np.array(self.grid.usable_mm) - kernels.sizes) / self.grid.pixel_mm + 1e-6
        )
        last = np.maximum(steps.astype(np.int64), 0)
        least = int(kernels.pixels.sum(axis=(1, 2)).min())
        waves: _Waves | None = None
        found: list[Position] = []
        for number in tiling.open_to(size, self.effort.same_size):
            tile = tiling.tiles[number]
            if tile.row > last[:, 1].max() or tile.column > last[:, 0].max():
                continue
            # No position lets a kernel leave the grid, so larger patches are never needed.
            shape = (
                min(tiling.side + kernels.pixels.shape[1] - 1, self.grid.shape[0]),
                min(tiling.side + kernels.pixels.shape[2] - 1, self.grid.shape[1]),
            )
            patch = np.s_[tile.row : tile.row + shape[0], tile.column : tile.column + shape[1]]
            occupied = self._occupied[patch]
            position = None
            if occupied.size - int(occupied.sum()) >= least:
                waves = waves or self._waves(kernels, shape)
                position = self._best_in(kernels, waves, tile, tiling.side, last)
            if position is None:
                tiling.close(number, size)
                continue
            found.append(position)
            if len(found) >= self.effort.tiles:
                break
        return max(found, key=lambda one: one.score) if found else None

    def _tiling(self, kernels: Kernels) -> _Tiling:
        """Return the tiles for kernels of this extent: as large, or one tile for large kernels."""
        side, whole = _LEAST_TILE, max(self.grid.shape)
        while side < max(kernels.pixels.shape[1:]):
            side *= 2
        side = side if side <= _LARGEST_TILE * whole else whole
        if side not in self._tilings:
            self._tilings[side] = _Tiling(self.grid.shape, side)
        return self._tilings[side]

    def _waves(self, kernels: Kernels, shape: tuple[int, int]) -> _Waves:
        """Transform kernels for correlation with patches of at least this shape."""
        fast = (
            int(scipy.fft.next_fast_len(shape[0], real=False)),
            int(scipy.fft.next_fast_len(shape[1], real=True)),
        )
        return _Waves(
            fast, self._transform(kernels.pixels, fast), self._transform(kernels.ring, fast)
        )

    def _transform(self, pixels: BoolArray, shape: tuple[int, int]) -> _Spectrum:
        """Return conjugate spectra of kernels; rows of zeros are not transformed."""
        wave = scipy.fft.rfft(pixels.astype(np.float32), n=shape[1], axis=2, workers=self.workers)
        wave = scipy.fft.fft(wave, n=shape[0], axis=1, overwrite_x=True, workers=self.workers)
        return np.conj(wave, out=wave)

    def _best_in(
        self, kernels: Kernels, waves: _Waves, tile: _Tile, side: int, last: IntArray
    ) -> Position | None:
        """Return the free position with the most contact among those of a tile."""
        rows = tile.row + np.arange(min(side, int(last[:, 1].max()) - tile.row + 1))
        columns = tile.column + np.arange(min(side, int(last[:, 0].max()) - tile.column + 1))
        extent = (len(rows), len(columns))
        free = self._correlation(self._occupied, waves.pixels, tile, waves.shape, extent) < 0.5
        free &= rows[None, :, None] <= last[:, 1][:, None, None]
        free &= columns[None, None, :] <= last[:, 0][:, None, None]
        able = np.flatnonzero(free.any(axis=(1, 2)))
        if len(able) == 0:
            return None
        score = self._correlation(self._touched, waves.ring[able], tile, waves.shape, extent)
        np.rint(score, out=score)
        score /= kernels.ring_size[able].astype(np.float32)[:, None, None]
        # How far to the right its far side comes, as a share of the sheet; less so upwards.
        right = columns * self.grid.pixel_mm + kernels.sizes[able, 0][:, None]
        up = rows * self.grid.pixel_mm
        score -= (self.pull * right / self.grid.usable_mm[0]).astype(np.float32)[:, None, :]
        score -= (0.1 * self.pull * up / self.grid.usable_mm[1]).astype(np.float32)[None, :, None]
        score = np.where(free[able], score, np.float32(-np.inf))
        where = int(np.argmax(score))
        rotation, row, column = np.unravel_index(where, score.shape)
        return Position(
            float(score.flat[where]), int(able[rotation]), int(rows[row]), int(columns[column])
        )

    def _correlation(
        self,
        cells: _Cells,
        waves: _Spectrum,
        tile: _Tile,
        shape: tuple[int, int],
        extent: tuple[int, int],
    ) -> _Cells:
        """Correlate the patch at a tile with kernels, for the positions of the tile."""
        patch = cells[tile.row : tile.row + shape[0], tile.column : tile.column + shape[1]]
        wave = scipy.fft.rfft2(patch, s=shape, workers=self.workers) * waves
        wave = scipy.fft.ifft(wave, axis=1, overwrite_x=True, workers=self.workers)[:, : extent[0]]
        result = scipy.fft.irfft(wave, n=shape[1], axis=2, overwrite_x=True, workers=self.workers)
        return np.asarray(result[:, :, : extent[1]], dtype=np.float32)
