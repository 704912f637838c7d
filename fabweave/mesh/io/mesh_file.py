"""Hold what a mesh file says: its mesh as it stands there, objects, unit, and which way is up."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh

#: Millimetres in each unit that a mesh file can state.
UNIT_MM = (("um", 0.001), ("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4), ("ft", 304.8))

#: Meshes of many more triangles than can be woven, even after a remeshing.
MOST_TRIANGLES = 10_000_000
#: Objects that are placed, in all; each becomes a part of its own.
MOST_PLACED = 100_000


@frozen_value
class MeshFile:
    """A mesh as it was read from a file.

    Parameters
    ----------
    mesh : PolyMesh
        The mesh, in the file's own unit.
    format : str
        The format, such as ``"obj"``, by what the file holds.
    unit : str or None
        The unit that the file states (one of those in `UNIT_MM`), or None if it states none.
    notes : tuple of str
        What a person should know about the reading.
    up : {"z", "y"} or None
        The axis that points up, as the file or the standard of its format says; None where neither
        does.
    objects : tuple of (str, int)
        Name and number of faces of each object that the file places, as they stand in it, in the
        order of faces; empty for formats that place none.
    """

    mesh: PolyMesh
    format: str
    unit: str | None = None
    notes: tuple[str, ...] = ()
    up: Literal["z", "y"] | None = None
    objects: tuple[tuple[str, int], ...] = ()

    @property
    def unit_mm(self) -> float | None:
        """Millimetres in the stated unit, or None if the file states none."""
        return None if self.unit is None else dict(UNIT_MM)[self.unit]


@contextmanager
def faults_of(name: str) -> Iterator[None]:
    """Put the name of a file before what is wrong with it.

    What is no number, or too large for one, is left to the check of the mesh.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


class Placed:
    """Triangles of objects, gathered one after another, each as often as it is placed.

    How much they come to is bounded: a small file can place its objects very often.
    """

    def __init__(self) -> None:
        self._points: list[FloatArray] = []
        self._triangles: list[IntArray] = []
        self._names: list[str] = []
        self._n_points = self._n_triangles = 0

    def add(
        self, name: str, points: FloatArray, triangles: IntArray, matrix: FloatArray | None = None
    ) -> None:
        """Place an object.

        Parameters
        ----------
        name : str
        points : (V, 3) float array
            Where there are more than corners, those that no triangle uses are left out.
        triangles : (T, 3) int array
        matrix : (4, 4) float array, optional
            Where it is placed, for columns; a mirror turns the faces, so that they stay outside
            out.

        Raises
        ------
        InputError
            If a triangle names a point that does not exist, or all comes to more than can be meant.
        """
        if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(points):
            wrong = triangles.max() if triangles.min() >= 0 else triangles.min()
            raise InputError(
                f"a face of object {name[:60]!r} names vertex {wrong}, but there are only "
                f"{len(points)}, counted from 0; export it again"
            )
        if len(points) > triangles.size:  # most of them are those of other objects
            used, corners = np.unique(triangles, return_inverse=True)
            points, triangles = points[used], corners.reshape(triangles.shape)
        self._n_points += len(points)
        self._n_triangles += len(triangles)
        if len(self._names) == MOST_PLACED or self._n_triangles > MOST_TRIANGLES:
            raise InputError(
                f"its objects, each as often as it is placed, come to {len(self._names) + 1:,} "
                f"objects with {self._n_triangles:,} triangles or more; at most {MOST_PLACED:,} "
                f"and {MOST_TRIANGLES:,} are read. Export one coarser mesh"
            )
        if matrix is not None and not np.array_equal(matrix, np.eye(4)):
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
            if np.linalg.det(matrix[:3, :3]) < 0:
                triangles = triangles[:, ::-1]
        self._points.append(points)
        self._triangles.append(triangles + (self._n_points - len(points)))
        self._names.append(name)

    @property
    def objects(self) -> tuple[tuple[str, int], ...]:
        """Name and number of triangles of all that was placed."""
        return tuple(zip(self._names, map(len, self._triangles), strict=True))

    def mesh(self) -> PolyMesh:
        """Return all as one mesh, in the order in which it was placed."""
        if not self._names:
            return PolyMesh.from_triangles(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
        return PolyMesh.from_triangles(
            np.concatenate(self._points), np.concatenate(self._triangles)
        )
