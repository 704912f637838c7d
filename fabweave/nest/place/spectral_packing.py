"""Find the best free position of a shape on one sheet, by correlation of pixels.

All free positions of a shape are the zeros of one correlation of its pixels with the sheet's,
and its contact with what is there is a second one (the spectral packing of Cui, Rong, Chen and
Matusik, "Dense, interlocking-free and scalable spectral packing of generic 3D objects",
SIGGRAPH 2023, in the plane). Correlations of pixels are whole numbers, so rounding makes them
exact, and the result depends on neither the order of additions nor the number of workers.

Pixels leave a little room around a piece; so it is slid against those on the sheet, exactly. The
least distance of two polygons that do not meet is that of a corner of one from a side of the other.
So a small motion of a piece keeps the gap if all such pairs near it keep it, and to first order
each pair is one linear inequality in three unknowns, a shift and a turn. A step goes as far as
these inequalities let it towards what is near, and to the left; where it comes to is measured
again, so that what is kept is exact.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.fft
import shapely
from scipy.ndimage import distance_transform_edt
from scipy.optimize import nnls

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.parallel.executors import in_threads
from fabweave.nest.container import Container
from fabweave.nest.item_shape import ItemShape, Spot, fitting_angles, rotated
from fabweave.nest.layout import Effort
from fabweave.nest.place.raster import closed_sides, filled_pixels, region_sides, ring_sides

#: Aimed at beyond the gap, millimetres: what is not linear takes of it.
_SPARE_MM = 0.005
#: What is nearer than the gap and this, millimetres, draws the outline to it.
_NEAR_MM = 4.0
#: How far a step moves the centre, or turns the farthest point, at most, and how many there are;
_STEP_MM, _STEPS = 1.5, 6
#: how far all steps together move it; a step that gains less is the last.
_FAR_MM, _DONE_MM = 4.0, 0.02
#: How strongly an outline is drawn to the left and down, as a share of what being near does.
_LEFT, _DOWN = 0.1, 0.01
#: What is nearer than so many steps limits a step.
_REACHED = 1.5
#: Lengths that are none, and what a proof forgives, millimetres.
_NOTHING, _PROOF_MM = 1e-12, 1e-9
#: Least lengths to divide by, millimetres, and mm².
_LEAST_MM, _LEAST_MM2 = 1e-9, 1e-18
#: Rows of the two limits of a turn.
_TURN_LIMITS = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
#: Motions are rounded to this fraction of a millimetre, so that no last bit is carried on.
_GRAIN = 65536.0


@frozen_value
class _Sides:
    """Closed rings as K sides: their starts, their vectors, and how much ring each start is of."""

    start: FloatArray  # (K, 2)
    along: FloatArray  # (K, 2)
    weight: FloatArray  # (K,) half of the two sides that meet there, millimetres
    low: FloatArray  # (K, 2)
    high: FloatArray  # (K, 2)

    def within(self, low: FloatArray, high: FloatArray) -> "_Sides":
        """Return the sides whose rectangles meet one."""
        kept = ((self.low <= high) & (self.high >= low)).all(axis=1)
        return _Sides(
            self.start[kept], self.along[kept], self.weight[kept], self.low[kept], self.high[kept]
        )


def _sides(ends: FloatArray) -> _Sides:
    """Return the sides (K, 2, 2) of one ring."""
    along = ends[:, 1] - ends[:, 0]
    length = np.hypot(along[:, 0], along[:, 1])
    weight = (length + np.roll(length, 1)) / 2.0
    return _Sides(ends[:, 0], along, weight, ends.min(axis=1), ends.max(axis=1))


def _concatenated(parts: Sequence[_Sides]) -> _Sides:
    """Return the sides of all parts."""
    if not parts:
        return _sides(np.empty((0, 2, 2)))
    start, along, weight, low, high = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("start", "along", "weight", "low", "high")
    )
    return _Sides(start, along, weight, low, high)


class PlacedOutlines:
    """The outlines on a sheet: a search's state, which grows as pieces are put down."""

    def __init__(self, container: Container, gap_mm: float) -> None:
        """Start with what is barred."""
        self.container = container
        self.gap_mm = gap_mm
        self._rings: list[_Sides] = []
        self._geometries: list[shapely.Geometry] = []
        self._low, self._high = np.empty((0, 2)), np.empty((0, 2))
        for ring in shapely.get_rings(shapely.get_parts(container.barred)):
            self._add(ring_sides(shapely.Polygon(ring)), ring)

    def add(self, outline: FloatArray) -> None:
        """Put an outline (K, 2) down."""
        self._add(closed_sides(outline), shapely.polygons(outline))

    def _add(self, ends: FloatArray, geometry: shapely.Geometry) -> None:
        ring = _sides(ends)
        self._rings.append(ring)
        self._geometries.append(geometry)
        self._low = np.concatenate([self._low, ring.low.min(axis=0)[None]])
        self._high = np.concatenate([self._high, ring.high.max(axis=0)[None]])

    def near(self, low: FloatArray, high: FloatArray) -> _Sides:
        """Return the sides whose rectangles meet one."""
        rings = self._meeting(low, high)
        return _concatenated([self._rings[number].within(low, high) for number in rings])

    def has_room(self, outline: FloatArray) -> bool:
        """Return whether an outline is inside the usable area and keeps the gap, exactly."""
        low, high = outline.min(axis=0), outline.max(axis=0)
        if min(low.min(), (self.container.size_mm - high).min()) < -_PROOF_MM:
            return False
        near = self._meeting(low - self.gap_mm, high + self.gap_mm)
        others = np.array([self._geometries[number] for number in near], dtype=object)
        # Touching is no room even where the gap is zero.
        least = max(self.gap_mm - _PROOF_MM, 0.0)
        return not bool(shapely.dwithin(shapely.polygons(outline), others, least).any())

    def _meeting(self, low: FloatArray, high: FloatArray) -> IntArray:
        """Return the rings whose rectangles meet one."""
        return np.flatnonzero(((self._low <= high) & (self._high >= low)).all(axis=1))


def slide(spot: Spot, outline: FloatArray, placed: PlacedOutlines) -> Spot | None:
    """Return a spot near this one where an outline keeps the gap, as near as it can to others.

    Parameters
    ----------
    spot : Spot
        Where the outline overlaps nothing; it need not keep the gap.
    outline : (K, 2) float array
        Of the shape, in its own frame.
    placed : PlacedOutlines
        What is on the sheet already; the border of its usable area counts as well, and its rule for
        rotations holds.

    Returns
    -------
    Spot or None
        None if there is none nearby. That the gap is kept is proved with exact geometry.

    Examples
    --------
    >>> bar = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [0.0, 10.0]])
    >>> placed = PlacedOutlines(Container((100.0, 50.0)), 2.0)
    >>> placed.add(bar)
    >>> spot = slide(Spot(0.0, 1.0, 13.0), bar, placed)
    >>> round(spot.x_mm, 1), round(spot.y_mm, 1)
    (0.0, 12.0)
    """
    moving = _MovingOutline(spot.apply(outline), placed)
    least, most = np.deg2rad(placed.container.rotations.swing_deg(spot.angle_deg)) * moving.radius
    motion = np.zeros(3)
    contacts = moving.contacts(motion)
    best = motion if contacts.kept else None
    for _ in range(_STEPS):
        move = _step(contacts, (least - motion[2], most - motion[2]))
        if move is None:
            break
        motion = np.round((motion + move) * _GRAIN) / _GRAIN
        motion[2] = min(max(motion[2], least), most)
        if math.hypot(motion[0], motion[1]) + abs(motion[2]) > _FAR_MM:
            break
        contacts = moving.contacts(motion)
        if contacts.kept:
            gained = math.inf if best is None else float(np.abs(motion - best).max())
            best = motion
            if gained < _DONE_MM:
                break
    if best is None:
        return None
    for candidate in (moving.spot_after(best, spot), spot):
        if placed.has_room(candidate.apply(outline)):
            return candidate
    return None


@frozen_value
class _Contacts:
    """What an outline is near to: M places, each with the room that is left there.

    ``rows`` (M, 3) say how much the room grows with a motion, all in millimetres.
    """

    rows: FloatArray
    room: FloatArray  # (M,)
    weight: FloatArray  # (M,) millimetres of outline

    @property
    def kept(self) -> bool:
        """Whether the gap is kept, and the border."""
        return float(self.room.min(initial=0.0)) >= -_PROOF_MM


class _MovingOutline:
    """An outline that moves, and the pairs of corners and sides that it may come near to.

    A motion is a shift of the centre, and a turn as the way of the point farthest from it, (3,).
    """

    def __init__(self, outline: FloatArray, placed: PlacedOutlines) -> None:
        """Look for the pairs around where the outline is."""
        reach = placed.gap_mm + _NEAR_MM + _FAR_MM
        low, high = outline.min(axis=0), outline.max(axis=0)
        self.gap_mm = placed.gap_mm
        self.usable = np.array(placed.container.size_mm)
        self.centre = (low + high) / 2.0
        self.arms = outline - self.centre
        self.radius = float(np.hypot(*self.arms.T).max())
        self.sides = _sides(closed_sides(outline))
        self.others = placed.near(low - reach, high + reach)
        #: A corner of this outline with a side of another; a corner of another with a side of this.
        self.corner_pairs = _near_pairs(outline, self.others, reach)
        self.side_pairs = _near_pairs(self.others.start, self.sides, reach)

    def contacts(self, motion: FloatArray) -> _Contacts:
        """Return what the outline is near to after a motion."""
        turn = _turn_matrix(motion[2] / self.radius)
        arms = self.arms @ turn
        centre = self.centre + motion[:2]
        corner, other_side = self.corner_pairs
        corner_apart, corner_way = _apart(arms[corner] + centre, self.others, other_side)
        other_corner, side = self.side_pairs
        other_arms = self.others.start[other_corner] - centre
        side_apart, side_way = _apart(other_arms @ turn.T + self.centre, self.sides, side)
        side_way = side_way @ turn
        # The border: the room of each corner to each of the four sides.
        corners = arms + centre
        border = np.concatenate([corners, self.usable - corners], axis=1)
        border_corner, wall = np.nonzero(border < _NEAR_MM)
        inward = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[wall]
        normal = np.concatenate(
            [corner_way / _divisor(corner_apart), -side_way / _divisor(side_apart), inward]
        )
        arm = np.concatenate([arms[corner], other_arms - side_way, arms[border_corner]])
        swing = (arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]) / self.radius
        rooms = (corner_apart - self.gap_mm, side_apart - self.gap_mm, border[border_corner, wall])
        weights = (
            self.sides.weight[corner],
            self.others.weight[other_corner],
            self.sides.weight[border_corner],
        )
        return _Contacts(
            np.column_stack([normal, swing]), np.concatenate(rooms), np.concatenate(weights)
        )

    def spot_after(self, motion: FloatArray, spot: Spot) -> Spot:
        """Return the spot to which a motion takes what is at one."""
        turn = float(motion[2] / self.radius)
        away = np.array([spot.x_mm, spot.y_mm]) - self.centre
        x, y = away @ _turn_matrix(turn) + self.centre + motion[:2]
        return Spot(spot.angle_deg + math.degrees(turn), float(x), float(y))


def _step(contacts: _Contacts, turn_limits: tuple[float, float]) -> FloatArray | None:
    """Return the motion (3,) that goes as far as there is room towards what is near.

    It is the point nearest to where the draw goes, of those that keep the gap to first order: the
    least distance from a polyhedron, as one of non-negative least squares (C. L. Lawson, R. J.
    Hanson, "Solving Least Squares Problems", 1974, chapter 23). None if no motion keeps it.
    """
    near = contacts.room < _NEAR_MM
    draw = contacts.weight[near] * (1.0 - contacts.room[near] / _NEAR_MM)
    goal = -(draw @ contacts.rows[near]) / max(float(draw.sum()), 1.0)
    goal -= (_LEFT, _DOWN, 0.0)
    goal *= _STEP_MM / max(float(np.sqrt(goal @ goal)), _NOTHING)
    tight = contacts.room < _REACHED * _STEP_MM
    rows = np.concatenate([contacts.rows[tight], _TURN_LIMITS])
    room = np.concatenate([contacts.room[tight] - _SPARE_MM, [-turn_limits[0], turn_limits[1]]])
    bounded = np.isfinite(room)
    rows, room = rows[bounded], room[bounded]
    if len(rows) == 0:
        return goal  # nothing is in the way
    system = np.concatenate([rows.T, [-room - rows @ goal]])
    target = np.array([0.0, 0.0, 0.0, 1.0])
    try:
        weights, _ = nnls(system, target)
    except RuntimeError:
        return None  # it found no end
    rest = system @ weights - target
    if not rest[3] < -_NOTHING:
        return None
    return goal - rest[:3] / rest[3]


def _near_pairs(points: FloatArray, sides: _Sides, reach: float) -> tuple[IntArray, IntArray]:
    """Return the pairs of points and sides that are nearer than the reach."""
    x, y = points[:, :1], points[:, 1:]
    near = (x >= sides.low[:, 0] - reach) & (x <= sides.high[:, 0] + reach)
    near &= (y >= sides.low[:, 1] - reach) & (y <= sides.high[:, 1] + reach)
    point, side = np.nonzero(near)
    kept = _apart(points[point], sides, side)[0] < reach
    return point[kept], side[kept]


def _apart(points: FloatArray, sides: _Sides, which: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return how far points (M, 2) are from one side each, and the way to them from there."""
    along, away = sides.along[which], points - sides.start[which]
    length2 = np.maximum((along * along).sum(axis=1), _LEAST_MM2)
    share = ((away * along).sum(axis=1) / length2).clip(0.0, 1.0)
    way = away - share[:, None] * along
    return np.hypot(way[:, 0], way[:, 1]), way


def _divisor(distance: FloatArray) -> FloatArray:
    """Return distances as (M, 1), none of them too small to divide by."""
    return np.maximum(distance, _LEAST_MM)[:, None]


def _turn_matrix(angle: float) -> FloatArray:
    """Return the matrix that turns rows of points."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s], [-s, c]])


#: Congruent pieces and floating-point rotations differ by less, millimetres.
_SLACK_MM = 1e-4
#: How much more contact a position at the right end of the sheet must have, as a share of a shape's
#: rim; and how much of that counts towards its upper end.
PULL, _UPWARD = 0.1, 0.1
#: Pixels by which angles are told apart are so many times larger.
_COARSER = 4
#: What an overlap of larger pixels costs, by what as much contact is worth.
_OVERLAP = 4.0
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
class _CoarseSpectra:
    """Kernels at all angles in larger pixels, transformed."""

    shape: tuple[int, int]
    pixels: _Spectrum


@dataclass(eq=False)
class _Spectra:
    """Kernels transformed for patches of one size, each angle once it is looked at.

    ``able`` are the angles that may have room in each tile: nothing is ever taken away, so there is
    none at those where none was found.
    """

    kernels: Kernels
    shape: tuple[int, int]
    coarse: _CoarseSpectra
    pixels: _Spectrum
    ready: BoolArray
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
                able = spectra.able.get(tile, np.arange(len(spectra.ready)))
                likely = self._likely(kernels, spectra, tile, tiling.side, last, able)
                for angles in (likely, np.setdiff1d(able, likely)):
                    spots, room = self._free_spots(
                        kernels, spectra, tile, tiling.side, last, angles
                    )
                    able = np.setdiff1d(able, np.setdiff1d(angles, room))
                    spectra.able[tile] = able
                    for free in spots[:_SLIDES]:
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
            small = _pooled(kernels.pixels)
            least = (
                int(scipy.fft.next_fast_len(-(-shape[0] // _COARSER), real=False)),
                int(scipy.fft.next_fast_len(-(-shape[1] // _COARSER), real=True)),
            )
            coarse = _CoarseSpectra(least, self._transform(small, least))
            count = len(kernels.pixels)
            pixels = np.empty((count, fast[0], fast[1] // 2 + 1), dtype=np.complex64)
            self._last = _Spectra(kernels, fast, coarse, pixels, np.zeros(count, dtype=np.bool_))
        return self._last

    def _transform(self, pixels: npt.NDArray[Any], shape: tuple[int, int]) -> _Spectrum:
        """Return conjugate spectra of kernels; rows of zeros are not transformed."""
        result = np.empty((len(pixels), shape[0], shape[1] // 2 + 1), dtype=np.complex64)

        def transform(some: slice) -> None:
            half = scipy.fft.rfft(pixels[some].astype(np.float32), n=shape[1], axis=2)
            whole = scipy.fft.fft(half, n=shape[0], axis=1, overwrite_x=True)
            np.conj(whole, out=result[some])

        in_threads(transform, _cached_slices(len(pixels), shape[0] * shape[1]), self.workers)
        return result

    def _likely(
        self,
        kernels: Kernels,
        spectra: _Spectra,
        tile: _Tile,
        side: int,
        last: IntArray,
        angles: IntArray,
    ) -> IntArray:
        """Return the angles at which a tile is most likely to have a good spot.

        They are told apart by larger pixels, where a little overlap need not be any.
        """
        if len(angles) <= self.effort.likely:
            return angles
        shape, coarse = spectra.shape, spectra.coarse
        patch = np.s_[tile.row : tile.row + shape[0], tile.column : tile.column + shape[1]]
        worth = _pooled(self._touched[patch] - _OVERLAP * self._occupied[patch])
        extent = (-(-shape[0] // _COARSER), -(-shape[1] // _COARSER))
        score = _correlation(
            scipy.fft.rfft2(worth, s=coarse.shape), coarse.pixels[angles], coarse.shape, extent
        )
        score *= np.float32(_COARSER**2 / kernels.rim)
        right = np.arange(extent[1]) * (_COARSER * self.grid.pixel_mm)
        score -= (self.pull / self.grid.usable_mm[0] * right).astype(np.float32)
        for own, (wide, high) in zip(score, last[angles], strict=True):
            own[max((high - tile.row) // _COARSER + 1, 0) :] = -np.inf
            own[:, max((wide - tile.column) // _COARSER + 1, 0) :] = -np.inf
        best = score[:, : -(-side // _COARSER), : -(-side // _COARSER)].max(axis=(1, 2))
        best -= (self.pull / self.grid.usable_mm[0] * kernels.sizes[angles, 0]).astype(np.float32)
        # Rounded, so that no last bit chooses.
        order = np.argsort(-np.round(best, 4), kind="stable")
        return np.sort(angles[order[: self.effort.likely]])

    def _free_spots(
        self,
        kernels: Kernels,
        spectra: _Spectra,
        tile: _Tile,
        side: int,
        last: IntArray,
        angles: IntArray,
    ) -> tuple[list[Spot], IntArray]:
        """Return a tile's free spot with the most contact at each of these angles, the best first.

        And at which of the angles there is room.
        """
        pixel_mm, usable_mm = self.grid.pixel_mm, self.grid.usable_mm
        rows = tile.row + np.arange(min(side, int(last[:, 1].max()) - tile.row + 1))
        columns = tile.column + np.arange(min(side, int(last[:, 0].max()) - tile.column + 1))
        extent = (len(rows), len(columns))
        if len(angles) == 0:
            return [], angles
        fresh = angles[~spectra.ready[angles]]
        if len(fresh):
            spectra.pixels[fresh] = self._transform(kernels.pixels[fresh], spectra.shape)
            spectra.ready[fresh] = True
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
            for own, (wide, high) in zip(free, last[these], strict=True):
                own[max(high - tile.row + 1, 0) :] = False
                own[:, max(wide - tile.column + 1, 0) :] = False
            room = free.any(axis=(1, 2))
            able = these[room]
            if len(able) == 0:
                return able, able, np.empty(0, dtype=np.float32)
            score = _correlation(touched, pixels[room], spectra.shape, extent)
            np.rint(score, out=score)
            score /= np.float32(kernels.rim)
            right = columns * pixel_mm + kernels.sizes[able, 0][:, None]
            score -= (self.pull * right / usable_mm[0]).astype(np.float32)[:, None, :]
            score -= up[None, :, None]
            score[~free[room]] = -np.inf
            flat = score.reshape(len(able), -1)
            where = np.argmax(flat, axis=1)
            return able, where, flat[np.arange(len(able)), where]

        each = spectra.shape[0] * spectra.shape[1]
        parts = in_threads(best_of, _cached_slices(len(angles), each), self.workers)
        able, where, score = (np.concatenate(part) for part in zip(*parts, strict=True))
        row, column = np.unravel_index(where, extent)
        steps = np.stack([columns[column], rows[row]], axis=1) * pixel_mm
        spots = np.column_stack([kernels.angles_deg[able], steps - kernels.corners[able]])
        best = np.argsort(-score, kind="stable")
        return [Spot(*spot) for spot in spots[best].tolist()], able

    def _patch_spectrum(self, cells: _Cells, tile: _Tile, shape: tuple[int, int]) -> _Spectrum:
        """Transform the patch of the sheet at a tile."""
        patch = cells[tile.row : tile.row + shape[0], tile.column : tile.column + shape[1]]
        spectrum: _Spectrum = scipy.fft.rfft2(patch, s=shape)
        return spectrum


def _pooled(cells: npt.NDArray[Any]) -> _Cells:
    """Return the means of blocks of cells: larger pixels, on the last two axes."""
    high, wide = cells.shape[-2:]
    pad = [(0, 0)] * (cells.ndim - 2) + [(0, -high % _COARSER), (0, -wide % _COARSER)]
    even = np.pad(cells.astype(np.float32), pad)
    # Slice by slice, which is five times as fast as a mean over two short axes.
    rows = np.add.reduce([even[..., k::_COARSER, :] for k in range(_COARSER)])
    blocks: _Cells = np.add.reduce([rows[..., k::_COARSER] for k in range(_COARSER)])
    return blocks / np.float32(_COARSER**2)


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
