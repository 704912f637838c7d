"""Read the numbers of text files row by row, and polygon meshes in OBJ and OFF from them.

Rows are read all at once; only where a word is no number, the line that holds it is looked for.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import chain

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    frozen_value,
    offsets_of,
    places_in_groups,
)
from fabweave.core.errors import InputError
from fabweave.mesh.io.mesh_file import MeshFile
from fabweave.mesh.polymesh import PolyMesh

#: What Microsoft's libraries write for numbers that are none.
_NOT_NUMBER = re.compile(rb"\d\.#(?:(INF)|IND|QNAN|SNAN)0*|nan\(\w*\)", re.IGNORECASE)
#: Vertices and faces that go on in the next line; elsewhere a backslash may end the name of a path.
_CONTINUED = re.compile(rb"^[ \t]*[vf][ \t](?:.*\\[ \t]*\n)+.*", re.MULTILINE)


def text_lines(data: bytes, *, continued: bool = False) -> list[bytes]:
    r"""Return the lines of a text file without comments, whatever its line ends and encoding.

    Parameters
    ----------
    data : bytes
        A comment runs from ``#`` to the end of the line.
    continued : bool
        Whether a backslash at the end of a vertex or a face joins it with the next line, which is
        empty then.

    Examples
    --------
    >>> text_lines(b"# head\r\n1 2 # two\r\n3\r\n")
    [b'', b'1 2', b'3']
    """
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b".#" in data or b"nan(" in data.lower():
        data = _NOT_NUMBER.sub(lambda found: b"inf" if found[1] else b"nan", data)
    if b"#" in data:
        data = re.sub(rb"#.*", b"", data)
    if continued and b"\\" in data:
        data = _CONTINUED.sub(
            lambda found: re.sub(rb"\\[ \t]*\n", b" ", found[0]) + b"\n" * found[0].count(b"\n"),
            data,
        )
    return [line.strip() for line in data.splitlines()]


@frozen_value
class Rows:
    """Rows of numbers in a text file.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    lines : (R,) int array
        The line of each row, counted from 1.
    offsets : (R + 1,) int array
        Row ``r`` owns the numbers ``offsets[r]:offsets[r + 1]``.
    values : (N,) float array
    """

    name: str
    lines: IntArray
    offsets: IntArray
    values: FloatArray

    def require(self, fits: BoolArray, what: str) -> None:
        """Raise InputError with the line of the first row that does not fit."""
        if not fits.all():
            raise _fault(self.name, self.lines[np.argmin(fits)], what)

    def scalars(self, at: IntArray) -> FloatArray:
        """Return one number of each row, from its place among all."""
        self.require(at < self.offsets[1:], "the line has too few numbers")
        return self.values[at]

    def lists(self, at: IntArray) -> tuple[IntArray, FloatArray]:
        """Return the sizes and the items of the lists that begin with their sizes."""
        sizes = self.scalars(at)
        self.require(
            (sizes >= 0) & (sizes < self.offsets[1:] - at) & (sizes == np.floor(sizes)),
            "a list does not have as many numbers as it says",
        )
        counts = sizes.astype(np.int64)
        return counts, self.values[np.repeat(at + 1, counts) + places_in_groups(counts)]

    def positions(self) -> FloatArray:
        """Return the first three numbers of each row."""
        return np.column_stack([self.scalars(self.offsets[:-1] + axis) for axis in range(3)])


def number_rows(name: str, lines: Sequence[int], texts: Sequence[bytes]) -> Rows:
    """Return lines of a text file as numbers.

    Parameters
    ----------
    name : str
        Name of the file.
    lines : sequence of int
        The number of each line.
    texts : sequence of bytes
        What it holds.

    Raises
    ------
    InputError
        If a word is no number; its line is named.
    """
    try:
        values = np.fromiter(map(float, b" ".join(texts).split()), np.float64)
    except ValueError:
        for line, text in zip(lines, texts, strict=True):
            for word in text.split():
                try:
                    float(word)
                except ValueError:
                    shown = word[:40].decode("latin-1")
                    raise _fault(name, line, f"found {shown!r} instead of a number") from None
        raise
    sizes = np.fromiter((len(text.split()) for text in texts), np.int64, len(texts))
    return Rows(name, np.array(lines, dtype=np.int64), offsets_of(sizes), values)


def _fault(name: str, line: int, what: str) -> InputError:
    return InputError(f"{name}, line {line}: {what}")


def checked_mesh(
    name: str,
    points: npt.NDArray[np.floating],
    sizes: IntArray,
    corners: npt.NDArray[np.floating | np.integer],
    *,
    lines: Sequence[int] | IntArray = (),
    counted_from: int = 0,
) -> PolyMesh:
    """Return the mesh that was read, if each vertex that its faces name exists.

    Parameters
    ----------
    name : str
        Name of the file.
    points : (V, 3) array
    sizes, corners : arrays
        Corners of each face, and their vertices, counted from 0.
    lines : sequence of int
        The line of each face, where the file has lines.
    counted_from : {0, 1}
        What the file counts vertices from, for the message.

    Raises
    ------
    InputError
        If a face names a vertex that does not exist; the first is named.
    """
    offsets = offsets_of(sizes)
    fits = (corners >= 0) & (corners < len(points)) & (corners == np.floor(corners))
    if not fits.all():
        at = int(np.argmin(fits))
        face = int(np.searchsorted(offsets, at, side="right")) - 1
        raise InputError(
            f"{name}, {f'line {lines[face]}' if len(lines) else f'face {face}'}: a face names "
            f"vertex {corners[at] + counted_from:.15g}, but there are only {len(points)}, counted "
            f"from {counted_from}"
        )
    return PolyMesh(points.astype(np.float64), offsets, corners.astype(np.int64))


#: The numbers of texture and normal that follow that of a vertex.
_NUMBERS = re.compile(rb"/\S*")


def read_obj(data: bytes, name: str) -> MeshFile:
    r"""Read the bytes of an OBJ file.

    Vertices (``v``, with or without weight or colour) and faces (``f``, of any size, with or
    without texture and normal numbers, absolute or relative) are read; objects and groups are
    joined; every other statement is passed over.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Returns
    -------
    MeshFile
        Vertices in the order of the file.

    Raises
    ------
    InputError
        If a vertex or face cannot be read, or a face names a vertex that does not exist.

    Examples
    --------
    >>> read_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2/1 -1//1\n", "a.obj").mesh.faces()
    [[0, 1, 2]]
    """
    lines = text_lines(data, continued=True)
    of_vertex, of_face = (
        [at for at, line in enumerate(lines, start=1) if line.startswith(kind)]
        for kind in ((b"v ", b"v\t"), (b"f ", b"f\t"))
    )
    points = number_rows(name, of_vertex, [lines[at - 1][1:] for at in of_vertex]).positions()
    corners = [_NUMBERS.sub(b"", lines[at - 1][1:]) for at in of_face]
    faces = number_rows(name, of_face, corners)
    sizes = np.diff(faces.offsets)
    faces.require(sizes > 0, "a face has no corners")
    # Numbers below zero count back from the vertices so far; zero is none.
    known = np.repeat(np.searchsorted(of_vertex, of_face), sizes)
    index = np.where(faces.values > 0, faces.values - 1, known + faces.values)
    index[faces.values == 0] = -1
    mesh = checked_mesh(name, points, sizes, index, lines=of_face, counted_from=1)
    return MeshFile(mesh, "obj")


_KEYWORD = re.compile(rb"((?:ST|C|N)*)(4?n?)OFF")
#: Numbers that a letter of the keyword adds to each vertex.
_EXTRA = {b"ST": 2, b"C": 4, b"N": 3}


def read_off(data: bytes, name: str) -> MeshFile:
    r"""Read the text of an OFF file.

    The keyword may be absent or have prefixes (``ST``, ``C``, ``N``) whose numbers are passed over,
    as are the colours of faces. The format parts items by any blanks: in files without one line for
    each item, all that the keyword promises for each vertex must be there.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Returns
    -------
    MeshFile
        Vertices in the order of the file.

    Raises
    ------
    InputError
        If the file cannot be read, or a face names a vertex that does not exist.

    Examples
    --------
    >>> read_off(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "a.off").mesh.faces()
    [[0, 1, 2]]
    """
    if re.match(rb"\s*\w*OFF[ \t]+BINARY", data):
        raise InputError(f"{name}: binary OFF cannot be read; export it as text, or as PLY or OBJ")
    texts = text_lines(data)
    lines = [number for number, text in enumerate(texts, start=1) if text]
    if not lines:
        raise InputError(f"{name}: the file contains nothing but blank lines and comments")
    width, n_vertices, n_faces, after = _off_header(name, texts, lines)
    number = n_vertices + n_faces
    spare = len(lines) - after - number
    lines = lines[after : after + number]
    rows = number_rows(name, lines, [texts[line - 1] for line in lines])
    if spare < 0:
        rows = _one_a_row(rows, n_vertices, n_faces, width)
    points, faces = _some(rows, slice(n_vertices)), _some(rows, slice(n_vertices, number))
    positions = points.positions()
    mesh = checked_mesh(name, positions, *faces.lists(faces.offsets[:-1]), lines=faces.lines)
    notes = (f"{spare} lines after the last face were ignored",) if spare > 0 else ()
    return MeshFile(mesh, "off", notes=notes)


def _some(rows: Rows, some: slice) -> Rows:
    """Return a run of rows."""
    bounds = rows.offsets[some.start or 0 : some.stop + 1]
    return Rows(rows.name, rows.lines[some], bounds, rows.values)


def _off_header(name: str, texts: list[bytes], lines: list[int]) -> tuple[int, int, int, int]:
    """Return the numbers of each vertex, of vertices and of faces, and the lines that say so."""
    first = texts[lines[0] - 1].split()
    keyword = _KEYWORD.fullmatch(first[0])
    if keyword is None and not first[0].isdigit():  # the format lets the keyword be absent
        shown = first[0][:40].decode("latin-1")
        raise _fault(name, lines[0], f"found {shown!r} instead of the word OFF")
    if keyword is not None and keyword[2]:
        what = f"{first[0].decode()} is not in three dimensions; export as plain OFF"
        raise _fault(name, lines[0], what)
    width = 3
    after, counts = 1, first
    if keyword is not None:
        width += sum(_EXTRA[letter] for letter in re.findall(b"ST|C|N", keyword[1]))
        counts = first[1:]
        if not counts and len(lines) > 1:
            after, counts = 2, texts[lines[1] - 1].split()
    if len(counts) not in (2, 3) or not all(word.isdigit() for word in counts):
        what = "expected the numbers of vertices, faces and edges here"
        raise _fault(name, lines[after - 1], what)
    return width, int(counts[0]), int(counts[1]), after


def _one_a_row(rows: Rows, n_vertices: int, n_faces: int, width: int) -> Rows:
    """Divide numbers into rows that hold one vertex or one face each, wherever lines end."""
    room = len(rows.values)
    bounds = list(range(0, n_vertices * width + 1, width)) if n_vertices * width < room else [room]
    while len(bounds) <= n_vertices + n_faces and bounds[-1] < room:
        bounds.append(bounds[-1] + 1 + int(np.nan_to_num(rows.values[bounds[-1]]).clip(0, room)))
    if len(bounds) != n_vertices + n_faces + 1 or bounds[-1] != room:
        raise InputError(
            f"{rows.name}, at the end of the file: its numbers are not those of {n_vertices} "
            f"vertices and {n_faces} faces"
        )
    row = np.searchsorted(rows.offsets, bounds[:-1], side="right") - 1
    return Rows(rows.name, rows.lines[row], np.array(bounds), rows.values)


def obj_bytes(mesh: PolyMesh) -> bytes:
    r"""Return a mesh as the bytes of an OBJ file.

    Parameters
    ----------
    mesh : PolyMesh
        Every face has corners.

    Returns
    -------
    bytes
        Reading them gives the same faces and exactly the same positions.

    Raises
    ------
    InputError
        If a face has no corners, or names a vertex that does not exist.

    Examples
    --------
    >>> obj_bytes(PolyMesh.from_faces([[0, 0, 0], [0.1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    b'v 0.0 0.0 0.0\nv 0.1 0.0 0.0\nv 0.0 1.0 0.0\nf 1 2 3\n'
    """
    wrong = np.flatnonzero((mesh.indices < 0) | (mesh.indices >= mesh.n_vertices))
    if len(wrong):
        raise InputError(
            f"{len(wrong)} corners name vertices that do not exist (first: vertex "
            f"{mesh.indices[wrong[0]]} of {mesh.n_vertices}); check the mesh before writing it"
        )
    empty = np.flatnonzero(mesh.face_sizes == 0)
    if len(empty):
        raise InputError(
            f"{len(empty)} faces have no corners (first: face {empty[0]}); OBJ cannot hold them; "
            "remove them first"
        )
    rows: Iterable[str] = chain(
        (f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()),
        (" ".join(["f", *[str(vertex + 1) for vertex in face]]) for face in mesh.faces()),
    )
    return ("\n".join(rows) + "\n").encode("ascii")
