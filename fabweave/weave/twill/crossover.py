"""Cross twists with one another: take the better of both patch by patch."""

from collections.abc import Iterable

import numpy as np
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.weave.twill.anneal import Couplings


def score(couplings: Couplings, twist: BoolArray) -> int:
    """Return how many conditions twists break."""
    pairs, windows = _broken(couplings, twist)
    return int(pairs @ couplings.pair_weight + windows @ couplings.window_weight)


def cross(couplings: Couplings, twist: BoolArray, others: Iterable[BoolArray]) -> BoolArray:
    """Improve twists by patches of others.

    Where two choices of twists differ, they do so in patches, connected by shared conditions. No
    condition touches two patches, so each patch may be taken or left by itself, and is taken if
    it breaks less.

    Parameters
    ----------
    couplings : Couplings
        The conditions.
    twist : (X,) bool array
        What is to be improved.
    others : iterable of (X,) bool array
        Where patches come from, one after the other.

    Returns
    -------
    (X,) bool array
        Breaks no more conditions than ``twist`` does, and no more than any of ``others`` that
        differs from it in one patch only.

    References
    ----------
    Tinós, Whitley, Chicano, "Partition crossover for pseudo-Boolean optimization" (FOGA 2015).
    """
    result = twist.copy()
    for other in others:
        differing = np.flatnonzero(result != other)
        if not len(differing):
            continue
        among = couplings.neighbours[differing][:, differing]
        n_patches, patch = csgraph.connected_components(among, directed=False)
        patch_of = np.full(couplings.n_crossings, -1, dtype=np.int64)
        patch_of[differing] = patch
        gain = np.zeros(n_patches)
        for conditions, weight, before, after in zip(
            (couplings.pairs, couplings.windows),
            (couplings.pair_weight, couplings.window_weight),
            _broken(couplings, result),
            _broken(couplings, other),
            strict=True,
        ):
            changed = np.flatnonzero(before != after)
            change = np.where(before[changed], weight[changed], -weight[changed])
            touched: IntArray = patch_of[conditions[changed]].max(axis=1)
            gain += np.bincount(touched, weights=change, minlength=n_patches)
        taken = differing[gain[patch] > 0]
        result[taken] = other[taken]
    return result


def _broken(couplings: Couplings, twist: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Return which pairs and which windows are broken."""
    left, right = twist[couplings.pairs].T
    a, b, c, d = twist[couplings.windows].T
    return left == right, (a != b) & (c != d)
