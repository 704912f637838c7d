"""Find the best free position of a shape on one sheet, by correlation of pixels.

All free positions of a shape are the zeros of one correlation of its pixels with the sheet's,
and its contact with what is there is a second one (the spectral packing of Cui, Rong, Chen and
Matusik, "Dense, interlocking-free and scalable spectral packing of generic 3D objects",
SIGGRAPH 2023, in the plane). Correlations of pixels are whole numbers, so rounding makes them
exact, and the result depends on neither the order of additions nor the number of workers.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.fft

from fabweave.arrays import BoolArray, FloatArray, IntArray
from fabweave.sheet.raster import clear_radius, filled_pixels, inflated_sides, ring_around
from fabweave.sheet.shape import Shape, fitting_angles, rotated

_SLACK_MM = 1e-4  # congruent pieces and floating-point rotations differ by less
_RING_MM = 4.0  # how near to a shape its neighbours count as contact
_PULL = 0.1  # contact that a position at the far end of the sheet must have more
_MAX_CELLS = 12_000_000  # pixels in one batch of correlations: bounds the memory, not the result

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

    usable_mm: tuple[float, float]
    pixel_mm: float
    radius_mm: float
    pad: int
    ring: int

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, padded to sizes with a fast transform."""
        width, height = (int(np.ceil(side / self.pixel_mm)) for side in self.usable_mm)
        return (
            int(scipy.fft.next_fast_len(height + 2 * self.pad + 1, real=False)),
            int(scipy.fft.next_fast_len(width + 2 * self.pad + 1, real=True)),
        )


def grid_of(usable_mm: tuple[float, float], gap_mm: float, pixel_mm: float) -> Grid:
    """Return the grid of a sheet for a gap.

    Examples
    --------
    >>> grid_of((580.0, 380.0), 3.0, 2.0).shape
    (200, 300)
    """
    radius = clear_radius(gap_mm, pixel_mm) + _SLACK_MM
    ring = max(1, round(_RING_MM / pixel_mm))
    return Grid(usable_mm, pixel_mm, radius, int(np.ceil(radius / pixel_mm)) + ring, ring)


def kernels_of(shape: Shape, grid: Grid, rotations: int) -> Kernels:
    """Return the pixels of a shape at every angle at which it fits the grid's usable area."""
    angles = fitting_angles(shape, grid.usable_mm, rotations)
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


class SheetPixels:
    """The occupied pixels of one sheet, and their spectra until the next piece is put down.

    The state of a search, not a value: it changes as pieces are put down.
    """

    def __init__(self, grid: Grid, *, workers: int) -> None:
        """Start with an empty sheet."""
        self.grid = grid
        self.workers = workers
        self._occupied = np.zeros(grid.shape, dtype=np.float32)
        self._touched = np.ones(grid.shape, dtype=np.float32)
        columns, rows = (int(side / grid.pixel_mm) for side in grid.usable_mm)
        self._touched[grid.pad : grid.pad + rows, grid.pad : grid.pad + columns] = 0.0
        self._spectra: tuple[_Spectrum, _Spectrum] | None = None

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
        self._spectra = None

    def best_position(self, kernels: Kernels) -> Position | None:
        """Return the free position with the most contact, or None if there is none."""
        if self._spectra is None:
            self._spectra = (
                scipy.fft.rfft2(self._occupied, workers=self.workers),
                scipy.fft.rfft2(self._touched, workers=self.workers),
            )
        steps = np.floor(
            (np.array(self.grid.usable_mm) - kernels.sizes) / self.grid.pixel_mm + 1e-6
        )
        last = np.maximum(steps.astype(np.int64), 0)
        batch = max(1, _MAX_CELLS // int(np.prod(self.grid.shape)))
        best: Position | None = None
        for start in range(0, len(kernels.angles_deg), batch):
            chosen = np.arange(start, min(start + batch, len(kernels.angles_deg)))
            found = self._best_of(kernels, chosen, last, self._spectra)
            if found is not None and (best is None or found.score > best.score):
                best = found
        return best

    def _best_of(
        self,
        kernels: Kernels,
        chosen: IntArray,
        last: IntArray,
        spectra: tuple[_Spectrum, _Spectrum],
    ) -> Position | None:
        rows, columns = int(last[chosen, 1].max()) + 1, int(last[chosen, 0].max()) + 1
        overlap = self._correlation(kernels.pixels[chosen], spectra[0], rows, columns)
        free = overlap < 0.5
        free &= np.arange(rows)[None, :, None] <= last[chosen, 1][:, None, None]
        free &= np.arange(columns)[None, None, :] <= last[chosen, 0][:, None, None]
        able = free.any(axis=(1, 2))
        if not able.any():
            return None
        chosen, free = chosen[able], free[able]
        score = self._correlation(kernels.ring[chosen], spectra[1], rows, columns)
        np.rint(score, out=score)
        score /= kernels.ring_size[chosen].astype(np.float32)[:, None, None]
        # How far to the right its far side comes, as a share of the sheet; less so upwards.
        right = np.arange(columns) * self.grid.pixel_mm + kernels.sizes[chosen, 0][:, None]
        up = np.arange(rows) * self.grid.pixel_mm
        score -= (_PULL * right / self.grid.usable_mm[0]).astype(np.float32)[:, None, :]
        score -= (0.1 * _PULL * up / self.grid.usable_mm[1]).astype(np.float32)[None, :, None]
        score = np.where(free, score, np.float32(-np.inf))
        where = int(np.argmax(score))
        rotation, row, column = np.unravel_index(where, score.shape)
        return Position(float(score.flat[where]), int(chosen[rotation]), int(row), int(column))

    def _correlation(
        self, pixels: BoolArray, spectrum: _Spectrum, rows: int, columns: int
    ) -> _Cells:
        height, width = self.grid.shape
        pixels = pixels[:, :height, :width]
        kernel = pixels.astype(np.float32)
        wave = scipy.fft.rfft(kernel, n=width, axis=2, workers=self.workers)
        wave = scipy.fft.fft(wave, n=height, axis=1, overwrite_x=True, workers=self.workers)
        np.conj(wave, out=wave)
        wave *= spectrum
        wave = scipy.fft.ifft(wave, axis=1, overwrite_x=True, workers=self.workers)[:, :rows]
        result = scipy.fft.irfft(wave, n=width, axis=2, overwrite_x=True, workers=self.workers)
        return np.asarray(result[:, :, :columns], dtype=np.float32)
