"""Read polygon meshes in PLY, text or binary, and write them as text."""

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.io.lines import Line, checked_mesh, text_lines
from fabweave.mesh.io.obj import counted_face_lines, vertex_lines
from fabweave.mesh.polymesh import PolyMesh

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
_END = re.compile(rb"^[ \t]*end_header[ \t]*(\r\n|\n|\r|\Z)", re.MULTILINE)
_END_OLD_MAC = re.compile(rb"\r[ \t]*end_header[ \t]*\r")


#: Scanners write some twenty properties; time grows with the square of their number.
_MOST_NAMED = 1000
_FACE_LISTS = ("vertex_indices", "vertex_index")


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


def read_ply(data: bytes, name: str) -> tuple[PolyMesh, tuple[str, ...]]:
    r"""Read the bytes of a PLY file: text, little-endian or big-endian.

    Positions and faces are read, or triangle strips where there are no faces; other properties
    and elements, before or after them, are passed over.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Returns
    -------
    mesh : PolyMesh
        Vertices and faces in the order of the file.
    notes : tuple of str
        What a person should know.

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
    >>> read_ply((header + body).encode(), "a.ply")[0].faces()
    [[0, 1, 2]]
    """
    order, elements, start, n_lines = _read_head(data, name)
    lines = text_lines(b"" if order else data[start:], name, first=n_lines + 1)
    vertices: npt.NDArray[Any] | None = None
    lists: dict[str, tuple[IntArray, npt.NDArray[Any]]] = {}
    for element in elements:
        columns: list[tuple[IntArray, npt.NDArray[Any]]] = []
        rows: list[Line] = []
        if order:
            columns, start = _binary_columns(data, start, order, element, name)
        else:
            rows = _text_rows(lines, element, name)
        if element.name == "vertex" and vertices is None:
            axes = _axes(element, name)
            if order:
                vertices = np.column_stack([columns[axis][1] for axis in axes])
            else:
                vertices = _text_scalars(rows, element, axes)
        elif element.name in ("face", "tristrips") and element.name not in lists:
            at = _face_list(element, name)
            lists[element.name] = columns[at] if order else _text_lists(rows, element, at)
        if vertices is not None and "face" in lists and len(lists["face"][0]):
            break
    if vertices is None:
        raise InputError(f"{name}: the file has no vertices (no element 'vertex' in its header)")
    with np.errstate(invalid="ignore"):  # a signalling "not a number" is left to the mesh check
        vertices = vertices.astype(np.float64)
    if "tristrips" in lists and not ("face" in lists and len(lists["face"][0])):
        sizes, items = lists["tristrips"]
        triangles = _triangles_of_strips(sizes, items.astype(np.int64))
        number = agree(len(sizes), "{n} [row|rows] of triangle strips")
        note = f"the file has {number}, which were read as {len(triangles)} triangles"
        mesh = checked_mesh(name, vertices, np.full(len(triangles), 3), triangles.ravel())
        return mesh, (note,)
    if "face" not in lists:
        raise InputError(
            f"{name}: the file has no faces (no element 'face' in its header); is it a point "
            "cloud? export it again with polygon faces"
        )
    return checked_mesh(name, vertices, *lists["face"]), ()


def _axes(element: _Element, name: str) -> list[int]:
    """Return which properties of the vertices are x, y and z."""
    names = [item.name for item in element.properties]
    lists = [number for number, item in enumerate(element.properties) if item.count]
    scalars = names[: min(lists, default=len(names))]
    if not {"x", "y", "z"} <= set(scalars):
        raise InputError(
            f"{name}: the header gives the vertices no properties x, y and z before any list; "
            f"it gives {', '.join(names) or 'none'}"
        )
    return [scalars.index(axis) for axis in "xyz"]


def _face_list(element: _Element, name: str) -> int:
    """Return which property of the faces is the list of vertices."""
    for position, item in enumerate(element.properties):
        if item.name in _FACE_LISTS and item.count:
            if item.kind[0] == "f":
                raise InputError(f"{name}: the faces' vertex numbers are not whole numbers")
            return position
    raise InputError(
        f"{name}: the header gives the faces no list property called vertex_indices or vertex_index"
    )


def _triangles_of_strips(counts: IntArray, items: IntArray) -> IntArray:
    """Return the triangles of strips of vertices, (T, 3).

    A strip ends with its row, or at a vertex of -1. Every other triangle runs the other way round,
    and those with a vertex twice only lead from one place to another.
    """
    row = np.repeat(np.arange(len(counts)), counts)
    ends = items == -1
    fresh = np.ones(len(items), dtype=bool)
    fresh[1:] = (row[1:] != row[:-1]) | ends[:-1]
    start = np.maximum.accumulate(np.where(fresh, np.arange(len(items)), 0))
    at = np.arange(max(len(items) - 2, 0))
    at = at[(start[at] == start[at + 2]) & ~ends[at + 2]]
    odd = (at - start[at]) % 2 == 1
    first, second = np.where(odd, at + 1, at), np.where(odd, at, at + 1)
    triangles = np.column_stack((items[first], items[second], items[at + 2]))
    a, b, c = triangles.T
    return np.asarray(triangles[(a != b) & (b != c) & (c != a)])


def _read_head(data: bytes, name: str) -> tuple[str, list[_Element], int, int]:
    """Return the byte order, the elements, and how many bytes and lines the header has."""
    if data[:3] != b"ply" or data[3:4] not in (b"\n", b"\r", b" ", b"\t"):
        raise InputError(f"{name}, line 1: expected the word ply here")
    end = _END_OLD_MAC.search(data) if b"\n" not in data[:5] else None
    end = end or _END.search(data)
    if end is None:
        raise InputError(f"{name}: the header has no line end_header")
    text = data[: end.start()].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.rstrip("\n").split("\n")
    order = None
    elements: list[_Element] = []
    for number, line in enumerate(lines[1:], start=2):
        words = line.split()
        try:
            if not words or words[0] in ("comment", "obj_info"):
                continue
            if words[0] == "format":
                order = _ORDERS.get("".join(words[1:2]))
                if order is None:
                    raise ValueError(f"the format must be {', '.join(_ORDERS)}")  # noqa: TRY301 -- one place adds the line number
            elif words[0] == "element":
                elements.append(_element(words))
            elif words[0] == "property" and elements:
                elements[-1].properties.append(_property(words))
            else:
                raise ValueError("this line is not a format, an element, a property or a comment")  # noqa: TRY301 -- as above
            if max(len(elements), *(len(one.properties) for one in elements[-1:]), 0) > _MOST_NAMED:
                raise ValueError(  # noqa: TRY301 -- as above
                    f"there are more than {_MOST_NAMED} elements, or properties of an element; "
                    "export positions and faces only"
                )
        except ValueError as error:
            raise InputError(f"{name}, line {number}: {line[:60]!r}: {error}") from None
    if order is None:
        raise InputError(f"{name}: the header has no line that begins with format")
    return order, elements, end.end(), len(lines) + 1


def _element(words: list[str]) -> _Element:
    if len(words) != 3 or not (words[2].isascii() and words[2].isdigit() and len(words[2]) < 19):
        raise ValueError("an element needs a name and a number")
    return _Element(words[1], int(words[2]), [])


def _property(words: list[str]) -> _Property:
    is_list = words[1:2] == ["list"]
    kinds = words[2:4] if is_list else words[1:2]
    if len(words) != (5 if is_list else 3):
        raise ValueError(
            "a property needs a type and a name, or the word list, two types and a name"
        )
    unknown = [kind for kind in kinds if kind not in _TYPES]
    if unknown:
        raise ValueError(f"unknown type {unknown[0]!r}; the types are {', '.join(_TYPES)}")
    codes = [_TYPES[kind] for kind in kinds]
    if is_list and codes[0][0] == "f":
        raise ValueError("the length of a list must be a whole number")
    return _Property(words[-1], codes[-1], codes[0] if is_list else "")


def _text_rows(lines: Iterator[Line], element: _Element, name: str) -> list[Line]:
    """Return the lines of an element in a text file."""
    wanted = element.number if element.properties else 0
    rows = list(islice(lines, wanted))
    if len(rows) < wanted:
        raise InputError(
            f"{name}, at the end of the file: only {len(rows)} of {wanted} rows of element "
            f"{element.name!r} are there"
        )
    return rows


def _text_scalars(rows: list[Line], element: _Element, positions: list[int]) -> FloatArray:
    """Return some properties of an element that come before any list, (N, positions)."""
    values = array("d")
    for line in rows:
        words = line.text.split()
        if len(words) < len(element.properties):  # every property, a list too, takes a word
            what = f"found {len(words)} numbers, but expected {len(element.properties)} or more"
            raise line.fault(what)
        values.extend(line.floats([words[position] for position in positions]))
    return np.asarray(values, dtype=np.float64).reshape(-1, len(positions))


def _text_lists(rows: list[Line], element: _Element, position: int) -> tuple[IntArray, IntArray]:
    """Return one list property of an element: the lengths, and all items in one array."""
    sizes, items = array("q"), array("q")
    for line in rows:
        words = line.text.split()
        at = 0
        for item in element.properties[:position]:
            at += 1 + (len(line.counted(words, at)) if item.count else 0)
        corners = line.integers(line.counted(words, at))
        sizes.append(len(corners))
        items.extend(corners)
    return np.asarray(sizes, dtype=np.int64), np.asarray(items, dtype=np.int64)


def _binary_columns(
    data: bytes, start: int, order: str, element: _Element, name: str
) -> tuple[list[tuple[IntArray, npt.NDArray[Any]]], int]:
    """Return each property of an element, as lengths and values of its rows, and its last byte."""
    if not element.properties or not element.number:
        return _walk(data, start, order, element, 0, name)
    # Most files have faces of one size: take the first row's and see.
    first, _ = _walk(data, start, order, element, 1, name)
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for at, (item, (sizes, _)) in enumerate(zip(element.properties, first, strict=True)):
        if item.count:
            fields.append((f"n{at}", order + item.count))
        fields.append((f"p{at}", order + item.kind, (int(sizes[0]),)))
    kind = np.dtype(fields)
    if kind.itemsize * element.number <= len(data) - start:
        records = np.frombuffer(data, kind, count=element.number, offset=start)
        columns = []
        for at, (item, (sizes, _)) in enumerate(zip(element.properties, first, strict=True)):
            if item.count and not np.all(records[f"n{at}"] == sizes[0]):
                break
            columns.append((np.repeat(sizes, element.number), records[f"p{at}"].reshape(-1)))
        else:
            return columns, start + records.nbytes
    return _walk(data, start, order, element, element.number, name)


def _walk(
    data: bytes, start: int, order: str, element: _Element, n_rows: int, name: str
) -> tuple[list[tuple[IntArray, npt.NDArray[Any]]], int]:
    """Read the first rows of an element, each of which begins where the one before it ends."""
    sizes = [array("q") for _ in element.properties]
    parts: list[list[bytes]] = [[] for _ in element.properties]
    at = start
    for row in range(n_rows):
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
        (np.asarray(size, dtype=np.int64), np.frombuffer(b"".join(part), order + item.kind))
        for size, part, item in zip(sizes, parts, element.properties, strict=True)
    ]
    return columns, at


def ply_bytes(mesh: PolyMesh) -> bytes:
    r"""Return the bytes of a PLY text file; reading them gives the same numbers back.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.

    Returns
    -------
    bytes
        The same mesh gives the same bytes.

    Examples
    --------
    >>> mesh = PolyMesh.from_faces([[0, 0, 0], [0.1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> ply_bytes(mesh).splitlines()[-1]
    b'3 0 1 2'
    """
    small = mesh.n_faces == 0 or int(mesh.face_sizes.max()) < 256
    lines = ["ply", "format ascii 1.0", f"element vertex {mesh.n_vertices}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines.append(f"element face {mesh.n_faces}")
    lines.append(f"property list {'uchar' if small else 'int'} int vertex_indices")
    lines.append("end_header")
    lines += vertex_lines(mesh) + counted_face_lines(mesh)
    return ("\n".join(lines) + "\n").encode("ascii")
