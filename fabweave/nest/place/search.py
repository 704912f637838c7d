"""Find the best free position of a shape on one sheet, by correlation of pixels.

All free positions of a shape are the zeros of one correlation of its pixels with the sheet's,
and its contact with what is there is a second one (the spectral packing of Cui, Rong, Chen and
Matusik, "Dense, interlocking-free and scalable spectral packing of generic 3D objects",
SIGGRAPH 2023, in the plane). Correlations of pixels are whole numbers, so rounding makes them
exact, and the result depends on neither the order of additions nor the number of workers.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import scipy.fft
import shapely
from scipy.ndimage import distance_transform_edt

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.parallel.executors import in_threads
from fabweave.nest.container import Container
from fabweave.nest.item_shape import ItemShape, Spot, fitting_angles, rotated
from fabweave.nest.layout import Effort
from fabweave.nest.place.raster import filled_pixels, region_sides
from fabweave.nest.place.slide import PlacedOutlines, slide

#: Congruent pieces and floating-point rotations differ by less, millimetres.
_SLACK_MM = 1e-4
#: How much more contact a position at the right end of the sheet must have, as a share of a shape's
#: rim; and how much of that counts towards its upper end.
PULL, _UPWARD = 0.1, 0.1
#: Of a tile's best positions, how many are tried.
_SLIDES = 4
#: Numbers that are transformed together, about: what a processor's cache holds.
_CACHED = 250_000
#: Positions on a side of the smallest tiles.
_LEAST_TILE = 48
#: Tiles larger than this share of the sheet do not pay: it is searched whole.
_LARGEST_TILE = 0.3

_Spectrum = npt.NDArray[np.complex64]
_Cells = npt.NDArray[np.float32]


@frozen_value
class Kernels:
    """The pixels of one shape at each of R angles.

    ``pixels`` are (R, h, w); ``corners`` (R, 2) is the least corner of the rotated outline, which
    is at pixel (pad, pad); ``sizes`` (R, 2) is its width and height; ``sides`` (E, 2, 2) are
    those of the outline as pixels see it, inflated.
    """

    outline: FloatArray
    sides: FloatArray
    angles_deg: FloatArray
    corners: FloatArray
    sizes: FloatArray
    pixels: BoolArray
    rim: float

    @property
    def nbytes(self) -> int:
        """Memory of the pixels, in bytes."""
        return self.pixels.nbytes


@dataclass(frozen=True)
class Grid:
    """The pixels of a sheet: the usable area and a border of `pad` pixels around it.

    A shape owns the pixels whose centres are in it, inflated by ``radius_mm``, and what is barred
    is inflated by ``barred_mm``: shapes that share no pixel do not meet, and keep the gap from
    what is barred. ``near`` is how far, in pixels, the neighbourhood of a shape or of the border
    reaches: a position is the better, the more of its pixels are in one.
    """

    container: Container
    gap_mm: float
    pixel_mm: float
    radius_mm: float
    barred_mm: float
    pad: int
    near: int

    @property
    def usable_mm(self) -> tuple[float, float]:
        """Width and height of the usable area."""
        return self.container.size_mm

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, padded to sizes with a fast transform."""
        width, height = (int(np.ceil(side / self.pixel_mm)) for side in self.usable_mm)
        return (
            int(scipy.fft.next_fast_len(height + 2 * self.pad + 1, real=False)),
            int(scipy.fft.next_fast_len(width + 2 * self.pad + 1, real=True)),
        )


def grid_of(container: Container, gap_mm: float, pixel_mm: float, near_mm: float) -> Grid:
    """Return the grid of a sheet for a gap; what is nearer than ``near_mm`` counts as contact.

    Examples
    --------
    >>> grid_of(Container((580.0, 380.0)), 3.0, 2.0, 20.0).shape
    (196, 300)
    """
    # Half the gap, so that no position is lost that has it; more, where shapes would meet else.
    radius = max(gap_mm / 2.0, pixel_mm / math.sqrt(2.0)) + _SLACK_MM
    # Of a point, one in a shape and one in what is barred, less than the gap apart, a pixel's
    # centre is within half a diagonal of the first or of one between them.
    barred = gap_mm + math.sqrt(2.0) * pixel_mm - radius + 2.0 * _SLACK_MM
    pad = int(np.ceil(radius / pixel_mm)) + 1
    near = max(1, round(near_mm / pixel_mm))
    return Grid(container, gap_mm, pixel_mm, radius, barred, pad, near)


def kernels_of(shape: ItemShape, grid: Grid, count: int) -> Kernels:
    """Return the pixels of a shape at every angle at which it fits the grid's usable area."""
    angles = fitting_angles(shape, grid.usable_mm, count, grid.container.rotations)
    outlines = rotated(shape.outline, angles)
    corners = outlines.min(axis=1)
    sizes = outlines.max(axis=1) - corners
    sides = region_sides(shapely.polygons(shape.outline), grid.radius_mm)
    shift = grid.pad * grid.pixel_mm - corners
    moved = rotated(sides.reshape(-1, 2), angles) + shift[:, None]
    moved = moved.reshape(len(angles), -1, 2, 2)
    extent = np.ceil(sizes.max(axis=0) / grid.pixel_mm).astype(int) + 2 * grid.pad
    pixels = filled_pixels(moved, (int(extent[1]), int(extent[0])), grid.pixel_mm)
    length = float(np.hypot(*(sides[:, 1] - sides[:, 0]).T).sum())
    rim = length * grid.near / grid.pixel_mm
    return Kernels(shape.outline, sides, angles, corners, sizes, pixels, rim)


@dataclass(frozen=True)
class _Tile:
    """A square of positions, by its least row and column."""

    row: int
    column: int


@frozen_value
class _Spectra:
    """Kernels at all angles, transformed for patches of one size.

    ``able`` are the angles that had room in each tile when it was last searched: nothing is ever
    taken away, so there is no room at the others.
    """

    kernels: Kernels
    shape: tuple[int, int]
    pixels: _Spectrum
    able: dict[_Tile, IntArray] = field(default_factory=dict)


class _Tiling:
    """The positions of a sheet in square tiles, from left to right, with what failed in each.

    Part of a search's state: it remembers the sizes for which there is no room in a tile.
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
        """Remember that there is no room for a piece of this size in a tile."""
        self._failed[number] = np.concatenate((self._failed[number], size[None]))


class SheetPixels:
    """The occupied pixels of one sheet, and the outlines that are placed there.

    The state of a search, not a value: it changes as pieces are put down.
    """

    def __init__(self, grid: Grid, effort: Effort, *, workers: int, pull: float = PULL) -> None:
        """Start with an empty sheet."""
        self.pull = pull
        self.grid = grid
        self.effort = effort
        self.workers = workers
        self._occupied = np.zeros(grid.shape, dtype=np.float32)
        columns, rows = (int(side / grid.pixel_mm) for side in grid.usable_mm)
        self._touched = np.ones(grid.shape, dtype=np.float32)
        inner = np.s_[grid.near : rows - grid.near, grid.near : columns - grid.near]
        self._touched[grid.pad : grid.pad + rows, grid.pad : grid.pad + columns][inner] = 0.0
        self._tilings: dict[int, _Tiling] = {}
        self._last: _Spectra | None = None
        self._placed = PlacedOutlines(grid.container, grid.gap_mm)
        if grid.container.barred is not None:
            self._occupy(region_sides(grid.container.barred, grid.barred_mm))

    def put(self, kernels: Kernels, spot: Spot) -> None:
        """Put a shape down."""
        self._placed.add(spot.apply(kernels.outline))
        self._occupy(spot.apply(kernels.sides))

    def _occupy(self, sides: FloatArray) -> None:
        """Occupy the pixels inside closed sides (E, 2, 2)."""
        size = self.grid.pixel_mm
        sides = sides + self.grid.pad * size
        low = (np.floor(sides.min(axis=(0, 1)) / size).astype(int) - self.grid.near).clip(0)
        high = np.ceil(sides.max(axis=(0, 1)) / size).astype(int) + self.grid.near
        high = high.clip(0, self.grid.shape[::-1])
        columns, rows = (high - low).tolist()
        if rows <= 0 or columns <= 0:
            return
        inside = filled_pixels((sides - low * size)[None], (rows, columns), size)[0]
        if not inside.any():
            return
        here = np.s_[low[1] : high[1], low[0] : high[0]]
        self._occupied[here][inside] = 1.0
        self._touched[here][distance_transform_edt(~inside) <= self.grid.near] = 1.0

    def place(self, kernels: Kernels, size: FloatArray) -> Spot | None:
        """Return a spot with much contact, where a shape keeps the gap; None if there is none.

        The sheet is searched tile by tile from the left, up to the first that has room. Tiles where
        a piece of nearly this size (length and width) has failed before are passed over. Positions
        of pixels are slid to where they are exact.
        """
        tiling = self._tiling(kernels)
        steps = np.floor(
            (np.array(self.grid.usable_mm) - kernels.sizes) / self.grid.pixel_mm + 1e-6
        )
        last = np.maximum(steps.astype(np.int64), 0)
        least = int(kernels.pixels.sum(axis=(1, 2)).min())
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
            if occupied.size - int(occupied.sum()) >= least:
                spectra = self._spectra(kernels, shape)
                for free in self._free_spots(kernels, spectra, tile, tiling.side, last)[:_SLIDES]:
                    spot = slide(free, kernels.outline, self._placed)
                    if spot is not None:
                        return spot
            tiling.close(number, size)
        return None

    def _tiling(self, kernels: Kernels) -> _Tiling:
        """Return the tiles for kernels of this extent: as large, or one tile for large kernels."""
        side, longest = _LEAST_TILE, max(self.grid.shape)
        while side < max(kernels.pixels.shape[1:]):
            side *= 2
        side = side if side <= _LARGEST_TILE * longest else longest
        if side not in self._tilings:
            self._tilings[side] = _Tiling(self.grid.shape, side)
        return self._tilings[side]

    def _spectra(self, kernels: Kernels, shape: tuple[int, int]) -> _Spectra:
        """Transform kernels for correlation with patches of their shape.

        Pieces of a shape come one after another, and patches of a shape are of one size: what was
        transformed last is kept.
        """
        if self._last is None or self._last.kernels is not kernels:
            fast = (
                int(scipy.fft.next_fast_len(shape[0], real=False)),
                int(scipy.fft.next_fast_len(shape[1], real=True)),
            )
            self._last = _Spectra(kernels, fast, self._transform(kernels.pixels, fast))
        return self._last

    def _transform(self, pixels: BoolArray, shape: tuple[int, int]) -> _Spectrum:
        """Return conjugate spectra of kernels; rows of zeros are not transformed."""
        result = np.empty((len(pixels), shape[0], shape[1] // 2 + 1), dtype=np.complex64)

        def transform(some: slice) -> None:
            half = scipy.fft.rfft(pixels[some].astype(np.float32), n=shape[1], axis=2)
            whole = scipy.fft.fft(half, n=shape[0], axis=1, overwrite_x=True)
            np.conj(whole, out=result[some])

        in_threads(transform, _cached_slices(len(pixels), shape[0] * shape[1]), self.workers)
        return result

    def _free_spots(
        self, kernels: Kernels, spectra: _Spectra, tile: _Tile, side: int, last: IntArray
    ) -> list[Spot]:
        """Return a tile's free spot with the most contact at each angle, the best first."""
        pixel_mm, usable_mm = self.grid.pixel_mm, self.grid.usable_mm
        rows = tile.row + np.arange(min(side, int(last[:, 1].max()) - tile.row + 1))
        columns = tile.column + np.arange(min(side, int(last[:, 0].max()) - tile.column + 1))
        extent = (len(rows), len(columns))
        angles = spectra.able.get(tile, np.arange(len(spectra.pixels)))
        if len(angles) == 0:
            return []
        occupied, touched = (
            self._patch_spectrum(cells, tile, spectra.shape)
            for cells in (self._occupied, self._touched)
        )
        # How far up its side comes, as a share of the sheet, counts less than how far to the right.
        up = (_UPWARD * self.pull * rows * pixel_mm / usable_mm[1]).astype(np.float32)

        def best_of(some: slice) -> tuple[IntArray, IntArray, _Cells]:
            """Return the angles of these with room, the best position at each, and its score."""
            these = angles[some]
            pixels = spectra.pixels[these]
            free = _correlation(occupied, pixels, spectra.shape, extent) < 0.5
            free &= rows[None, :, None] <= last[these, 1][:, None, None]
            free &= columns[None, None, :] <= last[these, 0][:, None, None]
            room = free.any(axis=(1, 2))
            able, free = these[room], free[room]
            if len(able) == 0:
                return able, able, np.empty(0, dtype=np.float32)
            score = _correlation(touched, pixels[room], spectra.shape, extent)
            np.rint(score, out=score)
            score /= np.float32(kernels.rim)
            right = columns * pixel_mm + kernels.sizes[able, 0][:, None]
            score -= (self.pull * right / usable_mm[0]).astype(np.float32)[:, None, :]
            score -= up[None, :, None]
            score[~free] = -np.inf
            flat = score.reshape(len(able), -1)
            where = np.argmax(flat, axis=1)
            return able, where, flat[np.arange(len(able)), where]

        each = spectra.shape[0] * spectra.shape[1]
        parts = in_threads(best_of, _cached_slices(len(angles), each), self.workers)
        able, where, score = (np.concatenate(part) for part in zip(*parts, strict=True))
        spectra.able[tile] = able
        row, column = np.unravel_index(where, extent)
        steps = np.stack([columns[column], rows[row]], axis=1) * pixel_mm
        spots = np.column_stack([kernels.angles_deg[able], steps - kernels.corners[able]])
        return [Spot(*spot) for spot in spots[np.argsort(-score, kind="stable")].tolist()]

    def _patch_spectrum(self, cells: _Cells, tile: _Tile, shape: tuple[int, int]) -> _Spectrum:
        """Transform the patch of the sheet at a tile."""
        patch = cells[tile.row : tile.row + shape[0], tile.column : tile.column + shape[1]]
        spectrum: _Spectrum = scipy.fft.rfft2(patch, s=shape)
        return spectrum


def _correlation(
    patch: _Spectrum, spectra: _Spectrum, shape: tuple[int, int], extent: tuple[int, int]
) -> _Cells:
    """Correlate a patch with kernels, for the positions of its tile."""
    rows = scipy.fft.ifft(patch * spectra, axis=1, overwrite_x=True)[:, : extent[0]]
    whole = scipy.fft.irfft(rows, n=shape[1], axis=2)[:, :, : extent[1]]
    return whole.astype(np.float32, copy=False)


def _cached_slices(count: int, each: int) -> list[slice]:
    """Return slices of a few transforms of so many numbers: they stay in a processor's cache."""
    step = max(2, _CACHED // each)
    return [slice(begin, begin + step) for begin in range(0, count, step)]
