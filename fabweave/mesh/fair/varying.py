"""Calculate with numbers and vectors together with their derivatives."""

from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray

#: Lengths below this are taken for it, so that nothing is divided by zero.
_TINY = 1e-300


@dataclass(frozen=True)
class Varying:
    """Numbers that vary with some coordinates, and how fast (forward differentiation).

    Parameters
    ----------
    value : (N,) or (N, 3) float array
    slope : (N, C) or (N, 3, C) float array
        The derivative by each of C coordinates.
    """

    value: FloatArray
    slope: FloatArray

    def __add__(self, other: "Varying | FloatArray | float") -> "Varying":
        """Return the sum."""
        if isinstance(other, Varying):
            return Varying(self.value + other.value, self.slope + other.slope)
        return Varying(self.value + other, self.slope)

    def __sub__(self, other: "Varying | FloatArray | float") -> "Varying":
        """Return the difference."""
        return self + other * -1.0

    def __mul__(self, other: "Varying | FloatArray | float") -> "Varying":
        """Return the product of numbers."""
        if isinstance(other, Varying):
            slope = self.slope * other.value[..., None] + other.slope * self.value[..., None]
            return Varying(self.value * other.value, slope)
        return Varying(self.value * other, self.slope * np.asarray(other)[..., None])

    def __truediv__(self, other: "Varying") -> "Varying":
        """Return the quotient of numbers."""
        return self * other.by(1.0 / other.value, -1.0 / other.value**2)

    def by(self, value: FloatArray, rate: FloatArray) -> "Varying":
        """Return a function of these numbers: its values, and its derivatives by them."""
        return Varying(value, rate[..., None] * self.slope)

    def log(self) -> "Varying":
        """Return the logarithm of numbers."""
        return self.by(np.log(self.value), 1.0 / self.value)

    def root(self) -> "Varying":
        """Return the square root of numbers that are not negative."""
        root = np.sqrt(np.maximum(self.value, _TINY))
        return self.by(root, 0.5 / root)

    def size(self) -> "Varying":
        """Return how large numbers are."""
        return self.by(np.abs(self.value), np.sign(self.value))

    def over(self, bound: float = 0.0) -> "Varying":
        """Return by how much numbers exceed a bound, or zero."""
        more = self.value > bound
        return self.by(np.where(more, self.value - bound, 0.0), more.astype(np.float64))

    def dot(self, other: "Varying") -> "Varying":
        """Return the scalar product of vectors."""
        slope = np.einsum("nd,ndc->nc", self.value, other.slope)
        slope += np.einsum("nd,ndc->nc", other.value, self.slope)
        return Varying(np.einsum("nd,nd->n", self.value, other.value), slope)

    def cross(self, other: "Varying") -> "Varying":
        """Return the vector product."""
        slope = np.cross(self.value[:, :, None], other.slope, axis=1)
        slope -= np.cross(other.value[:, :, None], self.slope, axis=1)
        return Varying(np.cross(self.value, other.value), slope)

    def unit(self) -> tuple["Varying", "Varying"]:
        """Return vectors at length one, and their lengths."""
        length = self.dot(self).root()
        way = self.value / length.value[:, None]
        slope = self.slope - way[:, :, None] * length.slope[:, None, :]
        return Varying(way, slope / length.value[:, None, None]), length


def combined(points: FloatArray, shares: FloatArray | list[float]) -> Varying:
    """Return sums of K points by shares, as they vary with the coordinates of these points.

    Parameters
    ----------
    points : (N, K, 3) float array
    shares : (N, K) or (K,) float array

    Returns
    -------
    Varying
        Vectors; the coordinates are those of the first point, then those of the second, and so on.
    """
    count, number = points.shape[:2]
    share = np.broadcast_to(shares, (count, number))
    slope = np.einsum("nk,de->ndke", share, np.eye(3)).reshape(count, 3, 3 * number)
    return Varying(np.einsum("nk,nkd->nd", share, points), slope)
