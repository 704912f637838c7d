"""Read STL, text or binary."""

import re

import numpy as np

from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.io.mesh_file import MeshFile
from fabweave.mesh.io.text import number_rows, text_lines
from fabweave.mesh.polymesh import PolyMesh

#: Bytes before the first triangle of a binary file; the last four of them say how many there are.
HEAD = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])
#: What programs write that do not know beforehand how many triangles there will be.
_UNKNOWN = (0, 2**32 - 1)


def stated_triangles(data: bytes) -> int:
    """Return how many triangles the head of a binary file states."""
    return int.from_bytes(data[HEAD - 4 : HEAD], "little")


def is_binary_stl(data: bytes) -> bool:
    """Tell whether a file has just as many bytes as the triangles that it would state."""
    return len(data) >= HEAD and len(data) == HEAD + _TRIANGLE.itemsize * stated_triangles(data)


def read_stl(data: bytes, name: str) -> MeshFile:
    r"""Read the bytes of an STL file; its size tells binary from text, not its first word.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        Its name, for messages.

    Returns
    -------
    MeshFile
        Every face has corners of its own, as in the file; in text they may be more than three.

    Raises
    ------
    InputError
        If the file is cut short, or cannot be understood.

    Examples
    --------
    >>> text = b"solid\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendsolid"
    >>> read_stl(text, "a.stl").mesh.faces()
    [[0, 1, 2]]
    """
    begins_as_text = re.match(rb"(\xef\xbb\xbf)?\s*(solid|facet)\b", data, re.IGNORECASE)
    if not is_binary_stl(data) and begins_as_text and b"\0" not in data[:1024]:
        return _read_text(data, name)
    if len(data) < HEAD:
        raise InputError(
            f"{name}: it is cut short, or no STL file: a binary one has {HEAD} bytes or more, this "
            f"{len(data)}; copy or export it again"
        )
    held, more = divmod(len(data) - HEAD, _TRIANGLE.itemsize)
    count = stated_triangles(data)
    notes = []
    if count in _UNKNOWN and held:
        notes.append(f"the file states {count} triangles, but has {held}, and all were read")
        count = held
    elif count > held:
        raise InputError(
            f"{name}: it is cut short: {held} of {count} triangles are there; copy or export it "
            "again"
        )
    more += (held - count) * _TRIANGLE.itemsize
    if more:
        text = "{n} [byte|bytes] after the last triangle [was|were] ignored"
        notes.append(agree(more, text))
    rows = np.frombuffer(data, _TRIANGLE, count, HEAD)
    with np.errstate(invalid="ignore"):  # a signalling "not a number" is left to the mesh check
        points = rows["corners"].reshape(-1, 3).astype(np.float64)
    mesh = PolyMesh(points, 3 * np.arange(count + 1), np.arange(3 * count))
    return MeshFile(mesh, "stl", notes=tuple(notes))


def _read_text(data: bytes, name: str) -> MeshFile:
    """Read a text file: only its loops and their vertices matter."""
    lines = text_lines(data)
    at, ends = (
        [number for number, line in enumerate(lines, 1) if line.startswith(words)]
        for words in (_spelt(b"vertex"), _spelt(b"endloop"))
    )
    points = number_rows(name, at, [lines[number - 1][6:] for number in at]).positions()
    offsets = np.searchsorted(at, [0, *ends])
    if offsets[-1] < len(at):
        raise InputError(
            f"{name}: it is cut short: the loop of line {at[offsets[-1]]}, after {len(ends)} "
            "faces, does not end; copy or export it again"
        )
    ended = any(line.startswith(_spelt(b"endsolid")) for line in lines[-100:])
    notes = () if ended else ("the file does not end with endsolid; it may be cut short",)
    return MeshFile(PolyMesh(points, offsets, np.arange(len(at))), "stl", notes=notes)


def _spelt(word: bytes) -> tuple[bytes, ...]:
    """Return how programs write a keyword."""
    return word, word.upper(), word.capitalize()
