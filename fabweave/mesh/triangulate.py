"""Cut the faces of a mesh into triangles."""

import numpy as np

from fabweave.core.arrays import IntArray, places_in_groups
from fabweave.mesh.polymesh import PolyMesh, face_centres, triangle_normals


def triangulate(mesh: PolyMesh) -> PolyMesh:
    """Cut every face into triangles that follow its shape.

    Quads are cut along their shorter diagonal; faces with more corners get a vertex at the mean
    of their corners and one triangle for each edge.

    Parameters
    ----------
    mesh : PolyMesh
        Faces with three or more corners.

    Returns
    -------
    PolyMesh
        Triangles only: those of triangular faces first, then of quads, then of others; the
        vertices of the mesh come first.

    Examples
    --------
    >>> kite = PolyMesh.from_faces(
    ...     [[0, 0, 0], [2, -1, 0], [3, 0, 0], [2, 1, 0]], [[0, 1, 2, 3]])
    >>> triangulate(kite).faces()
    [[1, 2, 3], [1, 3, 0]]
    """
    if np.all(mesh.face_sizes == 3):
        return mesh
    triangles = mesh.indices[_corners(mesh, 3)]
    quads = mesh.indices[_corners(mesh, 4)]
    a, b, c, d = (mesh.vertices[quads[:, k]] for k in range(4))
    turn = np.sum((c - a) ** 2, axis=1) > np.sum((d - b) ** 2, axis=1)
    quads = np.where(turn[:, None], np.roll(quads, -1, axis=1), quads)
    large = np.flatnonzero(mesh.face_sizes > 4)
    sizes = mesh.face_sizes[large]
    face = np.repeat(np.arange(len(large)), sizes)
    place = places_in_groups(sizes)
    start = mesh.offsets[:-1][large][face]
    fans = np.column_stack(
        [
            mesh.indices[start + place],
            mesh.indices[start + (place + 1) % sizes[face]],
            mesh.n_vertices + face,
        ]
    )
    vertices = np.concatenate([mesh.vertices, face_centres(mesh)[large]])
    halves = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return PolyMesh.from_faces(vertices, np.concatenate([triangles, halves, fans]))


def _corners(mesh: PolyMesh, size: int) -> IntArray:
    """Return the corner numbers of all faces of one size, (N, size)."""
    corners: IntArray = mesh.offsets[:-1][mesh.face_sizes == size, None] + np.arange(size)
    return corners


def surface_area(mesh: PolyMesh) -> float:
    """Return the area of a mesh, its faces cut into triangles.

    Examples
    --------
    >>> corners = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]
    >>> surface_area(PolyMesh.from_faces(corners, [[0, 1, 2, 3]]))
    2.0
    """
    return float(np.linalg.norm(triangle_normals(triangulate(mesh)), axis=1).sum()) / 2.0
