"""Read a sheet from DXF group codes, independently of any DXF library."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from sys import intern

import numpy as np

from fabweave.verify.drawing import LAYERS, Drawing, Flags, Floats, Ints, ReadError
from fabweave.verify.read.content import read_content

APPID = "FABWEAVE"
R12 = "AC1009"
DRAWN = ("LWPOLYLINE", "POLYLINE", "CIRCLE", "LINE")
#: The groups that entities may have; any other, as an extrusion has, may change what is cut.
_GROUPS = (0, 5, 8, 10, 11, 20, 21, 30, 31, 40, 42, 43, 66, 70, 90, 100, 330, 1000, 1001)
#: Of these, heights above the sheet and the width of lines: there are none.
_ZERO = (30, 31, 43)


@dataclass(frozen=True, eq=False)
class _Section:
    """A section's pairs of group code and value; each group 0 begins an entity.

    ``owner`` is the entity of each group, -1 for what comes before the first one.
    """

    code: Ints
    value: Sequence[str]

    @cached_property
    def begin(self) -> Ints:
        """Where each entity begins."""
        return np.flatnonzero(self.code == 0)

    @cached_property
    def owner(self) -> Ints:
        """The entity of each group."""
        return np.cumsum(self.code == 0) - 1

    @cached_property
    def kind(self) -> list[str]:
        """What each entity is."""
        return [self.value[at] for at in self.begin.tolist()]

    @cached_property
    def names(self) -> list[str]:
        """The kind and handle of each entity, or its number where it has no handle."""
        return [
            f"{kind} {handle or number}"
            for number, (kind, handle) in enumerate(
                zip(self.kind, self.texts(5), strict=True), start=1
            )
        ]

    def texts(self, code: int, missing: str = "") -> list[str]:
        """Return for each entity its first value with a code."""
        result = [missing] * len(self.begin)
        places = np.flatnonzero((self.code == code) & (self.owner >= 0))
        # The last to be written is the first in the file.
        for at, entity in zip(
            places[::-1].tolist(), self.owner[places][::-1].tolist(), strict=True
        ):
            result[entity] = self.value[at]
        return result

    def numbers(self, places: Ints) -> Floats:
        """Return the values of some groups as numbers.

        Raises
        ------
        ReadError
            If one is not a finite number.
        """
        values = [self.value[at] for at in places.tolist()]
        try:
            result = np.fromiter(map(float, values), np.float64, len(values))
        except ValueError as error:
            name = self.names[int(self.owner[places[0]])]
            raise ReadError(f"{name} or a later one: {error}") from error
        strange = places[~np.isfinite(result)]
        if len(strange):
            name = self.names[int(self.owner[strange[0]])]
            raise ReadError(f"{name} has a coordinate or value that is not finite")
        return result


_NOTHING = _Section(np.zeros(0, dtype=np.int64), [])


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
    entities = sections["ENTITIES"]
    problems = _unit_problems(sections.get("HEADER", _NOTHING))
    tables = sections.get("TABLES", _NOTHING)
    columns = (tables.texts(code) for code in (2, 62, 70, 290))
    for what, name, index, flags, plotted in zip(tables.kind, *columns, strict=True):
        if what == "LAYER" and (index[:1] == "-" or flags not in ("", "0") or plotted == "0"):
            problems.append(f"layer {name!r} is switched off, frozen, locked or not plotted")
    # What stands in a block may be drawn, too.
    for strange in sorted({*sections.get("BLOCKS", _NOTHING).kind} - {"BLOCK", "ENDBLK"}):
        problems.append(f"BLOCKS has {strange}, which may not be there")
    kind = np.array(entities.kind, dtype=object)
    count, corner = len(kind), (kind == "VERTEX") | (kind == "SEQEND")
    # Corners belong to the entity before them; what is drawn to themselves.
    parent = np.maximum.accumulate(np.where(corner, -1, np.arange(count)))
    belongs = corner & (parent >= 0) & (kind[parent] == "POLYLINE")
    drawn = np.isin(kind, DRAWN)
    shapes = np.flatnonzero(drawn)
    layer = entities.texts(8)
    problems += [
        f"{entities.names[at]} may not be in a cutting file"
        for at in np.flatnonzero(~drawn & ~belongs).tolist()
    ]
    problems += [
        f"{entities.names[at]} is on layer {layer[at]!r}, which is none of {', '.join(layers)}"
        for at in shapes.tolist()
        if layer[at] not in layers
    ]
    problems += _strange_groups(entities)
    # A POLYLINE's own point is none of its corners.
    start, points, bulges = _points(
        entities,
        np.where(drawn, np.arange(count), parent),
        (drawn | belongs) & (kind != "POLYLINE"),
    )
    start = start[np.append(shapes, count)]
    radius = np.full(count, np.nan)
    circles = entities.code == 40
    radius[entities.owner[circles]] = entities.numbers(np.flatnonzero(circles))
    least = np.where(kind[shapes] == "CIRCLE", 1, 2)
    wrong = (np.diff(start) < least) | (np.isnan(radius[shapes]) == (least == 1))
    for at in shapes[wrong][:1].tolist():
        raise ReadError(
            f"{entities.names[at]} has not the coordinates, or the radius, that it needs"
        )
    closed, piece = entities.texts(70, "0"), _pieces(entities)
    return Drawing(
        # One string for each layer and piece: a file's own would keep all its text in memory.
        layer=[intern(layer[at]) for at in shapes.tolist()],
        piece=[piece.get(at) for at in shapes.tolist()],
        name=[entities.names[at] for at in shapes.tolist()],
        points=points,
        bulges=bulges,
        start=start,
        closed=np.array([closed[at] == "1" for at in shapes.tolist()], dtype=bool),
        radius=radius[shapes],
        problems=tuple(problems),
    )


def _sections(path: Path) -> dict[str, _Section]:
    """Read the sections of a DXF text file, to its end."""
    text = read_content(path).decode("utf-8", errors="replace").replace("\r\n", "\n")
    lines = text.split("\n")
    values = lines[1::2]
    try:
        code = np.fromiter(map(int, lines[: 2 * len(values) : 2]), np.int64, len(values))
    except (ValueError, OverflowError) as error:
        raise ReadError(f"a line that should be a group code is not a number: {error}") from error
    if not values or code[-1] != 0 or values[-1] != "EOF":
        raise ReadError("the file does not end with EOF: it is truncated")
    found: dict[str, _Section] = {}
    ends = ("SECTION", "ENDSEC")
    marks = [at for at in np.flatnonzero(code == 0).tolist() if values[at] in ends]
    for mark, end in pairwise([*marks, len(code)]):
        if values[mark] != "SECTION":
            continue
        name = values[mark + 1] if code[mark + 1] == 2 else ""
        if not name or name in found:
            raise ReadError(f"a section has no name, or there are two called {name!r}")
        found[name] = _Section(code[mark + 2 : end], values[mark + 2 : end])
    return found


def _strange_groups(entities: _Section) -> list[str]:
    """Return what entities have that changes how they are drawn."""
    inside = entities.owner >= 0
    problems = [
        f"an entity has a group {code}, which may change how it is drawn"
        for code in sorted({*entities.code[inside].tolist()} - {*_GROUPS})
    ]
    for codes, allowed, what in (
        (_ZERO, (0,), "a width, or a height above the sheet"),
        ((70,), (0, 1), "flags that are not open or closed"),
    ):
        values = entities.numbers(np.flatnonzero(inside & np.isin(entities.code, codes)))
        if not np.isin(values, allowed).all():
            problems.append(f"an entity has {what}")
    return problems


def _points(entities: _Section, shape: Ints, drawn: Flags) -> tuple[Ints, Floats, Floats]:
    """Return where each shape's points begin, all points, and the bulge after each.

    Parameters
    ----------
    entities : _Section
    shape : (E,) int array
        The entity that the points of an entity belong to.
    drawn : (E,) bool array
        Whether its points are drawn.
    """
    inside = np.append(drawn, [False])[entities.owner]
    x, y, bent = (
        np.flatnonzero(inside & np.isin(entities.code, codes))
        for codes in ((10, 11), (20, 21), (42,))
    )
    if not np.array_equal(x + 1, y):
        raise ReadError("coordinates do not come in pairs of x and y")
    size = np.bincount(shape[entities.owner[x]], minlength=len(shape))
    bulges = np.zeros(len(x))
    before = np.searchsorted(x, bent) - 1
    if np.any(before < 0) or np.any(entities.owner[x[before]] != entities.owner[bent]):
        raise ReadError("a bulge comes before the corner that it is of")
    bulges[before] = entities.numbers(bent)
    points = np.column_stack([entities.numbers(x), entities.numbers(y)])
    return np.concatenate([[0], np.cumsum(size)]), points, bulges


def _pieces(entities: _Section) -> dict[int, str]:
    """Return the piece of each entity that says so, in our extended data."""
    names = np.flatnonzero(entities.code == 1000)
    return {
        int(entities.owner[at]): intern(entities.value[at])
        for at in names.tolist()
        if entities.code[at - 1] == 1001 and entities.value[at - 1] == APPID
    }


def _unit_problems(header: _Section) -> list[str]:
    """Judge the units."""
    names = np.flatnonzero(header.code[:-1] == 9).tolist()
    variables = {header.value[at]: header.value[at + 1] for at in names}
    old = variables.get("$ACADVER") == R12  # which knows neither variable
    return [
        f"{name} is {variables.get(name)}; it must be {wanted} for millimetres"
        for name, wanted in (("$INSUNITS", "4"), ("$MEASUREMENT", "1"))
        if variables.get(name, wanted if old else None) != wanted
    ]
