"""Divide the nodes of a graph into classes that have no edge inside."""

import numpy as np
from scipy import sparse

from fabweave.core.arrays import IntArray


def colour(neighbours: sparse.csr_array) -> IntArray:
    """Give each node the least class that no neighbour has.

    Examples
    --------
    >>> path = sparse.csr_array(np.eye(4, k=1) + np.eye(4, k=-1))
    >>> colour(path).tolist()
    [0, 1, 0, 1]
    """
    bounds, indices = neighbours.indptr.tolist(), neighbours.indices.tolist()
    classes = [-1] * neighbours.shape[0]
    for node in range(len(classes)):
        taken = {classes[other] for other in indices[bounds[node] : bounds[node + 1]]}
        classes[node] = next(k for k in range(len(taken) + 1) if k not in taken)
    return np.array(classes, dtype=np.int64)
