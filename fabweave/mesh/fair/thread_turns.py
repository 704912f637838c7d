"""Follow threads from portal to portal, by connectivity alone."""

import numpy as np
from scipy import sparse

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges


@frozen_value
class Portals:
    """The portals of a mesh at some positions, one for each corner of a face.

    The portal of half-edge ``h`` runs from the centre of its face to its head; the thread that
    passes that corner comes over the edge of ``h`` and goes on over the next one. In between it
    runs straight across the crossings' quads, so it turns at portals only.

    Parameters
    ----------
    arriving, leaving, across : (H, 3) float arrays
        Unit vectors from the middle of the portal before to this one's, from this one's to the
        next one's, and along the portal. Meaningless where there is no crossing before or after.
    come, go, width : (H,) float arrays
        The lengths of these; 1 where they vanish.
    """

    arriving: FloatArray
    leaving: FloatArray
    across: FloatArray
    come: FloatArray
    go: FloatArray
    width: FloatArray


def turns_in_a_row(half: Halfedges, passed: BoolArray, length: int) -> sparse.csr_array:
    """Return the map from turns at portals to sums along threads, over as many as asked.

    A thread turns left at a portal by what it turns there when it passes the corner forward, and
    by the opposite when it passes it backward. Threads are walked both ways, which the factor
    √½ makes up for in squares.
    """
    count = half.n_halfedges
    # As threads are traced: a forward pass of a corner goes on over the next edge, backward.
    ahead, behind = half.twin[half.next], half.twin
    after = np.concatenate(
        [
            np.where(ahead >= 0, count + half.prev[ahead], -1),
            np.where(behind >= 0, behind, -1),
        ]
    )
    passed_either_way = np.tile(passed, 2)
    walk = [np.flatnonzero(passed_either_way)]
    for _ in range(length - 1):
        onward = after[walk[-1]]
        goes_on = (onward >= 0) & passed_either_way[onward]
        walk = [states[goes_on] for states in [*walk, onward]]
    states = np.stack(walk, axis=1)
    signs = np.where(states >= count, -1.0, 1.0) * np.sqrt(0.5)
    return sparse_rows(states % count, signs, count)


def ideal_cosines(half: Halfedges, n_vertices: int, sizes: IntArray) -> FloatArray:
    """Return the cosine at which threads would arrive at each portal if all were regular.

    The quad of a crossing has the angle 2π/k at a vertex with k edges and 2π/n at the centre of
    a face with n in a regular tiling, where the two add up to π; elsewhere they are scaled to.
    """
    edges = np.bincount(half.tail, minlength=n_vertices)
    # A straight boundary is half a turn.
    edges[half.tail[half.twin < 0]] *= 2
    return np.cos(np.pi * sizes / (sizes + edges[half.head]))


def sparse_rows(columns: IntArray, values: FloatArray, width: int) -> sparse.csr_array:
    """Return a sparse map whose rows hold values, the same or their own, at columns (N, K)."""
    count, size = columns.shape
    entries = np.broadcast_to(values, columns.shape).reshape(-1)
    starts = np.arange(0, count * size + 1, size)
    return sparse.csr_array((entries, columns.reshape(-1), starts), shape=(count, width))
