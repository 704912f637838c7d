"""Hold what is drawn on a sheet: entities on layers, in the order of the cut."""

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from fabweave.arrays import FloatArray, frozen


class Layer(Enum):
    """The layers, in the order in which they are cut; NOTES is never cut."""

    ENGRAVE_LABEL = "ENGRAVE_LABEL"
    ENGRAVE_MARK = "ENGRAVE_MARK"
    CUT_INNER = "CUT_INNER"
    CUT_OUTER = "CUT_OUTER"
    NOTES = "NOTES"


@dataclass(frozen=True, eq=False)
class Polyline:
    """A run of straight segments on a layer, (N, 2) points in millimetres, maybe closed."""

    layer: Layer
    points: FloatArray
    closed: bool = False

    def __post_init__(self) -> None:
        """Freeze the points."""
        object.__setattr__(self, "points", frozen(self.points))


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
    """All entities of one piece in sheet coordinates: engraving, then holes, then the outline."""

    piece_id: str
    entities: tuple[Entity, ...]


@dataclass(frozen=True)
class SheetDrawing:
    """One sheet: its size, its pieces in cutting order, and notes that are not cut."""

    name: str
    width_mm: float
    height_mm: float
    pieces: tuple[PieceDrawing, ...]
    notes: tuple[Entity, ...]
