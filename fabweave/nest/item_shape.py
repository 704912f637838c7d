"""Prepare outlines for nesting: check them, measure them, and find the congruent ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen, frozen_value
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.stock.rotations import FREE, Rotations

#: Vertices that differ less, millimetres, are the same vertex.
_CONGRUENT_MM = 1e-6
#: What rotation by floating-point numbers may add to a length, millimetres.
_FIT_MM = 1e-7
#: Angles of a fine fan, a multiple of all that are tried otherwise.
_FINE_ANGLES = 720
#: Parts of a millimetre to which perimeters of congruent outlines are equal, rounded.
_PERIMETER_PARTS = 100.0


@frozen_value
class ItemShape:
    """An outline in its own frame, shared by all pieces that are congruent to it.

    Parameters
    ----------
    outline : (K, 2) float array
        Simple polygon; its least rectangle lies along the axes, the long side along x.
    hull : (H, 2) float array
        Its convex hull.
    area_mm2, length_mm, width_mm : float
        Area of the outline, and the sides of its least rectangle.
    """

    outline: FloatArray
    hull: FloatArray
    area_mm2: float
    length_mm: float
    width_mm: float


@dataclass(frozen=True)
class Pose:
    """How a piece lies on its shape: q = R(angle_deg) p + (x, y) for a point p of the piece."""

    shape: int
    angle_deg: float
    x_mm: float
    y_mm: float


def rotated(points: FloatArray, angles_deg: FloatArray) -> FloatArray:
    """Return points (N, 2) turned about the origin by each of R angles, (R, N, 2).

    Examples
    --------
    >>> import numpy as np
    >>> rotated(np.array([[1.0, 0.0]]), np.array([90.0])).round(9).tolist()
    [[[0.0, 1.0]]]
    """
    angles = np.deg2rad(angles_deg)
    cosine, sine = np.cos(angles), np.sin(angles)
    matrices = np.stack([np.stack([cosine, sine], -1), np.stack([-sine, cosine], -1)], -2)
    result: FloatArray = points[None] @ matrices
    return result


@dataclass(frozen=True)
class Spot:
    """Where a shape is: q = R(angle_deg) p + (x, y), from the corner of the usable area."""

    angle_deg: float
    x_mm: float
    y_mm: float

    def apply(self, points: FloatArray) -> FloatArray:
        """Return where points (..., 2) of the shape are.

        Examples
        --------
        >>> Spot(90.0, 5.0, 0.0).apply(np.array([1.0, 0.0])).round(9).tolist()
        [5.0, 1.0]
        """
        turned = rotated(points.reshape(-1, 2), np.array([self.angle_deg]))[0]
        result: FloatArray = (turned + np.array([self.x_mm, self.y_mm])).reshape(points.shape)
        return result


def check_outlines(outlines: Sequence[FloatArray], ids: Sequence[str]) -> None:
    """Raise InputError unless every outline is a simple polygon with an area.

    Raises
    ------
    InputError
        Naming the pieces that are empty, not finite, without area, or cross themselves.

    Examples
    --------
    >>> import numpy as np
    >>> check_outlines([np.zeros((2, 2))], ["A1"])
    Traceback (most recent call last):
        ...
    fabweave.core.errors.InputError: 1 of 1 outlines cannot be nested: A1 (2 points, 3 are needed)
    """
    if len(ids) != len(outlines):
        raise InputError(f"{len(outlines)} outlines have {len(ids)} ids: give one id for each")
    faults: list[str] = []
    for name, outline in zip(ids, outlines, strict=True):
        if outline.ndim != 2 or outline.shape[1] != 2:
            faults.append(f"{name} (its shape is {outline.shape}; (K, 2) is needed)")
        elif len(outline) < 3:
            faults.append(f"{name} ({len(outline)} points, 3 are needed)")
        elif not np.isfinite(outline).all():
            faults.append(f"{name} (a coordinate is not finite)")
        else:
            polygon = shapely.polygons(outline)
            if not shapely.is_valid(polygon):
                faults.append(f"{name} ({shapely.is_valid_reason(polygon)})")
            elif not shapely.area(polygon) > 0.0:
                faults.append(f"{name} (no area)")
    if faults:
        raise InputError(
            f"{len(faults)} of {len(outlines)} outlines cannot be nested: {few_of(faults)}"
        )


def shape_of(
    outline: FloatArray, *, upright: bool = False
) -> tuple[ItemShape, float, float, float]:
    """Return the shape of an outline, and the angle and the shift that take it there.

    ``upright`` leaves the outline as it is turned: its length and width are those of the rectangle
    along the axes.

    Examples
    --------
    >>> import numpy as np
    >>> shape, angle, x, y = shape_of(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 3.0], [0.0, 3.0]]))
    >>> round(shape.length_mm, 9), round(shape.width_mm, 9), abs(round(angle))
    (3.0, 1.0, 90)
    """
    polygon = shapely.polygons(outline)
    hull = shapely.get_coordinates(shapely.convex_hull(polygon))[:-1]
    sides = np.roll(hull, -1, axis=0) - hull
    # Rounded, so that congruent outlines and repeated runs choose the same side.
    angles = -np.rad2deg(np.arctan2(sides[:, 1], sides[:, 0]))
    boxes = np.ptp(rotated(hull, angles), axis=1)
    best = int(np.argmin(np.round(boxes[:, 0] * boxes[:, 1], 6)))
    angle = float(angles[best]) + (90.0 if boxes[best, 0] < boxes[best, 1] else 0.0)
    angle = 0.0 if upright else round(angle, 6)
    turned = rotated(outline, np.array([angle]))[0]
    shift = -turned.min(axis=0)
    turned_hull = rotated(hull, np.array([angle]))[0] + shift
    length, width = np.ptp(turned, axis=0)
    shape = ItemShape(
        outline=frozen(turned + shift),
        hull=frozen(turned_hull),
        area_mm2=float(shapely.area(polygon)),
        length_mm=float(max(length, width)),
        width_mm=float(min(length, width)),
    )
    return shape, angle, float(shift[0]), float(shift[1])


def shapes_of(
    outlines: Sequence[FloatArray], *, upright: bool = False
) -> tuple[tuple[ItemShape, ...], tuple[Pose, ...]]:
    """Return the distinct shapes among outlines, and how each outline lies on its shape.

    Outlines are congruent if a rotation and a shift take the vertices of one, in order and from
    the first on, to those of the other (mirror images are not: pieces are cut face up).

    Parameters
    ----------
    outlines : sequence of (K, 2) float arrays
        Simple polygons, millimetres.
    upright : bool
        Whether outlines must lie on their shape as they are turned, or by half a turn.

    Returns
    -------
    shapes : tuple of ItemShape
        In the order of their first appearance.
    poses : tuple of Pose
        One for each outline.

    Examples
    --------
    >>> import numpy as np
    >>> bar = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]])
    >>> shapes, poses = shapes_of([bar, rotated(bar, np.array([30.0]))[0] + 7.0])
    >>> len(shapes), [pose.shape for pose in poses]
    (1, [0, 0])
    """
    shapes: list[ItemShape] = []
    poses: list[Pose] = []
    buckets: dict[tuple[int, int], list[int]] = {}
    for outline in outlines:
        sides = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
        key = (len(outline), round(float(sides.sum()) * _PERIMETER_PARTS))
        pose = None
        for number in buckets.get(key, ()):
            pose = _pose_on(outline, shapes[number].outline, number, upright=upright)
            if pose is not None:
                break
        if pose is None:
            shape, angle, x, y = shape_of(outline, upright=upright)
            pose = Pose(len(shapes), angle, x, y)
            buckets.setdefault(key, []).append(len(shapes))
            shapes.append(shape)
        poses.append(pose)
    return tuple(shapes), tuple(poses)


def _pose_on(outline: FloatArray, target: FloatArray, number: int, *, upright: bool) -> Pose | None:
    centre, aim = outline.mean(axis=0), target.mean(axis=0)
    z = (outline - centre) @ np.array([1.0, 1.0j])
    w = (target - aim) @ np.array([1.0, 1.0j])
    angle = float(np.rad2deg(np.angle(np.vdot(z, w))))
    if upright:
        angle = 0.0 if abs(angle) < 90.0 else 180.0
    turned = rotated(outline - centre, np.array([angle]))[0]
    if np.abs(turned + aim - target).max() > _CONGRUENT_MM:
        return None
    shift = aim - rotated(centre[None], np.array([angle]))[0, 0]
    return Pose(number, angle, float(shift[0]), float(shift[1]))


def fitting_angles(
    shape: ItemShape, usable_mm: tuple[float, float], count: int, rotations: Rotations = FREE
) -> FloatArray:
    """Return angles at which a shape fits into a usable rectangle, in degrees, maybe none.

    These are the evenly spread ones that fit, as far as they are allowed. If none of those does, a
    fine fan of angles is tried and the fitting angle with the most room is returned; so the answer
    is empty for every count (a multiple of 4) or for none.

    Examples
    --------
    >>> import numpy as np
    >>> shape = shape_of(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]]))[0]
    >>> fitting_angles(shape, (1.0, 4.0), 4).tolist()
    [90.0, 270.0]
    """
    angles, room = _angles_and_room(shape, usable_mm, rotations, count)
    if (room >= -_FIT_MM).any():
        return angles[room >= -_FIT_MM]
    angles, room = _angles_and_room(shape, usable_mm, rotations, _FINE_ANGLES)
    best = [int(np.argmax(room.round(6)))] if (room >= -_FIT_MM).any() else []
    return angles[best]


def _angles_and_room(
    shape: ItemShape, usable_mm: tuple[float, float], rotations: Rotations, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return angles to try, degrees, and the room that they leave on the tighter axis, (R,)."""
    angles = rotations.angles_deg(count)
    boxes = np.ptp(rotated(shape.hull, angles), axis=1)
    return angles, np.min(np.array(usable_mm) - boxes, axis=1)
