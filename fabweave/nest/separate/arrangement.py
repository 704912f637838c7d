"""Hold where pieces are while they are still being moved, and turn that into placements."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.nest.item_shape import Pose, rotated
from fabweave.nest.layout import Placement
from fabweave.nest.separate.item_field import ItemField

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
