"""Read a sheet from DXF group codes, independently of any DXF library."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fabweave.verify.drawing import LAYERS, Drawing, Look, ReadError, Shape, read_content

APPID = "FABWEAVE"
R12 = "AC1009"
DRAWN = ("LWPOLYLINE", "POLYLINE", "CIRCLE", "LINE")
#: The groups that entities may have; any other, as an extrusion has, may change what is cut.
_GROUPS = {0, 5, 8, 10, 11, 20, 21, 30, 31, 40, 42, 43, 66, 70, 90, 100, 330, 1000, 1001}
#: What some groups may hold: heights above the sheet, the width of lines, open or closed.
_FLAT = "a width, or a height above the sheet", (0.0,)
_HELD = {
    30: _FLAT, 31: _FLAT, 43: _FLAT, 70: ("flags that are not open or closed", (0.0, 1.0)),
}  # fmt: skip

#: What a layer's groups say of its lines, and those that say nothing of them.
_LOOKS = {6: "line type", 62: "colour", 370: "line width", 420: "true colour"}
_LAYER_GROUPS = {2, 5, 70, 100, 290, 330, 347, 390} | _LOOKS.keys()
#: The line type of all lines, without dashes.
_SOLID = "CONTINUOUS"

#: Pairs of group code and value.
_Groups: TypeAlias = Sequence[tuple[int, str]]


def read_dxf(path: Path, layers: tuple[str, ...] = LAYERS) -> Drawing:
    """Read the entities of a DXF file's model space and judge its declarations.

    Only LWPOLYLINE, POLYLINE, CIRCLE and LINE are drawn; anything else, what is on none of
    ``layers`` or on one that is hidden, another unit than millimetres, and groups that our entities
    do not need are kept as problems.

    Raises
    ------
    ReadError
        If the file is not a complete DXF text file.
    """
    sections = _sections(path)
    if "ENTITIES" not in sections:
        raise ReadError("there is no ENTITIES section")
    header = sections.get("HEADER", ())
    variables = {one[1]: two[1].strip() for one, two in pairwise(header) if one[0] == 9}
    problems = _unit_problems(variables)
    looks = []
    for kind, groups in _entities(sections.get("TABLES", ())):
        first = dict(reversed(groups))
        if kind == "LAYER":
            looks.append(_look(groups))
        if kind == "LTYPE" and first.get(2, "").upper() == _SOLID and first.get(73, "0") != "0":
            problems.append(f"the line type {first[2]} has dashes")
        hidden = first.get(62, "").startswith("-") or first.get(290) == "0"
        if kind == "LAYER" and (hidden or first.get(70, "0") != "0"):
            problems.append(
                f"layer {first.get(2)!r} is switched off, frozen, locked or not plotted"
            )
    # What stands in a block may be drawn, too.
    blocks = {kind for kind, _ in _entities(sections.get("BLOCKS", ()))}
    for strange in sorted(blocks - {"BLOCK", "ENDBLK"}):
        problems.append(f"BLOCKS has {strange}, which may not be there")
    shapes: list[Shape] = []
    strange_groups: set[str] = set()
    for number, (kind, groups) in enumerate(_joined(_entities(sections["ENTITIES"])), start=1):
        first = dict(reversed(groups))
        name = f"{kind} {first.get(5) or number}"
        for code in {code for code, _ in groups} - _GROUPS:
            strange_groups.add(f"a group {code}, which may change how it is drawn")
        for code, value in {group for group in groups if group[0] in _HELD}:
            if _number(value, name) not in _HELD[code][1]:
                strange_groups.add(_HELD[code][0])
        if kind not in DRAWN:
            problems.append(f"{name} may not be in a cutting file")
            continue
        shapes.append(_shape(kind, name, groups))
        if shapes[-1].layer not in layers:
            problems.append(
                f"{name} is on layer {shapes[-1].layer!r}, which is none of {', '.join(layers)}"
            )
    problems += [f"an entity has {what}" for what in sorted(strange_groups)]
    return Drawing(
        tuple(shapes), tuple(problems), looks=tuple(looks), form=variables.get("$ACADVER", "")
    )


def _look(groups: _Groups) -> Look:
    """Return what an entry of a layer says of its lines; what it says twice, twice."""
    stated: dict[str, str] = {}
    for code, value in groups:
        if code in _LOOKS or code not in _LAYER_GROUPS:
            key = _LOOKS.get(code, f"group {code}")
            stated[key] = f"{stated[key]}, {value}" if key in stated else value.strip()
    return Look(dict(groups).get(2, ""), stated)


def _shape(kind: str, name: str, groups: _Groups) -> Shape:
    """Return what an entity draws."""
    # A POLYLINE's own point is none of its corners, which come after it.
    own = [at for at, (code, _) in enumerate(groups) if code == 0][:1] or [len(groups)]
    corners = groups[own[0] :] if kind == "POLYLINE" else groups
    places: list[str] = []
    bulges: list[float] = []
    for (code, value), (after, other) in pairwise([*corners, (0, "")]):
        if code in (10, 11) and after == code + 10:
            places += value, other
            bulges.append(0.0)
        elif code == 42 and bulges:
            bulges[-1] = _number(value, name)
        elif code in (10, 11, 42):
            raise ReadError(f"{name}: coordinates do not come in pairs, or a bulge before them")
    codes = [code for code, _ in corners]
    if codes.count(20) + codes.count(21) != len(bulges):
        raise ReadError(f"{name}: coordinates do not come in pairs of x and y")
    radii = [_number(value, name) for code, value in groups if code == 40]
    least = 1 if kind == "CIRCLE" else 2
    if len(bulges) < least or bool(radii) != (least == 1):
        raise ReadError(f"{name} has not the coordinates, or the radius, that it needs")
    # In our extended data.
    pieces = [two[1] for one, two in pairwise(groups) if one == (1001, APPID) and two[0] == 1000]
    first = dict(reversed(groups))
    return Shape(
        layer=first.get(8, ""),
        piece=pieces[0] if pieces else None,
        name=name,
        points=np.array([_number(place, name) for place in places]).reshape(-1, 2),
        bulges=np.array(bulges),
        closed=first.get(70) == "1",
        radius=radii[-1] if radii else None,
    )


def _number(value: str, name: str) -> float:
    """Return a finite number."""
    try:
        result = float(value)
    except ValueError as error:
        raise ReadError(f"{name}: {error}") from error
    if not isfinite(result):
        raise ReadError(f"{name} has a coordinate or value that is not finite")
    return result


def _sections(path: Path) -> dict[str, _Groups]:
    """Read the sections of a DXF text file, to its end."""
    text = read_content(path).decode("utf-8", errors="replace").replace("\r\n", "\n")
    lines = text.split("\n")
    pairs = zip(lines[::2], lines[1::2], strict=False)
    try:
        groups = [(int(code), value) for code, value in pairs]
    except ValueError as error:
        raise ReadError(f"a line that should be a group code is not a number: {error}") from error
    if not groups or groups[-1] != (0, "EOF"):
        raise ReadError("the file does not end with EOF: it is truncated")
    found: dict[str, _Groups] = {}
    marks = [at for at, pair in enumerate(groups) if pair in {(0, "SECTION"), (0, "ENDSEC")}]
    for mark, end in pairwise([*marks, len(groups)]):
        if groups[mark][1] == "SECTION":
            code, name = groups[mark + 1]
            if code != 2 or not name or name in found:
                raise ReadError(f"a section has no name, or there are two called {name!r}")
            found[name] = groups[mark + 2 : end]
    return found


def _entities(groups: _Groups) -> Iterator[tuple[str, _Groups]]:
    """Yield the kind of each entity of a section, and its groups."""
    begins = [at for at, (code, _) in enumerate(groups) if code == 0]
    for begin, end in pairwise([*begins, len(groups)]):
        yield groups[begin][1], groups[begin + 1 : end]


def _joined(entities: Iterable[tuple[str, _Groups]]) -> list[tuple[str, _Groups]]:
    """Return entities, each POLYLINE together with the corners after it."""
    result: list[tuple[str, _Groups]] = []
    for kind, groups in entities:
        if kind in ("VERTEX", "SEQEND") and result and result[-1][0] == "POLYLINE":
            result[-1] = ("POLYLINE", [*result[-1][1], (0, kind), *groups])
        else:
            result.append((kind, groups))
    return result


def _unit_problems(variables: dict[str, str]) -> list[str]:
    """Judge the units."""
    old = variables.get("$ACADVER") == R12  # which knows neither variable
    return [
        f"{name} is {variables.get(name)}; it must be {wanted} for millimetres"
        for name, wanted in (("$INSUNITS", "4"), ("$MEASUREMENT", "1"))
        if variables.get(name, wanted if old else None) != wanted
    ]
