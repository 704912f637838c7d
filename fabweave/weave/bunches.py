"""Part the threads into bunches, sets of threads that do not cross one another."""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.arrays import IntArray
from fabweave.weave.threads import Threads


def thread_graph(threads: Threads) -> sparse.csr_array:
    """Return which threads cross which: a symmetric (T, T) matrix that counts crossings.

    A thread that crosses itself has an entry on the diagonal.
    """
    by_crossing = np.argsort(threads.crossing, kind="stable")
    pairs = threads.thread_of_pass[by_crossing].reshape(-1, 2)
    rows = np.concatenate((pairs[:, 0], pairs[:, 1]))
    columns = np.concatenate((pairs[:, 1], pairs[:, 0]))
    size = threads.n_threads
    counts = np.ones(len(rows), dtype=np.int64)
    return sparse.coo_array((counts, (rows, columns)), shape=(size, size)).tocsr()


def part_bunches(threads: Threads) -> IntArray:
    """Give each thread a bunch number, 0 upwards, so that threads of one bunch never cross.

    Two bunches, warp and weft, are found whenever two suffice; otherwise threads take the first
    free number, those with most neighbours first. A thread that crosses itself is coloured as if
    it did not.

    Returns
    -------
    (T,) int array
        Bunch numbers.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects" (2011), section 6.1.
    """
    graph = thread_graph(threads)
    two = _two_bunches(graph)
    if two is not None:
        return two
    degrees = np.diff(graph.indptr)
    bunch = np.full(threads.n_threads, -1, dtype=np.int64)
    for thread in np.argsort(-degrees, kind="stable"):
        neighbours = graph.indices[graph.indptr[thread] : graph.indptr[thread + 1]]
        taken = set(bunch[neighbours[neighbours != thread]].tolist())
        bunch[thread] = next(number for number in range(len(taken) + 1) if number not in taken)
    return bunch


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
