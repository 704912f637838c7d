"""Fit motions about a point to places and their images."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray


def best_motions(here: FloatArray, there: FloatArray, mirrors: BoolArray | bool) -> FloatArray:
    """Return the rotations, or reflections, about the origin that take places nearest to others.

    Parameters
    ----------
    here, there : (..., N, 3) float arrays
        Places and their images.
    mirrors : bool, or array of them
        Whether to return a reflection.

    Returns
    -------
    (..., 3, 3) float array
        Orthogonal matrices.

    References
    ----------
    Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32
    (1976).
    """
    left, _, right = np.linalg.svd(np.swapaxes(there, -1, -2) @ here)
    sign = np.sign(np.linalg.det(left) * np.linalg.det(right)) * np.where(mirrors, -1.0, 1.0)
    left = left * np.stack((np.ones_like(sign), np.ones_like(sign), sign), axis=-1)[..., None, :]
    return np.asarray(left @ right)


def distances_left(matrix: FloatArray, here: FloatArray, there: FloatArray) -> FloatArray:
    """Return how far motions take places from their images, (..., N)."""
    away = here @ np.swapaxes(matrix, -1, -2)
    away -= there
    return np.sqrt(np.einsum("...i,...i->...", away, away))
