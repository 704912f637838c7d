"""Read a sheet from SVG."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from fabweave.verify.drawing import LAYERS, Drawing, Floats, ReadError, Shape

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
FORBIDDEN = ("transform", "style", "class", "clip-path", "mask")
SILENT = ("defs", "metadata", "title", "desc")

_LENGTH = re.compile(r"\s*([0-9.eE+-]+)\s*mm\s*")
_TOKEN = re.compile(r"[A-Za-z]|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def read_svg(path: Path) -> Drawing:
    """Read the shapes of an SVG file, with y turned up and lengths in millimetres.

    A transform, a style, a shape outside a layer, a curve or an unknown element is kept as a
    problem, because it may change what is cut.

    Raises
    ------
    ReadError
        If the file is not SVG with its size in millimetres.
    """
    try:
        # The file is the user's own job, and expat limits entity expansion.
        root = ET.parse(path).getroot()  # noqa: S314 - as said above
    except ET.ParseError as error:
        raise ReadError(f"it is not well-formed XML: {error}") from error
    if root.tag != f"{SVG}svg":
        raise ReadError(f"its root is {root.tag}, not svg")
    width = _millimetres(root, "width")
    height = _millimetres(root, "height")
    try:
        box = [float(word) for word in root.get("viewBox", "").replace(",", " ").split()]
    except ValueError as error:
        raise ReadError(f"viewBox is not four numbers: {error}") from error
    if len(box) != 4 or box[2] <= 0.0 or box[3] <= 0.0:
        raise ReadError(f"viewBox is not four numbers: {root.get('viewBox')!r}")
    reader = _Reader(np.array(box[:2]), np.array([width / box[2], height / box[3]]), height)
    if abs(reader.scale[0] / reader.scale[1] - 1.0) > 1e-6:
        reader.problems.append(
            f"one unit of the viewBox is {reader.scale[0]:g} mm wide and {reader.scale[1]:g} high"
        )
    reader.read(root, None)
    return Drawing(
        tuple(reader.shapes), tuple(reader.layers), width, height, tuple(reader.problems)
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


class _Reader:
    """Walk the elements and collect shapes, layers and problems."""

    def __init__(self, origin: Floats, scale: Floats, height: float) -> None:
        self.origin = origin
        self.scale = scale
        self.height = height
        self.shapes: list[Shape] = []
        self.layers: list[str] = []
        self.problems: list[str] = []

    def read(self, element: ET.Element, layer: str | None) -> None:
        """Read the children of an element."""
        for name in FORBIDDEN:
            if name in element.attrib:
                self.problems.append(f"<{_plain(element)}> {element.get('id')} has a {name}")
        for child in element:
            kind = _plain(child)
            if kind in SILENT:
                continue
            if kind == "g":
                label = child.get(f"{INKSCAPE}label")
                if child.get(f"{INKSCAPE}groupmode") == "layer" and label is not None:
                    self.layers.append(label)
                    if label not in LAYERS:
                        self.problems.append(f"layer {label!r} is none of {', '.join(LAYERS)}")
                    self.read(child, label)
                else:
                    self.read(child, layer)
                continue
            for name in FORBIDDEN:
                if name in child.attrib:
                    self.problems.append(f"<{kind}> {child.get('id')} has a {name}")
            self._shape(child, kind, layer or "")

    def _shape(self, element: ET.Element, kind: str, layer: str) -> None:
        """Read one shape."""
        name = element.get("id") or f"<{kind}>"
        title = element.find(f"{SVG}title")
        piece = title.text.strip() if title is not None and title.text else None
        if not layer:
            self.problems.append(f"{name} is in no layer")
        if element.get("fill") not in (None, "none"):
            self.problems.append(f"{name} is filled with {element.get('fill')}")
        if kind == "circle":
            values = [_number(element, key) for key in ("cx", "cy", "r")]
            centre = self._place(np.array([values[:2]]))
            radius = values[2] * float(self.scale[0])
            self.shapes.append(Shape(layer, piece, centre, False, radius, None, name))
        elif kind == "line":
            ends = np.array([[_number(element, f"x{n}"), _number(element, f"y{n}")] for n in "12"])
            self.shapes.append(Shape(layer, piece, self._place(ends), False, None, None, name))
        elif kind == "path":
            runs, strange = _path_runs(element.get("d", ""))
            if strange:
                self.problems.append(f"{name} uses the path command {strange}")
            for points, closed in runs:
                self.shapes.append(
                    Shape(layer, piece, self._place(points), closed, None, None, name)
                )
        else:
            self.problems.append(f"{name} is a <{kind}>, which may not be in a cutting file")

    def _place(self, points: Floats) -> Floats:
        """Turn file coordinates to millimetres with y up."""
        result = (points - self.origin) * self.scale
        result[:, 1] = self.height - result[:, 1]
        if not np.all(np.isfinite(result)):
            raise ReadError("a coordinate is not finite")
        return result


def _plain(element: ET.Element) -> str:
    """Return an element's name without its namespace."""
    return str(element.tag).rpartition("}")[2]


def _number(element: ET.Element, name: str) -> float:
    """Read a number from an attribute."""
    try:
        return float(element.get(name, ""))
    except ValueError as error:
        raise ReadError(f"{element.get('id')}: {name} is {element.get(name)!r}") from error


def _path_runs(data: str) -> tuple[list[tuple[Floats, bool]], str]:
    """Read the runs of a path of straight segments; also the first command that is not one.

    Examples
    --------
    >>> runs, strange = _path_runs("M0,0 L2,0 l0,1 Z M5 5 H6")
    >>> [(points.tolist(), closed) for points, closed in runs]
    [([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]], True), ([[5.0, 5.0], [6.0, 5.0]], False)]
    >>> _path_runs("M0 0 C1 1 2 2 3 3")[1]
    'C'
    """
    tokens = _TOKEN.findall(data)
    runs: list[tuple[list[list[float]], bool]] = []
    here = (0.0, 0.0)
    command = ""
    at = 0
    while at < len(tokens):
        if tokens[at].isalpha():
            command = tokens[at]
            at += 1
        if command in ("Z", "z"):
            if runs:
                runs[-1] = (runs[-1][0], True)
                here = (runs[-1][0][0][0], runs[-1][0][0][1])
            command = ""
            continue
        size = {"M": 2, "L": 2, "H": 1, "V": 1}.get(command.upper())
        if size is None:
            return [(np.array(points), closed) for points, closed in runs], command or "none"
        here = _goal(command, tokens[at : at + size], here)
        at += size
        if command in "Mm":
            runs.append(([list(here)], False))
            command = "l" if command == "m" else "L"
        elif not runs:
            raise ReadError("a path does not begin with a move")
        elif runs[-1][1]:
            runs.append(([list(runs[-1][0][0]), list(here)], False))
        else:
            runs[-1][0].append(list(here))
    return [(np.array(points), closed) for points, closed in runs], ""


def _goal(command: str, words: list[str], here: tuple[float, float]) -> tuple[float, float]:
    """Return where a path command leads."""
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise ReadError(f"a path has a broken number: {error}") from error
    base = here if command.islower() else (0.0, 0.0)
    if command in "Hh" and values:
        return base[0] + values[0], here[1]
    if command in "Vv" and values:
        return here[0], base[1] + values[0]
    if len(values) < 2:
        raise ReadError("a path ends in the middle of a command")
    return base[0] + values[0], base[1] + values[1]
