"""Part the threads into bunches, sets of threads that do not cross one another."""

import heapq
from collections.abc import Sequence
from itertools import count, pairwise

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.mesh.topology import solve_parity
from fabweave.weave.threads import Threads

#: The vertices next to each vertex, in rising order.
Neighbours = Sequence[Sequence[int]]


def colour_graph(neighbours: Neighbours) -> tuple[list[int], int]:
    """Colour a graph so that neighbours differ, with few colours: DSATUR.

    The vertex whose neighbours have most colours comes first, and takes the first that is free.

    Parameters
    ----------
    neighbours : sequence of sequences of int
        The vertices next to each; symmetric, without loops.

    Returns
    -------
    colours : list of int
        The colour of each vertex, 0 upwards.
    at_least : int
        No colouring has fewer: so many of the vertices are all next to one another.

    References
    ----------
    Brélaz, "New methods to color the vertices of a graph", CACM 22(4), 1979.

    Examples
    --------
    >>> pentagon = [[1, 4], [0, 2], [1, 3], [2, 4], [0, 3]]
    >>> colour_graph(pentagon)
    ([0, 1, 0, 1, 2], 2)
    """
    colours = [-1] * len(neighbours)
    seen: list[set[int]] = [set() for _ in neighbours]
    clique: set[int] = set()
    heap = [(0, -len(row), vertex) for vertex, row in enumerate(neighbours)]
    heapq.heapify(heap)
    while heap:
        saturation, _, vertex = heapq.heappop(heap)
        if colours[vertex] >= 0 or -saturation < len(seen[vertex]):
            continue
        colour = next(free for free in count() if free not in seen[vertex])
        colours[vertex] = colour
        if clique.issubset(neighbours[vertex]):
            clique.add(vertex)
        for other in neighbours[vertex]:
            if colours[other] < 0 and colour not in seen[other]:
                seen[other].add(colour)
                heapq.heappush(heap, (-len(seen[other]), -len(neighbours[other]), other))
    return colours, len(clique)


@frozen_value
class Bunches:
    """A partition of the threads into bunches.

    Parameters
    ----------
    bunch : (T,) int array
        The bunch of each thread, 0 upwards; with more than two, the first has most crossings.
    at_least : int
        No partition has fewer bunches: so many threads were found that all cross one another.
    crosses_itself : (T,) bool array
        Threads that cross themselves. In their bunch they count as if they did not.
    """

    bunch: IntArray
    at_least: int
    crosses_itself: BoolArray

    @property
    def n_bunches(self) -> int:
        """Number of bunches."""
        return int(self.bunch.max(initial=-1)) + 1

    @property
    def fewest(self) -> bool:
        """Whether it is proved that there cannot be fewer."""
        return self.n_bunches == self.at_least

    @property
    def warp_and_weft(self) -> bool:
        """Whether there are two bunches, and no thread crosses itself."""
        return self.n_bunches == 2 and not self.crosses_itself.any()


def thread_graph(threads: Threads) -> sparse.csr_array:
    """Return which threads cross which: a symmetric (T, T) matrix that counts crossings.

    A thread that crosses itself has an entry on the diagonal, two for each crossing.
    """
    by_crossing = np.argsort(threads.crossing, kind="stable")
    pairs = threads.thread_of_pass[by_crossing].reshape(-1, 2)
    rows = np.concatenate((pairs[:, 0], pairs[:, 1]))
    columns = np.concatenate((pairs[:, 1], pairs[:, 0]))
    size = threads.n_threads
    counts = np.ones(len(rows), dtype=np.int64)
    return sparse.coo_array((counts, (rows, columns)), shape=(size, size)).tocsr()


def count_bodies(threads: Threads) -> int:
    """Count the parts of a weave that no crossing joins: each falls away from the others.

    Threads without a crossing are left out.

    Parameters
    ----------
    threads : Threads

    Returns
    -------
    int
        One for a weave that hangs together.
    """
    number, label = csgraph.connected_components(thread_graph(threads), directed=False)
    return int(number - np.count_nonzero(~threads.woven)) if len(label) else 0


def find_bunches(threads: Threads) -> Bunches:
    """Part the threads into few bunches, and say how few there could be.

    Two bunches, warp and weft, are found whenever two suffice. Otherwise the graph of threads
    is coloured: see ``colour_graph``.

    Parameters
    ----------
    threads : Threads
        The walks.

    Returns
    -------
    Bunches
        The same for the same threads.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects" (2011), section 6.1.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.threads import trace_threads
    >>> bunches = find_bunches(trace_threads(build_halfedges(parse_shape("shape:cube"))))
    >>> bunches.bunch.tolist(), bunches.fewest
    ([0, 1, 2, 3], True)
    """
    graph = thread_graph(threads)
    crosses_itself = np.asarray(graph.diagonal() > 0)
    two = _two_bunches(graph)
    if two is not None:
        return Bunches(two, len(np.unique(two)), crosses_itself)
    rows = [graph.indices[low:high].tolist() for low, high in pairwise(graph.indptr.tolist())]
    neighbours = [
        sorted(other for other in row if other != thread) for thread, row in enumerate(rows)
    ]
    colours, at_least = colour_graph(neighbours)
    bunch = _longest_first(np.array(colours, dtype=np.int64), threads.lengths)
    return Bunches(bunch, at_least, crosses_itself)


def part_bunches(threads: Threads) -> IntArray:
    """Give each thread a bunch number, 0 upwards, so that threads of one bunch never cross.

    Returns
    -------
    (T,) int array
        Bunch numbers; see ``find_bunches``.
    """
    return find_bunches(threads).bunch


def _longest_first(colours: IntArray, lengths: IntArray) -> IntArray:
    """Renumber bunches by how many passes they have, the most first."""
    total = np.bincount(colours, weights=lengths)
    return np.argsort(np.argsort(-total, kind="stable"))[colours]


def _two_bunches(graph: sparse.csr_array) -> IntArray | None:
    """Two-colour the graph, or return None: connected components of its double cover."""
    entries = graph.tocoo()
    apart = entries.row != entries.col
    first, second = (ends[apart].astype(np.int64) for ends in (entries.row, entries.col))
    sides = solve_parity(graph.shape[0], first, second, np.ones(len(first), dtype=bool))
    return None if sides.odd_ring else sides.opposite.astype(np.int64)
