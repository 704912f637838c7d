"""Decide over and under: the twist sense of every crossing of a weave."""

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.core.messages import agree
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import Broken


@frozen_value
class Weave:
    """Threads with over and under.

    Parameters
    ----------
    threads : Threads
        The walks.
    pattern : str
        Its name, such as ``"plain"``.
    twist : (X,) bool array
        Twist sense of each crossing's edge: true is counter-clockwise.
    over : (P,) bool array
        Whether each pass lies on top.
    broken : Broken
        The conditions of the pattern that are broken.
    broken_at_turns : int
        Of a twill: the places besides where a thread turns back at a rim and loses its rhythm; see
        `fabweave.weave.twill.conditions.broken_at_turns`.
    """

    threads: Threads
    pattern: str
    twist: BoolArray
    over: BoolArray
    broken: Broken = Broken(0, 0, 0)
    broken_at_turns: int = 0

    @property
    def exact(self) -> bool:
        """Whether the pattern holds everywhere."""
        return self.broken.total == 0


def at_turns_text(count: int) -> str:
    """Say where threads that turn back break the rhythm of a twill."""
    return agree(count, "{n} place[|s] where threads turn back at a rim")


def exact_text(broken_at_turns: int) -> str:
    """Say that a pattern is exact, and where all the same it is not.

    Examples
    --------
    >>> exact_text(0), exact_text(2)
    ('exact', 'exact, but for 2 places where threads turn back at a rim')
    """
    return "exact" + (f", but for {at_turns_text(broken_at_turns)}" if broken_at_turns else "")


def over_of_passes(threads: Threads, twist: BoolArray) -> BoolArray:
    """Return whether each pass lies on top, (P,).

    A counter-clockwise edge takes its left strand over its right one, and the strand that arrives
    forward comes from the left: so a forward pass is on top exactly where the twist is true.

    Seen from outside and along the edge, the strand that goes from lower left to upper right then
    lies on top: the two strands of a counter-clockwise edge are a right-handed helix, like the
    thread of a common screw. This is the one sense of twist everywhere in fabweave.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), proof of theorem 5.2.
    """
    return threads.forward == twist[threads.crossing]


def strand_passes(weave: Weave) -> IntArray:
    """Return the pass that goes under and the one that goes over at each crossing, (X, 2)."""
    crossing = weave.threads.crossing
    passes = np.zeros((weave.threads.n_crossings, 2), dtype=np.int64)
    passes[crossing, weave.over.astype(np.int64)] = np.arange(len(crossing))
    return passes


def plain_weave(threads: Threads) -> Weave:
    """Weave every thread over one, under one.

    All twists have one sense, so every thread alternates, on every mesh.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> from fabweave.weave.threads import trace_threads
    >>> tetrahedron = PolyMesh.from_faces(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
    ...     [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    >>> plain_weave(trace_threads(build_halfedges(tetrahedron))).over.reshape(3, 4).tolist()[0]
    [True, False, True, False]
    """
    twist = np.ones(threads.n_crossings, dtype=bool)
    return Weave(threads, "plain", twist, over_of_passes(threads, twist))
