"""Hold what is drawn on a sheet: entities on layers, in the order of the cut."""

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

import numpy as np

from fabweave.core.arc_path import flattened
from fabweave.core.arrays import FloatArray, frozen_value

#: An outline in the notes may have lost its short sides.
_SAME_MM = 0.5


class Layer(Enum):
    """The layers, in the order in which they are cut; NOTES is never cut."""

    ENGRAVE_LABEL = "ENGRAVE_LABEL"
    ENGRAVE_MARK = "ENGRAVE_MARK"
    CUT_INNER = "CUT_INNER"
    CUT_OUTER = "CUT_OUTER"
    NOTES = "NOTES"

    # Drawings look up layers millions of times; Enum's own hash is slow, and says no more.
    __hash__ = object.__hash__


@frozen_value
class Polyline:
    """A run of straight segments and arcs on a layer, maybe closed.

    Parameters
    ----------
    layer : Layer
    points : (N, 2) float array
        Millimetres; the first point of a closed run is not repeated.
    closed : bool
    bulges : (N,) float array or None
        The tangent of a quarter of the sweep of the side that leaves each point, positive to the
        left (the convention of DXF), 0 for straight; None if all are straight.
    width_mm : float or None
        How wide it is shown where a format has widths; None for a hairline. Only notes are wide.
    """

    layer: Layer
    points: FloatArray
    closed: bool = False
    bulges: FloatArray | None = None
    width_mm: float | None = None

    def flattened(self, tolerance_mm: float) -> FloatArray:
        """Return points along the run so near that chords are within the tolerance of arcs."""
        if self.bulges is None:
            return self.points
        return flattened(self.points, self.bulges, tolerance_mm, closed=self.closed)


@dataclass(frozen=True)
class Circle:
    """A circle on a layer, in millimetres."""

    layer: Layer
    x: float
    y: float
    radius: float


Entity: TypeAlias = Polyline | Circle


@dataclass(frozen=True)
class PieceDrawing:
    """All entities of one piece in sheet coordinates: engraving, then holes, then the outline.

    ``name`` is what people call it by what it bears, where that is not its id.
    """

    piece_id: str
    entities: tuple[Entity, ...]
    name: str = ""

    @property
    def title(self) -> str:
        """What people call it."""
        return self.name or self.piece_id


@dataclass(frozen=True)
class SheetDrawing:
    """One sheet: its size, its pieces in cutting order, and notes that are not cut.

    ``open_outlines`` says that outlines are interrupted by micro-joints on purpose.
    """

    name: str
    width_mm: float
    height_mm: float
    pieces: tuple[PieceDrawing, ...]
    notes: tuple[Entity, ...]
    open_outlines: bool = False

    @property
    def edge(self) -> FloatArray:
        """The corners of the sheet: of the first note, if that is its outline, (N, 2).

        Examples
        --------
        >>> SheetDrawing("sheet 1", 20.0, 10.0, (), ()).edge.tolist()
        [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [0.0, 10.0]]
        """
        wide, high = self.width_mm, self.height_mm
        first = self.notes[0] if self.notes else None
        if isinstance(first, Polyline) and first.closed:
            size = np.ptp(first.points, axis=0)
            if np.abs(size - (wide, high)).max() < _SAME_MM:
                return first.points
        return np.array([[0.0, 0.0], [wide, 0.0], [wide, high], [0.0, high]])
