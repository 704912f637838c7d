"""Read a file's bytes, and hold what is read from a sheet's drawing, the same for DXF and SVG."""

import stat
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

#: No file of a job has more bytes: in general, and by the end of its name.
_LARGEST = 1 << 30
_LARGEST_OF = {".toml": 1 << 24, ".txt": 1 << 24, ".csv": 1 << 27, ".png": 1 << 28, ".pdf": 1 << 28}


def too_large(name: str, size: int) -> str:
    """Say that no file of this name has so many bytes in a job; empty if one may."""
    most = _LARGEST_OF.get(Path(name).suffix, _LARGEST)
    return f"it has {size} bytes; such a file of a job has at most {most}" if size > most else ""


def read_content(path: Path) -> bytes:
    """Return what is in a file.

    Raises
    ------
    ReadError
        If it is a device, a pipe or the like, which may have no end, or too large for a job's.
    OSError
        If it cannot be read.
    """
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(f"{path.name} is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise ReadError("it is no regular file")
    if large := too_large(path.name, status.st_size):
        raise ReadError(large)
    return path.read_bytes()


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, line ends as they are; errors as for its content."""
    return read_content(path).decode("utf-8")


Floats: TypeAlias = npt.NDArray[np.float64]
Ints: TypeAlias = npt.NDArray[np.int64]

#: Where arcs are looked at as runs of chords, those stand off by this.
CHORDS_MM = 5e-4
#: A side of a lesser bulge is straight, to all digits that floats have.
_STRAIGHT = 1e-9
#: An arc that needs more chords is wider than any sheet.
_MOST_CHORDS = 20_000.0


def chords_of(points: Floats) -> Floats:
    """Return the vector from each point to the next, from the last to the first."""
    return np.concatenate([points[1:], points[:1]]) - points


def ring_area(ring: Floats) -> float:
    """Return the area in a closed run of points and bulges, positive if counter-clockwise.

    Examples
    --------
    >>> round(ring_area(np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]])), 6)
    3.141593
    """
    points, bulges = ring[:, :2], ring[:, 2]
    x, y = (points - points[0]).T
    straight = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2.0
    chords = np.hypot(*chords_of(points).T)
    bent = np.abs(bulges) > _STRAIGHT
    turn = 4.0 * np.arctan(np.abs(bulges[bent]))
    radius = chords[bent] / (2.0 * np.sin(turn / 2.0))
    # A thin segment's area is two thirds of chord and height; the exact formula loses digits.
    height = np.abs(bulges[bent]) * chords[bent] / 2.0
    caps = np.where(
        turn < 1e-2,
        2.0 / 3.0 * chords[bent] * height * (1.0 + turn**2 / 80.0),
        radius**2 / 2.0 * (turn - np.sin(turn)),
    )
    return float(straight + np.sum(np.sign(bulges[bent]) * caps))


def along(points: Floats, bulges: Floats) -> tuple[Floats, Ints]:
    """Return points along sides from each point to the next, and the point each comes after.

    The last point ends the run, whatever its bulge. Arcs become chords within ``CHORDS_MM``.

    Examples
    --------
    >>> dense, _ = along(np.array([[0.0, 0.0], [2.0, 0.0]]), np.array([1.0, 0.0]))
    >>> dense[:, 1].min().round(3), dense[-1].tolist()
    (np.float64(-1.0), [2.0, 0.0])
    """
    place = points[:, 0] + 1j * points[:, 1]
    goal = np.append(place[1:], place[-1:])
    # What leaves its chord by less than that is straight.
    bent = np.abs(bulges) * np.abs(goal - place) > CHORDS_MM / 100.0
    bent[-1:] = False
    bulge = np.where(bent, bulges, 1.0)
    turn = 4.0 * np.arctan(bulge)
    centre = (place + goal) / 2.0 + 1j * (goal - place) * (1.0 - bulge**2) / (4.0 * bulge)
    radius = np.maximum(np.abs(place - centre), 1e-9)
    widest = 2.0 * np.arccos(np.maximum(1.0 - CHORDS_MM / radius, 0.0))
    steps = np.minimum(np.ceil(np.abs(turn) / widest), _MOST_CHORDS)
    counts = np.where(bent, steps, 1.0).astype(np.int64)
    after = np.repeat(np.arange(len(points)), counts)
    share = (np.arange(len(after)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[after]
    result = place[after]
    curved = bent[after] & (share > 0.0)
    side = after[curved]
    result[curved] = centre[side] + (place[side] - centre[side]) * np.exp(
        1j * share[curved] * turn[side]
    )
    return np.column_stack([result.real, result.imag]), after


def ring_points(ring: Floats) -> Floats:
    """Return points along a closed run of points and bulges; the first is there again at its end.

    Examples
    --------
    >>> ring_points(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]]))[-1].tolist()
    [0.0, 0.0]
    """
    closed = np.concatenate([ring, ring[:1]])
    return along(closed[:, :2], closed[:, 2])[0]


Flags: TypeAlias = npt.NDArray[np.bool_]

ENGRAVE_LAYERS = ("ENGRAVE_LABEL", "ENGRAVE_MARK")
HOLES = "CUT_INNER"
OUTLINES = "CUT_OUTER"
NOTES = "NOTES"
LAYERS = (*ENGRAVE_LAYERS, HOLES, OUTLINES, NOTES)
#: Everything is on this layer of a DXF file for a service.
PLAIN_LAYER = "0"


class ReadError(ValueError):
    """Say what is wrong with a file."""


@dataclass(frozen=True, eq=False)
class Shape:
    """One thing drawn: a run of segments or arcs, or a circle (one point and a radius).

    ``bulges`` holds the tangent of a quarter of each side's turning angle, zero for straight.
    """

    layer: str
    piece: str | None
    name: str
    points: Floats
    bulges: Floats
    closed: bool
    radius: float | None = None

    @property
    def where(self) -> str:
        """How to name the shape in a finding."""
        return self.name if self.piece is None else f"{self.name} of piece {self.piece}"

    @cached_property
    def ring(self) -> Floats:
        """Its points and bulges, (N, 3)."""
        return np.column_stack([self.points, self.bulges])

    @cached_property
    def run(self) -> Floats:
        """Its points and bulges with its end: that of a closed one is its first point again."""
        ring = self.ring
        return np.concatenate([ring, ring[:1]]) if self.closed else ring

    @cached_property
    def traced(self) -> Floats:
        """Points along it, the first repeated at the end of a closed one.

        Circles and arcs become runs of short chords.
        """
        if self.radius is not None:
            angles = np.linspace(0.0, 2.0 * np.pi, 73)
            return self.points[0] + self.radius * np.column_stack([np.cos(angles), np.sin(angles)])
        run = self.run
        return along(run[:, :2], run[:, 2])[0] if self.bulges.any() else run[:, :2]


@dataclass(frozen=True, eq=False)
class Look:
    """How a file says that a layer of DXF is drawn, or ``count`` SVG elements from ``name`` on."""

    layer: str
    stated: dict[str, str]
    name: str = ""
    count: int = 1
    width_mm: float = np.nan


@dataclass(frozen=True, eq=False)
class Drawing:
    """One sheet as read: shapes in file order, y up, millimetres; and what the file declares.

    ``form`` is the version of a DXF file, and what a coordinate of an SVG file counts.
    """

    shapes: tuple[Shape, ...]
    problems: tuple[str, ...]
    layers: tuple[str, ...] = ()
    looks: tuple[Look, ...] = ()
    form: str = ""
    width_mm: float | None = None
    height_mm: float | None = None

    @cached_property
    def groups(self) -> dict[tuple[str, str | None], list[Shape]]:
        """The shapes of each layer and piece, in file order."""
        groups: dict[tuple[str, str | None], list[Shape]] = {}
        for shape in self.shapes:
            groups.setdefault((shape.layer, shape.piece), []).append(shape)
        return groups

    def of(self, layer: str, piece: str | None) -> list[Shape]:
        """Return the shapes that a piece has on a layer, in file order."""
        return self.groups.get((layer, piece), [])


def corners_apart(one: Floats, two: Floats) -> float:
    """Return the greatest distance of corresponding corners; infinite for unlike polygons."""
    return float(np.abs(one - two).max()) if one.shape == two.shape else np.inf
