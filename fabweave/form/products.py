"""Move points to the nearest ones whose differences have given lengths and inner products."""

from contextlib import suppress
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.linalg import LinAlgError, solveh_banded
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from fabweave.core.arrays import FloatArray, frozen_value

#: What is added to equations, a share of their size, lest two of them say the same.
_RIDGE = 1e-13
#: Equations of which each has to do with none that are farther away than this, as those of strips
#: by themselves, are solved as a band.
_BAND = 64


@frozen_value
class Products:
    """Conditions on points: of each, two sums of points have a given inner product.

    Parameters
    ----------
    first, second : (C, N) sparse arrays
        What is summed.
    wanted : (C,) float array
    scale : (C,) float array
        By which products are divided.
    """

    first: sp.csr_array
    second: sp.csr_array
    wanted: FloatArray
    scale: FloatArray

    def off(self, points: FloatArray) -> tuple[FloatArray, sp.csr_array]:
        """Return how far products are off, (C,), and how that changes, (C, 3 N) by axes."""
        one, other = self.first @ points, self.second @ points
        off = (np.einsum("cd,cd->c", one, other) - self.wanted) / self.scale
        change = [
            _times(other[:, axis] / self.scale, self.first)
            + _times(one[:, axis] / self.scale, self.second)
            for axis in range(3)
        ]
        return off, sp.csr_array(sp.hstack(change))

    def nearest(self, points: FloatArray, *, exact: float, steps: int) -> tuple[FloatArray, float]:
        """Return about the nearest points that keep all conditions, and how far off they are.

        Newton's steps, each as short as can be, until no product is farther off than ``exact``.

        Parameters
        ----------
        points : (N, 3) float array
            Where they set out.
        exact : float
        steps : int
            At most.
        """
        own, reach = self._as_band
        off, change = own.off(points)
        for _ in range(steps):
            if float(np.abs(off).max(initial=0.0)) <= exact:
                break
            step = change.T @ _solved(change @ change.T, off, reach)
            points = points - step.reshape(3, -1).T
            off, change = own.off(points)
        return points, float(np.abs(off).max(initial=0.0))

    @cached_property
    def _as_band(self) -> "tuple[Products, int]":
        """The conditions in an order in which those that share a point are near to one another.

        And how far away they are there, at most. The order stays where that is too far for a band.
        """
        about = abs(self.first) + abs(self.second)
        shared = sp.csr_array(about @ about.T)
        order = reverse_cuthill_mckee(shared, symmetric_mode=True)
        row, column = sp.coo_array(shared).coords
        place = np.argsort(order)
        reach = int(np.abs(place[row] - place[column]).max(initial=0))
        if reach > _BAND:
            return self, reach
        first, second = self.first[order], self.second[order]
        return Products(first, second, self.wanted[order], self.scale[order]), reach


def _times(factor: FloatArray, rows: sp.csr_array) -> sp.csr_array:
    """Return a sparse matrix with each row times a factor."""
    data = np.repeat(factor, np.diff(rows.indptr)) * rows.data
    return sp.csr_array((data, rows.indices, rows.indptr), shape=rows.shape)


def _solved(square: sp.csr_array, off: FloatArray, reach: int) -> FloatArray:
    """Return what solves symmetric equations, each with others that are so far away at most."""
    square = sp.csr_array(square + _RIDGE * square.diagonal().mean() * sp.eye_array(len(off)))
    if reach <= _BAND:
        row, column = sp.coo_array(square).coords
        low = row >= column
        band = np.zeros((reach + 1, len(off)))
        band[(row - column)[low], column[low]] = square.data[low]
        with suppress(LinAlgError):  # two that say the same but for rounding
            return np.asarray(solveh_banded(band, off, lower=True, check_finite=False))
    factors = splu(
        sp.csc_array(square), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
    return np.asarray(factors.solve(off))
