"""Read a list of stock, stock.toml: sheets with prices, offcuts with outlines, and their defects.

A list has entries ``[[sheet]]`` and ``[[offcut]]``. job.toml keeps the same entries, with outlines
in place of the names of their files, so that a job needs nothing beside it.
"""

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import shapely

from fabweave.core.arc_path import flattened
from fabweave.core.arrays import FloatArray
from fabweave.core.entries import Key, in_range, line_key, number_key, read_entry, read_toml
from fabweave.core.errors import InputError
from fabweave.core.files import read_input, silenced
from fabweave.core.messages import agree, shown
from fabweave.core.units import format_length, parse_length
from fabweave.stock.sheet_size import (
    MAX_SIDE_MM,
    MOST_SHEETS,
    Ring,
    SheetSize,
    parse_roll,
    parse_stock,
)

if TYPE_CHECKING:
    from ezdxf.document import Drawing

_CHORD_MM = 0.01  # how far chords may be from arcs
_MOST_RINGS = 5_000
#: What stands near the end of every DXF file, text or binary.
_END, _TAIL = b"EOF", 64


def read_outline(path: Path) -> tuple[FloatArray, list[FloatArray]]:
    """Return the outline that a DXF file draws, and the holes that it draws in it.

    The closed line around the largest area is the outline; closed lines and circles in it are
    holes. Lines that are not closed, such as texts and dimensions, are passed over.

    Parameters
    ----------
    path : Path
        LWPOLYLINE, POLYLINE and CIRCLE are read, in the file's unit; without one, millimetres.

    Returns
    -------
    outline : (K, 2) float array
        Millimetres.
    holes : list of (H, 2) float arrays

    Raises
    ------
    InputError
        If it cannot be read, or draws none or more than one outline.
    """
    from ezdxf.filemanagement import readfile  # noqa: PLC0415 - it takes long to import

    data = read_input(path, "the outline")
    if _END not in data[-_TAIL:]:
        raise InputError(
            f"cannot read the outline in {path}: it does not end with EOF as DXF files do, so it "
            "is cut off, or not a DXF file; copy it again, or export it as R2010"
        )
    rings: list[FloatArray] = []
    try:
        with silenced("ezdxf"):
            document = readfile(path)
            scale = _scale(document, path)
            for entity in document.modelspace():
                rings += [scale * ring for ring in _rings(entity, _CHORD_MM / scale)]
                if len(rings) > _MOST_RINGS:
                    raise InputError(  # noqa: TRY301 -- told as the others
                        f"{path} has more than {_MOST_RINGS} closed lines; keep the outline of the "
                        "offcut and the holes in it"
                    )
    except (InputError, MemoryError):
        raise
    except Exception as error:  # of a file that is no DXF, or half of one, ezdxf makes any error
        raise InputError(
            f"{path} cannot be read as a DXF file ({type(error).__name__}); export it again, as "
            "R2010 or R2000"
        ) from error
    rings = [ring for ring in rings if np.isfinite(ring).all()]
    polygons = [shapely.Polygon(ring) for ring in rings]
    order = sorted(range(len(rings)), key=lambda at: -polygons[at].area)
    if not order or not polygons[order[0]].area > 0.0:
        raise InputError(
            f"{path} has no closed line: join the lines of the outline into one closed polyline"
        )
    if not polygons[order[0]].is_valid:
        raise InputError(f"the outline in {path} crosses itself; draw it without crossings")
    inside = polygons[order[0]]
    beside = [at for at in order[1:] if not inside.covers(polygons[at])]
    if beside:
        raise InputError(
            f"{path} has {agree(len(beside), '{n} closed line[|s]')} outside the outline; keep "
            "one outline in a file, with nothing outside it"
        )
    return rings[order[0]], [rings[at] for at in order[1:] if polygons[at].area > 0.0]


def _scale(document: "Drawing", path: Path) -> float:
    """Return how many millimetres a unit of the drawing is long."""
    known = {0: 1.0, 1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0}
    unit = int(document.header.get("$INSUNITS", 0))
    if unit not in known:
        raise InputError(
            f"{path} is in unit {unit} ($INSUNITS), which is not supported; use millimetres"
        )
    return known[unit]


def _rings(entity: Any, chord: float) -> list[FloatArray]:
    """Return the closed line that an entity draws, if it does; arcs with chords so near."""
    kind = entity.dxftype()
    if kind == "CIRCLE":
        radius = float(entity.dxf.radius)
        if not 0.0 < radius < math.inf:
            return []
        count = int(np.clip(np.pi / np.sqrt(2.0 * chord / radius), 16, 720))
        return [_around((entity.dxf.center.x, entity.dxf.center.y), radius, count)]
    if kind == "LWPOLYLINE":
        rows = [(x, y, bulge) for x, y, bulge in entity.get_points("xyb")]
        closed = bool(entity.closed)
    elif kind == "POLYLINE" and entity.is_2d_polyline:
        rows = [
            (v.dxf.location.x, v.dxf.location.y, v.dxf.get("bulge", 0.0)) for v in entity.vertices
        ]
        closed = bool(entity.is_closed)
    else:
        return []
    if len(rows) > 2 and rows[0][:2] == rows[-1][:2]:
        rows, closed = rows[:-1], True
    if not closed or len(rows) < 2 or len(rows) > _MOST_CORNERS:
        return []
    values = np.array(rows, dtype=np.float64)
    ring = flattened(values[:, :2], values[:, 2], chord, closed=True)
    return [ring] if len(ring) >= 3 else []


_KINDS = ("offcut", "sheet")
_DECIMALS = 4  # of a millimetre, as in drawings
_CORNERS = 24  # of a polygon around a round defect
_MOST_CORNERS = 20_000
_FORMS = "{x=.., y=.., diameter=..}, {x=.., y=.., width=.., height=..} or {polygon=[[x, y], ..]}"


def read_stock(path: Path) -> tuple[SheetSize, ...]:
    """Return the sheets of a stock.toml, offcuts first.

    Plain values beside them, such as ``margin = "5mm"``, are options: settings read them.

    Raises
    ------
    InputError
        If it cannot be read; the message says in which entry, and what to do.
    """
    document = read_toml(path, "the stock")
    plain = [key for key, value in document.items() if not isinstance(value, list | dict)]
    for key in set(plain) - set(_KINDS):
        del document[key]
    if plain and not document:
        raise InputError(
            f"{path} sets {', '.join(plain[:4])}, but lists no stock: write an entry [[sheet]] or "
            "[[offcut]]"
        )
    return stock_of(document, str(path), path.parent)


def stock_of(
    document: dict[str, Any], where: str, folder: Path | None = None
) -> tuple[SheetSize, ...]:
    """Return the sheets that the tables of a list of stock describe, offcuts first.

    Parameters
    ----------
    document : dict
        Its ``sheet`` and ``offcut`` are lists of tables.
    where : str
        What it is called in messages.
    folder : Path, optional
        Where files of outlines are looked for.

    Examples
    --------
    >>> stock_of({"sheet": [{"size": "600x400mm", "price": 4.5}]}, "stock.toml")[0].price
    4.5
    """
    tables = (
        [(kind, document.get(kind, [])) for kind in _KINDS] if isinstance(document, dict) else []
    )
    if not tables or not all(
        isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)
        for _, entries in tables
    ):
        raise InputError(f"{where} is not a list of stock: write entries [[sheet]] and [[offcut]]")
    strange = [str(key) for key in document if key not in _KINDS]
    if strange:
        raise InputError(
            f"{where} has {agree(len(strange), '[an unknown key|unknown keys]')}: "
            f"{', '.join(strange[:4])}; write entries [[sheet]] and [[offcut]] only"
        )
    sheets: list[SheetSize] = []
    for kind, entries in tables:
        for number, entry in enumerate(entries, start=1):
            place = f"{where}, [[{kind}]] {number}"
            sheets.append(_Entry(entry, place, folder).sheet(kind, number))
    if not sheets:
        raise InputError(f"{where} lists no stock: write an entry [[sheet]] or [[offcut]]")
    twice = [name for name, count in Counter(sheet.name for sheet in sheets).items() if count > 1]
    if twice:
        raise InputError(
            f"{where}: {agree(len(twice), '[a name is|names are]')} used by more than one entry: "
            f"{', '.join(twice[:4])}; give each entry its own name"
        )
    return tuple(sheets)


def _grain(value: Any) -> float | None:
    """Accept the direction of the grain, and return it from 0 up to 180 degrees."""
    if isinstance(value, str):
        try:
            value = float(value.strip().removesuffix("deg").removesuffix("°"))
        except ValueError:
            return None
    angle = in_range(-1e9, 1e9)(value)
    return None if angle is None else round(angle % 180.0, 6) % 180.0


def _count(value: Any) -> int | None:
    """Accept a number of sheets."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    return value if whole and 1 <= value <= MOST_SHEETS else None


def _tables(value: Any) -> list[Any] | None:
    """Accept a list of tables."""
    return value if isinstance(value, list) and all(isinstance(t, dict) for t in value) else None


def _kind_key(expected: str, kind: Any) -> Key:
    """Return a key that takes a value of a kind."""
    return Key(expected, lambda value: value if isinstance(value, kind) else None)


@dataclass(frozen=True)
class _Table:
    """What an entry may have; below more is asked of an outline, a size and a defect."""

    name: Annotated[str | None, line_key(200)] = None
    size: Annotated[str | None, _kind_key('a text such as "600x400mm"', str)] = None
    roll: Annotated[str | None, _kind_key('a text such as "12mm:50m"', str)] = None
    outline: Annotated[
        str | list[Any] | None, _kind_key("a list of points or the name of a DXF file", str | list)
    ] = None
    quantity: Annotated[
        int | None,
        Key(f"a whole number from 1 to {MOST_SHEETS}; leave it out if there is no limit", _count),
    ] = None
    price: Annotated[float | None, number_key(0.0, 1e9)] = None
    grain: Annotated[
        float | None, Key("its angle to the sheet's width in degrees, such as 90", _grain)
    ] = None
    material: Annotated[str | None, line_key(200)] = None
    defects: Annotated[list[Any] | None, Key(f"a list of tables: {_FORMS}", _tables)] = None


class _Entry:
    """One table of a list, which knows where it comes from."""

    def __init__(self, table: dict[str, Any], where: str, folder: Path | None) -> None:
        self.table = _Table(**read_entry(table, where, _Table))
        self.where, self.folder = where, folder

    def refuse(self, what: str) -> InputError:
        """Return an error that says where."""
        return InputError(f"{self.where}: {what}")

    def sheet(self, kind: str, number: int) -> SheetSize:
        """Return the sheet that is described."""
        shape = (self.table.size, self.table.outline, self.table.defects)
        if self.table.roll is not None and shape != (None, None, None):
            raise self.refuse("a roll has no size, outline and defects; leave them out")
        outline, holes = self.outline()
        rings = [*holes, *self.defects()]
        if outline is None:
            size = self.size()
            wide, high, low = size.width_mm, size.height_mm, np.zeros(2)
        else:
            low = outline.min(axis=0)
            wide, high = (outline.max(axis=0) - low).round(_DECIMALS).tolist()
            self.require_side(max(wide, high))
        sheet = SheetSize(
            wide,
            high,
            self.table.quantity or (1 if kind == "offcut" else None),
            name=self.table.name or f"{kind} {number}",
            price=self.table.price,
            material=self.material(),
            grain_deg=self.table.grain,
            offcut=kind == "offcut",
            roll_mm=None if self.table.roll is None else wide,
            outline=() if outline is None else _ring(outline - low),
            defects=tuple(_ring(ring - low) for ring in rings),
        )
        inside = shapely.Polygon(sheet.ring)
        if not (shapely.is_valid(inside) and inside.area > 0.0):
            reason = shapely.is_valid_reason(inside)
            raise self.refuse(f"its outline crosses itself or has no area ({reason})")
        for at, ring in enumerate(sheet.defects, start=1):
            if not inside.intersects(shapely.Polygon(ring)):
                raise self.refuse(
                    f"defect {at} lies outside the sheet; measure from its lower left corner"
                )
        return sheet

    def material(self) -> str | None:
        """Return the name of a material, and its sort, in the form in which threads name theirs."""
        name = self.table.material
        return None if name is None else ":".join(map(str.strip, name.lower().split(":", 1)))

    def size(self) -> SheetSize:
        """Return the sheet that a size describes."""
        value = self.table.size
        if self.table.roll is not None:
            value = f"roll:{self.table.roll}"
        if value is None:
            raise self.refuse(
                'there is no size; write size = "600x400mm", or outline = "offcut_01.dxf"'
            )
        try:
            size = parse_stock(value) if self.table.roll is None else parse_roll(value)
        except InputError as error:
            raise self.refuse(str(error)) from error
        if size.quantity is not None:
            raise self.refuse(
                f"{value!r} includes a number of sheets; write quantity = {size.quantity}"
            )
        # What job.toml keeps is rounded so.
        return SheetSize(round(size.width_mm, 3), round(size.height_mm, 3))

    def require_side(self, side_mm: float) -> None:
        """Refuse what is longer than any sheet."""
        if side_mm > MAX_SIDE_MM:
            raise self.refuse(
                f"its outline is {format_length(side_mm)} long, but no sheet is longer than "
                f"{format_length(MAX_SIDE_MM)}; check the unit: outlines are in millimetres"
            )

    def outline(self) -> tuple[Any, list[Any]]:
        """Return the outline, if there is one, and the holes in it."""
        value = self.table.outline
        if value is None:
            return None, []
        if self.table.size is not None:
            raise self.refuse("it has both a size and an outline; leave one of them out")
        if isinstance(value, str):
            if self.folder is None:
                raise self.refuse(f"outline {value!r} names a file; write its points instead")
            try:
                return read_outline(self.folder / value)
            except InputError as error:
                raise self.refuse(str(error)) from error
        return self.points(value, "outline"), []

    def points(self, value: Any, what: str) -> Any:
        """Return corners as an array."""
        try:
            points = np.array(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            points = np.zeros(0)
        if points.ndim != 2 or points.shape[1:] != (2,) or not 3 <= len(points) <= _MOST_CORNERS:
            raise self.refuse(
                f"{what} must be a list of 3 to {_MOST_CORNERS} points, such as [[0, 0], [100, 0], "
                "[0, 80]], in millimetres"
            )
        if not np.isfinite(points).all() or np.abs(points).max() > 1e3 * MAX_SIDE_MM:
            raise self.refuse(f"{what} has an impossible coordinate; write millimetres")
        return points

    def defects(self) -> list[Any]:
        """Return the defects as polygons around them."""
        tables = enumerate(self.table.defects or (), start=1)
        return [self.defect(number, table) for number, table in tables]

    def defect(self, number: int, table: dict[str, Any]) -> Any:
        """Return one defect as a polygon around it."""
        what, keys = f"defect {number}", sorted(table)
        if keys == ["polygon"]:
            ring = self.points(table["polygon"], what)
            if not shapely.is_valid(shapely.Polygon(ring)):
                raise self.refuse(
                    f"the polygon of {what} crosses itself; draw it without crossings"
                )
            return ring
        if keys not in (["diameter", "x", "y"], ["height", "width", "x", "y"]):
            raise self.refuse(f"{what} has {', '.join(keys) or 'nothing'}; write {_FORMS}")
        values = {key: self.length(f"{key} of {what}", table[key]) for key in keys}
        if min(values[key] for key in keys if key not in "xy") <= 0.0:
            raise self.refuse(f"{what} has no size; give it one, or leave it out")
        corner = np.array([values["x"], values["y"]])
        if "diameter" in values:
            return _around(corner, values["diameter"] / 2.0, _CORNERS)
        sides = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        return corner + sides * np.array([values["width"], values["height"]])

    def length(self, what: str, value: Any) -> float:
        """Return a length: millimetres, or a text with a unit."""
        if isinstance(value, str):
            try:
                return parse_length(value, what=what, zero_ok=True)
            except InputError as error:
                raise self.refuse(str(error)) from error
        length: float | None = in_range(-MAX_SIDE_MM, MAX_SIDE_MM)(value)
        if length is None:
            raise self.refuse(f"{what} is {shown(value, 40)}, but must be a length within a sheet")
        return length


def _around(centre: Any, radius: float, count: int) -> FloatArray:
    """Return a polygon whose sides touch a circle: nothing of a hole or a defect is forgotten."""
    angle = np.arange(count) * (2.0 * np.pi / count)
    reach = radius / np.cos(np.pi / count)
    return np.asarray(centre) + reach * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _ring(points: Any) -> Ring:
    """Return points as they are kept."""
    rounded: list[list[float]] = (np.round(points, _DECIMALS) + 0.0).tolist()
    return tuple((x, y) for x, y in rounded)
