"""Turn a mesh upright, and scale it to its size."""

import math
from typing import Literal, TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh

#: The axis that points up.
Up: TypeAlias = Literal["x", "y", "z"]


def resize_mesh(
    mesh: PolyMesh, *, size_mm: float | None = None, scale: float | None = None
) -> tuple[PolyMesh, float]:
    """Scale a mesh to a size, or by a factor; with neither, leave it as it is.

    Parameters
    ----------
    mesh : PolyMesh
        The mesh; only vertices that faces use count for its size.
    size_mm : float, optional
        The largest dimension of the bounding box afterwards.
    scale : float, optional
        Factor for all coordinates.

    Returns
    -------
    mesh : PolyMesh
        The scaled mesh.
    factor : float
        What the coordinates were multiplied by.

    Raises
    ------
    InputError
        If both are given, one is not a positive number, or the mesh has no size.

    Examples
    --------
    >>> mesh, factor = resize_mesh(
    ...     PolyMesh.from_faces([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]]), size_mm=100)
    >>> factor, mesh.vertices.max()
    (50.0, np.float64(100.0))
    """
    if size_mm is not None and scale is not None:
        raise InputError("a size and a scale were both given; give one of them")
    for name, value in (("size", size_mm), ("scale", scale)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"the {name} must be a positive number, but is {value}")
    if size_mm is None and scale is None:
        return mesh, 1.0
    factor = scale if scale is not None else float(size_mm or 0.0) / largest_dimension(mesh)
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = mesh.vertices * factor
    if not math.isfinite(factor) or factor <= 0 or np.isinf(vertices[mesh.indices]).any():
        raise InputError("the mesh is too small or too large to be scaled; check its units")
    return mesh.with_vertices(vertices), float(factor)


def largest_dimension(mesh: PolyMesh) -> float:
    """Return the largest side of the bounding box of the faces.

    Raises
    ------
    InputError
        If the mesh has no faces, no size, or coordinates that are not numbers.

    Examples
    --------
    >>> largest_dimension(PolyMesh.from_faces([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    2.0
    """
    points = mesh.vertices[mesh.indices]
    if not len(points):
        raise InputError("the mesh has no faces, so it has no size")
    with np.errstate(all="ignore"):
        largest = float(np.ptp(points, axis=0).max())
    if not math.isfinite(largest):
        raise InputError("the mesh has coordinates that are not numbers, so it has no size")
    if largest == 0:
        raise InputError("all vertices of the mesh are at one point, so it has no size")
    return largest


def turn_upright(mesh: PolyMesh, up: Up) -> PolyMesh:
    """Turn a mesh so that the axis that points up becomes z.

    With y up, x stays and what looked along z looks along -y, to the front, as graphics programs do
    it; with x up, y becomes x.

    Parameters
    ----------
    mesh : PolyMesh
    up : {"z", "y", "x"}

    Returns
    -------
    PolyMesh

    Examples
    --------
    >>> mesh = PolyMesh.from_faces([[1, 2, 3], [4, 5, 6], [7, 8, 10]], [[0, 1, 2]])
    >>> turn_upright(mesh, "y").vertices[0].tolist(), turn_upright(mesh, "x").vertices[0].tolist()
    ([1.0, -3.0, 2.0], [2.0, 3.0, 1.0])
    """
    if up == "z":
        return mesh
    return PolyMesh(turned_upright(mesh.vertices, up), mesh.offsets, mesh.indices)


def turned_upright(points: FloatArray, up: Up) -> FloatArray:
    """Return points, or vectors, (N, 3), as `turn_upright` turns vertices.

    Examples
    --------
    >>> turned_upright(np.array([[1.0, 2.0, 3.0]]), "y").tolist()
    [[1.0, -3.0, 2.0]]
    """
    if up == "z":
        return points
    x, y, z = points.T
    turned = (x, -z, y) if up == "y" else (y, z, x)
    # A zero has no sign worth writing.
    return np.column_stack(turned) + 0.0
