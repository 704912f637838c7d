"""Read and write polygon meshes in Wavefront OBJ."""

from array import array

import numpy as np

from fabweave.core.errors import InputError
from fabweave.mesh.io.lines import checked_mesh, position, text_lines
from fabweave.mesh.polymesh import PolyMesh


def read_obj(data: bytes, name: str) -> tuple[PolyMesh, tuple[str, ...]]:
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
    mesh : PolyMesh
        Vertices in the order of the file.
    notes : tuple of str
        What a person should know.

    Raises
    ------
    InputError
        If a vertex or face cannot be read, or a face names a vertex that does not exist.

    Examples
    --------
    >>> mesh, notes = read_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2/1 -1//1\n", "a.obj")
    >>> mesh.faces()
    [[0, 1, 2]]
    """
    vertices, sizes, indices, lines = array("d"), array("q"), array("q"), array("q")
    for line in text_lines(data, name, continued=True):
        words = line.text.split()
        if words[0] == b"v":
            vertices.extend(position(line, words[1:]))
        elif words[0] == b"f":
            corners = line.integers([word.partition(b"/")[0] for word in words[1:]])
            if not corners:
                raise line.fault("a face has no corners")
            known = len(vertices) // 3
            for corner in corners:
                if not -known <= corner or corner == 0:
                    what = f"there are only {known} vertices" if corner else "OBJ counts from 1"
                    raise line.fault(f"a face names vertex {corner}, but {what}")
                indices.append(corner - 1 if corner > 0 else known + corner)
            sizes.append(len(corners))
            lines.append(line.number)
    return checked_mesh(name, vertices, sizes, indices, lines=lines, counted_from=1), ()


def obj_bytes(mesh: PolyMesh) -> bytes:
    r"""Return the bytes of an OBJ file; reading them gives the same numbers back.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh whose faces have corners.

    Returns
    -------
    bytes
        ASCII text with line feeds; the same mesh gives the same bytes.

    Raises
    ------
    InputError
        If a face has no corners, which the format cannot say.

    Examples
    --------
    >>> obj_bytes(PolyMesh.from_faces([[0, 0, 0], [0.1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    b'v 0.0 0.0 0.0\nv 0.1 0.0 0.0\nv 0.0 1.0 0.0\nf 1 2 3\n'
    """
    empty = np.flatnonzero(mesh.face_sizes == 0)
    if len(empty):
        raise InputError(
            f"{len(empty)} faces have no corners (first: face {empty[0]}); OBJ cannot hold them; "
            "remove them first"
        )
    faces = [" ".join(["f", *[str(vertex + 1) for vertex in face]]) for face in mesh.faces()]
    return ("\n".join(vertex_lines(mesh, "v ") + faces) + "\n").encode("ascii")


def vertex_lines(mesh: PolyMesh, prefix: str = "") -> list[str]:
    """Return one line a vertex, each number as short as it can be without loss."""
    return [f"{prefix}{x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]


def counted_face_lines(mesh: PolyMesh) -> list[str]:
    """Return one line a face: its number of corners, then its vertices counted from 0."""
    return [" ".join(map(str, [len(face), *face])) for face in mesh.faces()]
