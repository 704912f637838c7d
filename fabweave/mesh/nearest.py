"""Find the closest points of a surface."""

from functools import cache, cached_property
from types import ModuleType

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.parallel.interrupt import held_back


@cache
def libigl() -> ModuleType:
    """Return libigl, which takes a while to import, and which most jobs never need.

    An interrupt in the midst of that would end the process.
    """
    with held_back():
        import igl.predicates  # noqa: PLC0415 -- see above
    return igl


@frozen_value
class Feet:
    """The closest points of a surface to some places; each of its arrays is made when asked for.

    Parameters
    ----------
    surface : Surface
    triangle : (N,) int array
        On which of its triangles they lie.
    scaled : (N, 3) float array
        Where, in the scale of its tree.
    square : (N,) float array
        How far, squared, in that scale.
    """

    surface: "Surface"
    triangle: IntArray
    scaled: FloatArray
    square: FloatArray

    @cached_property
    def points(self) -> FloatArray:
        """Where they are, (N, 3)."""
        return self.scaled / self.surface.scale + self.surface.origin

    @cached_property
    def distances(self) -> FloatArray:
        """How far, (N,)."""
        return np.sqrt(np.maximum(self.square, 0.0)) / self.surface.scale

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals of the triangles, (N, 3)."""
        return self.surface.normals[self.triangle]

    @cached_property
    def corners(self) -> IntArray:
        """The corners of the triangles, (N, 3)."""
        return self.surface.triangles[self.triangle]

    @cached_property
    def shares(self) -> FloatArray:
        """How much each corner has in them, (N, 3).

        ``points`` are the sums of the corners' positions by these shares, which are positive and
        add up to one.
        """
        return _barycentric(self.scaled, self.surface.scaled[self.corners])


class Surface:
    """A surface of triangles, asked for the closest points to places.

    Parameters
    ----------
    points : (N, 3) float array
        Finite.
    triangles : (T, 3) int array
        Corners; triangles without area are left out.
    """

    def __init__(self, points: FloatArray, triangles: IntArray) -> None:
        """Sort the triangles into a tree."""
        # igl ends the interpreter on input that it does not expect, so it gets none.
        if not np.isfinite(points).all():
            raise ValueError("a surface needs finite points")
        if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(points):
            raise ValueError("triangles name points that do not exist")
        self.origin = points.mean(axis=0) if len(points) else np.zeros(3)
        reach = float(np.abs(points - self.origin).max(initial=0.0))
        # A power of two rounds nothing, and keeps squares in range.
        self.scale = float(np.ldexp(1.0, -int(np.frexp(reach)[1])))
        self.scaled = np.ascontiguousarray((points - self.origin) * self.scale)
        corner = self.scaled[triangles]
        area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        # What is so thin that the square of its area is no number has none.
        size = np.linalg.norm(area, axis=1, keepdims=True)
        wide = size[:, 0] > 0.0
        if not wide.any():
            raise ValueError("a surface needs triangles with an area")
        self._numbers = np.flatnonzero(wide)
        self.triangles = np.ascontiguousarray(triangles[wide])
        self.normals = area[wide] / size[wide]
        self._tree = libigl().AABB()
        self._tree.init(self.scaled, self.triangles)

    def feet(self, places: FloatArray) -> Feet:
        """Return the closest points of the surface, and where on which triangle they are.

        Parameters
        ----------
        places : (N, 3) float array
            Finite.
        """
        if not np.isfinite(places).all():
            raise ValueError("the places must be finite")
        return Feet(self, *self._nearest((places - self.origin) * self.scale))

    def hits(self, places: FloatArray, ways: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return which triangle a ray from each place meets first, and how far it goes.

        Parameters
        ----------
        places : (N, 3) float array
            Finite.
        ways : (N, 3) float array
            Directions, of length one.

        Returns
        -------
        triangles : (N,) int array
            Their numbers; -1 where it meets none.
        distances : (N,) float array
            Infinite where it meets none.

        Examples
        --------
        >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> one = Surface(corners, np.array([[0, 1, 2]]))
        >>> above = np.array([[0.2, 0.2, 3.0], [9.0, 9.0, 3.0]])
        >>> [found.tolist() for found in one.hits(above, np.array([[0.0, 0, -1]] * 2))]
        [[0, -1], [3.0, inf]]
        """
        if not len(places):
            return np.zeros(0, dtype=np.int64), np.zeros(0)
        begin = np.ascontiguousarray((places - self.origin) * self.scale)
        met, far, _ = self._tree.intersect_ray_first(
            self.scaled, self.triangles, begin, np.ascontiguousarray(ways)
        )
        triangles = np.asarray(met, dtype=np.int64).reshape(-1)
        far = np.asarray(far, dtype=np.float64).reshape(-1) / self.scale
        missed = triangles < 0
        return np.where(missed, -1, self._numbers[triangles]), np.where(missed, np.inf, far)

    def _nearest(self, asked: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return triangles, closest points and squared distances, all in the tree's scale."""
        if not len(asked):
            return np.zeros(0, dtype=np.int64), asked, np.zeros(0)
        square, nearest, closest = self._tree.squared_distance(
            self.scaled, self.triangles, np.ascontiguousarray(asked)
        )
        return (
            np.asarray(nearest, dtype=np.int64).reshape(-1),
            np.asarray(closest, dtype=np.float64).reshape(-1, 3),
            np.asarray(square, dtype=np.float64).reshape(-1),
        )


def _barycentric(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the shares of the three corners at points of their triangles, (N, 3)."""
    side = corners[:, 1:] - corners[:, :1]
    here = points - corners[:, 0]
    a, b, c = (np.einsum("nd,nd->n", side[:, i], side[:, j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    p, q = (np.einsum("nd,nd->n", side[:, i], here) for i in range(2))
    det = a * c - b * b
    det = np.where(det > 0, det, 1.0)
    second, third = (c * p - b * q) / det, (a * q - b * p) / det
    shares = np.clip(np.column_stack([1 - second - third, second, third]), 0.0, 1.0)
    return shares / np.maximum(shares.sum(axis=1, keepdims=True), 1e-300)
