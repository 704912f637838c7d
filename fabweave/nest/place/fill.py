"""Fill one sheet: piece after piece, by size, wherever each touches most."""

from dataclasses import field

import numpy as np

from fabweave.core.arrays import BoolArray, frozen_value
from fabweave.nest.container import Container
from fabweave.nest.fits import sheet_grid
from fabweave.nest.item_shape import ItemShape, Pose, Spot
from fabweave.nest.layout import Effort, Placement
from fabweave.nest.place.raster import Cache
from fabweave.nest.place.spectral_packing import PULL, Grid, Kernels, SheetPixels, kernels_of
from fabweave.stock.sheet_size import SheetSize

#: Memory of kernels that are kept for the next try; it does not change the result.
_CACHE_BYTES = 150_000_000


def kernel_cache() -> Cache[tuple[Grid, int], Kernels]:
    """Return an empty cache of kernels."""
    return Cache(_CACHE_BYTES)


@frozen_value
class NestingJob:
    """What a call of `nest` works on, and the kernels that it keeps for the next try.

    Parameters
    ----------
    shapes : tuple of ItemShape
        What is congruent has one shape.
    poses : tuple of Pose
        How each piece lies on its shape.
    names : list of str
        What the pieces are called in messages.
    stock : tuple of SheetSize
        The sheets that there are.
    margin_mm, gap_mm : float
        Least distance of a piece from the border of its sheet, and from another piece.
    near_mm : float
        What is nearer to a piece counts as contact.
    effort : Effort
    workers : int
        Threads for the transforms.
    containers : tuple of Container
        The usable area of each sheet of the stock.
    fits : (shapes, stock) bool array
        Which shape fits on which sheet.
    """

    shapes: tuple[ItemShape, ...]
    poses: tuple[Pose, ...]
    names: list[str]
    stock: tuple[SheetSize, ...]
    margin_mm: float
    gap_mm: float
    near_mm: float
    effort: Effort
    workers: int
    containers: tuple[Container, ...]
    fits: BoolArray
    cache: Cache[tuple[Grid, int], Kernels] = field(default_factory=kernel_cache)

    def shape(self, piece: int) -> ItemShape:
        """Return the shape of a piece."""
        return self.shapes[self.poses[piece].shape]

    def grid(self, number: int) -> Grid:
        """Return the grid of a sheet of the stock, with larger pixels if it is very large."""
        return sheet_grid(self.containers[number], self.gap_mm, self.effort, self.near_mm)

    def kernels(self, shape: int, grid: Grid) -> Kernels:
        """Return the pixels of a shape, from the cache if they are there."""
        return self.cache.get(
            (grid, shape), lambda: kernels_of(self.shapes[shape], grid, self.effort.angles)
        )


@frozen_value
class Plan:
    """Sheets in use, by their number in the stock, and the placement of each piece."""

    sheets: tuple[int, ...]
    placements: dict[int, Placement]

    def areas_mm2(self, job: NestingJob) -> list[float]:
        """Return the area of the pieces on each sheet, square millimetres."""
        total = [0.0] * len(self.sheets)
        for piece, placement in self.placements.items():
            total[placement.sheet] += job.shape(piece).area_mm2
        return total


def fill_sheet(
    job: NestingJob, queue: list[int], number: int, sheet: int, pull: float = PULL
) -> dict[int, Placement]:
    """Place as many pieces of a queue on one sheet as there is room for.

    Parameters
    ----------
    job : NestingJob
        Shapes, stock and settings.
    queue : list of int
        The pieces that are left, in the order in which they are tried.
    number, sheet : int
        The sheet's number in the stock, and in the layout.
    pull : float
        How strongly pieces are drawn to the left: the more, the larger the rest at the right.

    Returns
    -------
    dict of int to Placement
        With at least the first piece of the queue that fits on an empty sheet.
    """
    grid = job.grid(number)
    pixels = SheetPixels(grid, job.effort, workers=job.workers, pull=pull)
    failed = np.empty((0, 2))
    placements: dict[int, Placement] = {}
    for piece in queue:
        index = job.poses[piece].shape
        shape = job.shapes[index]
        size = np.array([shape.length_mm, shape.width_mm])
        too_large = (size >= job.effort.same_size * failed).all(axis=1).any()
        if too_large or not job.fits[index, number]:
            continue
        kernels = job.kernels(index, grid)
        spot = pixels.place(kernels, size)
        if spot is not None:
            pixels.put(kernels, spot)
            placements[piece] = _placement(piece, sheet, spot, job.poses[piece], job.margin_mm)
            continue
        failed = np.concatenate([failed, size[None]])
        if len(failed) >= job.effort.failures:
            break
    return placements


def _placement(piece: int, sheet: int, spot: Spot, pose: Pose, margin_mm: float) -> Placement:
    """Return the placement of a piece whose shape is at a spot."""
    x, y = spot.apply(np.array([pose.x_mm, pose.y_mm])) + margin_mm
    rotation = (spot.angle_deg + pose.angle_deg) % 360.0
    return Placement(piece, sheet, rotation, float(x), float(y))
