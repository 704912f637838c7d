"""Hold where each piece stands on which sheet."""

from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.stock.rotations import FREE, Rotations
from fabweave.stock.sheet_size import SheetSize


@dataclass(frozen=True)
class Placement:
    """A rigid motion of one piece onto one sheet: a point p stands at R(rotation) p + (x, y)."""

    piece: int
    sheet: int
    rotation_deg: float
    x_mm: float
    y_mm: float

    def apply(self, points: FloatArray) -> FloatArray:
        """Return points of the piece where they stand on the sheet, (N, 2).

        Examples
        --------
        >>> import numpy as np
        >>> Placement(0, 0, 90.0, 10.0, 0.0).apply(np.array([[1.0, 0.0]])).round(9).tolist()
        [[10.0, 1.0]]
        """
        angle = np.deg2rad(self.rotation_deg)
        cosine, sine = np.cos(angle), np.sin(angle)
        rotation = np.array([[cosine, -sine], [sine, cosine]])
        return points @ rotation.T + np.array([self.x_mm, self.y_mm])


@dataclass(frozen=True)
class Layout:
    """The sheets in use and one placement for each piece, in the order of the pieces.

    ``notes`` say what is worth knowing about how it was found; ``recorded`` that the same settings
    may not find it again, so that it must be taken from where it is recorded. ``rotations`` is the
    rule for the angles of pieces that it keeps.
    """

    sheets: tuple[SheetSize, ...]
    placements: tuple[Placement, ...]
    margin_mm: float
    gap_mm: float
    notes: tuple[str, ...] = ()
    recorded: bool = False
    rotations: Rotations = FREE
