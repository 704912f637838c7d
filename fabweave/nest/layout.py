"""Hold where each piece stands on which sheet, and how long is looked for that."""

from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.stock.rotations import FREE, Rotations
from fabweave.stock.sheet_size import SheetSize


@dataclass(frozen=True)
class Effort:
    """How hard to look: all counts, so that a result never depends on the machine.

    Parameters
    ----------
    pixel_mm : float
        Side of a pixel.
    angles : int
        How many angles are tried, evenly spread: a divisor of 720 and a multiple of 4.
    likely : int
        How many of them are tried first, told apart by larger pixels; others only if none of these
        has room. All angles are tried together if it is as many.
    orders : int
        In how many orders the pieces are tried again where the last sheet holds little.
    failures : int
        How many pieces may fail on a sheet before it is closed.
    same_size : float
        A piece at least this share as long and as wide as one that failed is not tried.
    rounds : int
        How many rounds are spent on emptying a sheet, at most.
    patience : int
        How many of them may pass without any success.
    density : float
        No sheet is emptied if the pieces, grown by half the gap, would take more than this share
        of the others.
    halvings : int
        How often what may be left of a side of the last sheet is halved, so that more of it is left
        over.
    """

    pixel_mm: float
    angles: int
    likely: int
    orders: int
    failures: int
    same_size: float
    rounds: int
    patience: int
    density: float
    halvings: int


#: By name. The figures are choices of ours, between what they gain on the piece sets of
#: tests/benchmarks/bench_nesting.py and what they cost.
EFFORTS = {
    "quick": Effort(
        pixel_mm=2.0, angles=20, likely=4, orders=3, failures=40, same_size=0.9,
        rounds=0, patience=0, density=0.0, halvings=0,
    ),
    "normal": Effort(
        pixel_mm=1.25, angles=24, likely=4, orders=3, failures=40, same_size=0.9,
        rounds=200, patience=24, density=0.7, halvings=0,
    ),
    "best": Effort(
        pixel_mm=1.0, angles=24, likely=24, orders=0, failures=60, same_size=0.93,
        rounds=900, patience=120, density=0.8, halvings=4,
    ),
}  # fmt: skip

#: To say how many sheets will be needed, and not to cut: twice as fast as ``quick``. Of 17 jobs of
#: 12 to 80 pieces it took as many sheets as that for 15, one more for one, and one less for one.
ROUGH = Effort(
    pixel_mm=3.0, angles=20, likely=4, orders=0, failures=20, same_size=0.9,
    rounds=0, patience=0, density=0.0, halvings=0,
)  # fmt: skip


def effort_named(name: str) -> Effort:
    """Return the settings of an effort: ``quick``, ``normal`` or ``best``.

    Raises
    ------
    InputError
        If there is no such effort.

    Examples
    --------
    >>> effort_named("quick").pixel_mm
    2.0
    """
    if name not in EFFORTS:
        raise InputError(f"no effort is called {name!r}: choose one of {', '.join(EFFORTS)}")
    return EFFORTS[name]


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
