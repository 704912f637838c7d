"""Find where a ribbon runs through itself near by: one stretch, or it and the next."""

import numpy as np

from fabweave.arrays import FloatArray, IntArray
from fabweave.ribbon.distance import piercing
from fabweave.ribbon.facets import Facets, facet_pairs
from fabweave.ribbon.stretches import Stretches


def folded_pairs(
    stretches: Stretches, facets: Facets, pairs: IntArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the pairs of neighbouring stretches that run through each other.

    Facets that follow each other along a ribbon share an edge or a corner, and are always near:
    no distance can be asked of them, but they must meet in what they share only. Where
    cross-lines of a tight bend cross one another, they do not.

    Parameters
    ----------
    stretches : Stretches
    facets : Facets
    pairs : (N, 2) int array
        Each the same stretch twice, or two that follow each other.

    Returns
    -------
    pairs : (K, 2) int array
    distance : (K,) float array
        All 0.
    place : (K, 3) float array
        In the middle of one pair of facets that run through each other.
    """
    kept, places = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    for which, first, second in facet_pairs(stretches, facets, pairs, 0.0):
        twice = pairs[which, 0] == pairs[which, 1]
        once = np.flatnonzero(~twice | (first < second))
        same = facets.vertices[first[once]][:, :, None] == facets.vertices[second[once]][:, None, :]
        n_shared = same.sum(axis=(1, 2))
        loose = np.flatnonzero(n_shared < 2)
        once, same = once[loose], same[loose]
        shared = np.full((len(once), 2), -1, dtype=np.int64)
        at, one, other = np.nonzero(same)
        shared[at] = np.column_stack((one, other))
        a, b = facets.corners[first[once]], facets.corners[second[once]]
        bad = np.flatnonzero(piercing(a, b, shared))
        own, begin = np.unique(which[once[bad]], return_index=True)
        kept.append(own)
        places.append((a[bad[begin]].mean(axis=1) + b[bad[begin]].mean(axis=1)) / 2)
    found = pairs[np.concatenate(kept)]
    return found, np.zeros(len(found)), np.concatenate(places)
