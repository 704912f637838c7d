"""Write weaves as Gauss codes: the crossings of each thread, over or under."""

import numpy as np

from fabweave.weave.knot.rotation_system import TwistedThreads
from fabweave.weave.thread_labels import thread_labels


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
