"""Read a sheet from DXF group codes, independently of any DXF library."""

from pathlib import Path
from sys import intern
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.verify.drawing import LAYERS, Drawing, Flags, Floats, Ints, Look, ReadError
from fabweave.verify.read.dxf_allowed import strange_parts
from fabweave.verify.read.dxf_groups import Entities, Groups, read_groups

Header: TypeAlias = dict[str, dict[int, str]]

APPID = "FABWEAVE"
R12 = "AC1009"
DRAWN = ("LWPOLYLINE", "POLYLINE", "CIRCLE", "LINE")


def read_dxf(path: Path, layers: tuple[str, ...] = LAYERS) -> Drawing:
    """Read the entities of a DXF file's model space and judge its declarations.

    Only LWPOLYLINE, POLYLINE, CIRCLE and LINE are drawn; anything else, what is on none of
    ``layers``, another unit than millimetres, untrue extents, and whatever may be drawn otherwise
    than the coordinates say is kept as a problem.

    Raises
    ------
    ReadError
        If the file is not a complete DXF text file.
    """
    sections = read_groups(path).sections()
    if "ENTITIES" not in sections:
        raise ReadError("there is no ENTITIES section")
    nothing = Groups(np.zeros(0, dtype=np.int64), [])
    header = _header(sections.get("HEADER", nothing))
    looks = _looks(Entities(sections.get("TABLES", nothing)))
    strange = strange_parts(sections)
    return _drawing(Entities(sections["ENTITIES"]), header, looks, layers, strange)


def _looks(tables: Entities) -> dict[str, frozenset[Look]]:
    """Read what lines on each layer look like."""
    exact, index = tables.texts(tables.at(420), ""), tables.texts(tables.at(62), "")
    looks: dict[str, frozenset[Look]] = {}
    for at, name in enumerate(tables.texts(tables.at(2), "")):
        if tables.kind[at] != "LAYER":
            continue
        try:
            colour = f"#{int(exact[at]):06X}" if exact[at] else None
            look = Look(colour, int(index[at]) if index[at] else None)
        except ValueError as error:
            raise ReadError(f"layer {name!r}: {error}") from error
        looks[name] = looks.get(name, frozenset()) | {look}
    return looks


def _header(groups: Groups) -> Header:
    """Read the header variables."""
    header: Header = {}
    values: dict[int, str] = {}
    for code, value in zip(groups.code.tolist(), groups.value, strict=True):
        if code == 9:
            values = header.setdefault(value, {})
        else:
            values[code] = value
    return header


def _drawing(
    entities: Entities,
    header: Header,
    looks: dict[str, frozenset[Look]],
    layers: tuple[str, ...],
    problems: list[str],
) -> Drawing:
    """Read every entity and say what is wrong."""
    kind = np.array(entities.kind, dtype=object)
    count = len(kind)
    corner = (kind == "VERTEX") | (kind == "SEQEND")
    # Corners belong to the entity before them; what is drawn to themselves.
    parent = np.maximum.accumulate(np.where(corner, -1, np.arange(count)))
    belongs = corner & (parent >= 0) & (kind[parent] == "POLYLINE")
    drawn = np.array([name in DRAWN for name in entities.kind], dtype=bool)
    shapes = np.flatnonzero(drawn)
    problems = problems + _unit_problems(header)
    problems += [
        f"{entities.names[at]} may not be in a cutting file"
        for at in np.flatnonzero(~drawn & ~belongs).tolist()
    ]
    layer = entities.texts(entities.at(8), "")
    problems += [
        f"{entities.names[at]} is on layer {layer[at]!r}, which is none of {', '.join(layers)}"
        for at in shapes.tolist()
        if layer[at] not in layers
    ]
    start, points, bulges = _points(entities, kind, parent, drawn)
    closed = np.zeros(count, dtype=bool)
    runs = np.flatnonzero((kind == "LWPOLYLINE") | (kind == "POLYLINE"))
    closed[runs] = np.fmod(np.trunc(entities.first_numbers(70, runs, 0.0)), 2.0) != 0.0
    radius = np.full(count, np.nan)
    circles = np.flatnonzero(kind == "CIRCLE")
    radius[circles] = entities.first_numbers(40, circles)
    problems += _extent_problems(header, points, np.repeat(radius[shapes], np.diff(start)))
    piece = _pieces(entities)
    return Drawing(
        # One string for each layer and piece: a file's own would keep all its text in memory.
        layer=[intern(layer[at]) for at in shapes.tolist()],
        piece=[key and intern(key) for key in (piece[at] for at in shapes.tolist())],
        name=[entities.names[at] for at in shapes.tolist()],
        points=points,
        bulges=bulges,
        start=start,
        closed=closed[shapes],
        radius=radius[shapes],
        layers=tuple(looks),
        width_mm=None,
        height_mm=None,
        problems=tuple(problems),
        looks=looks,
        version=header.get("$ACADVER", {}).get(1),
    )


def _pieces(entities: Entities) -> list[str | None]:
    """Return the piece of each entity: the first string of our extended data."""
    marks, strings = entities.at(1001), entities.at(1000)
    if not len(marks):
        return [None] * len(entities.begin)
    ours = np.array([value == APPID for value in entities.text(marks)])
    above = np.searchsorted(marks, strings) - 1
    same = (above >= 0) & (entities.owner[marks[above]] == entities.owner[strings])
    first = entities.first(strings[same & ours[above]])
    result: list[str | None] = [None] * len(entities.begin)
    for entity, value in zip(entities.owner[first].tolist(), entities.text(first), strict=True):
        result[entity] = value
    return result


def _points(
    entities: Entities, kind: npt.NDArray[np.object_], parent: Ints,
    drawn: Flags,
) -> tuple[Ints, Floats, Floats]:  # fmt: skip
    """Return the points of all shapes, where each shape's begin, and the bulge after each point."""
    corners = np.flatnonzero((kind == "VERTEX") & (kind[parent] == "POLYLINE") & (parent >= 0))
    of_corner = (entities.first_numbers(10, corners), entities.first_numbers(20, corners))
    line, plain = kind == "LINE", drawn & (kind != "POLYLINE")
    owners, values = [], []
    for near, far, more in ((10, 11, of_corner[0]), (20, 21, of_corner[1])):
        places = entities.at(near, far)
        own, second = entities.owner[places], entities.groups.code[places] == far
        places = places[plain[own] & (line[own] | ~second)]
        own, second = entities.owner[places], entities.groups.code[places] == far
        # By entity, the far end of a line last; the corners of a polyline in their order.
        owner = np.concatenate([own, parent[corners]])
        order = np.argsort(2 * owner + np.concatenate([second, corners < 0]), kind="stable")
        owners.append(owner[order])
        values.append(np.concatenate([entities.numbers(places), more])[order])
        if near == 10:
            slot = np.empty_like(order)
            slot[order] = np.arange(len(order))
            bulges = _bulges(entities, kind, places, slot, corners)
    sizes = [np.bincount(owner, minlength=len(kind))[drawn] for owner in owners]
    least = np.where(kind[drawn] == "CIRCLE", 1, 2)
    for at in np.flatnonzero((sizes[0] != sizes[1]) | (sizes[0] < least))[:1].tolist():
        name = entities.names[int(np.flatnonzero(drawn)[at])]
        raise ReadError(f"{name} has {sizes[0][at]} x and {sizes[1][at]} y coordinates")
    start = np.concatenate([[0], np.cumsum(sizes[0])])
    return start, np.column_stack(values), bulges


def _bulges(
    entities: Entities, kind: npt.NDArray[np.object_], places: Ints,
    slot: Ints, corners: Ints,
) -> Floats:  # fmt: skip
    """Return the bulge after each point.

    ``places`` are the groups of x coordinates, ``slot`` where they went, corners' after them.
    """
    bulges = np.zeros(len(slot))
    bulges[slot[len(places) :]] = entities.first_numbers(42, corners, 0.0)
    bent = entities.at(42)
    bent = bent[kind[entities.owner[bent]] == "LWPOLYLINE"]
    values = entities.numbers(bent)
    before = np.searchsorted(places, bent) - 1
    if len(bent) and len(places):
        kept = (before >= 0) & (entities.owner[places[before]] == entities.owner[bent])
        bulges[slot[before[kept]]] = values[kept]
    return bulges


def _unit_problems(header: Header) -> list[str]:
    """Judge version and units, and whether the drawing itself is shown, where it is."""
    version = header.get("$ACADVER", {}).get(1, "")
    problems = []
    for name, wanted in (("$INSUNITS", "4"), ("$MEASUREMENT", "1")):
        value = header.get(name, {}).get(70)
        # R12 knows neither variable.
        if (value is None and version != R12) or (value is not None and value != wanted):
            problems.append(f"{name} is {value}; it must be {wanted} for millimetres")
    if header.get("$TILEMODE", {}).get(70, "1") != "1":
        problems.append("$TILEMODE is not 1: a layout is shown in place of the drawing")
    if any(float(value) != 0.0 for value in header.get("$INSBASE", {}).values()):
        problems.append("$INSBASE is not the origin: the drawing is moved where it is inserted")
    return problems


def _extent_problems(header: Header, points: Floats, radius: Floats) -> list[str]:
    """Judge whether the declared extents hold the drawing."""
    if not len(points):
        return []
    try:
        low = np.array([float(header["$EXTMIN"][code]) for code in (10, 20)])
        high = np.array([float(header["$EXTMAX"][code]) for code in (10, 20)])
    except (KeyError, ValueError):
        return ["$EXTMIN and $EXTMAX are missing or not numbers"]
    reach = np.nan_to_num(radius)[:, None]
    true_low, true_high = np.min(points - reach, axis=0), np.max(points + reach, axis=0)
    # Written so that NaN objects.
    if not (np.all(low <= true_low + 0.01) and np.all(high >= true_high - 0.01)):
        return [
            f"$EXTMIN {low.tolist()} and $EXTMAX {high.tolist()} do not hold the drawing, which "
            f"reaches from {true_low.round(3).tolist()} to {true_high.round(3).tolist()}"
        ]
    return []
