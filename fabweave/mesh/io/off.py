"""Read and write polygon meshes in OFF, as text and as binary."""

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.mesh.io.number_rows import first_columns, float_numbers, parse_int, row_lists
from fabweave.mesh.io.obj import counted_face_lines, vertex_lines
from fabweave.mesh.io.token_rows import Rows, text_rows
from fabweave.mesh.polymesh import PolyMesh

_KEYWORD = re.compile(r"((?:ST|C|N)*)(4?n?)OFF")
_BINARY = re.compile(rb"\s*((?:ST|C|N)*)OFF[ \t]+BINARY[ \t]*\r?\n")
#: Numbers that a letter of the keyword adds to each vertex.
_EXTRA = {"ST": 2, "C": 4, "N": 3}


def read_off(data: bytes, name: str) -> tuple[PolyMesh, tuple[str, ...]]:
    r"""Read the bytes of an OFF file, text or binary.

    The keyword may carry ``ST``, ``C`` and ``N`` and may stand on the line of the counts;
    comments, colours and normals are passed over.

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
        If the file is not an OFF file, is cut short, or names a vertex that does not exist.

    Examples
    --------
    >>> mesh, notes = read_off(b"OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n", "a.off")
    >>> mesh.faces()
    [[0, 1, 2]]
    """
    binary = _BINARY.match(data)
    if binary:
        extra = _extra_numbers(binary.group(1).decode("ascii"))
        return _read_binary(data, binary.end(), name, extra)
    rows = text_rows(data, name)
    if not len(rows):
        raise InputError(f"{name}: the file contains nothing but blank lines and comments")
    extra, n_vertices, n_faces, rows = _text_header(rows)
    if len(rows) < n_vertices + n_faces:
        return _read_stream(rows, n_vertices, n_faces, extra), ()
    vertices = first_columns(rows.cut(0, n_vertices), 3)
    face_rows = rows.cut(n_vertices, n_vertices + n_faces)
    # One face a line; what follows its corners is a colour.
    sizes, indices = row_lists(face_rows, np.zeros(n_faces, dtype=np.int64))
    check_range(sizes, indices, n_vertices, name, face_rows)
    spare = len(rows) - n_vertices - n_faces
    notes = (f"{spare} lines after the last face were ignored",) if spare else ()
    return PolyMesh(vertices, offsets_of(sizes), indices), notes


def check_range(
    sizes: IntArray, indices: IntArray, n_vertices: int, name: str, rows: Rows | None = None
) -> None:
    """Raise an error that names the first face with a vertex that does not exist."""
    wrong = np.flatnonzero((indices < 0) | (indices >= n_vertices))
    if not len(wrong):
        return
    face = int(np.searchsorted(np.cumsum(sizes), wrong[0], side="right"))
    what = (
        f"a face names vertex {indices[wrong[0]]}, but there are only {n_vertices}, counted from 0"
    )
    raise rows.fault(face, what) if rows else InputError(f"{name}, face {face}: {what}")


def _extra_numbers(letters: str) -> int:
    return sum(_EXTRA[letter] for letter in re.findall("ST|C|N", letters))


def _text_header(rows: Rows) -> tuple[int, int, int, Rows]:
    """Return the extra numbers of each vertex, the counts, and the rows that follow."""
    words = rows.tokens(0)
    keyword = _KEYWORD.fullmatch(words[0])
    extra = at = 0
    if keyword is not None:
        if keyword.group(2):
            raise rows.fault(0, f"{words[0]} is not in three dimensions; export as plain OFF")
        extra = _extra_numbers(keyword.group(1))
        words = words[1:]
        if not words:
            at = 1
            words = rows.tokens(1) if len(rows) > 1 else []
    elif not words[0].isdigit():  # the format lets the keyword be absent
        raise rows.fault(0, f"found {words[0][:40]!r} instead of the word OFF")
    try:
        counts = [parse_int(word) for word in words]
    except ValueError:
        counts = []
    if len(counts) not in (2, 3) or min(counts) < 0:
        raise rows.fault(at, "expected the numbers of vertices, faces and edges here")
    return extra, counts[0], counts[1], rows.cut(at + 1)


def _read_stream(rows: Rows, n_vertices: int, n_faces: int, extra: int) -> PolyMesh:
    """Read a file that puts several vertices or faces on a line; it may hold no face colours."""
    values = float_numbers(rows)
    ends = np.cumsum(rows.counts)

    def fault(token: int, what: str) -> InputError:
        return rows.fault(int(np.searchsorted(ends, token, side="right")), what)

    width = 3 + extra
    start = n_vertices * width
    early = f"the file ends before its {n_vertices} vertices and {n_faces} faces are complete"
    if len(values) < start + n_faces:
        raise fault(len(values), early)
    numbers = values[start:]
    broken = np.flatnonzero(~((np.abs(numbers) < 2**53) & (numbers == np.floor(numbers))))
    if len(broken):
        raise fault(start + int(broken[0]), "a number in a face is not whole")
    flat = numbers.astype(np.int64)
    starts_of_faces = _record_starts(flat.tolist(), n_faces)
    if len(starts_of_faces) <= n_faces:
        raise fault(len(values), early)
    if starts_of_faces[-1] != len(flat):
        raise fault(start + int(starts_of_faces[-1]), "there are more numbers after the last face")
    sizes = flat[starts_of_faces[:-1]]
    indices = np.delete(flat, starts_of_faces[:-1])
    check_range(sizes, indices, n_vertices, rows.name)
    vertices = values[:start].reshape(n_vertices, width)[:, :3]
    return PolyMesh(vertices, offsets_of(sizes), indices)


def _record_starts(flat: list[int], n_faces: int) -> IntArray:
    """Walk from face to face; return where each starts and the last ends, as far as they go."""
    starts_of_faces = [0]
    position = 0
    for _ in range(n_faces):
        size = flat[position] if position < len(flat) else -1
        position += 1 + size
        if size < 0 or position > len(flat):
            break
        starts_of_faces.append(position)
    return np.array(starts_of_faces, dtype=np.int64)


def _read_binary(data: bytes, base: int, name: str, extra: int) -> tuple[PolyMesh, tuple[str, ...]]:
    """Read what follows ``OFF BINARY``: 32-bit integers and floats.

    The format wants them big-endian; some programs write them as their machine has them.
    """
    words = np.frombuffer(data, dtype=">i4", offset=base, count=(len(data) - base) // 4)
    if len(words) < 3:
        raise InputError(f"{name}, byte {base}: the file ends inside its header")
    width = 3 + extra
    turned = words.view("<i4")
    notes: tuple[str, ...] = ()
    if not _has_room(words, width) and _has_room(turned, width):
        words = turned
        notes = ("the numbers in the file are little-endian, and were read as such",)
    n_vertices, n_faces = int(words[0]), int(words[1])
    start = 3 + n_vertices * width
    if not _has_room(words, width):
        raise InputError(
            f"{name}, byte {base}: the header promises {n_vertices} vertices and {n_faces} faces, "
            f"but only {len(data) - base} bytes follow"
        )
    floats = (
        words[3:start].view(words.dtype.str.replace("i", "f")).reshape(n_vertices, width)[:, :3]
    )
    sizes = []
    starts = []
    position, end = start, len(words)
    flat = words.tolist()
    # A face's place depends on every face before it (sizes and colours vary), so walk.
    for face in range(n_faces):
        size = flat[position] if position < end else -1
        after = position + 1 + size
        colours = flat[after] if size >= 0 and after < end else -1
        if size < 0 or colours < 0 or after + 1 + colours > end:
            raise InputError(
                f"{name}, byte {base + 4 * position}: face {face} of {n_faces} is broken or cut "
                "short"
            )
        sizes.append(size)
        starts.append(position + 1)
        position = after + 1 + colours
    size_array = np.array(sizes, dtype=np.int64)
    offsets = offsets_of(size_array)
    shift = np.array(starts, dtype=np.int64) - offsets[:-1]
    indices = words[np.arange(offsets[-1]) + np.repeat(shift, size_array)].astype(np.int64)
    check_range(size_array, indices, n_vertices, name)
    with np.errstate(invalid="ignore"):  # a signalling "not a number" is left to the mesh check
        vertices = floats.astype(np.float64)
    return PolyMesh(vertices, offsets, indices), notes


def _has_room(words: npt.NDArray[Any], width: int) -> bool:
    """Tell whether the vertices and faces that the head of a binary file promises may follow."""
    n_vertices, n_faces = int(words[0]), int(words[1])
    room = 3 + n_vertices * width + 2 * n_faces
    return n_vertices >= 0 and n_faces >= 0 and room <= len(words)


def off_bytes(mesh: PolyMesh) -> bytes:
    r"""Return the bytes of an OFF text file; reading them gives the same numbers back.

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
    >>> off_bytes(PolyMesh.from_faces([[0, 0, 0], [0.1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    b'OFF\n3 1 0\n0.0 0.0 0.0\n0.1 0.0 0.0\n0.0 1.0 0.0\n3 0 1 2\n'
    """
    lines = ["OFF", f"{mesh.n_vertices} {mesh.n_faces} 0"]
    lines += vertex_lines(mesh) + counted_face_lines(mesh)
    return ("\n".join(lines) + "\n").encode("ascii")
