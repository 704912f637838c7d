"""Hold a piece: what is cut, with its stations, cut-outs and joints."""

from collections.abc import Sequence
from dataclasses import field

import numpy as np

from fabweave.core.arc_path import Path
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen, frozen_value
from fabweave.piece.joint.kinds import JointKind


@frozen_value
class Slot:
    """A cut-out that is not a circle, and the station that it belongs to."""

    station: int
    path: Path


@frozen_value
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
        Diameter of the fastener in the middle of each crossing, NaN where there is none.
    start_joint, end_joint : int or None
        The joints at its first and last station.
    more_holes : (H, 4) float array
        Holes that are not in the middle of a crossing: station, x, y, diameter.
    slots : tuple of Slot
        A slot at a station with a ``hole_mm`` is there in place of the round hole.
    guides : tuple of (2, 2) float arrays
        Short lines to lay a joined piece by; they are engraved.
    covers : tuple of (K, 2) float arrays
        The parts of its outer face, polygons, that strands above cover in the woven object.
    rim_turns : (R,) int array
        The stations after which, and before the next, it turns back at the boundary.
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
    more_holes: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))
    slots: tuple[Slot, ...] = ()
    guides: tuple[FloatArray, ...] = ()
    covers: tuple[FloatArray, ...] = ()
    rim_turns: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def holes(self) -> FloatArray:
        """All round holes, (H, 4): station, x, y, diameter; by stations, middle holes first."""
        round_here = ~np.isnan(self.hole_mm)
        round_here[[slot.station for slot in self.slots]] = False
        at = np.flatnonzero(round_here)
        middle = np.column_stack((at, self.points[at], self.hole_mm[at]))
        return frozen(np.concatenate((middle, self.more_holes)))

    @property
    def hole_area_mm2(self) -> float:
        """The area of its holes and slots."""
        slots = sum(abs(slot.path.area) for slot in self.slots)
        return float(np.pi / 4 * np.sum(self.holes[:, 3] ** 2) + slots)

    @property
    def net_area_mm2(self) -> float:
        """The area of the material that is left of it: its outline without holes and slots."""
        return self.path.area - self.hole_area_mm2


@frozen_value
class Joint:
    """Where two pieces of one thread meet at a crossing.

    ``pieces`` holds the number of the piece that ends here and of the piece that begins here;
    for a ring cut from one piece both are the same. ``holes`` is an (n, 2, 2) array: for each
    fastener the point on the first and on the second piece; ``hole_mm`` is their diameter, NaN if
    there are none. ``lap_mm`` is how far the pieces lap along their middle line, ``ahead_mm`` how
    much of that lies ahead of the middle of the crossing.
    """

    id: int
    crossing: int
    pieces: tuple[int, int]
    kind: JointKind
    holes: FloatArray
    hole_mm: float
    lap_mm: float
    ahead_mm: float


@frozen_value
class Owners:
    """The piece and station of each strand of each crossing.

    Column 0 is the strand under, column 1 the strand over. Where a strand has a joint, the piece
    that ends there counts.

    Parameters
    ----------
    piece : (X, 2) int array
    station : (X, 2) int array
    """

    piece: IntArray
    station: IntArray

    def partners(self, piece: Piece) -> IntArray:
        """Return the piece that a piece crosses at each of its stations, (S,)."""
        return self.piece[piece.crossings, 1 - piece.over.astype(np.int64)]


def find_owners(pieces: Sequence[Piece], n_crossings: int) -> Owners:
    """Find the owner of every strand; each is carried by one piece, or by two at a joint."""
    owner = np.zeros((n_crossings, 2), dtype=np.int64)
    station = np.zeros((n_crossings, 2), dtype=np.int64)
    for index, piece in enumerate(pieces):
        first = 1 if piece.start_joint is not None else 0
        crossing, side = piece.crossings[first:], piece.over[first:].astype(np.int64)
        owner[crossing, side] = index
        station[crossing, side] = np.arange(first, len(piece.crossings))
    return Owners(owner, station)
