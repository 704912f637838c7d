"""Read the path data of SVG: straight segments and circular arcs."""

import re
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fabweave.verify.drawing import Floats, Ints, ReadError

_NUMBER = r"-?[0-9]+(?:\.[0-9]+)?"
_POINT = f"{_NUMBER},{_NUMBER}"
#: What nearly every path is: runs of absolute points and arcs.
_PLAIN_PATH = re.compile(f"(?:M{_POINT}(?:L{_POINT}|A{_POINT} 0 0 [01] {_POINT})*Z?)+")
_COMMAND = re.compile("[MLAZ]")
_TO_SPACES = str.maketrans("MLAZ,", "     ")
_TOKEN = re.compile(r"[A-Za-z]|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
#: How many numbers follow a command.
_SIZES = {"M": 2, "L": 2, "H": 1, "V": 1, "A": 7}
#: An arc that returns to the beginning of its run comes so near.
_BACK = 1e-9


class Runs(NamedTuple):
    """The runs of a path.

    ``points`` (N, 2) and the ``bulges`` of the sides that leave them, (N,), are those of all
    runs; ``sizes`` and ``closed`` say for each run how many points it has and whether it is
    closed. ``strange`` is the first command that is neither a straight segment's nor a circular
    arc's; empty if there is none. Bulges are as seen with y up.
    """

    points: Floats
    bulges: Floats
    sizes: list[int]
    closed: list[bool]
    strange: str


def path_runs(data: str) -> Runs:
    """Read the runs of a path.

    Examples
    --------
    >>> runs = path_runs("M0,0 L2,0 l0,1 Z M5 5 H6")
    >>> runs.points.tolist(), runs.sizes, runs.closed
    ([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [5.0, 5.0], [6.0, 5.0]], [3, 2], [True, False])
    >>> path_runs("M0,0A1,1 0 0 0 2,0L2,5").bulges.round(9).tolist()
    [1.0, 0.0, 0.0]
    >>> path_runs("M0 0 C1 1 2 2 3 3").strange
    'C'
    """
    if _PLAIN_PATH.fullmatch(data):
        return _plain_runs(data)
    return _any_runs(data)


def _plain_runs(data: str) -> Runs:
    """Read a path of absolute points and arcs, all numbers at once."""
    words = np.array(_COMMAND.findall(data))
    numbers = np.array(list(map(float, data.translate(_TO_SPACES).split())))
    points_at = np.flatnonzero(words != "Z")
    kinds = words[points_at]
    ends = np.cumsum(np.where(kinds == "A", 7, 2))
    points = np.column_stack([numbers[ends - 2], numbers[ends - 1]])
    first = np.flatnonzero(kinds == "M")
    sizes = np.diff(np.append(first, len(kinds)))
    last = points_at[first + sizes - 1] + 1
    closed = np.append(words, "M")[last] == "Z"
    arcs = np.flatnonzero(kinds == "A")
    values = numbers[ends[arcs][:, None] + np.arange(-7, 0)]
    return _with_arcs(points, sizes, closed, arcs, values)


def _with_arcs(
    points: Floats, sizes: Ints, closed: Ints, arcs: Ints, values: Floats, strange: str = ""
) -> Runs:
    """Put arcs into runs; arc ``k`` leads to point ``arcs[k]`` and has the numbers ``values[k]``.

    The numbers are those of the command: two radii, a rotation, two flags and the goal.
    """
    bulges = np.zeros(len(points))
    if len(arcs):
        radius, other, _, large, sweep = values[:, :5].T
        chord = np.hypot(*(points[arcs] - points[arcs - 1]).T)
        if np.any((radius != other) | ~(radius > 0.0)):
            strange = strange or "A with unlike radii"
        elif np.any(chord > 2.0 * radius * (1.0 + 1e-6)):
            strange = strange or "A with too small a radius"
        elif np.any((large != 0.0) & (large != 1.0) | (sweep != 0.0) & (sweep != 1.0)):
            strange = strange or "A with a flag that is none"
        else:
            half = np.arcsin(np.minimum(chord / (2.0 * radius), 1.0))
            half = np.where(large == 1.0, np.pi - half, half)
            # Angles grow from x to y, which points down in the file.
            bulges[arcs - 1] = np.where(sweep == 1.0, -1.0, 1.0) * np.tan(half / 2.0)
    # An arc back to the beginning of a closed run says the first point again.
    last = np.cumsum(sizes) - 1
    begin = last - sizes + 1
    again = closed.astype(bool) & (sizes > 1) & np.isin(last, arcs)
    again &= np.hypot(*(points[last] - points[begin]).T) < _BACK
    kept = np.ones(len(points), dtype=bool)
    kept[last[again]] = False
    return Runs(
        points[kept],
        bulges[kept],
        (sizes - again).tolist(),
        closed.astype(bool).tolist(),
        strange,
    )


@dataclass
class _Walk:
    """What has been read of a path, command by command."""

    points: list[tuple[float, float]] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    closed: list[bool] = field(default_factory=list)
    arcs: list[int] = field(default_factory=list)
    values: list[list[float]] = field(default_factory=list)

    @property
    def beginning(self) -> tuple[float, float]:
        """The first point of the last run."""
        return self.points[-self.sizes[-1]]

    def begin(self, point: tuple[float, float]) -> None:
        """Begin a run."""
        self.points.append(point)
        self.sizes.append(1)
        self.closed.append(False)

    def go(self, point: tuple[float, float]) -> None:
        """Go on to a point; after a closed run, from its beginning."""
        if not self.sizes:
            raise ReadError("a path does not begin with a move")
        if self.closed[-1]:
            self.begin(self.beginning)
        self.points.append(point)
        self.sizes[-1] += 1

    def runs(self, strange: str) -> Runs:
        """Return what was read."""
        return _with_arcs(
            np.array(self.points, dtype=np.float64).reshape(-1, 2),
            np.array(self.sizes, dtype=np.int64),
            np.array(self.closed, dtype=np.int64),
            np.array(self.arcs, dtype=np.int64),
            np.array(self.values, dtype=np.float64).reshape(-1, 7),
            strange,
        )


def _any_runs(data: str) -> Runs:
    """Read a path command by command."""
    tokens = _TOKEN.findall(data)
    walk = _Walk()
    here = (0.0, 0.0)
    command = ""
    at = 0
    while at < len(tokens):
        if tokens[at].isalpha():
            command = tokens[at]
            at += 1
        if command in ("Z", "z"):
            if walk.sizes:
                walk.closed[-1] = True
                here = walk.beginning
            command = ""
            continue
        size = _SIZES.get(command.upper())
        if size is None:
            return walk.runs(command or "none")
        values = _values(tokens[at : at + size], size)
        at += size
        here = _goal(command, values, here)
        if command in "Mm":
            walk.begin(here)
            command = "l" if command == "m" else "L"
            continue
        walk.go(here)
        if command in "Aa":
            walk.arcs.append(len(walk.points) - 1)
            walk.values.append(values)
    return walk.runs("")


def _values(words: list[str], size: int) -> list[float]:
    """Read the numbers of a command."""
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise ReadError(f"a path has a broken number: {error}") from error
    if len(values) < size:
        raise ReadError("a path ends in the middle of a command")
    return values


def _goal(command: str, values: list[float], here: tuple[float, float]) -> tuple[float, float]:
    """Return where a path command leads."""
    base = here if command.islower() else (0.0, 0.0)
    if command in "Hh":
        return base[0] + values[0], here[1]
    if command in "Vv":
        return here[0], base[1] + values[0]
    return base[0] + values[-2], base[1] + values[-1]
