"""Hold what is read from a sheet's drawing, the same for DXF and SVG."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
Ints: TypeAlias = npt.NDArray[np.int64]
Flags: TypeAlias = npt.NDArray[np.bool_]

ENGRAVE_LAYERS = ("ENGRAVE_LABEL", "ENGRAVE_MARK")
HOLES = "CUT_INNER"
OUTLINES = "CUT_OUTER"
NOTES = "NOTES"
LAYERS = (*ENGRAVE_LAYERS, HOLES, OUTLINES, NOTES)


class ReadError(ValueError):
    """Say what is wrong with a file."""


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


@dataclass(frozen=True, eq=False)
class Drawing:
    """One sheet as read: shapes in file order, y up, millimetres; and what the file declares.

    Shapes are held as columns, since a sheet has many thousands. Points and bulges of shape ``k``
    are those from ``start[k]`` to ``start[k + 1]``; there is at least one point. The radius of
    what is no circle is NaN.
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
    def bent(self) -> Flags:
        """Whether each shape has an arc."""
        owner = np.repeat(np.arange(len(self.sizes)), self.sizes)
        return np.bincount(owner[self.bulges != 0.0], minlength=len(self.sizes)) > 0

    @cached_property
    def curved(self) -> Flags:
        """Whether each shape is a circle or has an arc."""
        return ~np.isnan(self.radius) | self.bent

    @cached_property
    def lengths(self) -> Floats:
        """The length of each shape."""
        every = np.arange(len(self.sizes))
        straight = every[~self.curved]
        result = np.zeros(len(every))
        points, owner = self.traced(straight)
        chords = np.hypot(*np.diff(points, axis=0).T)
        within = owner[1:] == owner[:-1]
        result[straight] = np.bincount(owner[1:][within], chords[within], len(straight))
        result[self.curved] = [length_of(self.shape(at)) for at in every[self.curved].tolist()]
        return result

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Every shape by itself."""
        return tuple(self.shape(at) for at in range(len(self.sizes)))

    def shape(self, at: int) -> Shape:
        """Return one shape by itself."""
        own = slice(int(self.start[at]), int(self.start[at + 1]))
        radius = None if np.isnan(self.radius[at]) else float(self.radius[at])
        return Shape(
            layer=self.layer[at],
            piece=self.piece[at],
            points=self.points[own],
            closed=bool(self.closed[at]),
            radius=radius,
            bulges=self.bulges[own] if np.any(self.bulges[own]) else None,
            name=self.name[at],
        )

    def points_of(self, shapes: Ints) -> Floats:
        """Return the points of some shapes one after another."""
        sizes = self.sizes[shapes]
        shift = np.repeat(self.start[shapes] - (np.cumsum(sizes) - sizes), sizes)
        return self.points[shift + np.arange(len(shift))]

    def traced(self, shapes: Ints) -> tuple[Floats, Ints]:
        """Return points along some shapes as `traced` does, and the place in the list of each."""
        if np.any(self.curved[shapes]):
            runs = [traced(self.shape(at)) for at in shapes.tolist()]
            return np.concatenate(runs), np.repeat(np.arange(len(runs)), [len(run) for run in runs])
        sizes = self.sizes[shapes]
        steps = sizes + self.closed[shapes]
        owner = np.repeat(np.arange(len(shapes)), steps)
        place = np.arange(len(owner)) - (np.cumsum(steps) - steps)[owner]
        # The point after the last of a closed run is its first.
        return self.points[self.start[shapes][owner] + place % sizes[owner]], owner


def sides(shape: Shape) -> Floats:
    """Return the vector of each side of a run, (N, 2); a closed run's last side returns."""
    points = shape.points
    ends = np.roll(points, -1, axis=0) if shape.closed else points[1:]
    return ends - points[: len(ends)]


def bulge_height(shape: Shape) -> float:
    """Return how far the arcs of a run leave its chords at most."""
    if shape.bulges is None or not np.any(shape.bulges):
        return 0.0
    chords = np.hypot(*sides(shape).T)
    return float(np.max(np.abs(shape.bulges[: len(chords)]) * chords / 2.0, initial=0.0))


def length_of(shape: Shape) -> float:
    """Return the length of a shape.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> length_of(Shape("NOTES", None, square, True, None, None, ""))
    8.0
    >>> round(length_of(Shape("NOTES", None, square[:2], True, None, np.ones(2), "")), 6)
    6.283185
    """
    if shape.radius is not None:
        return float(2.0 * np.pi * shape.radius)
    chords = np.hypot(*sides(shape).T)
    if shape.bulges is not None:
        bent = np.abs(shape.bulges[: len(chords)])
        turned = 4.0 * np.arctan(bent)
        stretch = np.where(bent > 0.0, turned * (1.0 + bent**2) / np.maximum(4.0 * bent, 1e-30), 1)
        chords = chords * stretch
    return float(np.sum(chords))


def traced(shape: Shape) -> Floats:
    """Return points along a shape, the first repeated at the end of a closed one.

    Circles and arcs become runs of short chords.
    """
    if shape.radius is not None:
        angles = np.linspace(0.0, 2.0 * np.pi, 73)
        return shape.points[0] + shape.radius * np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.vstack([shape.points, shape.points[:1]]) if shape.closed else shape.points
    if shape.bulges is None or not np.any(shape.bulges):
        return points
    pieces = [points[:1]]
    for start, end, bulge in zip(points[:-1], points[1:], shape.bulges, strict=False):
        steps = np.linspace(0.0, 1.0, 17 if bulge else 2)[1:, None]
        if bulge:
            a, b = complex(*start), complex(*end)
            centre = (a + b) / 2.0 + 1j * (b - a) * (1.0 - bulge**2) / (4.0 * bulge)
            arc = centre + (a - centre) * np.exp(1j * steps[:, 0] * 4.0 * np.arctan(bulge))
            pieces.append(np.column_stack([arc.real, arc.imag]))
        else:
            pieces.append(start + steps * (end - start))
    return np.vstack(pieces)
