"""Cut a surface in two along its mirror, and join a half to its image."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.mirror import Mirror
from fabweave.mesh.polymesh import PolyMesh

#: Vertices nearer to the mirror than this share of the mean edge are put on it before the cut.
_NEAR = 0.1


def half_of(surface: PolyMesh, mirror: Mirror) -> PolyMesh:
    """Return the part of a surface of triangles on the positive side of a mirror.

    Vertices near the mirror are put on it, and edges that cross it are cut there.

    Parameters
    ----------
    surface : PolyMesh
        An oriented manifold of triangles.
    mirror : Mirror

    Returns
    -------
    PolyMesh
        Triangles, with a boundary on the mirror.

    Examples
    --------
    >>> from fabweave.mesh.mirror import find_mirror
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> from fabweave.mesh.triangulate import triangulate
    >>> ball = triangulate(sphere(8, 50.0))
    >>> half = half_of(ball, find_mirror(ball))
    >>> half.n_faces == ball.n_faces // 2
    True
    """
    faces = surface.indices.reshape(-1, 3)
    ends = surface.vertices[np.roll(faces, -1, axis=1)] - surface.vertices[faces]
    near = _NEAR * float(np.linalg.norm(ends, axis=2).mean())
    height = (surface.vertices - mirror.point) @ mirror.normal
    on = np.abs(height) <= near
    points = surface.vertices - np.where(on, height, 0.0)[:, None] * mirror.normal
    height = np.where(on, 0.0, height)
    side = np.sign(height).astype(np.int64)
    corner_side = side[faces]
    whole = faces[(corner_side.min(axis=1) >= 0) & (corner_side.max(axis=1) > 0)]
    crossing = faces[(corner_side.min(axis=1) < 0) & (corner_side.max(axis=1) > 0)]
    cut, points = _cut(crossing, points, height)
    kept = np.concatenate([whole, cut])
    used, indices = np.unique(kept, return_inverse=True)
    return PolyMesh.from_faces(points[used], indices.reshape(-1, 3))


def _cut(crossing: IntArray, points: FloatArray, height: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the parts above of triangles that cross the mirror, and the points with new ones."""
    count = len(points)
    head = np.roll(crossing, -1, axis=1)
    across = height[crossing] * height[head] < 0
    low, high = np.minimum(crossing, head)[across], np.maximum(crossing, head)[across]
    code, number = np.unique(low * count + high, return_inverse=True)
    low, high = np.divmod(code, count)
    share = (height[low] / (height[low] - height[high]))[:, None]
    new = points[low] + share * (points[high] - points[low])
    middle = np.full(crossing.shape, -1)
    middle[across] = count + number.reshape(-1)
    pieces: list[list[int]] = []
    for face, between in zip(crossing.tolist(), middle.tolist(), strict=True):
        ring = []
        for corner, new_corner in zip(face, between, strict=True):
            ring += [corner] if height[corner] >= 0 else []
            ring += [new_corner] if new_corner >= 0 else []
        pieces += [[ring[0], ring[k], ring[k + 1]] for k in range(1, len(ring) - 1)]
    faces = np.array(pieces, dtype=np.int64).reshape(-1, 3)
    return faces, np.concatenate([points, new])


def joined_with_image(half: PolyMesh, mirror: Mirror, reach: float) -> PolyMesh:
    """Return a half and its mirror image, joined along the boundary that is on the mirror.

    Parameters
    ----------
    half : PolyMesh
        A surface on the positive side.
    mirror : Mirror
    reach : float
        Boundary vertices nearer to the mirror than this are put on it.

    Returns
    -------
    PolyMesh
        Exactly symmetric.
    """
    halfedges = build_halfedges(half)
    height = (half.vertices - mirror.point) @ mirror.normal
    on = np.zeros(half.n_vertices, dtype=bool)
    on[halfedges.tail[halfedges.twin < 0]] = True
    on &= np.abs(height) <= reach
    points = half.vertices - np.where(on, height, 0.0)[:, None] * mirror.normal
    number = np.where(on, np.arange(len(points)), len(points) + np.cumsum(~on) - 1)
    faces = half.indices.reshape(half.n_faces, -1)
    return PolyMesh.from_faces(
        np.concatenate([points, mirror.image(points[~on])]),
        np.concatenate([faces, number[faces[:, ::-1]]]),
    )
