"""Count by hand, so to speak, where a weave leaves the sequences of its fabric."""

from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.weave.fabrics import Fabric
from fabweave.weave.threads import Threads


def broken_floats(threads: Threads, over: BoolArray, warp: BoolArray, fabric: Fabric) -> int:
    """Count the passes at which a thread leaves the fabric's sequence of over and under.

    A pass is broken if it and those that follow, a repeat in all, are not the sequence of warp
    (or weft) from any start, walked either way. Rings are counted round the end; near the ends of
    an open thread, windows that do not fit are not counted.

    Parameters
    ----------
    threads : Threads
        The walks.
    over : (P,) bool array
        Whether each pass lies on top.
    warp : (T,) bool array
        Whether each thread belongs to the warp.
    fabric : Fabric
        What should be woven.

    Returns
    -------
    int
        Broken passes; 0 for an exact weave.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import cube
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(cube())))
    >>> both = np.array([True, True, False, False])
    >>> broken_floats(weave.threads, weave.over, both, Fabric(1, 1))
    0
    >>> broken_floats(weave.threads, weave.over, both, Fabric(2, 2))
    24
    """
    size = fabric.repeat
    thread = threads.thread_of_pass
    start = threads.offsets[thread]
    length = threads.lengths[thread]
    place = np.arange(len(thread)) - start
    code = np.zeros(len(thread), dtype=np.int64)
    for step in range(size):
        code |= over[start + (place + step) % length].astype(np.int64) << step
    counted = threads.closed[thread] | (place + size <= length)
    fits = np.where(
        warp[thread],
        np.isin(code, _codes(_sequences(fabric))),
        np.isin(code, _codes(~_sequences(replace(fabric, shift=1)))),
    )
    return int(np.count_nonzero(counted & ~fits))


def _sequences(fabric: Fabric) -> BoolArray:
    """Over (true) and under along the warp, for each label it may start with, (N, N)."""
    steps = np.arange(fabric.repeat)
    return (steps[:, None] + fabric.shift * steps) % fabric.repeat < fabric.over


def _codes(sequences: BoolArray) -> IntArray:
    """Return the windows of sequences, forwards and backwards, as integers."""
    both = np.concatenate((sequences, sequences[:, ::-1])).astype(np.int64)
    return np.unique((both << np.arange(both.shape[1])).sum(axis=1))
