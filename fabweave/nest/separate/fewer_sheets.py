"""Nest a finished plan on fewer sheets, one sheet less at a time.

A piece is put where it overlaps least with those on a sheet, found by correlation of coarse pixels.
That position need not be free: what overlaps a little is pushed apart afterwards. So pixels may be
coarse, and every sheet can be searched at every angle.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import itemgetter

import numpy as np
import numpy.typing as npt
import scipy.fft
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, frozen_value
from fabweave.nest.container import Container
from fabweave.nest.item_shape import Pose, rotated
from fabweave.nest.layout import Placement
from fabweave.nest.place.fill import NestingJob, Plan, fill_sheet
from fabweave.nest.place.raster import Cache, filled_pixels
from fabweave.nest.separate.separation import (
    ItemField,
    ObstacleField,
    PlacedItems,
    distances,
    item_arrays,
    item_field,
    obstacle_field,
    place_items,
    separate,
)

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
        self._kernels: Cache[tuple[ItemField, CoarsePixels], _Kernel] = Cache(_CACHE_BYTES)

    def positions(
        self, item: ItemField, pixels: CoarsePixels, costs: Sequence[_Cells]
    ) -> list[CoarsePosition | None]:
        """Return the position of least cost in each cost field, None where the item has none.

        Parameters
        ----------
        item : ItemField
            What is placed; its pixels are kept.
        pixels : CoarsePixels
            Of the sheets.
        costs : sequence of (rows, columns) float arrays
            What it costs to cover each pixel.
        """
        kernel = self._kernels.get((item, pixels), lambda: _kernel_of(item, pixels))
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
        nearest = obstacle.distances(centres * size).reshape(rows, columns)
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
        distance = distances(placed, points, np.full(len(points), item)).reshape(height, width)
        nearer = distance < nearest[window]
        second[window] = np.minimum(second[window], np.where(nearer, nearest[window], distance))
        nearest[window] = np.where(nearer, distance, nearest[window])
        items[window] = np.where(nearer, item, items[window])
    return PixelDistances(nearest, second, items, gap_mm)


def _cells(columns: int, rows: int) -> IntArray:
    """Return column and row of each cell, row by row, (rows * columns, 2)."""
    return np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)


#: The sheet of a piece that is on none.
UNPLACED = -1


@dataclass(eq=False)
class Arrangement:
    """The sheet of each of P pieces, (P,), and the pose of its item there, (P, 3).

    The state of a search, not a value: both arrays change as pieces are moved.

    A pose is x and y of the centroid, millimetres from the corner of the usable area, and the
    angle of the shape in radians.
    """

    sheet_of: IntArray
    poses: FloatArray

    def copy(self) -> "Arrangement":
        """Return another one that may be changed."""
        return Arrangement(self.sheet_of.copy(), self.poses.copy())

    def pieces_on(self, sheet: int) -> list[int]:
        """Return the pieces on a sheet."""
        return [int(piece) for piece in np.flatnonzero(self.sheet_of == sheet)]


def arrangement_of(
    placements: Iterable[Placement],
    poses: Sequence[Pose],
    items: Sequence[ItemField],
    margin_mm: float,
) -> Arrangement:
    """Return the arrangement that placements describe; pieces without one are unplaced.

    Parameters
    ----------
    placements : iterable of Placement
    poses : sequence of Pose
        How each piece lies on its shape.
    items : sequence of ItemField
        The field of each piece's shape.
    margin_mm : float
        Of the sheets.
    """
    sheet_of = np.full(len(poses), UNPLACED, dtype=np.int64)
    item_poses = np.zeros((len(poses), 3))
    for placement in placements:
        piece = placement.piece
        pose = poses[piece]
        # The centroid in the piece's own frame, and from there to the sheet.
        shifted = items[piece].centre - np.array([pose.x_mm, pose.y_mm])
        centroid = rotated(shifted[None], np.array([-pose.angle_deg]))[0]
        sheet_of[piece] = placement.sheet
        item_poses[piece, :2] = placement.apply(centroid)[0] - margin_mm
        item_poses[piece, 2] = np.deg2rad(placement.rotation_deg - pose.angle_deg)
    return Arrangement(sheet_of, item_poses)


def placement_of(
    piece: int, sheet: int, item_pose: FloatArray, pose: Pose, item: ItemField, margin_mm: float
) -> Placement:
    """Return the placement of a piece whose item is at a pose (3,) on a sheet."""
    angle = float(np.rad2deg(item_pose[2]))
    shift = np.array([pose.x_mm, pose.y_mm]) - item.centre
    moved = rotated(shift[None], np.array([angle]))[0, 0] + item_pose[:2] + margin_mm
    rotation = (angle + pose.angle_deg) % 360.0
    return Placement(piece, sheet, rotation, float(moved[0]), float(moved[1]))


#: Pairs that are farther apart than the gap by more than this cannot miss it.
_TOUCH_MM = 1e-9


def shortfall_mm(
    items: Sequence[ItemField], poses: FloatArray, container: Container, gap_mm: float
) -> float:
    """Return by how much the worst pair misses the gap, or an item leaves the usable area.

    Items keep the gap from what is barred, too. The result is negative where everything has more
    room than it needs; items that overlap miss the gap by all of it, and by the side of a square
    as large as their overlap.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.separate.separation import item_field
    >>> from fabweave.nest.item_shape import shape_of
    >>> bar = shape_of(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [0.0, 10.0]]))[0]
    >>> poses = np.array([[15.0, 5.0, 0.0], [15.0, 16.5, 0.0]])
    >>> shortfall_mm([item_field(bar, 2.0)] * 2, poses, Container((30.0, 30.0)), 2.0)
    0.5
    """
    placed = [
        rotated(item.outline, np.array([np.rad2deg(pose[2])]))[0] + pose[:2]
        for item, pose in zip(items, poses, strict=True)
    ]
    points = np.concatenate(placed)
    worst = float(max((-points).max(), (points - np.array(container.size_mm)).max()))
    polygons = np.array([shapely.polygons(outline) for outline in placed])
    if container.barred is not None:
        barred = np.array(container.barred)
        worst = max(worst, float(_pair_shortfalls(polygons, barred, gap_mm).max()))
    near = shapely.STRtree(polygons).query(
        polygons, predicate="dwithin", distance=gap_mm + _TOUCH_MM
    )
    first, second = near[:, near[0] < near[1]]
    if len(first) == 0:
        return worst
    return max(worst, float(_pair_shortfalls(polygons[first], polygons[second], gap_mm).max()))


def _pair_shortfalls(
    first: npt.NDArray[np.object_], second: npt.NDArray[np.object_], gap_mm: float
) -> FloatArray:
    """Return by how much each pair of geometries misses the gap."""
    apart = shapely.distance(first, second)
    shortfall: FloatArray = gap_mm - apart
    touching = apart <= 0.0
    second = np.broadcast_to(second, first.shape)
    overlap = shapely.intersection(first[touching], second[touching])
    shortfall[touching] += np.sqrt(shapely.area(overlap))
    return shortfall


#: Steps in which items must come apart.
_STEPS = 40
#: Steps that shake a sheet, and how far free items move in each, millimetres.
_PULLS, _PULL_MM = 5, 3.0
#: How often a larger gap is asked for: by what the proof found missing, and by this besides.
_PROOFS, _EXTRA_MM = 3, 0.005
#: What may be missing in a proof, millimetres.
_PROOF_MM = 1e-9
#: Overlap, in mm² times mm of depth, beyond which a position is hopeless.
_DEAR = 8000.0
#: Sheets that are searched for a position, and how many of these are tried.
_SEARCHED, _TRIED = 24, 3
#: Sheets that are searched for a swap in one round, pieces on each that might make way, and swaps
#: that are tried.
_SWAP_SHEETS, _SWAP_PARTNERS, _SWAPS = 4, 12, 5
#: The area of a piece that makes way, as shares of the newcomer's: a smaller one does not make
#: room, and a larger one does not help.
_LEAST_PARTNER, _MOST_PARTNER = 0.25, 0.98
#: A sheet with more pieces than this is left alone.
_MOST_PIECES = 250
#: On a sheet with more pieces than this, so many of them make room for one, and what is farther
#: from all of these, millimetres, does not matter to them.
_FULL, _MOVED, _AWAY_MM = 80, 40, 8.0
#: What leaves more than this share of the unplaced area is no success.
_GAINED = 0.95
#: At least this share of the patience is had, however little of a sheet has found room elsewhere.
_PATIENT = 0.6
#: The work, for each round: pieces that are on sheets where one is inserted, in all tries together.
_WORK = 600

#: Called after each round with the area that is unplaced, square millimetres.
EmptyingProgress = Callable[[float], None]


@frozen_value
class SeparationProblem:
    """What stays as it is while pieces move.

    Parameters
    ----------
    items : sequence of ItemField
        One for each piece.
    containers : sequence of Container
        The usable area of each sheet in use.
    obstacles : sequence of ObstacleField or None
        What is barred on each.
    gap_mm : float
        Least distance between pieces.
    search : CoarseSearch
        Finds positions.
    """

    items: Sequence[ItemField]
    containers: Sequence[Container]
    obstacles: Sequence[ObstacleField | None]
    gap_mm: float
    search: CoarseSearch

    def separated(
        self,
        pieces: Sequence[int],
        poses: FloatArray,
        sheet: int,
        *,
        pull_mm: tuple[float, float] | None = None,
        moving: BoolArray | None = None,
    ) -> FloatArray | None:
        """Return poses near these at which the pieces keep the gap, proved; None if not found.

        All pieces move, or those that are ``moving``; if there is a pull, it comes first.
        """
        items = [self.items[piece] for piece in pieces]
        near = _within_reach(items, poses, moving)
        arrays = item_arrays([items[number] for number in near])
        moving = None if moving is None else moving[near]
        container, gap = self.containers[sheet], self.gap_mm
        poses = poses.copy()
        for _ in range(_PROOFS):
            near_poses = separate(
                arrays,
                poses[near],
                container,
                gap,
                steps=_STEPS,
                pull_mm=pull_mm or (0.0, 0.0),
                pulls=0 if pull_mm is None else _PULLS,
                obstacle=self.obstacles[sheet],
                moving=moving,
            )
            if near_poses is None:
                return None
            poses[near] = near_poses
            shortfall = shortfall_mm(items, poses, container, self.gap_mm)
            if shortfall <= _PROOF_MM:
                return poses
            # The fields are a little coarse: ask for that much more.
            gap, pull_mm = gap + shortfall + _EXTRA_MM, None
        return None


def _within_reach(
    items: Sequence[ItemField], poses: FloatArray, moving: BoolArray | None
) -> IntArray:
    """Return the numbers of the items that move, and of those that they might come near to."""
    if moving is None:
        return np.arange(len(items))
    low, high = np.empty((2, len(items), 2))
    for number, (item, pose) in enumerate(zip(items, poses, strict=True)):
        outline = rotated(item.outline, np.rad2deg(pose[2:]))[0] + pose[:2]
        low[number], high[number] = outline.min(axis=0), outline.max(axis=0)
    low, high = low[:, None] - _AWAY_MM, high[:, None] + _AWAY_MM
    meet = (low <= high[moving, 0]) & (high >= low[moving, 0])
    return np.flatnonzero(meet.all(axis=2).any(axis=1))


@dataclass(eq=False)
class _Emptying:
    """The state of emptying a sheet: it changes with every piece that finds a place."""

    problem: SeparationProblem
    state: Arrangement
    sheets: list[int]
    random: np.random.Generator
    distances: dict[int, PixelDistances] = field(default_factory=dict)
    changes: dict[int, int] = field(default_factory=dict)
    #: What failed, also for congruent pieces: see :meth:`key`.
    failed: set[tuple[ItemField, int, int, int]] = field(default_factory=set)
    #: Pieces that are on sheets where one is inserted, in all tries together.
    work: int = 0

    def area(self, piece: int) -> float:
        return self.problem.items[piece].area_mm2

    def pool(self) -> list[int]:
        """Return the unplaced pieces, the largest first."""
        pieces = self.state.pieces_on(UNPLACED)
        return sorted(pieces, key=lambda piece: (-round(self.area(piece), 3), piece))

    def distances_on(self, sheet: int) -> PixelDistances:
        if sheet not in self.distances:
            pieces, placed = self.state.pieces_on(sheet), None
            if pieces:
                arrays = item_arrays([self.problem.items[piece] for piece in pieces])
                placed = place_items(arrays, self.state.poses[pieces])
            self.distances[sheet] = pixel_distances(
                coarse_pixels(self.problem.containers[sheet]),
                self.problem.gap_mm,
                placed,
                self.problem.obstacles[sheet],
            )
        return self.distances[sheet]

    def key(
        self, piece: int, sheet: int, leaving: int = UNPLACED
    ) -> tuple[ItemField, int, int, int]:
        """Return item, sheet, how often that has changed, and the piece that makes way."""
        return self.problem.items[piece], sheet, self.changes.get(sheet, 0), leaving

    def changed(self, sheet: int) -> None:
        self.distances.pop(sheet, None)
        self.changes[sheet] = self.changes.get(sheet, 0) + 1

    def positions(
        self, piece: int, sheet: int, leaving: Sequence[int | None]
    ) -> list[CoarsePosition | None]:
        """Return the best position if each of these, by number on the sheet, leaves it."""
        distances = self.distances_on(sheet)
        costs = [distances.cost(without=number) for number in leaving]
        pixels = coarse_pixels(self.problem.containers[sheet])
        return self.problem.search.positions(self.problem.items[piece], pixels, costs)

    def moving(self, pieces: Sequence[int], poses: FloatArray) -> BoolArray | None:
        """Return which pieces move to make room for the last one: on a full sheet those near it.

        None if all do.
        """
        if len(pieces) <= _FULL:
            return None
        reach = np.array([self.problem.items[piece].radius_mm for piece in pieces])
        apart = np.hypot(*(poses[:, :2] - poses[-1, :2]).T) - reach
        apart[-1] = -np.inf
        return flags(len(pieces), np.argsort(np.round(apart, 3), kind="stable")[:_MOVED])

    def insert(
        self, piece: int, sheet: int, position: CoarsePosition, leaving: int = UNPLACED
    ) -> bool:
        """Try to insert a piece on a sheet; return whether there is room for all pieces there."""
        pieces = [other for other in self.state.pieces_on(sheet) if other != leaving] + [piece]
        self.work += len(pieces)
        poses = self.state.poses[pieces]
        poses[-1] = position.x_mm, position.y_mm, position.angle
        moving = self.moving(pieces, poses)
        separated = self.problem.separated(pieces, poses, sheet, moving=moving)
        if separated is None:
            self.failed.add(self.key(piece, sheet, leaving))
            return False
        self.state.poses[pieces] = separated
        self.state.sheet_of[piece] = sheet
        if leaving != UNPLACED:
            self.state.sheet_of[leaving] = UNPLACED
        self.changed(sheet)
        return True

    def place(self, piece: int) -> bool:
        """Try to place a piece on the sheets where it overlaps least."""
        open_to = [sheet for sheet in self.sheets if self.key(piece, sheet) not in self.failed]
        ranked = []
        for sheet in open_to[:_SEARCHED]:
            position = self.positions(piece, sheet, [None])[0]
            if position is None or position.cost > _DEAR:
                self.failed.add(self.key(piece, sheet))
            else:
                ranked.append((position.cost, sheet, position))
        ranked.sort(key=itemgetter(0, 1))
        return any(self.insert(piece, sheet, position) for _, sheet, position in ranked[:_TRIED])

    def swap(self, piece: int) -> bool:
        """Try to put a piece in the place of a smaller one."""
        ranked = []
        area = self.area(piece)
        some_sheets = self.random.permutation(len(self.sheets))[:_SWAP_SHEETS]
        for sheet in [self.sheets[number] for number in some_sheets]:
            partners = [
                (number, other)
                for number, other in enumerate(self.state.pieces_on(sheet))
                if _LEAST_PARTNER * area < self.area(other) < _MOST_PARTNER * area
                and self.key(piece, sheet, other) not in self.failed
            ]
            if len(partners) > _SWAP_PARTNERS:
                some = np.sort(self.random.permutation(len(partners))[:_SWAP_PARTNERS])
                partners = [partners[number] for number in some]
            positions = self.positions(piece, sheet, [number for number, _ in partners])
            for position, (_, other) in zip(positions, partners, strict=True):
                if position is not None and position.cost <= _DEAR:
                    ranked.append((position.cost, sheet, other, position))
        ranked.sort(key=itemgetter(0, 1, 2))
        return any(
            self.insert(piece, sheet, position, other)
            for _, sheet, other, position in ranked[:_SWAPS]
        )

    def shake(self, sheet: int) -> None:
        """Move everything on a sheet to one side, as far as there is room."""
        pieces = self.state.pieces_on(sheet)
        if not pieces:
            return
        angle = 2.0 * math.pi * float(self.random.random())
        pull = (_PULL_MM * math.cos(angle), _PULL_MM * math.sin(angle))
        separated = self.problem.separated(pieces, self.state.poses[pieces], sheet, pull_mm=pull)
        if separated is not None:
            self.state.poses[pieces] = separated
            self.changed(sheet)


def empty_sheet(
    problem: SeparationProblem,
    start: Arrangement,
    sheet: int,
    *,
    rounds: int,
    patience: int,
    seed: int,
    progress: EmptyingProgress,
) -> Arrangement:
    """Move the pieces of one sheet to the others, as many as find room.

    Parameters
    ----------
    problem : SeparationProblem
        Items, containers and the gap.
    start : Arrangement
        Every piece on a sheet.
    sheet : int
        The sheet to empty.
    rounds : int
        How often to go through the pool; less often if there is much to push on full sheets.
    patience : int
        How often without any success, once nearly all has found room; less often before.
    seed : int
        For the choice of what is tried.
    progress : callable
        Called with the area that is unplaced after each round.

    Returns
    -------
    Arrangement
        Pieces for which there is no room are unplaced; all others keep the gap, proved. Pieces may
        have been swapped: those that are left are not those that were on the sheet, but have less
        area.
    """
    state = start.copy()
    others = sheets_to_fill(problem, state, sheet)
    state.sheet_of[state.sheet_of == sheet] = UNPLACED
    search = _Emptying(problem, state, others, np.random.default_rng(seed))
    if not others:
        return state
    whole = sum(map(search.area, search.pool()))
    least, since = math.inf, 0
    for number in range(rounds):
        for piece in search.pool():
            if search.work < _WORK * rounds:
                search.place(piece)
        pool = search.pool()
        left = sum(map(search.area, pool))
        progress(left)
        least, since = (left, 0) if left < _GAINED * least else (least, since + 1)
        # A sheet of which little has room elsewhere will hardly be emptied.
        enough = patience * max(1.0 - left / whole, _PATIENT)
        if not pool or since > enough or search.work >= _WORK * rounds:
            break
        if not search.swap(pool[number % len(pool)]):
            search.shake(others[int(search.random.integers(len(others)))])
    return state


def sheets_to_fill(problem: SeparationProblem, state: Arrangement, sheet: int) -> list[int]:
    """Return the other sheets in use, the emptiest first."""
    pieces = np.flatnonzero(state.sheet_of != UNPLACED)
    sheet_of = state.sheet_of[pieces]
    area = np.array([problem.items[int(piece)].area_mm2 for piece in pieces])
    size = len(problem.containers)
    counts = np.bincount(sheet_of, minlength=size)
    usable = np.array([container.open_mm2 for container in problem.containers])
    share = np.bincount(sheet_of, area, minlength=size) / usable
    return [
        int(other)
        for other in np.argsort(share.round(9), kind="stable")
        if other != sheet and 0 < counts[other] <= _MOST_PIECES
    ]


#: How strongly pieces are drawn to the left on the last sheet: its rest stays in one piece.
_LAST_PULL = 3.0
#: The share of a piece's rim that counts with the gap: half of it, at least, as inside a bend the
#: grown rim overlaps itself; and only half the gap is the piece's own.
_RIM_SHARE = 0.25

#: Called with how many sheets there are, and what share of the pieces of one has room elsewhere.
Progress = Callable[[int, float], None]


def fewer_sheets(job: NestingJob, plan: Plan, seed: int, progress: Progress) -> Iterator[Plan]:
    """Yield ever better plans: with one sheet less, and at last with an emptier last sheet.

    Parameters
    ----------
    job : NestingJob
        Shapes, stock and settings.
    plan : Plan
        All pieces, as the greedy search placed them.
    seed : int
        For what is tried.
    progress : callable
        Told how it goes.

    Yields
    ------
    Plan
        Complete, whenever something is better than before.
    """
    if job.effort.rounds == 0 or len(plan.sheets) < 2:
        return
    items: list[ItemField] = []
    search = CoarseSearch()
    obstacles = {
        number: obstacle_field(job.containers[number], job.gap_mm) for number in set(plan.sheets)
    }
    while len(plan.sheets) > 1:
        sheet = emptiest(job, plan)
        others = [number for number in range(len(plan.sheets)) if number != sheet]
        offered = sum(_offered_mm2(job, plan.sheets[other]) for other in others)
        if _needed_mm2(job) > job.effort.density * offered:
            return
        if not items:
            fields = [item_field(shape, job.gap_mm) for shape in job.shapes]
            items = [fields[pose.shape] for pose in job.poses]
        problem = SeparationProblem(
            items,
            [job.containers[number] for number in plan.sheets],
            [obstacles[number] for number in plan.sheets],
            job.gap_mm,
            search,
        )
        count, sheet_mm2 = len(plan.sheets), plan.areas_mm2(job)[sheet]

        def unplaced(area_mm2: float, count: int = count, sheet_mm2: float = sheet_mm2) -> None:
            progress(count, 1.0 - area_mm2 / sheet_mm2)

        arrangement = empty_sheet(
            problem,
            arrangement_of(plan.placements.values(), job.poses, items, job.margin_mm),
            sheet,
            rounds=job.effort.rounds,
            patience=job.effort.patience,
            seed=seed + count,
            progress=unplaced,
        )
        better = _plan_of(job, plan, arrangement, items, [*others, sheet])
        if better is None:
            return
        plan = better
        yield plan
        if arrangement.pieces_on(UNPLACED):
            return


def emptiest(job: NestingJob, plan: Plan) -> int:
    """Return the sheet with the least on it: one that is bought, if there is any."""
    areas = np.round(plan.areas_mm2(job), 6)
    offcut = np.array([job.stock[number].offcut for number in plan.sheets])
    if not offcut.all():
        areas[offcut] = np.inf
    return int(np.argmin(areas))


def _plan_of(
    job: NestingJob,
    plan: Plan,
    arrangement: Arrangement,
    items: Sequence[ItemField],
    order: list[int],
) -> Plan | None:
    """Return the plan of an arrangement, with what is unplaced on the last sheet of the order.

    Without that sheet if nothing is unplaced; None if not all of it fits there.
    """
    unplaced = arrangement.pieces_on(UNPLACED)
    if not unplaced:
        order = order[:-1]
    number = {sheet: new for new, sheet in enumerate(order)}
    placements = {
        piece: placement_of(
            piece,
            number[int(sheet)],
            arrangement.poses[piece],
            job.poses[piece],
            items[piece],
            job.margin_mm,
        )
        for piece, sheet in enumerate(arrangement.sheet_of)
        if sheet != UNPLACED
    }
    sheets = tuple(plan.sheets[sheet] for sheet in order)
    if unplaced:
        queue = sorted(unplaced, key=lambda piece: (-job.shape(piece).length_mm, piece))
        last = fill_sheet(job, queue, sheets[-1], len(sheets) - 1, pull=_LAST_PULL)
        if len(last) < len(unplaced):
            return None
        placements.update(last)
    return Plan(sheets, dict(sorted(placements.items())))


def _needed_mm2(job: NestingJob) -> float:
    """Return the area of all pieces, each grown by half the gap (corners left out)."""
    shapes = [job.shapes[pose.shape] for pose in job.poses]
    rims = [
        np.hypot(*(np.roll(shape.outline, -1, axis=0) - shape.outline).T).sum() for shape in shapes
    ]
    return sum(
        shape.area_mm2 + _RIM_SHARE * job.gap_mm * float(rim)
        for shape, rim in zip(shapes, rims, strict=True)
    )


def _offered_mm2(job: NestingJob, number: int) -> float:
    """Return the usable area of a sheet of the stock, grown by half the gap."""
    container = job.containers[number]
    width, height = container.size_mm
    return container.open_mm2 + job.gap_mm * (width + height + job.gap_mm)
