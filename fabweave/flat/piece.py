"""Hold a piece: what is cut, with its stations, holes and joints."""

from dataclasses import dataclass

from fabweave.arrays import BoolArray, FloatArray, IntArray, frozen
from fabweave.flat.path import Path


@dataclass(frozen=True, eq=False)
class Piece:
    """One flat piece of one thread, in its own coordinates (millimetres, nominal, no kerf).

    Parameters
    ----------
    id : str
        The label that is engraved, such as ``"A3"``; unique in the job.
    thread : int
        The thread it belongs to.
    path : Path
        What is cut: sides and arcs, simple, counter-clockwise, none shorter than 0.1 mm; within
        0.02 mm of the exact development.
    outline : (K, 2) float array
        Simple polygon, first point not repeated, its corners on the path and it within 0.01 mm.
    crossings : (S,) int array
        The crossings it passes, in the order of its thread.
    points : (S, 2) float array
        Where each crossing is.
    directions : (S, 2) float array
        Unit vectors along the thread at each crossing.
    rails : (S, 2, 2) float array
        The points of the right and the left edge abreast of each crossing.
    over : (S,) bool array
        Whether the piece lies on top there.
    hole_mm : (S,) float array
        Diameter of the fastener hole at each crossing, NaN where there is none.
    start_joint, end_joint : int or None
        The joints at its first and last station.
    """

    id: str
    thread: int
    path: Path
    outline: FloatArray
    crossings: IntArray
    points: FloatArray
    directions: FloatArray
    rails: FloatArray
    over: BoolArray
    hole_mm: FloatArray
    start_joint: int | None
    end_joint: int | None

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in (
            "outline", "crossings", "points", "directions", "rails", "over", "hole_mm",
        ):  # fmt: skip
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, eq=False)
class Joint:
    """Where two pieces of one thread lap at a crossing.

    ``pieces`` holds the number of the piece that ends here and of the piece that begins here;
    for a ring cut from one piece both are the same. ``holes`` is an (n, 2, 2) array: for each
    fastener the point on the first and on the second piece.
    """

    id: int
    crossing: int
    pieces: tuple[int, int]
    holes: FloatArray

    def __post_init__(self) -> None:
        """Freeze the array."""
        object.__setattr__(self, "holes", frozen(self.holes))
