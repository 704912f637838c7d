"""Read polygon meshes in PLY, text or binary, and write them as text."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.io.obj import counted_face_lines, vertex_lines
from fabweave.mesh.io.off import check_range
from fabweave.mesh.io.ply_body import BinaryBody, TextBody
from fabweave.mesh.io.ply_head import Element, read_head
from fabweave.mesh.polymesh import PolyMesh

_FACE_LISTS = ("vertex_indices", "vertex_index")


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
    header = read_head(data, name)
    body: TextBody | BinaryBody
    if header.order is None:
        body = TextBody(data, header.size, header.lines, name)
    else:
        body = BinaryBody(data, header.size, header.order, name)
    vertices: FloatArray | None = None
    faces: tuple[IntArray, IntArray] | None = None
    strips: tuple[IntArray, IntArray] | None = None
    for element in header.elements:
        if element.name == "vertex" and vertices is None:
            vertices = body.scalars(element, _columns(element, name))
        elif element.name == "face" and faces is None:
            faces = body.lists(element, _face_list(element, name))
        elif element.name == "tristrips" and strips is None:
            strips = body.lists(element, _face_list(element, name))
        else:
            body.skip(element)
        if vertices is not None and faces is not None and len(faces[0]):
            break
    if vertices is None:
        raise InputError(f"{name}: the file has no vertices (no element 'vertex' in its header)")
    if strips is not None and (faces is None or not len(faces[0])):
        triangles = _triangles_of_strips(*strips)
        check_range(np.full(len(triangles), 3), triangles.ravel(), len(vertices), name)
        number = agree(len(strips[0]), "{n} [row|rows] of triangle strips")
        note = f"the file has {number}, which were read as {len(triangles)} triangles"
        return PolyMesh.from_triangles(vertices, triangles), (note,)
    if faces is None:
        raise InputError(
            f"{name}: the file has no faces (no element 'face' in its header); is it a point "
            "cloud? export it again with polygon faces"
        )
    check_range(faces[0], faces[1], len(vertices), name)
    return PolyMesh(vertices, offsets_of(faces[0]), faces[1]), ()


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


def _columns(element: Element, name: str) -> list[int]:
    """Return which properties of the vertices are x, y and z."""
    names = [item.name for item in element.properties if item.count is None]
    if any(item.count is not None for item in element.properties[: len(names)]) or not (
        {"x", "y", "z"} <= set(names)
    ):
        raise InputError(
            f"{name}: the header gives the vertices no properties x, y and z before any list; "
            f"it gives {', '.join(item.name for item in element.properties) or 'none'}"
        )
    return [names.index(axis) for axis in "xyz"]


def _face_list(element: Element, name: str) -> int:
    """Return which property of the faces is the list of vertices."""
    for position, item in enumerate(element.properties):
        if item.name in _FACE_LISTS and item.count is not None:
            if item.kind[0] == "f":
                raise InputError(f"{name}: the faces' vertex numbers are not whole numbers")
            return position
    raise InputError(
        f"{name}: the header gives the faces no list property called vertex_indices or vertex_index"
    )


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
