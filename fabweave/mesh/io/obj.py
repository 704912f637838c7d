"""Read and write polygon meshes in Wavefront OBJ."""

from itertools import pairwise

import numpy as np

from fabweave.core.arrays import IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.mesh.io.number_rows import first_columns, int_numbers
from fabweave.mesh.io.token_rows import keyword_rows, text_rows, without_slashes
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
    rows = text_rows(data, name, continued=True)
    vertex_rows, vertex_at = keyword_rows(rows, "v")
    face_rows, face_at = keyword_rows(rows, "f")
    del rows
    vertices = first_columns(vertex_rows, 3)
    del vertex_rows
    sizes = face_rows.counts
    empty = np.flatnonzero(sizes == 0)
    if len(empty):
        raise face_rows.fault(int(empty[0]), "a face has no corners")
    numbers = int_numbers(without_slashes(face_rows))
    before = np.repeat(np.searchsorted(vertex_at, face_at), sizes)
    indices = np.where(numbers > 0, numbers - 1, before + numbers)
    wrong = np.flatnonzero((numbers == 0) | (indices < 0) | (indices >= len(vertices)))
    if len(wrong):
        first = int(wrong[0])
        known = before[first] if numbers[first] < 0 else len(vertices)
        raise face_rows.fault(
            int(np.searchsorted(np.cumsum(sizes), first, side="right")),
            f"a face names vertex {numbers[first]}, but "
            + ("OBJ counts from 1" if numbers[first] == 0 else f"there are only {known} vertices"),
        )
    return PolyMesh(vertices, offsets_of(sizes), indices), ()


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
    lines = vertex_lines(mesh, "v ")
    lines += ["f " + face for face in _face_lines(mesh.indices + 1, mesh.offsets)]
    return ("\n".join(lines) + "\n").encode("ascii")


def vertex_lines(mesh: PolyMesh, prefix: str = "") -> list[str]:
    """Return one line a vertex, each number as short as it can be without loss."""
    return [f"{prefix}{x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]


def _face_lines(numbers: IntArray, offsets: IntArray) -> list[str]:
    tokens = list(map(str, numbers.tolist()))
    bounds = offsets.tolist()
    return [" ".join(tokens[a:b]) for a, b in pairwise(bounds)]


def counted_face_lines(mesh: PolyMesh) -> list[str]:
    """Return one line a face: its number of corners, then its vertices counted from 0."""
    sizes = mesh.face_sizes.tolist()
    faces = _face_lines(mesh.indices, mesh.offsets)
    return [f"{size} {face}" if size else "0" for size, face in zip(sizes, faces, strict=True)]
