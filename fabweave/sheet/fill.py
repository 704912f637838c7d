"""Fill one sheet: the next few pieces by size, wherever they touch most."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fabweave.arrays import BoolArray
from fabweave.sheet.area import Area
from fabweave.sheet.effort import Effort
from fabweave.sheet.fits import sheet_grid
from fabweave.sheet.layout import Placement, SheetSize
from fabweave.sheet.search import PULL, Grid, Kernels, Position, SheetPixels, kernels_of
from fabweave.sheet.shape import Pose, Shape, rotated

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


@dataclass(frozen=True, eq=False)
class NestingJob:
    """What a call of `nest` works on, and the kernels that it keeps for the next try."""

    shapes: tuple[Shape, ...]
    poses: tuple[Pose, ...]
    names: list[str]
    sheets: tuple[SheetSize, ...]
    margin_mm: float
    gap_mm: float
    effort: Effort
    workers: int
    areas: tuple[Area, ...]  # of the sheets
    fits: BoolArray  # (shapes, sheets): which shape fits on which sheet
    cache: KernelCache = field(default_factory=KernelCache)

    def grid(self, sheet: int) -> Grid:
        """Return the grid of a sheet size, with larger pixels if it is very large."""
        return sheet_grid(self.areas[sheet], self.gap_mm, self.effort)

    def kernels(self, shape: int, grid: Grid) -> Kernels:
        """Return the pixels of a shape, from the cache if they are there."""
        return self.cache.get(
            (grid, shape), lambda: kernels_of(self.shapes[shape], grid, self.effort.rotations)
        )


@dataclass(frozen=True, eq=False)
class Plan:
    """Sheets in use, by their number in the stock, and where pieces stand on them."""

    used: tuple[int, ...]
    placements: dict[int, Placement]
    by_engine: bool = False

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
    waiting = [piece for piece in queue if job.fits[job.poses[piece].shape, choice]]
    failed = np.empty((0, 2))
    placed: dict[int, Placement] = {}
    while waiting:
        tried: list[tuple[int, Position]] = []
        head = 0
        while head < len(waiting) and len(tried) < job.effort.look_ahead:
            index = job.poses[waiting[head]].shape
            shape = job.shapes[index]
            size = np.array([shape.length_mm, shape.width_mm])
            if (size >= job.effort.same_size * failed).all(axis=1).any():
                waiting.pop(head)
                continue
            if tried and index == job.poses[waiting[head - 1]].shape:
                head += 1  # congruent with the one before it: the same position
                continue
            position = pixels.best_position(job.kernels(index, grid), size)
            if position is None:
                waiting.pop(head)
                failed = np.concatenate([failed, size[None]])
                if len(failed) >= job.effort.failures:
                    return placed
                continue
            tried.append((head, position))
            head += 1
        if not tried:
            break
        best, position = max(tried, key=lambda one: one[1].score)
        piece = waiting.pop(best)
        kernels = job.kernels(job.poses[piece].shape, grid)
        pixels.put(kernels, position)
        placed[piece] = _placement(job, piece, number, kernels, grid, position)
    return placed


def _placement(
    job: NestingJob, piece: int, sheet: int, kernels: Kernels, grid: Grid, position: Position
) -> Placement:
    """Return the motion of a piece whose shape stands at a position of the grid."""
    pose = job.poses[piece]
    angle = kernels.angles_deg[position.rotation]
    turned = rotated(np.array([[pose.x_mm, pose.y_mm]]), np.array([angle]))[0, 0]
    steps = np.array([position.column, position.row]) * grid.pixel_mm
    x, y = job.margin_mm + steps - kernels.corners[position.rotation] + turned
    rotation = (float(angle) + pose.angle_deg) % 360.0
    return Placement(piece, sheet, rotation, float(x), float(y))
