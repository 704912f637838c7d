"""Write weaves as Gauss codes: the crossings of each thread, over or under."""

import numpy as np

from fabweave.core.arrays import IntArray
from fabweave.core.errors import InputError
from fabweave.weave.knot.rotation_system import TwistedThreads
from fabweave.weave.thread_labels import thread_labels


def gauss_code(threads: TwistedThreads, thread: int) -> IntArray:
    """Return the Gauss code of one thread: its crossings in walking order, over or under.

    Parameters
    ----------
    threads : TwistedThreads
        The weave.
    thread : int
        The thread.

    Returns
    -------
    (P_t,) int array
        Crossing number plus one for each pass, positive over and negative under.

    Raises
    ------
    InputError
        If there is no such thread.

    Examples
    --------
    An edge of a two-sided triangle twisted three times makes a trefoil, with a chain of three
    crossings that the thread walks twice:

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> from fabweave.weave.knot.rotation_system import trace_twisted
    >>> lens = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]])
    >>> gauss_code(trace_twisted(build_halfedges(lens), [3, 0, 0]), 0).tolist()
    [1, -2, 3, -1, 2, -3]
    """
    if not 0 <= thread < threads.n_threads:
        raise InputError(f"there is no thread {thread}; there are {threads.n_threads}, from 0")
    own = slice(threads.offsets[thread], threads.offsets[thread + 1])
    return np.where(threads.over[own], 1, -1) * (threads.crossing[own] + 1)


def extended_gauss_code(threads: TwistedThreads) -> tuple[IntArray, ...]:
    """Return the extended Gauss code of all threads, which fixes the link and not its mirror too.

    The first pass of a crossing says over (positive) or under (negative); the second one says the
    sign of the crossing instead: positive is right-handed, threads oriented as they are walked.

    Returns
    -------
    tuple of (P_t,) int arrays
        One code for each thread.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> from fabweave.weave.knot.rotation_system import trace_twisted
    >>> lens = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]])
    >>> trefoil = trace_twisted(build_halfedges(lens), [3, 0, 0])
    >>> [code.tolist() for code in extended_gauss_code(trefoil)]
    [[1, -2, 3, 1, 2, 3]]
    """
    second = np.ones(len(threads.crossing), dtype=bool)
    second[np.unique(threads.crossing, return_index=True)[1]] = False
    value = np.where(second, threads.signs[threads.crossing], np.where(threads.over, 1, -1))
    code = value * (threads.crossing + 1)
    return tuple(np.split(code, threads.offsets[1:-1]))


def gauss_text(threads: TwistedThreads) -> str:
    """Write the signed Gauss code of all threads, one line a thread.

    Each pass is ``O`` (over) or ``U`` (under), the crossing number plus one, and the sign of the
    crossing (``+`` is right-handed, threads oriented as they are walked). This is the notation of
    the tables of virtual knots, which also holds for weaves of any genus.

    Returns
    -------
    str
        Lines such as ``A: O1+U2+O3+U1+O2+U3+``; nothing after the colon for a thread without
        crossings.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> from fabweave.weave.knot.rotation_system import trace_twisted
    >>> lens = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]])
    >>> print(gauss_text(trace_twisted(build_halfedges(lens), [-2, 0, 0])), end="")
    A: U1+O2+
    B: U2+O1+
    """
    level = np.where(threads.over, "O", "U").tolist()
    number = (threads.crossing + 1).tolist()
    sign = np.where(threads.signs[threads.crossing] > 0, "+", "-").tolist()
    words = [f"{o}{x}{s}" for o, x, s in zip(level, number, sign, strict=True)]
    bounds = threads.offsets.tolist()
    lines = [
        f"{label}: {''.join(words[bounds[t] : bounds[t + 1]])}".rstrip() + "\n"
        for t, label in enumerate(thread_labels(threads.n_threads))
    ]
    return "".join(lines)
