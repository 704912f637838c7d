"""Order the states of a successor permutation: its cycles and paths, as arrays."""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray


def order_states(successor: IntArray, count: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Return one direction of every walk of a permutation that holds each walk in both.

    State ``s`` and state ``s + count`` (modulo ``2 count``) are the same place passed the two
    ways, so the reverse of a walk visits the partners of its states in reverse order. Of the two,
    the walk that holds the smallest state is kept.

    Parameters
    ----------
    successor : (2 N,) int array
        The state that follows each state; -1 where the walk ends. Injective apart from the -1.
    count : int
        The number of places, N.

    Returns
    -------
    states : (K,) int array
        The states of the kept walks, walk after walk, in walking order.
    walk : (K,) int array
        The walk of each of them, 0 upwards in the order of the first states.
    closed : (W,) bool array
        Whether each walk is a cycle; one that is not begins at the state that nothing precedes.

    Examples
    --------
    Two places, joined in a ring:

    >>> import numpy as np
    >>> states, walk, closed = order_states(np.array([1, 0, 3, 2]), 2)
    >>> states.tolist(), walk.tolist(), closed.tolist()
    ([0, 1], [0, 0], [True])
    """
    n_states = len(successor)
    states = np.arange(n_states, dtype=np.int32)
    goes_on = successor >= 0
    links = sparse.csr_array(
        (
            np.ones(np.count_nonzero(goes_on), dtype=np.int8),
            successor[goes_on].astype(np.int32),
            np.concatenate(([0], np.cumsum(goes_on))).astype(np.int32),
        ),
        shape=(n_states, n_states),
    )
    n_walks, walk = csgraph.connected_components(links, directed=True, connection="weak")
    smallest = np.empty(n_walks, dtype=np.int64)
    smallest[walk[::-1]] = states[::-1]  # the last write wins, which is the smallest state
    # The same corner passed the other way lies in the reverse of the walk.
    reverse_walk = walk[(smallest + count) % n_states]
    kept = smallest < smallest[reverse_walk]
    has_predecessor = np.zeros(n_states, dtype=bool)
    has_predecessor[successor[goes_on]] = True
    starts = np.flatnonzero(~has_predecessor)
    first = smallest.copy()
    first[walk[starts]] = starts
    closed = np.ones(n_walks, dtype=bool)
    closed[walk[starts]] = False

    first, closed = first[kept], closed[kept]
    by_first = np.argsort(first, kind="stable")
    first, closed = first[by_first], closed[by_first]
    new_number = np.full(n_walks, -1, dtype=np.int32)
    new_number[walk[first]] = np.arange(len(first))
    ordered = _breadth_first(links, first)
    number = new_number[walk[ordered]]
    by_thread = np.argsort(number, kind="stable")
    return ordered[by_thread].astype(np.int64), number[by_thread].astype(np.int64), closed


def _breadth_first(links: sparse.csr_array, first: IntArray) -> IntArray:
    """Return the states reached from ``first``, all walks side by side, step after step.

    One breadth-first search from an extra root linked to every first state visits each walk in
    its own order; a stable sort by walk then puts every walk together.
    """
    n_states = links.shape[0]
    indptr = np.concatenate((links.indptr, [links.indptr[-1] + len(first)])).astype(np.int32)
    indices = np.concatenate((links.indices, first)).astype(np.int32)
    rooted = sparse.csr_array(
        (np.ones(len(indices), dtype=np.int8), indices, indptr),
        shape=(n_states + 1, n_states + 1),
    )
    reached = csgraph.breadth_first_order(
        rooted, n_states, directed=True, return_predecessors=False
    )
    return np.asarray(reached[1:])
