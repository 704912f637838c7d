"""Find faces of a mesh that run through one another."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, places_in_groups
from fabweave.mesh.nearest import libigl
from fabweave.mesh.polymesh import PolyMesh, corner_sines, face_of_corner
from fabweave.mesh.topology import keep_faces, sound_faces
from fabweave.mesh.triangulate import polygon_triangles

#: A corner turns in if the sine of its turn is beyond rounding.
_STRAIGHT = 1e-9


def self_intersections(mesh: PolyMesh) -> IntArray:
    """Find the pairs of faces that run through one another.

    Faces are cut into triangles; those that merely share a vertex or an edge do not count, those
    that touch otherwise do. A warning, not a verdict: a face that is not flat is only nearly its
    triangles. Faces that are not polygons, have no area, or
    use coordinates that are not numbers are ignored.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.

    Returns
    -------
    (N, 2) int array
        Pairs of faces, the smaller number first, sorted.

    Examples
    --------
    >>> crossed = PolyMesh.from_faces(
    ...     [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [0.6, 0.4, 1]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> self_intersections(crossed).tolist()
    [[0, 1]]
    """
    none = np.zeros((0, 2), dtype=np.int64)
    small, out_of_range, repeating = sound_faces(mesh)
    keep = ~(small | out_of_range | repeating)
    sound = keep_faces(mesh, keep)
    if not sound.n_faces:
        return none
    finite: BoolArray = np.logical_and.reduce(np.isfinite(sound.vertices), axis=1)
    spoilt = np.add.reduceat(~finite[sound.indices], sound.offsets[:-1], dtype=np.int64)
    keep[keep] = spoilt == 0
    sound = keep_faces(mesh, keep)
    if not sound.n_faces:
        return none
    points, corners = np.unique(sound.indices, return_inverse=True)
    places = _near_one(mesh.vertices[points])
    triangles, face = _triangles(PolyMesh(places, sound.offsets, corners))
    one, two, three = (places[triangles[:, k]] for k in range(3))
    # libigl ends the interpreter on input that it does not expect, so it gets none.
    wide = np.any(np.cross(two - one, three - one) != 0, axis=1)
    triangles, face = np.ascontiguousarray(triangles[wide]), face[wide]
    if not len(triangles):
        return none
    _, pairs, _ = libigl().predicates.find_self_intersections(places, triangles)
    face_pairs = np.sort(np.flatnonzero(keep)[face[pairs]].reshape(-1, 2), axis=1)
    face_pairs = face_pairs[face_pairs[:, 0] != face_pairs[:, 1]]
    code = np.unique(face_pairs[:, 0] * mesh.n_faces + face_pairs[:, 1])
    return np.column_stack(np.divmod(code, mesh.n_faces)).astype(np.int64)


def _near_one(points: FloatArray) -> FloatArray:
    """Scale by a power of two, which rounds nothing, so that products stay in range."""
    exponent = np.frexp(np.abs(points).max())[1]
    return np.ascontiguousarray(np.ldexp(points, -exponent))


def _triangles(mesh: PolyMesh) -> tuple[IntArray, IntArray]:
    """Cut faces into triangles, convex ones from their first corner; return whose each is, too."""
    turns_in = corner_sines(mesh) < -_STRAIGHT
    hollow = np.add.reduceat(turns_in, mesh.offsets[:-1], dtype=np.int64)
    # A quad with one corner that turns in is cut from there.
    dart = (hollow == 1) & (mesh.face_sizes == 4)
    shift = np.zeros(mesh.n_faces, dtype=np.int64)
    corner = np.flatnonzero(turns_in & dart[face_of_corner(mesh)])
    shift[dart] = corner - mesh.offsets[:-1][dart]
    # A quad with more of them crosses itself, and is no polygon.
    others = (hollow > 0) & (mesh.face_sizes != 4)
    sizes = np.where((hollow > 0) & ~dart, 0, mesh.face_sizes - 2)
    face = np.repeat(np.arange(mesh.n_faces), sizes)
    place = np.column_stack([np.zeros_like(face), *(k + places_in_groups(sizes) for k in (1, 2))])
    place = (place + shift[face, None]) % mesh.face_sizes[face, None]
    parts = [mesh.indices[mesh.offsets[:-1][face, None] + place]]
    owners = [face]
    for one in np.flatnonzero(others).tolist():
        loop = mesh.indices[mesh.offsets[one] : mesh.offsets[one + 1]].tolist()
        cut = polygon_triangles(mesh.vertices, loop)
        parts.append(np.array(cut, dtype=np.int64).reshape(-1, 3))
        owners.append(np.full(len(cut), one))
    return np.concatenate(parts), np.concatenate(owners)
