"""Find the designs that no other is better than in every way."""

from collections.abc import Sequence

import numpy as np

from fabweave.app.design.candidate import Candidate
from fabweave.core.arrays import BoolArray, FloatArray


def objectives(candidates: Sequence[Candidate]) -> FloatArray:
    """Return what is to be little, of each candidate, (N, 4): work, unlikeness, narrowness, sheets.

    Work is counted in pieces and crossings; where the likeness was not measured, the mesh is the
    model itself. What cannot be built is infinitely bad.
    """
    rows = np.full((len(candidates), 4), np.inf)
    for at, candidate in enumerate(candidates):
        figures = candidate.figures
        if figures is None or not candidate.makeable:
            continue
        rows[at] = (
            figures.hours[1] if figures.hours is not None else figures.pieces,
            figures.likeness_mean_mm or 0.0,
            -figures.narrowest_mm,
            figures.sheets,
        )
    return rows


def pareto_front(values: FloatArray) -> BoolArray:
    """Return which rows no other row is better than: as good in all, and better in one.

    Parameters
    ----------
    values : (N, K) float array
        The less, the better; rows that are not finite are on no front.

    Returns
    -------
    (N,) bool array

    Examples
    --------
    >>> pareto_front(np.array([[1.0, 9.0], [2.0, 2.0], [3.0, 3.0], [np.inf, 0.0]])).tolist()
    [True, True, False, False]
    """
    no_worse = np.all(values[:, None] <= values[None], axis=2)
    better = np.any(values[:, None] < values[None], axis=2)
    return np.asarray(
        ~np.any(no_worse & better, axis=0) & np.all(np.isfinite(values), axis=1), dtype=np.bool_
    )
