"""Read the crossing map, and say where it breaks its schema."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.verify.crossing_map import (
    Crossing,
    CrossingMap,
    Cut,
    Cutout,
    Dropped,
    Joint,
    Label,
    Piece,
    Sheet,
    Step,
    Thread,
)
from fabweave.verify.drawing import ReadError
from fabweave.verify.read.content import read_text
from fabweave.verify.read.json_schema import Node

SCHEMA = "fabweave.crossing-map/1"


def read_crossing_map(path: Path) -> CrossingMap:
    """Read the crossing map.

    Raises
    ------
    ReadError
        If it is not JSON or breaks the schema; the message says where.
    """
    try:
        document = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise ReadError(f"it is not JSON: {error}") from error
    root = Node(document, "map")
    if root["schema"].text() != SCHEMA:
        raise ReadError(f"its schema is {root['schema'].text()!r}, not {SCHEMA!r}")
    if root["units"].text() != "mm":
        raise ReadError(f"its units are {root['units'].text()!r}, not 'mm'")
    weave, broken = root["weave"], root["weave"]["broken"]
    sheets = tuple(_sheet(node) for node in root["sheets"].items())
    layout, rotations = root["layout"], root["layout"]["rotations"]
    spares = root.items_of("spares")
    mirrors = {sheet.number: sheet.width_mm for sheet in sheets if sheet.mirrored}
    pieces = tuple(_piece(node, mirrors) for node in root["pieces"].items())
    known = {piece.id: piece for piece in pieces}
    return CrossingMap(
        pattern=weave["pattern"].text(),
        exact=weave["exact"].flag(),
        broken=(
            broken["edge"].integer(),
            broken["face"].integer(),
            broken["vertex"].integer(),
        ),
        warp=tuple(node.integer() for node in weave.items_of("warp")),
        labels=tuple(node.integer() for node in weave.items_of("labels")),
        rotations=weave["rotations"].integer() if weave.has("rotations") else None,
        margin_mm=layout["margin_mm"].number(),
        gap_mm=layout["gap_mm"].number(),
        recorded=layout["recorded"].flag() if layout.has("recorded") else None,
        step_deg=rotations["step_deg"].maybe(Node.number),
        tolerance_deg=rotations["tolerance_deg"].number(),
        from_grain_deg=(
            rotations["from_grain_deg"].number() if rotations.has("from_grain_deg") else 0.0
        ),
        cut=_cut(root["cut"]),
        sheets=sheets,
        threads=tuple(node.record(Thread) for node in root["threads"].items()),
        crossings=tuple(node.record(Crossing) for node in root["crossings"].items()),
        pieces=pieces,
        spares=tuple(_spare(node, known, mirrors) for node in spares),
        spare_of={node["id"].text(): node["of"].text() for node in spares},
        joints=tuple(node.record(Joint) for node in root["joints"].items()),
        steps=tuple(node.record(Step) for node in root["steps"].items()),
        efforts=(
            root["assembly"]["effort"].number(),
            root["assembly"]["by_thread"].number(),
            root["assembly"]["by_number"].number(),
        ),
        last_tenth=root["assembly"]["last_tenth"].number(),
    )


def _sheet(node: Node) -> Sheet:
    """Read a sheet."""
    sheet = node.record(Sheet, number=node["sheet"].integer())
    if min(len(ring) for ring in (sheet.outline, *sheet.defects)) < 3:
        raise ReadError(f"{node.path} has an outline or a defect of fewer than three points")
    return sheet


def _cut(node: Node) -> Cut:
    """Read what the drawings are like."""
    colours = {
        item["layer"].text(): (item["colour"].text(), item["aci"].integer())
        for item in node["layers"].items()
    }
    return node.record(Cut, colours=colours)


def _cutout(node: Node) -> Cutout:
    """Read what is cut out of a piece."""
    station, kind = node["station"].integer(), node["kind"].text()
    if kind == "hole":
        x, y, diameter = (node[key].number() for key in ("x", "y", "diameter_mm"))
        return Cutout(station, (x, y, diameter), None)
    if kind != "slot":
        raise ReadError(f"{node.path}.kind is {kind!r}, neither 'hole' nor 'slot'")
    ring = node["path"].points(3)
    if len(ring) < 3:
        raise ReadError(f"{node.path}.path has fewer than three points")
    return Cutout(station, None, ring)


def _piece(node: Node, mirrors: Mapping[int, float]) -> Piece:
    """Read a piece, given the widths of the sheets that are mirrored."""
    placement = node["placement"]
    outline = node["outline"].points(2)
    if len(outline) < 3:
        raise ReadError(f"{node.path}.outline has fewer than three points")
    # Without a path, the outline is what is cut.
    path = np.column_stack([outline, np.zeros(len(outline))])
    if node.has("path"):
        path = node["path"].points(3)
        if len(path) < 2:
            raise ReadError(f"{node.path}.path has fewer than two points")
    cutouts = tuple(_cutout(item) for item in node.items_of("cutouts"))
    return node.record(
        Piece,
        **_place(placement),
        outline=outline,
        path=path,
        cutouts=cutouts if node.has("cutouts") else None,
        mirror_mm=mirrors.get(node["sheet"].integer()),
    )


def _place(placement: Node) -> dict[str, Any]:
    """Read where a piece stands."""
    return {
        "rotation_deg": placement["rotation_deg"].number(),
        "shift": np.array([placement["x_mm"].number(), placement["y_mm"].number()]),
    }


def _spare(node: Node, pieces: Mapping[str, Piece], mirrors: Mapping[int, float]) -> Piece:
    """Read a spare: the piece that it is a copy of, with its own name, place and labels."""
    original = pieces.get(node["of"].text())
    if original is None:
        raise ReadError(f"{node.path} is a spare of {node['of'].text()!r}, which is no piece")
    sheet = node["sheet"].integer()
    return replace(
        original,
        id=node["id"].text(),
        sheet=sheet,
        labels=tuple(item.record(Label) for item in node["labels"].items()),
        dropped=tuple(item.record(Dropped) for item in node["dropped"].items()),
        mirror_mm=mirrors.get(sheet),
        turned=False,
        **_place(node["placement"]),
    )
