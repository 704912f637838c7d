"""Build the five regular polyhedra."""

from itertools import combinations

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.mesh.polymesh import PolyMesh

_GOLDEN = (1 + 5**0.5) / 2


def tetrahedron() -> PolyMesh:
    """Return the regular tetrahedron with corners at (±1, ±1, ±1)."""
    return PolyMesh.from_faces(
        [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
        [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    )


def cube() -> PolyMesh:
    """Return the cube with corners at (±1, ±1, ±1)."""
    corners = [[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    return PolyMesh.from_faces(
        corners,
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
    )


def octahedron() -> PolyMesh:
    """Return the regular octahedron with corners at unit distance on the axes."""
    return PolyMesh.from_faces(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]],
        [
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ],
    )


def icosahedron() -> PolyMesh:
    """Return the regular icosahedron whose corners are those of three golden rectangles."""
    corners = np.array(
        [
            np.roll([0.0, a, b * _GOLDEN], shift)
            for shift in range(3)
            for a in (-1, 1)
            for b in (-1, 1)
        ]
    )
    return PolyMesh.from_faces(corners, _triangles_of_edge(corners, 2.0))


def dodecahedron() -> PolyMesh:
    """Return the regular dodecahedron whose corners are the face centres of the icosahedron."""
    solid = icosahedron()
    triangles = solid.indices.reshape(-1, 3)
    centres = solid.vertices[triangles].mean(axis=1)
    faces = []
    for vertex, axis in enumerate(solid.vertices):
        around = np.flatnonzero((triangles == vertex).any(axis=1))
        right = centres[around[0]] - axis * (centres[around[0]] @ axis) / (axis @ axis)
        up = np.cross(axis, right) / np.linalg.norm(axis)
        angle = np.arctan2(centres[around] @ up, centres[around] @ right)
        faces.append(around[np.argsort(angle)].tolist())
    return PolyMesh.from_faces(centres, faces)


def _triangles_of_edge(corners: FloatArray, edge: float) -> list[list[int]]:
    """Return all triangles whose three sides have a given length, turned outward."""
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    near = np.abs(apart - edge) < 1e-9 * edge
    faces = []
    for a, b, c in combinations(range(len(corners)), 3):
        if near[a, b] and near[b, c] and near[c, a]:
            outward = np.linalg.det(corners[[a, b, c]]) > 0
            faces.append([a, b, c] if outward else [a, c, b])
    return faces
