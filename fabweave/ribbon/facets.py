"""Cut ribbons into their facets, and find pairs of facets whose boxes are within reach."""

from collections.abc import Iterator

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value, offsets_of
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.stretches import Stretches

#: Pairs of facets are looked at in blocks of about this many, to bound memory.
_BLOCK = 1 << 18


@frozen_value
class Facets:
    """The facets of ribbons; filled only where they were wanted.

    Triangles ``2 r`` and ``2 r + 1`` make up the quad that follows rung ``r``; vertex ``2 r`` is
    the right and ``2 r + 1`` the left end of that rung.

    Parameters
    ----------
    vertices : (F, 3) int array
    corners : (F, 3, 3) float array
    low, high : (3, F) float arrays
        Boxes, by axes, so that every look-up runs through memory in order.
    """

    vertices: IntArray
    corners: FloatArray
    low: FloatArray
    high: FloatArray


def facet_vertices(ribbons: Ribbons, rungs: IntArray) -> IntArray:
    """Return the vertices of the two facets of the quads that follow some rungs, (2 N, 3).

    The facet at the near rung comes first.
    """
    after = following_rung(ribbons.offsets, ribbons.closed)[rungs]
    a, b, c, d = 2 * rungs, 2 * after, 2 * after + 1, 2 * rungs + 1
    slanted = ribbons.from_right[rungs]
    near = np.stack((a, np.where(slanted, c, b), d), axis=1)
    far = np.stack((np.where(slanted, a, b), np.where(slanted, b, c), np.where(slanted, c, d)), 1)
    return np.stack((near, far), axis=1).reshape(-1, 3)


def rung_ends(ribbons: Ribbons) -> FloatArray:
    """Return the vertices that facets use, (2 R, 3)."""
    return np.stack((ribbons.right, ribbons.left), axis=1).reshape(-1, 3)


def cut_facets(ribbons: Ribbons, rungs: IntArray) -> Facets:
    """Cut the quads that follow some rungs into facets."""
    count = 2 * ribbons.n_rungs
    rows = (2 * rungs[:, None] + [0, 1]).ravel()
    vertices, corners = np.empty((count, 3), dtype=np.int64), np.empty((count, 3, 3))
    vertices[rows] = facet_vertices(ribbons, rungs)
    corners[rows] = rung_ends(ribbons)[vertices[rows]]
    low, high = np.empty((2, 3, count))
    for axis in range(3):
        low[axis, rows] = np.minimum.reduce([corners[rows, k, axis] for k in range(3)])
        high[axis, rows] = np.maximum.reduce([corners[rows, k, axis] for k in range(3)])
    return Facets(vertices, corners, low, high)


def facet_pairs(
    stretches: Stretches, facets: Facets, pairs: IntArray, reach: FloatArray
) -> Iterator[tuple[IntArray, IntArray, IntArray]]:
    """Yield the pairs of facets, one of either stretch, whose boxes are within reach, in blocks.

    Parameters
    ----------
    stretches, facets
        Of the same ribbons.
    pairs : (P, 2) int array
        Stretches.
    reach : (P,) float array
        Of each pair, in millimetres.

    Yields
    ------
    which : (N,) int array
        The pair of stretches.
    first, second : (N,) int arrays
        The facets.
    """
    sizes = np.diff(stretches.offsets)
    counts = sizes[pairs[:, 0]] * sizes[pairs[:, 1]]
    bounds = np.searchsorted(np.cumsum(counts), np.arange(0, max(counts.sum(), 1), _BLOCK))
    for start, end in zip(bounds, [*bounds[1:], len(pairs)], strict=True):
        block = np.arange(start, end)
        which = np.repeat(block, counts[block])
        within = np.arange(len(which)) - np.repeat(offsets_of(counts[block])[:-1], counts[block])
        rows, columns = np.divmod(within, sizes[pairs[which, 1]])
        first = stretches.triangle[stretches.offsets[pairs[which, 0]] + rows]
        second = stretches.triangle[stretches.offsets[pairs[which, 1]] + columns]
        for below, above in zip(facets.low, facets.high, strict=True):
            far = reach[which]
            meet = (below[first] <= above[second] + far) & (below[second] <= above[first] + far)
            which, first, second = which[meet], first[meet], second[meet]
        yield which, first, second
