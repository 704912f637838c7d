"""Hold what is read from a sheet's drawing, the same for DXF and SVG."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.verify.measure import arcs
from fabweave.verify.measure.arcs import along, arc_lengths

Floats: TypeAlias = arcs.Floats
Ints: TypeAlias = arcs.Ints
Flags: TypeAlias = npt.NDArray[np.bool_]

ENGRAVE_LAYERS = ("ENGRAVE_LABEL", "ENGRAVE_MARK")
HOLES = "CUT_INNER"
OUTLINES = "CUT_OUTER"
NOTES = "NOTES"
LAYERS = (*ENGRAVE_LAYERS, HOLES, OUTLINES, NOTES)


class ReadError(ValueError):
    """Say what is wrong with a file."""


class Look(NamedTuple):
    """How lines look: exact colour (``"#FF0000"``), AutoCAD colour index, width in millimetres."""

    colour: str | None = None
    aci: int | None = None
    width_mm: float | None = None


@dataclass(frozen=True, eq=False)
class Shape:
    """One thing drawn: a run of segments or arcs, or a circle (one point and a radius).

    ``bulges`` holds the tangent of a quarter of each side's turning angle, zero for straight.
    """

    layer: str
    piece: str | None
    points: Floats
    closed: bool
    radius: float | None
    bulges: Floats | None
    name: str

    @property
    def where(self) -> str:
        """How to name the shape in a finding."""
        return self.name if self.piece is None else f"{self.name} of piece {self.piece}"

    @property
    def ring(self) -> Floats:
        """Its points and bulges, (N, 3)."""
        bulges = np.zeros(len(self.points)) if self.bulges is None else self.bulges
        return np.column_stack([self.points, bulges])


@dataclass(frozen=True, eq=False)
class Drawing:
    """One sheet as read: shapes in file order, y up, millimetres; and what the file declares.

    Shapes are held as columns, since a sheet has many thousands. Points and bulges of shape ``k``
    are those from ``start[k]`` to ``start[k + 1]``; there is at least one point. The radius of
    what is no circle is NaN. ``looks`` are those that occur on each layer, ``version`` is that of
    a DXF file, and ``unit_mm`` what a coordinate of an SVG file counts.
    """

    layer: Sequence[str]
    piece: Sequence[str | None]
    name: Sequence[str]
    points: Floats
    bulges: Floats
    start: Ints
    closed: Flags
    radius: Floats
    layers: tuple[str, ...]
    width_mm: float | None
    height_mm: float | None
    problems: tuple[str, ...]
    looks: Mapping[str, frozenset[Look]] = field(default_factory=dict)
    version: str | None = None
    unit_mm: float | None = None

    @cached_property
    def groups(self) -> dict[tuple[str, str | None], Ints]:
        """The shapes of each layer and piece, in file order."""
        codes: dict[tuple[str, str | None], int] = {}
        code = np.array(
            [codes.setdefault(key, len(codes)) for key in zip(self.layer, self.piece, strict=True)],
            dtype=np.int64,
        )
        order = np.argsort(code, kind="stable")
        parts = np.split(order, np.cumsum(np.bincount(code, minlength=len(codes)))[:-1])
        return dict(zip(codes, parts, strict=False))

    @cached_property
    def sizes(self) -> Ints:
        """The number of points of each shape."""
        return np.diff(self.start)

    @cached_property
    def lengths(self) -> Floats:
        """The length of each shape."""
        owner = np.repeat(np.arange(len(self.sizes)), self.sizes)
        following = np.arange(1, len(owner) + 1)
        last = self.start[1:] - 1
        # The last point of an open run leads nowhere.
        following[last] = np.where(self.closed, self.start[:-1], last)
        chords = np.hypot(*(self.points[following] - self.points).T)
        sums = np.bincount(owner, arc_lengths(chords, self.bulges), len(self.sizes))
        return np.where(np.isnan(self.radius), sums, 2.0 * np.pi * self.radius)

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Every shape by itself."""
        return tuple(self.shape(at) for at in range(len(self.sizes)))

    def shape(self, at: int) -> Shape:
        """Return one shape by itself."""
        rows = slice(int(self.start[at]), int(self.start[at + 1]))
        radius = None if np.isnan(self.radius[at]) else float(self.radius[at])
        return Shape(
            layer=self.layer[at],
            piece=self.piece[at],
            points=self.points[rows],
            closed=bool(self.closed[at]),
            radius=radius,
            bulges=self.bulges[rows] if np.any(self.bulges[rows]) else None,
            name=self.name[at],
        )

    def of(self, layer: str, piece: str | None) -> Ints:
        """Return which shapes a piece has on a layer, in file order."""
        return self.groups.get((layer, piece), np.zeros(0, dtype=np.int64))

    def shapes_of(self, layer: str, piece: str | None) -> list[Shape]:
        """Return the shapes that a piece has on a layer, each by itself."""
        return [self.shape(at) for at in self.of(layer, piece).tolist()]

    def slots(self, shapes: Ints) -> Ints:
        """Return which points some shapes have, one shape after another."""
        sizes = self.sizes[shapes]
        shift = np.repeat(self.start[shapes] - (np.cumsum(sizes) - sizes), sizes)
        return shift + np.arange(len(shift))

    def traced(self, shapes: Ints) -> tuple[Floats, Ints]:
        """Return points along some shapes as `traced` does, and the place in the list of each."""
        if not np.all(np.isnan(self.radius[shapes])):
            runs = [traced(self.shape(at)) for at in shapes.tolist()]
            return np.concatenate(runs), np.repeat(np.arange(len(runs)), [len(run) for run in runs])
        sizes = self.sizes[shapes]
        steps = sizes + self.closed[shapes]
        owner = np.repeat(np.arange(len(shapes)), steps)
        place = np.arange(len(owner)) - (np.cumsum(steps) - steps)[owner]
        # The point after the last of a closed run is its first.
        slots = self.start[shapes][owner] + place % sizes[owner]
        bulges = np.where(place < (steps - 1)[owner], self.bulges[slots], 0.0)
        points, after = along(self.points[slots], bulges)
        return points, owner[after]


def corners_apart(one: Floats, two: Floats) -> float:
    """Return the greatest distance of corresponding corners; infinite for unlike polygons."""
    return float(np.abs(one - two).max()) if one.shape == two.shape else np.inf


def traced(shape: Shape) -> Floats:
    """Return points along a shape, the first repeated at the end of a closed one.

    Circles and arcs become runs of short chords.
    """
    if shape.radius is not None:
        angles = np.linspace(0.0, 2.0 * np.pi, 73)
        return shape.points[0] + shape.radius * np.column_stack([np.cos(angles), np.sin(angles)])
    run = _run(shape)
    return along(run[:, :2], run[:, 2])[0]


def _run(shape: Shape) -> Floats:
    """Return the points and bulges of a run with its end, (N, 3)."""
    return np.concatenate([shape.ring, shape.ring[:1]]) if shape.closed else shape.ring
