"""Hold a polygon mesh as vertex positions and faces in compressed rows."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    flags,
    frozen,
    frozen_value,
    offsets_of,
    unit,
)


@frozen_value
class PolyMesh:
    """A polygon mesh: positions, and faces of any size in compressed rows.

    Parameters
    ----------
    vertices : (V, 3) float array
        Positions.
    offsets : (F + 1,) int array
        Face ``f`` owns the corners ``offsets[f]:offsets[f + 1]``.
    indices : (H,) int array
        The vertex at each corner, counter-clockwise seen from outside.

    Notes
    -----
    Corner numbers are half-edge numbers too: half-edge ``h`` runs from ``indices[h]`` to the
    vertex of the next corner of the same face.
    """

    vertices: FloatArray
    offsets: IntArray
    indices: IntArray

    def __post_init__(self) -> None:
        """Bring the arrays to their types and freeze them."""
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64).reshape(-1, 3)
        object.__setattr__(self, "vertices", frozen(vertices))
        for name in ("offsets", "indices"):
            values = np.ascontiguousarray(getattr(self, name), dtype=np.int64)
            object.__setattr__(self, name, frozen(values))

    @classmethod
    def from_faces(
        cls, vertices: npt.ArrayLike, faces: Sequence[Sequence[int]] | npt.NDArray[np.integer]
    ) -> "PolyMesh":
        """Build a mesh from a list of faces, each a sequence of vertex numbers.

        Examples
        --------
        >>> mesh = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> mesh.n_vertices, mesh.n_faces, mesh.n_corners
        (3, 1, 3)
        """
        positions = np.asarray(vertices, dtype=np.float64)
        if isinstance(faces, np.ndarray) and faces.ndim == 2:
            sizes = np.full(len(faces), faces.shape[1])
            return cls(positions, offsets_of(sizes), faces.reshape(-1).astype(np.int64))
        sizes = np.array([len(face) for face in faces], dtype=np.int64)
        flat = [vertex for face in faces for vertex in face]
        return cls(positions, offsets_of(sizes), np.array(flat, dtype=np.int64))

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return len(self.offsets) - 1

    @property
    def n_corners(self) -> int:
        """Number of corners, which is the number of half-edges."""
        return len(self.indices)

    @property
    def face_sizes(self) -> IntArray:
        """Number of corners of each face, (F,)."""
        return np.diff(self.offsets)

    def faces(self) -> list[list[int]]:
        """Return the faces as lists of vertex numbers."""
        flat = self.indices.tolist()
        bounds = self.offsets.tolist()
        return [flat[a:b] for a, b in pairwise(bounds)]

    @classmethod
    def from_triangles(cls, vertices: FloatArray, triangles: IntArray) -> "PolyMesh":
        """Build a mesh of triangles only, from their vertices, (T, 3)."""
        return cls(vertices, 3 * np.arange(len(triangles) + 1), triangles.reshape(-1))

    def with_vertices(self, vertices: FloatArray) -> "PolyMesh":
        """Return the same connectivity at other positions."""
        return PolyMesh(vertices, self.offsets, self.indices)


def face_of_corner(mesh: PolyMesh) -> IntArray:
    """Return the face that owns each corner, (H,)."""
    return np.repeat(np.arange(mesh.n_faces), mesh.face_sizes)


def next_corner(mesh: PolyMesh) -> IntArray:
    """Return the corner that follows each corner around its face, (H,)."""
    following = np.arange(1, mesh.n_corners + 1)
    filled = mesh.face_sizes > 0
    following[mesh.offsets[1:][filled] - 1] = mesh.offsets[:-1][filled]
    return following


def previous_corner(mesh: PolyMesh) -> IntArray:
    """Return the corner before each corner around its face, (H,)."""
    before = np.empty(mesh.n_corners, dtype=np.int64)
    before[next_corner(mesh)] = np.arange(mesh.n_corners)
    return before


def used_vertices(mesh: PolyMesh) -> BoolArray:
    """Return whether each vertex belongs to a face, (V,)."""
    return flags(mesh.n_vertices, mesh.indices)


def without_loose(mesh: PolyMesh) -> PolyMesh:
    """Return a mesh without the vertices that belong to no face, the others in their order."""
    used = used_vertices(mesh)
    return PolyMesh(mesh.vertices[used], mesh.offsets, (np.cumsum(used) - 1)[mesh.indices])


def triangle_normals(mesh: PolyMesh) -> FloatArray:
    """Return a normal of each face of a mesh of triangles, as long as twice its area, (T, 3)."""
    a, b, c = (mesh.vertices[mesh.indices[k::3]] for k in range(3))
    return np.cross(b - a, c - a)


def face_centres(mesh: PolyMesh) -> FloatArray:
    """Return the mean of the corners of each face, (F, 3)."""
    positions = mesh.vertices[mesh.indices]
    return np.add.reduceat(positions, mesh.offsets[:-1], axis=0) / mesh.face_sizes[:, None]


def face_areas(mesh: PolyMesh) -> FloatArray:
    """Return twice the vector area of each face, (F, 3)."""
    centre = face_centres(mesh)[face_of_corner(mesh)]
    here = mesh.vertices[mesh.indices] - centre
    spans = np.cross(here, here[next_corner(mesh)])
    return np.add.reduceat(spans, mesh.offsets[:-1], axis=0)


def face_normals(mesh: PolyMesh) -> FloatArray:
    """Return the unit normal of each face, by its vector area, (F, 3)."""
    return unit(face_areas(mesh))


def corner_sines(mesh: PolyMesh) -> FloatArray:
    """Return the sine of each corner, (H,), as its face sees it: negative where it turns in.

    Examples
    --------
    >>> square = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    >>> corner_sines(square).tolist()
    [1.0, 1.0, 1.0, 1.0]
    """
    corners = mesh.vertices[mesh.indices]
    leaving, arriving = (
        corners[next_corner(mesh)] - corners,
        corners - corners[previous_corner(mesh)],
    )
    normal = face_normals(mesh)[face_of_corner(mesh)]
    area = np.einsum("hd,hd->h", np.cross(arriving, leaving), normal)
    size = np.linalg.norm(leaving, axis=1) * np.linalg.norm(arriving, axis=1)
    return np.asarray(area / np.where(size > 0, size, 1.0))
