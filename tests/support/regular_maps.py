"""Build regular meshes as bare connectivity, with loops and several edges between two vertices."""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import IntArray
from fabweave.mesh.halfedge import Halfedges


def slit_map(sheets: int, slits: int) -> Halfedges:
    """Return the regular map (4k, 4, 1 + c (k - 1)): k tori glued along c slits each.

    Each torus consists of 2 c squares in a ring, one square around. The slits run from the
    middle of an even square to the middle of the next one; crossing a slit upward leads to the
    next torus. So k squares flow together around each end of a slit, to a face with 4 k sides.

    Parameters
    ----------
    sheets : int
        Number k of tori.
    slits : int
        Number c of slits.

    Returns
    -------
    Halfedges
        Connectivity with ``4 c k`` edges, ``2 c k`` vertices and ``2 c`` faces. There are loops
        and repeated edges, so only what needs connectivity alone can use it.

    Examples
    --------
    The maps (8, 4, 3) and (16, 4, 4):

    >>> for sheets, slits in (2, 2), (4, 1):
    ...     half = slit_map(sheets, slits)
    ...     sizes, valences = np.bincount(half.face), np.bincount(half.tail)
    ...     print(half.n_edges, sizes.tolist(), valences.tolist())
    16 [8, 8, 8, 8] [4, 4, 4, 4, 4, 4, 4, 4]
    16 [16, 16] [4, 4, 4, 4, 4, 4, 4, 4]
    """
    number = np.arange(8 * sheets * slits).reshape(sheets, slits, 2, 4)
    above, below = np.roll(number, -1, axis=0), np.roll(number, 1, axis=0)
    # Sides of a square: 0 bottom, 1 right, 2 top, 3 left. The right side of an even square, which
    # is the left side of the odd one after it, leads from each torus up to the next.
    following = np.roll(number, -1, axis=3)
    following[:, :, 0, 1] = above[:, :, 0, 2]
    following[:, :, 1, 2] = below[:, :, 1, 3]
    twin = np.empty_like(number)
    twin[..., 0], twin[..., 2] = number[..., 2], number[..., 0]
    twin[:, :, 0, 1], twin[:, :, 1, 3] = number[:, :, 1, 3], number[:, :, 0, 1]
    twin[:, :, 1, 1] = np.roll(number[:, :, 0, 3], -1, axis=1)
    twin[:, :, 0, 3] = np.roll(number[:, :, 1, 1], 1, axis=1)
    return halfedges_of_map(following.reshape(-1), twin.reshape(-1))


def dual_map(half: Halfedges) -> Halfedges:
    """Return the dual of a closed map: a vertex for each face and a face for each vertex.

    Examples
    --------
    >>> half = dual_map(slit_map(2, 2))
    >>> np.bincount(half.face).tolist(), np.bincount(half.tail).tolist()
    ([4, 4, 4, 4, 4, 4, 4, 4], [8, 8, 8, 8])
    """
    return halfedges_of_map(half.prev[half.twin], half.twin)


def halfedges_of_map(following: IntArray, twin: IntArray) -> Halfedges:
    """Complete the half-edge arrays of a closed map from two permutations.

    Parameters
    ----------
    following, twin : (H,) int arrays
        The next half-edge around the face, and the opposite one.

    Returns
    -------
    Halfedges
        With vertices, faces and edges numbered in the order of their first half-edges.

    Examples
    --------
    One square whose opposite sides are glued, a torus:

    >>> half = halfedges_of_map(np.array([1, 2, 3, 0]), np.array([2, 3, 0, 1]))
    >>> half.tail.tolist(), half.n_edges
    ([0, 0, 0, 0], 2)
    """
    count = np.arange(len(following))
    previous = np.empty_like(following)
    previous[following] = count
    first = np.flatnonzero(count < twin)
    edge = np.empty_like(twin)
    edge[first] = edge[twin[first]] = np.arange(len(first))
    return Halfedges(
        tail=_orbits(twin[previous]),
        face=_orbits(following),
        next=following,
        prev=previous,
        twin=twin,
        edge=edge,
        edge_halfedge=first,
    )


def _orbits(permutation: IntArray) -> IntArray:
    """Return the number of each element's cycle, in the order of their first elements."""
    count = len(permutation)
    links = sparse.csr_array(
        (np.ones(count, dtype=np.int8), permutation, np.arange(count + 1)), shape=(count, count)
    )
    label = csgraph.connected_components(links, directed=True, connection="weak")[1]
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first)).astype(np.int64)[inverse]
