"""Hold where pieces stand while they are still being moved, and turn that into placements."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.nest.item_shape import Pose, rotated
from fabweave.nest.layout import Placement
from fabweave.nest.separate.item_field import Body

#: The sheet of a piece that stands on none.
NOWHERE = -1


@dataclass(eq=False)
class Arrangement:
    """The sheet of each of P pieces, (P,), and the pose of its body there, (P, 3).

    The state of a search, not a value: both arrays change as pieces are moved.

    A pose is x and y of the centroid, millimetres from the corner of the usable area, and the
    angle of the shape in radians.
    """

    where: IntArray
    poses: FloatArray

    def copy(self) -> "Arrangement":
        """Return another one that may be changed."""
        return Arrangement(self.where.copy(), self.poses.copy())

    def on(self, sheet: int) -> list[int]:
        """Return the pieces on a sheet."""
        return [int(piece) for piece in np.flatnonzero(self.where == sheet)]


def arrangement_of(
    placements: Iterable[Placement], poses: Sequence[Pose], bodies: Sequence[Body], margin_mm: float
) -> Arrangement:
    """Return the arrangement that placements describe; pieces without one stand nowhere.

    Parameters
    ----------
    placements : iterable of Placement
    poses : sequence of Pose
        How each piece lies on its shape.
    bodies : sequence of Body
        The body of each piece's shape.
    margin_mm : float
        Of the sheets.
    """
    where = np.full(len(poses), NOWHERE, dtype=np.int64)
    stands = np.zeros((len(poses), 3))
    for placement in placements:
        pose = poses[placement.piece]
        angle = placement.rotation_deg - pose.angle_deg
        # The centroid in the piece's own frame, and from there to the sheet.
        centre = bodies[placement.piece].centre - np.array([pose.x_mm, pose.y_mm])
        own = rotated(centre[None], np.array([-pose.angle_deg]))[0]
        where[placement.piece] = placement.sheet
        stands[placement.piece, :2] = placement.apply(own)[0] - margin_mm
        stands[placement.piece, 2] = np.deg2rad(angle)
    return Arrangement(where, stands)


def placement_of(
    piece: int, sheet: int, stand: FloatArray, pose: Pose, body: Body, margin_mm: float
) -> Placement:
    """Return the placement of a piece whose body stands at a pose (3,) on a sheet."""
    angle = float(np.rad2deg(stand[2]))
    shift = np.array([pose.x_mm, pose.y_mm]) - body.centre
    moved = rotated(shift[None], np.array([angle]))[0, 0] + stand[:2] + margin_mm
    rotation = (angle + pose.angle_deg) % 360.0
    return Placement(piece, sheet, rotation, float(moved[0]), float(moved[1]))
