"""Hold what is drawn on a sheet: entities on layers, in the order of the cut."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from fabweave.core.arc_path import flattened
from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of

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
    """

    layer: Layer
    points: FloatArray
    closed: bool = False
    bulges: FloatArray | None = None

    @property
    def bends(self) -> FloatArray:
        """The bulge of the side that leaves each point, (N,)."""
        return np.zeros(len(self.points)) if self.bulges is None else self.bulges

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

    def outlines(self, tolerance_mm: float) -> list[FloatArray]:
        """Return the corners of its outlines, arcs as chords."""
        return [
            entity.flattened(tolerance_mm)
            for entity in self.entities
            if entity.layer is Layer.CUT_OUTER and isinstance(entity, Polyline)
        ]

    @property
    def title(self) -> str:
        """What people call it."""
        return self.name or self.piece_id


def draw_flat(
    piece_id: str,
    strokes: Iterable[FloatArray],
    ticks: Iterable[FloatArray],
    holes: Iterable[tuple[float, float, float]],
    outline: Polyline,
) -> PieceDrawing:
    """Return the drawing of a piece: its lettering, its ticks, its holes (x, y, d), its outline."""
    letters = (Polyline(Layer.ENGRAVE_LABEL, stroke) for stroke in strokes)
    marks = (Polyline(Layer.ENGRAVE_MARK, tick) for tick in ticks)
    circles = (Circle(Layer.CUT_INNER, x, y, diameter / 2) for x, y, diameter in holes)
    return PieceDrawing(piece_id, (*letters, *marks, *circles, outline))


@dataclass(frozen=True)
class SheetDrawing:
    """One sheet: its size, its pieces in cutting order, and notes that are not cut.

    ``open_outlines`` says that outlines are open on purpose: for micro-joints, or where another
    piece is cut along the same line. ``left_out`` names the notes that it has no room for.
    """

    name: str
    width_mm: float
    height_mm: float
    pieces: tuple[PieceDrawing, ...]
    notes: tuple[Entity, ...]
    open_outlines: bool = False
    left_out: tuple[str, ...] = ()

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


#: The shortest segment that laser programs take without merging it away, millimetres.
MIN_SEGMENT_MM = 0.1
#: What may be wrong with a drawing, and what to do about it.
_FAULTS = {
    "line(s) are among the notes, and not on their layer, or the other way round": (
        "put notes on the layer NOTES"
    ),
    "line(s) are not in cutting order": "put engraving first, then holes, then the outline",
    "piece(s) have no outline": "give each piece a closed line on CUT_OUTER",
    "line(s) that are cut are open": "close them, or engrave them",
    "point(s) are not finite, or over 500 m away": "coordinates must be numbers, in millimetres",
}
#: A coordinate beyond this is a mistaken unit, millimetres: no roll is longer.
_MOST_MM = 5e5


def on_grid(points: FloatArray) -> FloatArray:
    """Return points rounded to the step of the files, without negative zeros.

    Examples
    --------
    >>> import numpy as np
    >>> on_grid(np.array([[1.00004, -0.00001]])).tolist()
    [[1.0, 0.0]]
    """
    return np.round(points, 4) + 0.0


def check_drawing(drawing: SheetDrawing) -> None:
    """Raise unless a drawing can be written and cut: all writers ask first.

    Coordinates are finite and within a hundred metres; every piece is engraved, then its holes,
    then its outline (the order of ``Layer``), and has an outline; what is cut is closed, unless
    outlines are open on purpose; notes stand on their own layer. What else has to hold of a sheet,
    such as that nothing is drawn twice, is proved from the files.

    Raises
    ------
    InputError
        With the first kind of fault found, how often it occurs and in which pieces.

    Examples
    --------
    >>> check_drawing(SheetDrawing("sheet 1", 600.0, 400.0, (), ()))
    """
    sheet = np.array([drawing.width_mm, drawing.height_mm])
    if not np.all((sheet > 0.0) & (sheet <= _MOST_MM)):
        raise InputError(
            f"sheet {drawing.name!r} measures {sheet[0]} x {sheet[1]} mm, not 0 to 100 m"
        )
    rank_of = {layer: rank for rank, layer in enumerate(Layer)}
    shut = {Layer.CUT_INNER} if drawing.open_outlines else {Layer.CUT_INNER, Layer.CUT_OUTER}
    faults: dict[str, list[str]] = {fault: [] for fault in _FAULTS}
    for name, entities in (
        *((piece.piece_id, piece.entities) for piece in drawing.pieces),
        ("the notes", drawing.notes),
    ):
        layers = [entity.layer for entity in entities]
        noted = entities is drawing.notes
        disordered = sum(rank_of[one] > rank_of[after] for one, after in pairwise(layers))
        lines = [entity for entity in entities if isinstance(entity, Polyline)]
        rounds = [(item.x, item.y, item.radius) for item in entities if isinstance(item, Circle)]
        runs = [np.empty((0, 2)), *(line.points for line in lines)]
        values = (np.concatenate(runs), np.array(rounds).reshape(-1, 3))
        far = sum(int(np.any(~(np.abs(some) <= _MOST_MM), axis=1).sum()) for some in values)
        counts = (
            sum((layer is Layer.NOTES) is not noted for layer in layers),
            disordered,
            int(not (noted or drawing.open_outlines or Layer.CUT_OUTER in layers)),
            sum(not line.closed and line.layer in shut for line in lines),
            far,
        )
        for fault, count in zip(_FAULTS, counts, strict=True):
            faults[fault] += [name] * count
    for fault, names in faults.items():
        if names:
            raise InputError(
                f"{len(names)} {fault}, in {few_of(list(dict.fromkeys(names)))}; {_FAULTS[fault]}"
            )
