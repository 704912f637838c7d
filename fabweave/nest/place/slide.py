"""Slide a piece against those on a sheet, exactly: pixels leave a little room around it.

The least distance of two polygons that do not meet is that of a corner of one from a side of the
other. So a small motion of a piece keeps the gap if all such pairs near it keep it, and to first
order each pair is one linear inequality in three unknowns, a shift and a turn. A step goes as far
as these inequalities let it towards what is near, and to the left; where it comes to is measured
again, so that what is kept is exact.
"""

import math
from collections.abc import Sequence

import numpy as np
import shapely
from scipy.optimize import nnls

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.nest.container import Container
from fabweave.nest.item_shape import Spot
from fabweave.nest.place.raster import closed_sides, ring_sides

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
