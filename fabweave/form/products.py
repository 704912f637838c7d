"""Move points to the nearest ones whose differences have given lengths and inner products."""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fabweave.core.arrays import FloatArray, frozen_value

#: What is added to equations, a share of their size, lest two of them say the same.
_RIDGE = 1e-13


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
            sp.diags_array(other[:, axis] / self.scale) @ self.first
            + sp.diags_array(one[:, axis] / self.scale) @ self.second
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
        off, change = self.off(points)
        for _ in range(steps):
            if float(np.abs(off).max(initial=0.0)) <= exact:
                break
            square = change @ change.T
            square += _RIDGE * square.diagonal().mean() * sp.eye_array(len(off))
            factors = splu(
                sp.csc_array(square), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )  # fmt: skip
            points = points - (change.T @ factors.solve(off)).reshape(3, -1).T
            off, change = self.off(points)
        return points, float(np.abs(off).max(initial=0.0))
