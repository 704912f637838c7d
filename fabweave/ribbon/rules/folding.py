"""Find where a ribbon runs through itself near by: one stretch, or it and the next."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, unit
from fabweave.ribbon.facets import Facets, facet_pairs
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.rules.distance import piercing
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
    for which, first, second in facet_pairs(stretches, facets, pairs, np.zeros(len(pairs))):
        twice = pairs[which, 0] == pairs[which, 1]
        once = np.flatnonzero(~twice | (first < second))
        same = facets.vertices[first[once]][:, :, None] == facets.vertices[second[once]][:, None, :]
        n_shared = same.sum(axis=(1, 2))
        loose = np.flatnonzero(n_shared < 2)
        once, same = once[loose], same[loose]
        shared = np.full((len(once), 2), -1, dtype=np.int64)
        at, corner, other_corner = np.nonzero(same)
        shared[at] = np.column_stack((corner, other_corner))
        a, b = facets.corners[first[once]], facets.corners[second[once]]
        bad = np.flatnonzero(piercing(a, b, shared))
        numbers, begin = np.unique(which[once[bad]], return_index=True)
        kept.append(numbers)
        places.append((a[bad[begin]].mean(axis=1) + b[bad[begin]].mean(axis=1)) / 2)
    folded = pairs[np.concatenate(kept)]
    return folded, np.zeros(len(folded)), np.concatenate(places)


def run_straight(ribbons: Ribbons, stretches: Stretches) -> BoolArray:
    """Tell after which passes a ribbon surely does not run through itself, (P,).

    Looked at is what leads from the panel of a pass to the next panel, both included. Seen along
    one direction, let all its rails run within 45 degrees of one way, and all its cross-lines
    within 45 degrees of the way at right angles to it. Each facet is bounded by a bit of rail and a
    cross-line. So from any point of the strip to any other that lies further along it, or as far
    along and further across, one of the two diagonals of these ways rises all the time: no two
    points come to lie on each other.

    Parameters
    ----------
    ribbons : Ribbons
    stretches : Stretches
        Of these ribbons.

    Returns
    -------
    (P,) bool array
        False where it may, or may not, run through itself.
    """
    count = len(ribbons.entry)
    following = following_rung(ribbons.offsets, ribbons.closed)
    next_pass = following_rung(ribbons.pass_offsets, ribbons.closed)
    panel = ribbons.entry
    ahead = panel[np.where(next_pass >= 0, next_pass, np.arange(count))]
    rung, middle = ribbons.left - ribbons.right, ribbons.left + ribbons.right
    way = np.where(
        (next_pass >= 0)[:, None],
        middle[ahead] + middle[ahead + 1] - middle[panel] - middle[panel + 1],
        middle[panel + 1] - middle[panel],
    )
    way = unit(way)
    across = rung[panel] + rung[panel + 1] + rung[ahead] + rung[ahead + 1]
    across = unit(across - np.einsum("ij,ij->i", across, way)[:, None] * way)
    starts, ends = stretches.offsets[count : 2 * count] // 2, stretches.offsets[count + 1 :] // 2
    between = np.repeat(np.arange(count), ends[:count] - starts)
    straight = np.ones(count, dtype=bool)
    for owner, quads in (
        (
            (np.arange(count), panel),
            (between, stretches.triangle[2 * starts[0] : 2 * ends[count - 1] : 2] // 2),
            (np.arange(count), ahead),
        )
        if count
        else ()
    ):
        after = following[quads]
        for rail in (ribbons.right, ribbons.left):
            step = rail[after] - rail[quads]
            straight[owner[~_steeper(step, way[owner], across[owner])]] = False
        for line in (rung[quads], rung[after]):
            straight[owner[~_steeper(line, across[owner], way[owner])]] = False
    return straight


def _steeper(vectors: FloatArray, main: FloatArray, side: FloatArray) -> BoolArray:
    """Tell which vectors go farther along one direction than either way along another."""
    farther = np.einsum("ij,ij->i", vectors, main) > np.abs(np.einsum("ij,ij->i", vectors, side))
    return np.asarray(farther)
