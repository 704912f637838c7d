"""Read and write polygon meshes in OFF, as text and as binary."""

import re
from array import array

import numpy as np

from fabweave.core.errors import InputError
from fabweave.mesh.io.lines import Line, checked_mesh, position, text_lines
from fabweave.mesh.io.obj import counted_face_lines, vertex_lines
from fabweave.mesh.polymesh import PolyMesh

_KEYWORD = re.compile(rb"((?:ST|C|N)*)(4?n?)OFF")
_BINARY = re.compile(rb"\s*((?:ST|C|N)*)OFF[ \t]+BINARY[ \t]*\r?\n")
#: Numbers that a letter of the keyword adds to each vertex.
_EXTRA = {b"ST": 2, b"C": 4, b"N": 3}


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
        return _read_binary(data, binary.end(), name, _vertex_width(binary.group(1)))
    lines = list(text_lines(data, name))
    if not lines:
        raise InputError(f"{name}: the file contains nothing but blank lines and comments")
    width, n_vertices, n_faces, lines = _text_header(lines)
    if len(lines) < n_vertices + n_faces:
        lines = _one_a_line(lines, n_vertices, n_faces, width, name)
    vertices, sizes, indices = array("d"), array("q"), array("q")
    for line in lines[:n_vertices]:
        vertices.extend(position(line, line.text.split()))
    face_lines = lines[n_vertices : n_vertices + n_faces]
    for line in face_lines:
        corners = line.integers(line.counted(line.text.split()))  # what follows them is a colour
        sizes.append(len(corners))
        indices.extend(corners)
    spare = len(lines) - n_vertices - n_faces
    notes = (f"{spare} lines after the last face were ignored",) if spare else ()
    numbers = [line.number for line in face_lines]
    return checked_mesh(name, vertices, sizes, indices, lines=numbers), notes


def _vertex_width(letters: bytes) -> int:
    """Return how many numbers each vertex has, by the letters of the keyword."""
    return 3 + sum(_EXTRA[letter] for letter in re.findall(b"ST|C|N", letters))


def _text_header(lines: list[Line]) -> tuple[int, int, int, list[Line]]:
    """Return the numbers of a vertex, the counts, and the lines that follow."""
    line = lines[0]
    words = line.text.split()
    keyword = _KEYWORD.fullmatch(words[0])
    width, after = 3, 1
    if keyword is not None:
        if keyword.group(2):
            what = f"{words[0].decode()} is not in three dimensions; export as plain OFF"
            raise line.fault(what)
        width, words = _vertex_width(keyword.group(1)), words[1:]
        if not words and len(lines) > 1:
            line, after = lines[1], 2
            words = line.text.split()
    elif not words[0].isdigit():  # the format lets the keyword be absent
        what = f"found {words[0][:40].decode('latin-1')!r} instead of the word OFF"
        raise line.fault(what)
    if len(words) not in (2, 3) or not all(word.isdigit() for word in words):
        raise line.fault("expected the numbers of vertices, faces and edges here")
    n_vertices, n_faces = line.integers(words[:2])
    return width, n_vertices, n_faces, lines[after:]


def _one_a_line(
    lines: list[Line], n_vertices: int, n_faces: int, width: int, name: str
) -> list[Line]:
    """Give each vertex and face a line, where a file puts several on one; none has a colour."""
    words = [(line, word) for line in lines for word in line.text.split()]
    result: list[Line] = []
    at = 0
    while len(result) < n_vertices + n_faces and at < len(words):
        line, word = words[at]
        size = width if len(result) < n_vertices else 1 + max(line.integers([word])[0], 0)
        part = words[at : at + size]
        if len(part) < size:
            break
        result.append(Line(name, line.number, b" ".join(word for _, word in part)))
        at += size
    if len(result) < n_vertices + n_faces:
        raise InputError(
            f"{name}, at the end of the file: the file ends before its {n_vertices} vertices and "
            f"{n_faces} faces are complete"
        )
    if at < len(words):
        raise words[at][0].fault("there are more numbers after the last face")
    return result


def _read_binary(data: bytes, base: int, name: str, width: int) -> tuple[PolyMesh, tuple[str, ...]]:
    """Read what follows ``OFF BINARY``: 32-bit integers and floats.

    The format wants them big-endian; some programs write them as their machine has them.
    """
    for order in "><":
        words = np.frombuffer(data, f"{order}i4", offset=base, count=(len(data) - base) // 4)
        if len(words) < 3:
            raise InputError(f"{name}, byte {base}: the file ends inside its header")
        n_vertices, n_faces = int(words[0]), int(words[1])
        start = 3 + n_vertices * width
        if n_vertices >= 0 and n_faces >= 0 and start + 2 * n_faces <= len(words):
            break
    else:
        raise InputError(
            f"{name}, byte {base}: the header promises more vertices and faces than fit into the "
            f"{len(data) - base} bytes that follow"
        )
    with np.errstate(invalid="ignore"):  # a signalling "not a number" is left to the mesh check
        numbers = words[3:start].view(f"{order}f4").astype(np.float64)
    sizes, indices = array("q"), array("q")
    flat, at = words.tolist(), start
    # A face's place depends on every face before it (sizes and colours vary), so walk.
    for face in range(n_faces):
        size = flat[at] if at < len(flat) else -1
        after = at + 1 + size
        colours = flat[after] if size >= 0 and after < len(flat) else -1
        if colours < 0 or after + 1 + colours > len(flat):
            raise InputError(
                f"{name}, byte {base + 4 * at}: face {face} of {n_faces} is broken or cut short"
            )
        sizes.append(size)
        indices.extend(flat[at + 1 : after])
        at = after + 1 + colours
    turned = "the numbers in the file are little-endian, and were read as such"
    mesh = checked_mesh(name, numbers.reshape(-1, width)[:, :3], sizes, indices)
    return mesh, (turned,) if order == "<" else ()


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
