"""Spread points evenly over a surface."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, unit
from fabweave.mesh.polymesh import PolyMesh, face_centres, face_of_corner, next_corner

#: Steps of the sequence that fills a square most evenly (Roberts, "The unreasonable effectiveness
#: of quasirandom sequences", 2018): the inverse of the plastic number, and its square.
_STEPS = (0.7548776662466927, 0.5698402909980532)


def plain_triangles(mesh: PolyMesh) -> tuple[FloatArray, IntArray]:
    """Return a mesh as points and triangles; faces with more corners are cut around their centres.

    Parameters
    ----------
    mesh : PolyMesh

    Returns
    -------
    points : (V, 3) or (V + F, 3) float array
        The vertices, and the centres of the faces where some have more than three corners.
    triangles : (T, 3) int array

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube, octahedron
    >>> [len(plain_triangles(solid())[1]) for solid in (octahedron, cube)]
    [8, 24]
    """
    if np.all(mesh.face_sizes == 3):
        return mesh.vertices, mesh.indices.reshape(-1, 3)
    return fans(mesh)


def fans(mesh: PolyMesh) -> tuple[FloatArray, IntArray]:
    """Cut every face into triangles around its centre, which favours no corner.

    Returns
    -------
    points : (V + F, 3) float array
        The vertices, and the centres of the faces.
    triangles : (H, 3) int array
        One for each corner: its face's centre, the corner and the next one.
    """
    triangles = np.column_stack(
        [mesh.n_vertices + face_of_corner(mesh), mesh.indices, mesh.indices[next_corner(mesh)]]
    )
    return np.concatenate([mesh.vertices, face_centres(mesh)]), triangles


def area_samples(
    points: FloatArray, triangles: IntArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Spread points over triangles, as many on each as its area has a share in all.

    There is no chance in it: the same surface has the same samples.

    Parameters
    ----------
    points : (N, 3) float array
    triangles : (T, 3) int array
        At least one with an area.
    count : int
        How many samples.

    Returns
    -------
    places : (count, 3) float array
    normals : (count, 3) float array
        Unit normals of their triangles.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> solid = octahedron()
    >>> places, normals = area_samples(solid.vertices, solid.indices.reshape(-1, 3), 800)
    >>> np.allclose(np.abs(places).sum(axis=1), np.abs(solid.vertices).max())
    True
    >>> np.unique(np.sign(normals), axis=0, return_counts=True)[1].tolist()
    [100, 100, 100, 100, 100, 100, 100, 100]
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    span = np.cross(b - a, c - a)
    until = np.cumsum(np.linalg.norm(span, axis=1))
    number = np.arange(count)
    # The middles of equal shares: none is on a bound between two triangles.
    chosen = np.searchsorted(until, (number + 0.5) / count * until[-1], side="right")
    chosen = np.minimum(chosen, len(triangles) - 1)
    one, two = ((0.5 + step * number) % 1.0 for step in _STEPS)
    beyond = one + two > 1.0
    one, two = np.where(beyond, 1.0 - one, one), np.where(beyond, 1.0 - two, two)
    start = a[chosen]
    places = start + one[:, None] * (b[chosen] - start) + two[:, None] * (c[chosen] - start)
    return places, unit(span[chosen])
