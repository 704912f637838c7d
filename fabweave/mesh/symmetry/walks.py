"""Walk over all half-edges from a few of them, and follow the same walk from others."""

from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges


@frozen_value
class Walks:
    """The shortest walks from some half-edges to all that they are connected with.

    Parameters
    ----------
    order : (N,) int array
        The half-edges that are reached, by the length of their walk; those at the beginning first.
    before : (N,) int array
        Of which of them the walk comes; itself at the beginning.
    step : (N,) int array
        By which step: 0 to the next of the face, 1 to the twin.
    levels : (L + 1,) int array
        Walks of ``k`` steps are at ``levels[k]:levels[k + 1]``.
    """

    order: IntArray
    before: IntArray
    step: IntArray
    levels: IntArray


def plan_walks(halfedges: Halfedges, roots: IntArray) -> Walks:
    """Plan walks from some half-edges, no two of which are connected.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> pair = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2], [0, 2, 3]])
    >>> walks = plan_walks(build_halfedges(pair), np.array([0]))
    >>> walks.order.tolist(), walks.levels.tolist()
    ([0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5, 6])
    """
    count = halfedges.n_halfedges
    inner = halfedges.twin >= 0
    bounds = np.concatenate(([0], np.cumsum(1 + inner), [count + inner.sum() + len(roots)]))
    links = np.empty(bounds[-1], dtype=np.int64)
    links[bounds[:count]] = halfedges.next
    links[bounds[:count][inner] + 1] = halfedges.twin[inner]
    links[bounds[count] :] = roots
    graph = sparse.csr_array(
        (np.ones(len(links), dtype=np.int8), links.astype(np.int32), bounds.astype(np.int32)),
        shape=(count + 1, count + 1),
    )
    reached, came_from = csgraph.breadth_first_order(graph, count, directed=True)
    order: IntArray = reached[1:].astype(np.int64)
    before: IntArray = came_from[order].astype(np.int64)
    before[: len(roots)] = order[: len(roots)]
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(len(order))
    came = place[before]  # does not decrease
    came[: len(roots)] = -1
    levels = [0, len(roots)]
    while levels[-1] < len(order):
        levels.append(int(np.searchsorted(came, levels[-1])))
    step = (halfedges.next[before] != order).astype(np.int64)
    return Walks(order, before, step, np.array(levels, dtype=np.int64))


def step_table(halfedges: Halfedges, *, reverses: bool) -> IntArray:
    """Return where each step leads from each half-edge, (2, H), or leads to in a mirror image.

    A mirror image runs around faces the other way, so what is next comes to lie before.
    """
    return np.stack((halfedges.prev if reverses else halfedges.next, halfedges.twin))


def follow_walks(walks: Walks, table: IntArray, images: IntArray) -> IntArray:
    """Follow the same walks from other half-edges.

    Parameters
    ----------
    walks : Walks
        The walks.
    table : (2, H) int array
        Where steps lead.
    images : int array
        Where the walks begin, in the order of the roots.

    Returns
    -------
    (H,) int array
        Where the walk to each half-edge leads instead; -1 for those not reached, and where a walk
        would leave the mesh at its boundary.
    """
    flat = table.ravel()
    count = table.shape[1]
    result = np.full(count, -1, dtype=np.int64)
    result[walks.order[: len(images)]] = images
    shift = walks.step * count
    bounds = walks.levels.tolist()
    for low, high in pairwise(bounds[1:]):
        came = result[walks.before[low:high]]
        result[walks.order[low:high]] = np.where(came >= 0, flat[shift[low:high] + came], -1)
    return result
