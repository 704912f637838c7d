"""Solve equations that say of pairs whether they are equal or opposite."""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, frozen_value


@frozen_value
class ParityClasses:
    """Nodes that depend on one another, each equal or opposite to its class.

    Parameters
    ----------
    classes : (N,) int array
        The class of each node, numbered in the order of the first node of each.
    opposite : (N,) bool array
        Whether a node is opposite to the first node of its class; without meaning in a class
        that contradicts itself.
    odd_ring : tuple of int
        Nodes in order round a ring of equations that contradict one another; empty if there is
        none.
    """

    classes: IntArray
    opposite: BoolArray
    odd_ring: tuple[int, ...]

    @property
    def n_classes(self) -> int:
        """Number of classes."""
        return int(self.classes.max(initial=-1)) + 1


def solve_parity(count: int, first: IntArray, second: IntArray, differ: BoolArray) -> ParityClasses:
    """Solve a system of equations, each saying that two nodes are equal or opposite.

    Two copies of every node, one for each value, are linked as the equations say. A class that
    agrees falls into two components, one that contradicts itself into one.

    Parameters
    ----------
    count : int
        Number of nodes, N.
    first, second : (M,) int arrays
        The nodes of each equation.
    differ : (M,) bool array
        Whether they are opposite.

    Returns
    -------
    ParityClasses
        The solution, but for one free choice a class, or a contradiction.

    Examples
    --------
    >>> import numpy as np
    >>> solution = solve_parity(4, np.array([0, 1]), np.array([1, 3]), np.array([True, True]))
    >>> solution.classes.tolist(), solution.opposite.tolist()
    ([0, 0, 1, 0], [False, True, False, False])
    >>> ring = np.array([1, 2, 3])
    >>> sorted(solve_parity(4, np.r_[0, ring], np.r_[1, 2, 3, 1], np.ones(4, dtype=bool)).odd_ring)
    [1, 2, 3]
    """
    across = second + count * differ
    rows = np.concatenate((first, first + count))
    columns = np.concatenate((across, (across + count) % (2 * count)))
    double = sparse.coo_array(
        (np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(2 * count, 2 * count)
    ).tocsr()
    _, component = csgraph.connected_components(double, directed=False)
    # Of the two components of a class the smaller number stands for it.
    low = np.minimum(component[:count], component[count:])
    _, first_node, classes = np.unique(low, return_index=True, return_inverse=True)
    rank = np.empty(len(first_node), dtype=np.int64)
    rank[np.argsort(first_node, kind="stable")] = np.arange(len(first_node))
    opposite = component[:count] != component[first_node[classes]]
    torn = np.flatnonzero(component[:count] == component[count:])
    ring = _ring(double, int(torn[0]), count) if len(torn) else ()
    return ParityClasses(rank[classes.reshape(-1)], opposite, ring)


def _ring(double: sparse.csr_array, start: int, count: int) -> tuple[int, ...]:
    """Return a ring of equations that leads some node near another to its own opposite."""
    _, before = csgraph.breadth_first_order(double, start, directed=False, return_predecessors=True)
    way = [start + count]
    while way[-1] != start:
        way.append(int(before[way[-1]]))
    # The way may go to a ring, round it and back again: keep the ring.
    seen: dict[int, int] = {}
    bounds = (0, len(way) - 1)
    for at, node in enumerate(way):
        since = seen.get(node % count)
        if since is not None and at - since < bounds[1] - bounds[0]:
            bounds = (since, at)
        seen[node % count] = at
    return tuple(node % count for node in way[bounds[1] : bounds[0] : -1])
