"""Read a sheet from SVG: the elements, attributes and path data that our sheets have."""

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from fabweave.verify.drawing import LAYERS, Drawing, Floats, Look, ReadError, Shape, read_content

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
_LOOK = ("stroke", "stroke-width")
_SHAPE = {"id", "fill", *_LOOK}
#: What an element says of its look: names of attributes and their values.
_Stated: TypeAlias = tuple[tuple[str, str], ...]
#: The elements that our sheets need, and their attributes: others may change what is drawn.
ALLOWED = {
    "svg": {"version", "width", "height", "viewBox"},
    "g": {"id", f"{INKSCAPE}groupmode", f"{INKSCAPE}label"},
    "title": set(),
    "path": _SHAPE | {"d"},
    "circle": _SHAPE | {"cx", "cy", "r"},
    "line": _SHAPE | {"x1", "y1", "x2", "y2"},
}

#: What a coordinate may count, by its length in millimetres.
_UNITS = {"mm": 1.0, "px96": 25.4 / 96.0}

_LENGTH = re.compile(r"\s*([0-9.eE+-]+)\s*mm\s*")
_NUMBER = r"-?[0-9]+(?:\.[0-9]+)?"
_POINT = f"{_NUMBER},{_NUMBER}"
#: What every path is: runs of absolute points and arcs.
_PATH = re.compile(f"(?:M{_POINT}(?:L{_POINT}|A{_POINT} 0 0 [01] {_POINT})*Z?)+")
_COMMAND = re.compile("[MLAZ]")
_TO_SPACES = str.maketrans("MLAZ,", "     ")
#: An arc that returns to the beginning of its run comes so near.
_BACK = 1e-9


class Runs(NamedTuple):
    """The runs of a path.

    ``points`` (N, 2) and the ``bulges`` of the sides that leave them, (N,), are those of all
    runs; ``sizes`` and ``closed`` say for each run how many points it has and whether it is
    closed. Bulges are as seen with y up.
    """

    points: Floats
    bulges: Floats
    sizes: list[int]
    closed: list[bool]


def read_svg(path: Path, *, layered: bool = True) -> Drawing:
    """Read the shapes of an SVG file, with y turned up and lengths in millimetres.

    ``layered`` says whether it must have the layers of a sheet, or none.

    A shape outside a layer, and any element or attribute that our sheets do not need (transforms,
    styles, masks, animations, …) is kept as a problem, because it may change what is cut.

    Raises
    ------
    ReadError
        If the file is not SVG with its size in millimetres, or a shape cannot be understood.
    """
    try:
        # The file is the user's own job, and expat limits entity expansion.
        tree = _Tree()
        root = ET.fromstring(  # noqa: S314 - as said above
            read_content(path),
            ET.XMLParser(target=tree),  # noqa: S314
        )
    except ET.ParseError as error:
        raise ReadError(f"it is not well-formed XML: {error}") from error
    if root.tag != f"{SVG}svg":
        raise ReadError(f"its root is {root.tag}, not svg")
    size = np.array([_millimetres(root, name) for name in ("width", "height")])
    try:
        box = np.array(root.get("viewBox", "").split(), dtype=np.float64)
    except ValueError as error:
        raise ReadError(f"viewBox is not four numbers: {error}") from error
    if len(box) != 4 or not np.all(box[2:] > 0.0):
        raise ReadError(f"viewBox is not four numbers: {root.get('viewBox')!r}")
    scale = size / box[2:]
    reader = _Reader(LAYERS if layered else ("",), box[:2], scale, float(size[1]))
    # Sizes have four decimals.
    if abs(scale[0] / scale[1] - 1.0) > 1e-6 + 1e-4 / box[2:].min() + 1e-4 / size.min():
        reader.problems.append(
            f"one unit of the viewBox is {scale[0]:g} mm wide and {scale[1]:g} high"
        )
    reader.problems += [f"there is a {what} beside its elements" for what in tree.beside]
    reader.judge(root, "svg")
    reader.read(root, None)
    return Drawing(
        shapes=tuple(reader.shapes),
        problems=tuple(reader.problems),
        layers=tuple(reader.layers),
        looks=tuple(
            Look(layer, dict(stated), names[0], len(names), reader.width_mm(dict(stated)))
            for (layer, stated), names in reader.looks.items()
        ),
        form=next(
            (name for name, mm in _UNITS.items() if abs(scale[0] / mm - 1.0) < 1e-4),
            f"{scale[0]:g} mm",
        ),
        width_mm=float(size[0]),
        height_mm=float(size[1]),
    )


def _millimetres(root: ET.Element, name: str) -> float:
    """Read a length of the root element."""
    match = _LENGTH.fullmatch(root.get(name, ""))
    try:
        value = float(match.group(1)) if match else float("nan")
    except ValueError:
        value = float("nan")
    if not (np.isfinite(value) and value > 0.0):
        raise ReadError(f"{name} is {root.get(name)!r}, not a length in mm")
    return value


class _Tree(ET.TreeBuilder):
    """Build the tree, and keep what may change how it is drawn and is no part of it."""

    def __init__(self) -> None:
        super().__init__()
        self.beside: list[str] = []

    def pi(self, target: str, text: str | None = None) -> ET.Element:
        """Keep a processing instruction, such as one that names a style sheet."""
        self.beside.append(f"<?{target}?>")
        return super().pi(target, text)

    def doctype(self, name: str, *_: object) -> None:
        """Keep a document type, which may give attributes to elements."""
        self.beside.append(f"<!DOCTYPE {name}>")


@dataclass
class _Reader:
    """Walk the elements and collect shapes on their sheet, layers and problems."""

    known: tuple[str, ...]
    corner: Floats
    scale: Floats
    high_mm: float
    shapes: list[Shape] = field(default_factory=list)
    layers: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    #: The elements of each layer that look alike, by name.
    looks: dict[tuple[str, _Stated], list[str]] = field(default_factory=dict)

    def width_mm(self, stated: dict[str, str]) -> float:
        """Return how wide lines are; not a number if their width is none."""
        try:
            return float(stated["stroke-width"]) * float(self.scale[0])
        except (KeyError, ValueError):
            return float("nan")

    def read(self, element: ET.Element, layer: str | None) -> None:
        """Read the children of an element."""
        for child in element:
            kind = str(child.tag).removeprefix(SVG)
            self.judge(child, kind)
            if kind == "g":
                label = child.get(f"{INKSCAPE}label", "")
                if layer is not None or child.get(f"{INKSCAPE}groupmode") != "layer":
                    self.problems.append(f"<g> {child.get('id')} is no layer, or within one")
                else:
                    self.layers.append(label)
                    if label not in self.known:
                        self.problems.append(f"layer {label!r} is none of {', '.join(self.known)}")
                    if child.get("id") != label:
                        self.problems.append(f"layer {label!r} has the id {child.get('id')!r}")
                self.read(child, layer or label)
            elif kind in ("path", "circle", "line"):
                self._shape(child, kind, layer or "")
            elif kind != "title":
                self.problems.append(f"there is a <{kind}>, which may not be in a cutting file")

    def judge(self, element: ET.Element, kind: str) -> None:
        """Keep what an element has beside what our sheets need."""
        named = f"<{kind}> {element.get('id')}"
        for name in sorted({*element.attrib} - ALLOWED.get(kind, {*element.attrib})):
            self.problems.append(f"{named} has a {name.rpartition('}')[2]}")
        if kind not in ("svg", "g") and any(child.tag != f"{SVG}title" for child in element):
            self.problems.append(f"{named} has elements in it")

    def _shape(self, element: ET.Element, kind: str, layer: str) -> None:
        """Read one shape."""
        name = element.get("id") or f"<{kind}>"
        title = element.find(f"{SVG}title")
        piece = title.text.strip() if title is not None and title.text else None
        if not layer and layer not in self.known:
            self.problems.append(f"{name} is in no layer")
        if element.get("fill") != "none":
            self.problems.append(f"{name} is filled with {element.get('fill', 'black')}")
        stated = tuple((key, element.attrib[key]) for key in _LOOK if key in element.attrib)
        self.looks.setdefault((layer, stated), []).append(name)
        radius = None
        if kind == "path":
            runs = path_runs(element.get("d", ""))
        else:
            ends = (("cx", "cy"),) if kind == "circle" else (("x1", "y1"), ("x2", "y2"))
            points = np.array([[_number(element, key) for key in end] for end in ends])
            runs = Runs(points, np.zeros(len(points)), [len(points)], [False])
            radius = _number(element, "r") * float(self.scale[0]) if kind == "circle" else None
        if kind == "path" and 1 in runs.sizes:
            self.problems.append(f"{name} has a run of a single point")
        points = (runs.points - self.corner) * self.scale
        points[:, 1] = self.high_mm - points[:, 1]
        if not np.all(np.isfinite(points)):
            raise ReadError("a coordinate is not finite")
        ends_at = np.cumsum(runs.sizes)[:-1]
        parts = np.split(points, ends_at), np.split(runs.bulges, ends_at), runs.closed
        for run, bulges, closed in zip(*parts, strict=True):
            self.shapes.append(Shape(layer, piece, name, run, bulges, closed, radius))


def _number(element: ET.Element, name: str) -> float:
    """Read a number from an attribute."""
    try:
        value = float(element.get(name, ""))
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise ReadError(f"{element.get('id')}: {name} is {element.get(name)!r}")
    return value


def path_runs(data: str) -> Runs:
    """Read the runs of a path of absolute points and circular arcs, all numbers at once.

    Raises
    ------
    ReadError
        If there is anything else in it, or an arc that no circle has.

    Examples
    --------
    >>> runs = path_runs("M0,0L2,0L2,1ZM5,5L6,5")
    >>> runs.points.tolist(), runs.sizes, runs.closed
    ([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [5.0, 5.0], [6.0, 5.0]], [3, 2], [True, False])
    >>> path_runs("M0,0A1,1 0 0 0 2,0L2,5").bulges.round(9).tolist()
    [1.0, 0.0, 0.0]
    """
    if not _PATH.fullmatch(data):
        raise ReadError(f"a path is not of absolute points and arcs: {data:.40}")
    words = np.array(_COMMAND.findall(data))
    numbers = np.array(list(map(float, data.translate(_TO_SPACES).split())))
    points_at = np.flatnonzero(words != "Z")
    kinds = words[points_at]
    ends = np.cumsum(np.where(kinds == "A", 7, 2))
    points = np.column_stack([numbers[ends - 2], numbers[ends - 1]])
    first = np.flatnonzero(kinds == "M")
    sizes = np.diff(np.append(first, len(kinds)))
    last = first + sizes - 1
    closed = np.append(words, "M")[points_at[last] + 1] == "Z"
    arcs = np.flatnonzero(kinds == "A")
    # The numbers of an arc: two radii, a rotation, two flags (none is half a turn), and the goal.
    radius, other, _, _, sweep = numbers[ends[arcs][:, None] + np.arange(-7, -2)].T
    chord = np.hypot(*(points[arcs] - points[arcs - 1]).T)
    if np.any((radius != other) | ~(radius > 0.0) | (chord > 2.0 * radius * (1.0 + 1e-6))):
        raise ReadError("a path has an arc with unlike radii, or with one that is too small")
    half = np.arcsin(np.minimum(chord / (2.0 * radius), 1.0))
    bulges = np.zeros(len(points))
    # Angles grow from x to y, which points down in the file.
    bulges[arcs - 1] = np.where(sweep == 1.0, -1.0, 1.0) * np.tan(half / 2.0)
    # An arc back to the beginning of a closed run says the first point again.
    again = closed & (sizes > 1) & (kinds[last] == "A")
    again &= np.hypot(*(points[last] - points[first]).T) < _BACK
    kept = np.ones(len(points), dtype=bool)
    kept[last[again]] = False
    return Runs(points[kept], bulges[kept], (sizes - again).tolist(), closed.tolist())
