"""Fill one sheet: piece after piece, by size, wherever each touches most."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import field

import numpy as np

from fabweave.core.arrays import BoolArray, frozen_value
from fabweave.nest.area import Area
from fabweave.nest.effort import Effort
from fabweave.nest.fits import sheet_grid
from fabweave.nest.item_shape import Pose, Shape, Spot
from fabweave.nest.layout import Placement
from fabweave.nest.place.search import PULL, Grid, Kernels, SheetPixels, kernels_of
from fabweave.stock.sheet_size import SheetSize

_CACHE_BYTES = 150_000_000  # of kernels kept for the next try: bounds memory, not the result


class KernelCache:
    """The kernels used last, as many as memory allows."""

    def __init__(self) -> None:
        """Start empty."""
        self._kept: OrderedDict[tuple[Grid, int], Kernels] = OrderedDict()
        self._bytes = 0

    def get(self, key: tuple[Grid, int], make: Callable[[], Kernels]) -> Kernels:
        """Return what is kept under a key, or make and keep it."""
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        kernels = make()
        self._kept[key] = kernels
        self._bytes += kernels.nbytes
        while self._bytes > _CACHE_BYTES and len(self._kept) > 1:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return kernels


@frozen_value
class NestingJob:
    """What a call of `nest` works on, and the kernels that it keeps for the next try."""

    shapes: tuple[Shape, ...]
    poses: tuple[Pose, ...]
    names: list[str]
    sheets: tuple[SheetSize, ...]
    margin_mm: float
    gap_mm: float
    near_mm: float  # what is nearer to a piece counts as contact
    effort: Effort
    workers: int
    areas: tuple[Area, ...]  # of the sheets
    fits: BoolArray  # (shapes, sheets): which shape fits on which sheet
    cache: KernelCache = field(default_factory=KernelCache)

    def grid(self, sheet: int) -> Grid:
        """Return the grid of a sheet size, with larger pixels if it is very large."""
        return sheet_grid(self.areas[sheet], self.gap_mm, self.effort, self.near_mm)

    def kernels(self, shape: int, grid: Grid) -> Kernels:
        """Return the pixels of a shape, from the cache if they are there."""
        return self.cache.get(
            (grid, shape), lambda: kernels_of(self.shapes[shape], grid, self.effort.rotations)
        )


@frozen_value
class Plan:
    """Sheets in use, by their number in the stock, and where pieces stand on them."""

    used: tuple[int, ...]
    placements: dict[int, Placement]

    def areas(self, job: NestingJob) -> list[float]:
        """Return the area of the pieces on each sheet, square millimetres."""
        total = [0.0] * len(self.used)
        for piece, placement in self.placements.items():
            total[placement.sheet] += job.shapes[job.poses[piece].shape].area_mm2
        return total


def filled_sheet(
    job: NestingJob, queue: list[int], choice: int, number: int, pull: float = PULL
) -> dict[int, Placement]:
    """Return the placements of the pieces that go on one sheet.

    Parameters
    ----------
    job : NestingJob
        Shapes, stock and settings.
    queue : list of int
        The pieces that are left, in the order in which they are tried.
    choice, number : int
        Which size of the stock, and the number of this sheet in the layout.
    pull : float
        How strongly pieces are drawn to the left: the more, the larger the rest at the right.

    Returns
    -------
    dict of int to Placement
        At least the first piece of the queue that fits on an empty sheet.
    """
    grid = job.grid(choice)
    pixels = SheetPixels(grid, job.effort, workers=job.workers, pull=pull)
    failed = np.empty((0, 2))
    placed: dict[int, Placement] = {}
    for piece in queue:
        index = job.poses[piece].shape
        shape = job.shapes[index]
        size = np.array([shape.length_mm, shape.width_mm])
        too_large = (size >= job.effort.same_size * failed).all(axis=1).any()
        if too_large or not job.fits[index, choice]:
            continue
        kernels = job.kernels(index, grid)
        spot = pixels.place(kernels, size)
        if spot is not None:
            pixels.put(kernels, spot)
            placed[piece] = _placement(piece, number, spot, job.poses[piece], job.margin_mm)
            continue
        failed = np.concatenate([failed, size[None]])
        if len(failed) >= job.effort.failures:
            break
    return placed


def _placement(piece: int, sheet: int, spot: Spot, pose: Pose, margin_mm: float) -> Placement:
    """Return the motion of a piece whose shape stands at a spot."""
    x, y = spot.apply(np.array([pose.x_mm, pose.y_mm])) + margin_mm
    rotation = (spot.angle_deg + pose.angle_deg) % 360.0
    return Placement(piece, sheet, rotation, float(x), float(y))
