"""Map what of a model was lost to its surface: how far each small part is from the result."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.samples import plain_triangles

#: The sides of the parts are no longer than this share of the size.
_SIDE = 1 / 50
#: No triangle is cut oftener in four; a side that is longer yet belongs to a sliver.
_MOST_CUTS = 6


@frozen_value
class LossMap:
    """A model in small triangles, and how far each is from what stands in for it.

    Parameters
    ----------
    points : (N, 3) float array
        In millimetres.
    triangles : (T, 3) int array
        Corners, counter-clockwise as seen from outside.
    lost_mm : (T,) float array
        The distance of each triangle's centre.
    size_mm : float
        The greatest extent of the model.
    """

    points: FloatArray
    triangles: IntArray
    lost_mm: FloatArray
    size_mm: float


def loss_map(model: PolyMesh, result: PolyMesh) -> LossMap:
    """Map the distances from a model to the surface that stands in for it.

    Parameters
    ----------
    model : PolyMesh
        In millimetres.
    result : PolyMesh

    Returns
    -------
    LossMap
        Its triangles are those of the model, cut in four until they are small.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> model = octahedron()
    >>> inner = model.with_vertices(0.5 * model.vertices)
    >>> far = 0.5 * np.abs(model.vertices).max() / 3**0.5  # between parallel faces
    >>> loss = loss_map(model, inner)
    >>> bool(np.isclose(loss.lost_mm.min(), far)), len(loss.triangles)
    (True, 32768)
    """
    points, triangles = plain_triangles(model)
    size = float(np.ptp(model.vertices, axis=0).max())
    points, triangles = _cut(points, triangles, _SIDE * size)
    lost = Surface(*plain_triangles(result)).feet(points[triangles].mean(axis=1)).distances
    return LossMap(points, triangles, lost, size)


def _cut(points: FloatArray, triangles: IntArray, longest: float) -> tuple[FloatArray, IntArray]:
    """Cut triangles in four at the middles of their sides, until those are short enough."""
    for _ in range(_MOST_CUTS):
        corners = points[triangles]
        side = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
        long = np.flatnonzero(side > longest)
        if not len(long):
            break
        whole = triangles[long]
        a, b, c = whole.T
        ab, bc, ca = len(points) + np.arange(3 * len(long)).reshape(3, -1)
        middles = (points[whole] + points[np.roll(whole, -1, axis=1)]) / 2.0
        points = np.concatenate([points, middles.transpose(1, 0, 2).reshape(-1, 3)])
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        parts = np.concatenate([np.column_stack(quarter) for quarter in quarters])
        triangles = np.concatenate([np.delete(triangles, long, axis=0), parts])
    return points, triangles
