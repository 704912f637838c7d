"""Read the crossing map, and say where it breaks its schema."""

import contextlib
import json
import math
from collections.abc import Callable, Mapping
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
    Station,
    Step,
    Strand,
    Thread,
)
from fabweave.verify.drawing import Floats, ReadError

SCHEMA = "fabweave.crossing-map/1"


class _Node:
    """A JSON value that knows its path, so that errors say where."""

    __slots__ = ("above", "key", "value")

    def __init__(self, value: object, above: "_Node | str", key: str | int = "") -> None:
        self.value = value
        self.above = above
        self.key = key

    @property
    def path(self) -> str:
        """The path, put together only where it is asked for."""
        if isinstance(self.above, str):
            return self.above
        return self.above.path + (f".{self.key}" if isinstance(self.key, str) else f"[{self.key}]")

    def __getitem__(self, key: str) -> "_Node":
        """Return a member of an object."""
        if not isinstance(self.value, dict):
            raise ReadError(f"{self.path} is not an object")
        if key not in self.value:
            raise ReadError(f"{self.path} has no {key!r}")
        return _Node(self.value[key], self, key)

    def items(self, count: int | None = None) -> list["_Node"]:
        """Return the items of a list, of a certain length if given."""
        if not isinstance(self.value, list) or (count is not None and len(self.value) != count):
            raise ReadError(f"{self.path} is not a list" + (f" of {count}" if count else ""))
        return [_Node(item, self, at) for at, item in enumerate(self.value)]

    def has(self, key: str) -> bool:
        """Return whether this is an object with a member of that name."""
        return isinstance(self.value, dict) and key in self.value

    def items_of(self, key: str) -> list["_Node"]:
        """Return the items of a list that may be absent."""
        return self[key].items() if self.has(key) else []

    def integer(self) -> int:
        """Return an integer."""
        if not isinstance(self.value, int) or isinstance(self.value, bool):
            raise ReadError(f"{self.path} is not an integer but {self.value!r:.40}")
        return self.value

    def number(self) -> float:
        """Return a finite number."""
        value = self.value
        if isinstance(value, int | float) and not isinstance(value, bool):
            # A number beyond all floats raises, a huge exponent has become infinite.
            with contextlib.suppress(OverflowError):
                if math.isfinite(value):
                    return float(value)
        raise ReadError(f"{self.path} is not a finite number but {value!r:.40}")

    def flag(self) -> bool:
        """Return true or false."""
        if not isinstance(self.value, bool):
            raise ReadError(f"{self.path} is not true or false but {self.value!r:.40}")
        return self.value

    def text(self) -> str:
        """Return a string."""
        if not isinstance(self.value, str):
            raise ReadError(f"{self.path} is not a string but {self.value!r:.40}")
        return self.value

    def points(self, *inner: int) -> Floats:
        """Return a list of arrays of numbers as an (n, ...) array."""
        try:
            result = np.array(self.value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ReadError(f"{self.path} is not a list of points: {error}") from error
        result = result.reshape((0, *inner)) if result.size == 0 else result
        if result.shape[1:] != inner or not np.all(np.isfinite(result)):
            raise ReadError(f"{self.path} is not a list of points of shape {inner}")
        return result

    def maybe(self, read: "Callable[[_Node], Any]") -> Any:
        """Return null as None, anything else as read."""
        return None if self.value is None else read(self)


def read_crossing_map(path: Path) -> CrossingMap:
    """Read the crossing map.

    Raises
    ------
    ReadError
        If it is not JSON or breaks the schema; the message says where.
    """
    try:
        document = json.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError) as error:
        raise ReadError(f"it is not JSON: {error}") from error
    root = _Node(document, "map")
    if root["schema"].text() != SCHEMA:
        raise ReadError(f"its schema is {root['schema'].text()!r}, not {SCHEMA!r}")
    if root["units"].text() != "mm":
        raise ReadError(f"its units are {root['units'].text()!r}, not 'mm'")
    weave, broken = root["weave"], root["weave"]["broken"]
    sheets = tuple(_sheet(node) for node in root["sheets"].items())
    rotations = root["layout"]["rotations"]
    mirrors = {sheet.number: sheet.width_mm for sheet in sheets if sheet.mirrored}
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
        margin_mm=root["layout"]["margin_mm"].number(),
        gap_mm=root["layout"]["gap_mm"].number(),
        step_deg=rotations["step_deg"].maybe(_Node.number),
        tolerance_deg=rotations["tolerance_deg"].number(),
        cut=_cut(root["cut"]),
        sheets=sheets,
        threads=tuple(_thread(node) for node in root["threads"].items()),
        crossings=tuple(_crossing(node) for node in root["crossings"].items()),
        pieces=tuple(_piece(node, mirrors) for node in root["pieces"].items()),
        joints=tuple(_joint(node) for node in root["joints"].items()),
        steps=tuple(_step(node) for node in root["steps"].items()),
        efforts=(
            root["assembly"]["effort"].number(),
            root["assembly"]["by_thread"].number(),
            root["assembly"]["by_number"].number(),
        ),
        last_tenth=root["assembly"]["last_tenth"].number(),
    )


def _sheet(node: _Node) -> Sheet:
    """Read a sheet."""
    outline = node["outline"].points(2)
    defects = tuple(item.points(2) for item in node["defects"].items())
    if min(len(ring) for ring in (outline, *defects)) < 3:
        raise ReadError(f"{node.path} has an outline or a defect of fewer than three points")
    return Sheet(
        number=node["sheet"].integer(),
        name=node["name"].text(),
        width_mm=node["width_mm"].number(),
        height_mm=node["height_mm"].number(),
        mirrored=node["mirrored"].flag(),
        stock=node["stock"].text(),
        offcut=node["offcut"].flag(),
        price=node["price"].maybe(_Node.number),
        grain_deg=node["grain_deg"].maybe(_Node.number),
        outline=outline,
        defects=defects,
        material=node["material"].maybe(_Node.text) if node.has("material") else None,
        thickness_mm=node["thickness_mm"].number() if node.has("thickness_mm") else None,
        code=node["code"].maybe(_code) if node.has("code") else None,
        rest=node["rest"].maybe(_rest) if node.has("rest") else None,
    )


def _rest(node: _Node) -> tuple[str, Floats]:
    """Read what is kept of a sheet: its name and its outline."""
    return node["name"].text(), node["outline"].points(2)


def _code(node: _Node) -> tuple[float, float, float]:
    """Read where a sheet has its code."""
    return node["x_mm"].number(), node["y_mm"].number(), node["dot_mm"].number()


def _cut(node: _Node) -> Cut:
    """Read what the drawings are like."""
    profile, preset, dxf, units = (
        node[key].text() for key in ("profile", "preset", "dxf", "svg_units")
    )
    colours = {
        item["layer"].text(): (item["colour"].text(), item["aci"].integer())
        for item in node["layers"].items()
    }
    code = node["code"].text() if node.has("code") else None
    return Cut(profile, preset, dxf, units, node["hairline_mm"].number(), colours, code)


def _step(node: _Node) -> Step:
    """Read a step."""
    crossings, over, under, joints, fasten = (
        tuple(item.integer() for item in node[key].items())
        for key in ("crossings", "over", "under", "joints", "fasten")
    )
    return Step(
        step=node["step"].integer(),
        pieces=tuple(item.text() for item in node["pieces"].items()),
        crossings=crossings,
        over=over,
        under=under,
        joints=joints,
        fasten=fasten,
        closes=node["closes"].flag(),
        effort=node["effort"].number(),
        text=node["text"].text(),
    )


def _joint(node: _Node) -> Joint:
    """Read a joint; of what it need not state, what it states."""

    def stated(key: str) -> Any:
        return node[key].maybe(_Node.number) if node.has(key) else None

    return Joint(
        node["id"].integer(),
        _pair(node["pieces"]),
        node["crossing"].integer(),
        node["holes"].points(2, 2),
        kind=node["kind"].text() if node.has("kind") else "rivet",
        hole_mm=stated("hole_mm"),
        lap_mm=stated("lap_mm"),
        grip_mm=stated("grip_mm"),
    )


def _cutout(node: _Node) -> Cutout:
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


def _pair(node: _Node) -> tuple[str, str]:
    """Read two piece ids."""
    first, second = node.items(2)
    return first.text(), second.text()


def _thread(node: _Node) -> Thread:
    """Read a thread."""
    return Thread(
        node["id"].integer(),
        node["label"].text(),
        node["closed"].flag(),
        tuple(item.integer() for item in node["crossings"].items()),
        tuple(item.flag() for item in node["over"].items()),
        tuple(item.text() for item in node["pieces"].items()),
        node["bunch"].integer(),
    )


def _crossing(node: _Node) -> Crossing:
    """Read a crossing."""
    start, end = node["edge"].items(2)
    x, y, z = (item.number() for item in node["position"].items(3))
    over, under = (
        Strand(side["thread"].integer(), side["piece"].text(), side["station"].integer())
        for side in (node["over"], node["under"])
    )
    return Crossing(node["id"].integer(), (start.integer(), end.integer()), (x, y, z), over, under)


def _piece(node: _Node, mirrors: Mapping[int, float]) -> Piece:
    """Read a piece, given the widths of the sheets that are mirrored."""
    placement = node["placement"]
    start, end = (item.maybe(_Node.integer) for item in node["joints"].items(2))
    outline = node["outline"].points(2)
    if len(outline) < 3:
        raise ReadError(f"{node.path}.outline has fewer than three points")
    # Without a path, the outline is what is cut.
    path = np.column_stack([outline, np.zeros(len(outline))])
    if node.has("path"):
        path = node["path"].points(3)
        if len(path) < 2:
            raise ReadError(f"{node.path}.path has fewer than two points")
    return Piece(
        id=node["id"].text(),
        thread=node["thread"].integer(),
        sheet=node["sheet"].integer(),
        rotation_deg=placement["rotation_deg"].number(),
        shift=np.array([placement["x_mm"].number(), placement["y_mm"].number()]),
        joints=(start, end),
        outline=outline,
        path=path,
        stations=tuple(
            Station(
                crossing=item["crossing"].integer(),
                over=item["over"].flag(),
                partner=item["partner"].text(),
                x=item["x"].number(),
                y=item["y"].number(),
                hole_mm=item["hole_mm"].maybe(_Node.number),
                joint=item["joint"].maybe(_Node.integer),
            )
            for item in node["stations"].items()
        ),
        labels=tuple(_label(item) for item in node["labels"].items()),
        dropped=tuple(
            Dropped(item["kind"].text(), item["text"].text(), item["station"].maybe(_Node.integer))
            for item in node["dropped"].items()
        ),
        cutouts=tuple(_cutout(item) for item in node["cutouts"].items())
        if node.has("cutouts")
        else None,
        mirror_mm=mirrors.get(node["sheet"].integer()),
        kind=node["kind"].integer(),
    )


def _label(node: _Node) -> Label:
    """Read a label."""
    wide, high = (item.number() for item in node["box_mm"].items(2))
    return Label(
        kind=node["kind"].text(),
        text=node["text"].text(),
        station=node["station"].maybe(_Node.integer),
        height_mm=node["height_mm"].number(),
        x=node["x"].number(),
        y=node["y"].number(),
        rotation_deg=node["rotation_deg"].number(),
        length_mm=wide,
        box_height_mm=high,
    )
