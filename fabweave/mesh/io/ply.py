"""Read polygon meshes in PLY, text or binary."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.mesh.io.mesh_file import MeshFile
from fabweave.mesh.io.text import Rows, checked_mesh, number_rows, text_lines

# The byte order of each format; text has none.
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
_END = re.compile(rb"[\r\n][ \t]*end_header[ \t]*(\r\n|\n|\r|\Z)")
_FACE_LISTS = ("vertex_indices", "vertex_index", "vertex_indexes")
#: Elements that hold faces, and one after another what is taken where the one before is absent.
_FACES, _STRIPS = "face", "tristrips"

#: How many values each row has of one property (1 unless that is a list), and all values.
_Column: TypeAlias = tuple[IntArray, npt.NDArray[Any]]


@dataclass(frozen=True)
class _Property:
    """One property: its name, numpy type code, and for a list the type code of its count."""

    name: str
    kind: str
    count: str = ""


@dataclass(frozen=True)
class _Element:
    """One element: its name, how many there are, and their properties in order."""

    name: str
    number: int
    properties: list[_Property]


def read_ply(data: bytes, name: str) -> MeshFile:
    r"""Read the bytes of a PLY file: text, little-endian or big-endian.

    Positions and faces are read, or strips of triangles where there are no faces; other properties
    and elements, before or after them, are passed over.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Returns
    -------
    MeshFile
        Vertices and faces in the order of the file.

    Raises
    ------
    InputError
        If the header cannot be understood, the file is cut short, or a face names a vertex that
        does not exist.

    Examples
    --------
    >>> header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    >>> header += "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
    >>> body = "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    >>> read_ply((header + body).encode(), "a.ply").mesh.faces()
    [[0, 1, 2]]
    """
    order, elements, start = _read_head(data, name)
    if order:
        tables = _binary_tables(data, start, order, elements, name)
    else:
        tables = _text_tables(data, start, elements, name)
    points: npt.NDArray[Any] | None = None
    faces: dict[str, _Column] = {}
    for element, columns in zip(elements, tables, strict=True):
        names = [item.name for item in element.properties]
        if element.name == "vertex" and points is None:
            if not {"x", "y", "z"} <= set(names):
                raise InputError(
                    f"{name}: the header gives the vertices no properties x, y and z; it gives "
                    f"{', '.join(names) or 'none'}"
                )
            points = np.column_stack([columns[names.index(axis)][1] for axis in "xyz"])
        elif element.name in (_FACES, _STRIPS) and not len(faces.get(element.name, ([],))[0]):
            faces[element.name] = columns[_corners_at(element, name)]
        if points is not None and len(faces.get(_FACES, ([],))[0]):
            break
    if points is None:
        raise InputError(f"{name}: the file has no vertices (no element 'vertex' in its header)")
    if not faces:
        raise InputError(
            f"{name}: the file has no faces (no element 'face' in its header); is it a point "
            "cloud? export it again with polygon faces"
        )
    with np.errstate(invalid="ignore"):  # a signalling "not a number" is left to the mesh check
        points = points.astype(np.float64)
    sizes, corners = faces.get(_FACES, ([], []))
    if not len(sizes) and _STRIPS in faces:
        sizes, corners = _of_strips(*faces[_STRIPS])
    return MeshFile(checked_mesh(name, points, np.asarray(sizes), np.asarray(corners)), "ply")


def _corners_at(element: _Element, name: str) -> int:
    """Return which property of faces lists their corners: by its name, or as the only list."""
    lists = [at for at, item in enumerate(element.properties) if item.count]
    named = [at for at in lists if element.properties[at].name in _FACE_LISTS]
    if not named and (len(lists) != 1 or element.properties[lists[0]].kind[0] == "f"):
        raise InputError(
            f"{name}: the header gives the {element.name} no list property called "
            f"{' or '.join(_FACE_LISTS)}"
        )
    return (named or lists)[0]


def _of_strips(sizes: IntArray, corners: npt.NDArray[Any]) -> _Column:
    """Return the triangles of strips; -1 ends a strip, and every second triangle is turned."""
    ends = offsets_of(sizes)
    begins = np.zeros(len(corners) + 1, dtype=np.bool_)
    begins[ends] = True
    begins[1:] |= corners == -1
    start = np.maximum.accumulate(
        np.where(begins[:-1] | (corners == -1), np.arange(len(corners)) + (corners == -1), 0)
    )
    at = np.arange(max(0, len(corners) - 2))
    odd = (at - start[at]) % 2
    triangles = np.column_stack([corners[at], corners[at + 1 + odd], corners[at + 2 - odd]])
    a, b, c = triangles.T
    real = (start[at] == start[at + 2]) & (a != b) & (b != c) & (c != a) & (corners[at] != -1)
    return np.full(int(real.sum()), 3), triangles[real].reshape(-1)


def _read_head(data: bytes, name: str) -> tuple[str, list[_Element], int]:
    """Return the byte order, the elements, and how many bytes the header has."""
    if not re.match(rb"ply\s", data):
        raise InputError(f"{name}, line 1: expected the word ply here")
    end = _END.search(data)
    if end is None:
        raise InputError(f"{name}: the header has no line end_header")
    order = None
    elements: list[_Element] = []
    head = data[: end.start()].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    for number, line in enumerate(head.split("\n")[1:], start=2):
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", kind, *_] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", what, count] if count.isascii() and count.isdigit():
                elements.append(_Element(what, int(count), []))
            case ["property", "list", count, kind, what] if (
                elements and kind in _TYPES and _TYPES.get(count, "f")[0] != "f"
            ):
                elements[-1].properties.append(_Property(what, _TYPES[kind], _TYPES[count]))
            case ["property", kind, what] if elements and kind in _TYPES:
                elements[-1].properties.append(_Property(what, _TYPES[kind]))
            case _:
                raise InputError(
                    f"{name}, line {number}: {line[:60]!r} is no format ({', '.join(_ORDERS)}), "
                    f"no element with a number, and no property with a type ({', '.join(_TYPES)})"
                )
    if order is None:
        raise InputError(f"{name}: the header has no line that begins with format")
    return order, elements, end.end()


def _text_tables(
    data: bytes, start: int, elements: Iterable[_Element], name: str
) -> Iterator[list[_Column]]:
    """Yield the columns of each element in a text file, with one line for each row."""
    before = len(text_lines(data[:start]))
    texts = text_lines(data[start:])
    lines = [at for at, text in enumerate(texts) if text]
    wanted = [element.number if element.properties else 0 for element in elements]
    everything = None
    if len(lines) < sum(wanted):  # maybe lines end elsewhere
        numbers = [before + at + 1 for at in lines]
        everything = number_rows(name, numbers, [texts[at] for at in lines])
    first = 0
    for element, count in zip(elements, wanted, strict=True):
        if everything is None:
            some = lines[first : first + count]
            first += count
            rows = number_rows(name, [before + at + 1 for at in some], [texts[at] for at in some])
        else:
            rows, first = _one_a_row(everything, element, count, first)
        at = rows.offsets[:-1]
        columns: list[_Column] = []
        for item in element.properties:
            ones = np.ones(count, dtype=np.int64)
            sizes, values = rows.lists(at) if item.count else (ones, rows.scalars(at))
            columns.append((sizes, values))
            at = at + sizes + bool(item.count)
        yield columns


def _one_a_row(rows: Rows, element: _Element, count: int, first: int) -> tuple[Rows, int]:
    """Return the rows of an element among numbers whose lines end anywhere, and what follows."""
    bounds = [first]
    while len(bounds) <= count and bounds[-1] < len(rows.values):
        at = bounds[-1]
        for item in element.properties:
            size = rows.values[at] if item.count and at < len(rows.values) else 0.0
            at += 1 + int(np.nan_to_num(size).clip(0, len(rows.values)))
        bounds.append(at)
    if len(bounds) <= count or bounds[-1] > len(rows.values):
        raise InputError(
            f"{rows.name}, at the end of the file: only {max(0, len(bounds) - 2)} of {count} rows "
            f"of element {element.name!r} are there"
        )
    line = np.searchsorted(rows.offsets, bounds[:-1], side="right") - 1
    return Rows(rows.name, rows.lines[line], np.array(bounds), rows.values), bounds[-1]


def _binary_tables(
    data: bytes, start: int, order: str, elements: Iterable[_Element], name: str
) -> Iterator[list[_Column]]:
    """Yield the columns of each element in a binary file."""
    for element in elements:
        # Most files have faces of one size: take the first row's and see.
        columns, _ = _walk(data, start, order, element, min(element.number, 1), name)
        fields: list[tuple[str, str, tuple[int, ...]]] = []
        for at, (item, (sizes, _)) in enumerate(zip(element.properties, columns, strict=True)):
            fields += [(f"n{at}", order + item.count, ())] if item.count else []
            fields.append((f"p{at}", order + item.kind, tuple(sizes.tolist())))
        kind = np.dtype(fields)
        if element.number > 1 and kind.itemsize:
            count = min(element.number, (len(data) - start) // kind.itemsize)
            rows = np.frombuffer(data, kind, count=count, offset=start)
            counted = [at for at, item in enumerate(element.properties) if item.count]
            if count == element.number and all(
                np.all(rows[f"n{at}"] == columns[at][0]) for at in counted
            ):
                columns = [
                    (np.repeat(sizes, count), rows[f"p{at}"].reshape(-1))
                    for at, (sizes, _) in enumerate(columns)
                ]
                start += rows.nbytes
                yield columns
                continue
        columns, start = _walk(data, start, order, element, element.number, name)
        yield columns


def _walk(
    data: bytes, start: int, order: str, element: _Element, n_rows: int, name: str
) -> tuple[list[_Column], int]:
    """Read the first rows of an element, each of which begins where the one before it ends."""
    sizes: list[list[int]] = [[] for _ in element.properties]
    parts: list[list[bytes]] = [[] for _ in element.properties]
    at = start
    for row in range(n_rows if element.properties else 0):
        for column, item in enumerate(element.properties):
            count = 1
            if item.count:
                stated = data[at : at + int(item.count[1:])]
                count = int.from_bytes(
                    stated, "little" if order == "<" else "big", signed=item.count[0] == "i"
                )
                at += int(item.count[1:])
            end = at + count * int(item.kind[1:])
            if count < 0 or end > len(data):
                raise InputError(
                    f"{name}, byte {at}: the file ends in row {row} of {element.number} of "
                    f"element {element.name!r}, or the length of a list in it is wrong"
                )
            sizes[column].append(count)
            parts[column].append(data[at:end])
            at = end
    columns = [
        (np.array(size, dtype=np.int64), np.frombuffer(b"".join(part), order + item.kind))
        for size, part, item in zip(sizes, parts, element.properties, strict=True)
    ]
    return columns, at
