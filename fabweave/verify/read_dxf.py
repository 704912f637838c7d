"""Read a sheet from DXF group codes, independently of any DXF library."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fabweave.verify.drawing import LAYERS, Drawing, Floats, ReadError, Shape

Group: TypeAlias = tuple[int, str]
Entity: TypeAlias = tuple[str, list[Group]]

APPID = "FABWEAVE"
R12 = "AC1009"
DRAWN = ("LWPOLYLINE", "POLYLINE", "CIRCLE", "LINE")


def read_dxf(path: Path) -> Drawing:
    """Read the entities of a DXF file's model space and judge its declarations.

    Only LWPOLYLINE, POLYLINE, CIRCLE and LINE are drawn; anything else, an unknown layer, another
    unit than millimetres, a mirrored extrusion or untrue extents is kept as a problem.

    Raises
    ------
    ReadError
        If the file is not a complete DXF text file.
    """
    groups = _groups(path)
    sections = _sections(groups)
    header = _header(sections.get("HEADER", []))
    if "ENTITIES" not in sections:
        raise ReadError("there is no ENTITIES section")
    shapes: list[Shape] = []
    problems = _unit_problems(header)
    entities = list(_entities(sections["ENTITIES"]))
    at = 0
    while at < len(entities):
        kind, body = entities[at]
        vertices: list[list[Group]] = []
        at += 1
        while at < len(entities) and entities[at][0] in ("VERTEX", "SEQEND"):
            if entities[at][0] == "VERTEX":
                vertices.append(entities[at][1])
            at += 1
        name = f"{kind} {next((value for code, value in body if code == 5), at)}"
        if kind not in DRAWN:
            problems.append(f"{name} may not be in a cutting file")
            continue
        shape, flaw = _shape(kind, name, body, vertices)
        shapes.append(shape)
        problems.extend(flaw)
    problems.extend(_extent_problems(header, shapes))
    layers = tuple(
        value
        for kind, body in _entities(sections.get("TABLES", []))
        if kind == "LAYER"
        for code, value in body
        if code == 2
    )
    return Drawing(tuple(shapes), layers, None, None, tuple(problems))


def _groups(path: Path) -> list[Group]:
    """Read pairs of group code and value."""
    text = path.read_bytes().decode("utf-8", errors="replace").replace("\r\n", "\n")
    lines = text.split("\n")
    try:
        codes = [int(line) for line in lines[0:-1:2]]
    except ValueError as error:
        raise ReadError(f"a line that should be a group code is not a number: {error}") from error
    groups = list(zip(codes, (line.strip() for line in lines[1::2]), strict=False))
    if not groups or groups[-1] != (0, "EOF"):
        raise ReadError("the file does not end with EOF: it is truncated")
    return groups


def _sections(groups: Sequence[Group]) -> dict[str, list[Group]]:
    """Split the groups by section."""
    sections: dict[str, list[Group]] = {}
    current: list[Group] | None = None
    opened = False
    for code, value in groups:
        if code == 0 and value == "SECTION":
            opened = True
        elif code == 0 and value == "ENDSEC":
            current = None
        elif opened and code == 2:
            current = sections.setdefault(value, [])
            opened = False
        elif current is not None:
            current.append((code, value))
    return sections


def _header(groups: Sequence[Group]) -> dict[str, dict[int, str]]:
    """Read the header variables."""
    header: dict[str, dict[int, str]] = {}
    values: dict[int, str] = {}
    for code, value in groups:
        if code == 9:
            values = header.setdefault(value, {})
        else:
            values[code] = value
    return header


def _entities(groups: Sequence[Group]) -> Iterator[Entity]:
    """Split groups at each code 0."""
    body: list[Group] | None = None
    kind = ""
    for code, value in groups:
        if code == 0:
            if body is not None:
                yield kind, body
            kind, body = value, []
        elif body is not None:
            body.append((code, value))
    if body is not None:
        yield kind, body


class _Values:
    """The values of one entity by group code, and its piece from the extended data."""

    def __init__(self, body: Sequence[Group], name: str) -> None:
        self.name = name
        self.by_code: dict[int, list[str]] = {}
        self.piece: str | None = None
        ours = False
        for code, value in body:
            if code < 1000:
                self.by_code.setdefault(code, []).append(value)
            elif code == 1001:
                ours = value == APPID
            elif ours and code == 1000 and self.piece is None:
                self.piece = value

    def text(self, code: int) -> str:
        """Return the first value, or nothing."""
        return self.by_code.get(code, [""])[0]

    def numbers(self, code: int) -> list[float]:
        """Return all values as numbers."""
        try:
            return [float(value) for value in self.by_code.get(code, ())]
        except ValueError as error:
            raise ReadError(f"{self.name}: group {code} is not a number: {error}") from error

    def number(self, code: int, default: float | None = None) -> float:
        """Return the first value as a number."""
        values = self.numbers(code)
        if values:
            return values[0]
        if default is None:
            raise ReadError(f"{self.name}: group {code} is missing")
        return default


def _shape(
    kind: str, name: str, body: list[Group], vertices: list[list[Group]]
) -> tuple[Shape, list[str]]:
    """Read one entity and say what is wrong with it."""
    values = _Values(body, name)
    layer = values.text(8)
    bulges = None
    radius = None
    x, y = values.numbers(10), values.numbers(20)
    if kind == "LWPOLYLINE":
        bulges = _lw_bulges(body) if 42 in values.by_code else None
    elif kind == "POLYLINE":
        corners = [_Values(vertex, name) for vertex in vertices]
        x, y = [c.number(10) for c in corners], [c.number(20) for c in corners]
        bulges = np.array([c.number(42, 0.0) for c in corners])
    elif kind == "CIRCLE":
        radius = values.number(40)
    else:
        x, y = x + values.numbers(11), y + values.numbers(21)
    least = 1 if kind == "CIRCLE" else 2
    if len(x) != len(y) or len(x) < least:
        raise ReadError(f"{name} has {len(x)} x and {len(y)} y coordinates")
    points = np.array([x, y], dtype=np.float64).T
    if not np.all(np.isfinite(points)) or not np.isfinite(radius or 0.0):
        raise ReadError(f"{name} has a coordinate that is not finite")
    closed = kind in ("LWPOLYLINE", "POLYLINE") and bool(int(values.number(70, 0.0)) & 1)
    shape = Shape(layer, values.piece, points, closed, radius, bulges, name)
    flaws = []
    if layer not in LAYERS:
        flaws.append(f"{shape.where} is on layer {layer!r}, which is none of {', '.join(LAYERS)}")
    if any(z < 0.0 for z in values.numbers(230)):
        flaws.append(f"{shape.where} is mirrored by its extrusion direction")
    if values.number(67, 0.0) == 1.0:
        flaws.append(f"{shape.where} is in paper space")
    return shape, flaws


def _lw_bulges(body: Sequence[Group]) -> Floats:
    """Read the bulge that follows each vertex of an LWPOLYLINE."""
    bulges: list[float] = []
    for code, value in body:
        if code == 10:
            bulges.append(0.0)
        elif code == 42 and bulges:
            try:
                bulges[-1] = float(value)
            except ValueError as error:
                raise ReadError(f"a bulge is not a number: {error}") from error
    return np.array(bulges)


def _unit_problems(header: dict[str, dict[int, str]]) -> list[str]:
    """Judge version and units."""
    version = header.get("$ACADVER", {}).get(1, "")
    problems = []
    for name, wanted in (("$INSUNITS", "4"), ("$MEASUREMENT", "1")):
        value = header.get(name, {}).get(70)
        # R12 knows neither variable.
        if (value is None and version != R12) or (value is not None and value != wanted):
            problems.append(f"{name} is {value}; it must be {wanted} for millimetres")
    return problems


def _extent_problems(header: dict[str, dict[int, str]], shapes: Sequence[Shape]) -> list[str]:
    """Judge whether the declared extents hold the drawing."""
    if not shapes:
        return []
    try:
        low = np.array([float(header["$EXTMIN"][code]) for code in (10, 20)])
        high = np.array([float(header["$EXTMAX"][code]) for code in (10, 20)])
    except (KeyError, ValueError):
        return ["$EXTMIN and $EXTMAX are missing or not numbers"]
    reach = np.array([shape.radius or 0.0 for shape in shapes])
    true_low = np.min(
        [s.points.min(axis=0) - r for s, r in zip(shapes, reach, strict=True)], axis=0
    )
    true_high = np.max(
        [s.points.max(axis=0) + r for s, r in zip(shapes, reach, strict=True)], axis=0
    )
    if np.any(low > true_low + 0.01) or np.any(high < true_high - 0.01):
        return [
            f"$EXTMIN {low.tolist()} and $EXTMAX {high.tolist()} do not hold the drawing, which "
            f"reaches from {true_low.round(3).tolist()} to {true_high.round(3).tolist()}"
        ]
    return []
