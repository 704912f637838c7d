"""Part the threads into bunches, sets of threads that do not cross one another."""

from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.weave.graph_colouring import colour_graph
from fabweave.weave.threads import Threads

#: How many threads the searches of ``colour_graph`` may look at; a few seconds at the most.
_EFFORT = 1_000_000


@frozen_value
class Bunches:
    """A partition of the threads into bunches.

    Parameters
    ----------
    bunch : (T,) int array
        The bunch of each thread, 0 upwards; with more than two, the first has most crossings.
    at_least : int
        No partition has fewer bunches: so many threads were found that all cross one another, or
        a search was complete.
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
    """Part the threads into as few bunches as can be found, and say how few there could be.

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
    colouring = colour_graph(neighbours, effort=_EFFORT)
    colours = np.array(colouring.colours, dtype=np.int64)
    return Bunches(_longest_first(colours, threads.lengths), colouring.at_least, crosses_itself)


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
    number = np.empty(len(total), dtype=np.int64)
    number[np.argsort(-total, kind="stable")] = np.arange(len(total))
    return number[colours]


def _two_bunches(graph: sparse.csr_array) -> IntArray | None:
    """Two-colour the graph, or return None: connected components of its double cover."""
    size = graph.shape[0]
    entries = graph.tocoo()
    apart = entries.row != entries.col
    rows, columns = entries.row[apart], entries.col[apart]
    double = sparse.coo_array(
        (
            np.ones(2 * len(rows), dtype=np.int8),
            (np.concatenate((rows, rows + size)), np.concatenate((columns + size, columns))),
        ),
        shape=(2 * size, 2 * size),
    )
    _, sheet = csgraph.connected_components(double, directed=False)
    if np.any(sheet[:size] == sheet[size:]):
        return None
    return np.asarray(sheet[:size] > sheet[size:]).astype(np.int64)
