"""Read a sheet from SVG."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from fabweave.verify.drawing import LAYERS, Drawing, Floats, Look, ReadError
from fabweave.verify.read.content import read_content
from fabweave.verify.read.svg_paths import path_runs

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
#: The elements that our sheets need, and their attributes: others may change what is drawn.
ALLOWED = {
    "svg": {"version", "width", "height", "viewBox"},
    "g": {"id", f"{INKSCAPE}groupmode", f"{INKSCAPE}label"},
    "title": set(),
    "path": {"id", "fill", "stroke", "stroke-width", "d"},
    "circle": {"id", "fill", "stroke", "stroke-width", "cx", "cy", "r"},
    "line": {"id", "fill", "stroke", "stroke-width", "x1", "y1", "x2", "y2"},
}

_LENGTH = re.compile(r"\s*([0-9.eE+-]+)\s*mm\s*")


def read_svg(path: Path, *, layered: bool = True) -> Drawing:
    """Read the shapes of an SVG file, with y turned up and lengths in millimetres.

    ``layered`` says whether it must have the layers of a sheet, or none.

    A shape outside a layer, a curve, and any element or attribute that our sheets do not need
    (transforms, styles, masks, animations, …) is kept as a problem, because it may change what is
    cut.

    Raises
    ------
    ReadError
        If the file is not SVG with its size in millimetres.
    """
    try:
        # The file is the user's own job, and expat limits entity expansion.
        parser = ET.XMLParser(target=_Builder())  # noqa: S314 - as said above
        root = ET.fromstring(read_content(path), parser)  # noqa: S314 - the same
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
    size = np.array([width, height])
    reader = _Reader(np.array(box[:2]), size / np.array(box[2:]), size, layered=layered)
    if abs(reader.scale[0] / reader.scale[1] - 1.0) > 1e-6:
        reader.problems.append(
            f"one unit of the viewBox is {reader.scale[0]:g} mm wide and {reader.scale[1]:g} high"
        )
    reader.judge(root, "svg")
    reader.read(root, None)
    return reader.drawing()


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


class _Builder(ET.TreeBuilder):
    """Builds the tree of a file that does not tell programs to look elsewhere."""

    def doctype(self, *_said: object) -> None:
        """Refuse declarations: they may add attributes, and name entities."""
        raise ReadError("it has a DOCTYPE, which may change what is drawn")

    def pi(self, target: str, text: str | None = None) -> ET.Element:
        """Refuse instructions, such as those that name a stylesheet."""
        raise ReadError(f"it has a processing instruction <?{target} {text or ''}?>")


class _Reader:
    """Walk the elements and collect shapes, layers and problems."""

    def __init__(self, origin: Floats, scale: Floats, size: Floats, *, layered: bool) -> None:
        self.known = LAYERS if layered else ("",)
        self.origin = origin
        self.scale = scale
        self.size = size
        self.owners: list[tuple[str, str | None, str]] = []
        self.points: list[Floats] = [np.zeros((0, 2))]
        self.bulges: list[Floats] = [np.zeros(0)]
        self.sizes: list[int] = []
        self.closed: list[bool] = []
        self.radius: list[float] = []
        self.layers: list[str] = []
        self.looks: dict[str, set[Look]] = {}
        self.problems: list[str] = []

    def drawing(self) -> Drawing:
        """Return what was collected, in millimetres with y up."""
        points = (np.concatenate(self.points) - self.origin) * self.scale
        points[:, 1] = self.size[1] - points[:, 1]
        if not np.all(np.isfinite(points)):
            raise ReadError("a coordinate is not finite")
        return Drawing(
            layer=[layer for layer, _, _ in self.owners],
            piece=[piece for _, piece, _ in self.owners],
            name=[name for _, _, name in self.owners],
            points=points,
            bulges=np.concatenate(self.bulges),
            start=np.concatenate([[0], np.cumsum(self.sizes, dtype=np.int64)]),
            closed=np.array(self.closed, dtype=bool),
            radius=np.array(self.radius, dtype=np.float64) * float(self.scale[0]),
            layers=tuple(self.layers),
            width_mm=float(self.size[0]),
            height_mm=float(self.size[1]),
            problems=tuple(self.problems),
            looks={layer: frozenset(looks) for layer, looks in self.looks.items()},
            unit_mm=float(self.scale[0]),
        )

    def read(self, element: ET.Element, layer: str | None) -> None:
        """Read the children of an element."""
        for child in element:
            kind = _plain(child)
            self.judge(child, kind)
            if kind == "title":
                if len(child):
                    self.problems.append("<title> has elements in it")
            elif kind == "g":
                label = child.get(f"{INKSCAPE}label")
                if layer is not None:
                    self.problems.append(f"a group is within layer {layer!r}")
                elif child.get(f"{INKSCAPE}groupmode") == "layer" and label is not None:
                    self.layers.append(label)
                    if label not in self.known:
                        self.problems.append(f"layer {label!r} is none of {', '.join(self.known)}")
                else:
                    self.problems.append(f"<g> {child.get('id')} is no layer")
                self.read(child, label if layer is None else layer)
            else:
                self._shape(child, kind, layer or "")

    def judge(self, element: ET.Element, kind: str) -> None:
        """Keep what an element has beside what our sheets need."""
        for name in sorted({*element.attrib} - ALLOWED.get(kind, {*element.attrib})):
            short = name.rpartition("}")[2]
            self.problems.append(f"<{kind}> {element.get('id')} has a {short}")
        if kind in ALLOWED and element.tag != SVG + kind:
            self.problems.append(f"<{kind}> {element.get('id')} is not of SVG's namespace")
        if kind != "title" and any(
            text and not text.isspace() for text in (element.text, element.tail)
        ):
            self.problems.append(f"<{kind}> {element.get('id')} has text beside it or in it")

    def _shape(self, element: ET.Element, kind: str, layer: str) -> None:
        """Read one shape."""
        name = element.get("id") or f"<{kind}>"
        title = element.find(f"{SVG}title")
        piece = title.text.strip() if title is not None and title.text else None
        if not layer and layer not in self.known:
            self.problems.append(f"{name} is in no layer")
        if element.get("fill") != "none":
            self.problems.append(f"{name} is filled with {element.get('fill', 'black')}")
        if any(_plain(child) != "title" for child in element):
            self.problems.append(f"{name} has elements in it")
        owner = (layer, piece, name)
        width = element.get("stroke-width")
        wide = None if width is None else _number(element, "stroke-width") * float(self.scale[0])
        look = Look(element.get("stroke"), None, wide)
        self.looks.setdefault(layer, set()).add(look)
        if kind == "circle":
            x, y, radius = (_number(element, key) for key in ("cx", "cy", "r"))
            self._add(owner, np.array([[x, y]]), [1], [False], radius)
        elif kind == "line":
            ends = np.array([[_number(element, f"x{n}"), _number(element, f"y{n}")] for n in "12"])
            self._add(owner, ends, [2], [False])
        elif kind == "path":
            points, bulges, sizes, closed, strange = path_runs(element.get("d", ""))
            if strange:
                self.problems.append(f"{name} uses the path command {strange}")
            if 1 in sizes:
                self.problems.append(f"{name} has a run of a single point")
            self._add(owner, points, sizes, closed, bulges=bulges)
        else:
            self.problems.append(f"{name} is a <{kind}>, which may not be in a cutting file")

    def _add(
        self,
        owner: tuple[str, str | None, str],
        points: Floats,
        sizes: list[int],
        closed: list[bool],
        radius: float = float("nan"),
        bulges: Floats | None = None,
    ) -> None:
        """Keep shapes in file coordinates."""
        self.points.append(points)
        self.bulges.append(np.zeros(len(points)) if bulges is None else bulges)
        self.owners.extend([owner] * len(sizes))
        self.sizes.extend(sizes)
        self.closed.extend(closed)
        self.radius.extend([radius] * len(sizes))


def _plain(element: ET.Element) -> str:
    """Return an element's name without its namespace."""
    return str(element.tag).rpartition("}")[2]


def _number(element: ET.Element, name: str) -> float:
    """Read a number from an attribute."""
    try:
        value = float(element.get(name, ""))
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise ReadError(f"{element.get('id')}: {name} is {element.get(name)!r}")
    return value
