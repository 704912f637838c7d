"""List the conditions of a 2/2 twill, and count those that a choice of twists breaks."""

import math
import re
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, flags, frozen_value
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.threads import Threads, crossing_of_halfedges

_LEAST, _MOST = Fraction(1, 10), Fraction(10)


@dataclass(frozen=True)
class TwillWeights:
    """How much a broken face or vertex condition counts, where a broken edge condition counts 1.

    Edge conditions are the rhythm along each thread, over two and under two. Face and vertex
    conditions are what lines the steps of neighbouring threads up to diagonals.

    Parameters
    ----------
    face, vertex : Fraction
        The weights.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 6.4.

    Examples
    --------
    >>> TwillWeights(Fraction(3, 2), Fraction(2)).whole
    (2, 3, 4)
    """

    face: Fraction = Fraction(1)
    vertex: Fraction = Fraction(1)

    @property
    def equal(self) -> bool:
        """Whether all conditions count alike."""
        return self.face == self.vertex == 1

    @property
    def whole(self) -> tuple[int, int, int]:
        """The least whole numbers in proportion: for edge, face and vertex conditions."""
        scale = math.lcm(self.face.denominator, self.vertex.denominator)
        return scale, int(self.face * scale), int(self.vertex * scale)

    def __str__(self) -> str:
        """Write the weights as :func:`parse_weights` reads them."""
        return f"{float(self.face):g}/{float(self.vertex):g}"


EQUAL = TwillWeights()


def parse_weights(text: str) -> TwillWeights:
    """Read the weights of face and vertex conditions.

    Raises
    ------
    InputError
        If the text is something else, or a weight is out of range.

    Examples
    --------
    >>> str(parse_weights("2/2")), str(parse_weights(" 1.50 / 3 "))
    ('2/2', '1.5/3')
    """
    found = re.fullmatch(r"(\d{1,2}(?:\.\d0*)?)\s*/\s*(\d{1,2}(?:\.\d0*)?)", text.strip(), re.ASCII)
    weights = TwillWeights(Fraction(found[1]), Fraction(found[2])) if found else None
    if weights is None or not all(_LEAST <= one <= _MOST for one in (weights.face, weights.vertex)):
        raise InputError(
            f"{text[:40]!r} are no weights of face and vertex conditions; write two numbers from "
            "0.1 to 10 with at most one decimal, such as 2/2"
        )
    return weights


def tidy_weights(text: str) -> str:
    """Return weights in their usual form."""
    return str(parse_weights(text))


@frozen_value
class TwillConditions:
    """The conditions of a 2/2 twill as tuples of crossings.

    Parameters
    ----------
    n_crossings : int
        Number of crossings.
    edge : (M, 2) int array
        The first and the last of three crossings consecutive along a thread: they must twist in
        opposite senses.
    thread : (M,) int array
        The thread along which each edge condition lies.
    face : (N, 4) int array
        Four edges consecutive around a face: where the middle two differ, the outer two agree.
    vertex : (O, 4) int array
        The same around a vertex.
    """

    n_crossings: int
    edge: IntArray
    thread: IntArray
    face: IntArray
    vertex: IntArray

    @property
    def gaps(self) -> IntArray:
        """Face and vertex conditions together, (N + O, 4)."""
        return np.concatenate((self.face, self.vertex))

    @property
    def count(self) -> int:
        """Number of all conditions."""
        return len(self.edge) + len(self.face) + len(self.vertex)


@dataclass(frozen=True)
class Broken:
    """How many conditions are broken."""

    edge: int
    face: int
    vertex: int

    @property
    def total(self) -> int:
        """All of them."""
        return self.edge + self.face + self.vertex

    def __str__(self) -> str:
        """Say how many of which."""
        return f"{self.total} ({self.edge} edge, {self.face} face, {self.vertex} vertex)"


def twill_conditions(halfedges: Halfedges, threads: Threads) -> TwillConditions:
    """List all conditions of a 2/2 twill.

    Four edges consecutive around a face or a vertex make a condition if they are four different
    places, so triangles and vertices of valence three make none. A boundary edge has no twist: no
    condition reaches over one, nor over the place where a thread turns back at one.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of the mesh.
    threads : Threads
        Its threads.

    Returns
    -------
    TwillConditions

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), definition 5.1.

    Examples
    --------
    >>> from fabweave.mesh.shapes import solids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(solids.cube())
    >>> conditions = twill_conditions(halfedges, trace_threads(halfedges))
    >>> len(conditions.edge), len(conditions.face), len(conditions.vertex)
    (24, 24, 0)
    """
    # The medial graph knows no difference between the two: a face of it for each face and vertex.
    around_vertex = halfedges.twin[halfedges.prev]
    pairs, thread, turned = _along_threads(threads)
    edge, thread = pairs[~turned], thread[~turned]
    return TwillConditions(
        n_crossings=threads.n_crossings,
        edge=edge,
        thread=thread,
        face=_windows(halfedges.next, halfedges, threads),
        vertex=_windows(around_vertex, halfedges, threads),
    )


def count_broken(conditions: TwillConditions, twist: BoolArray) -> Broken:
    """Count the broken conditions of each kind.

    Examples
    --------
    >>> import numpy as np
    >>> pairs = np.array([[0, 1], [1, 2]])
    >>> windows = np.array([[0, 1, 2, 3]])
    >>> conditions = TwillConditions(4, pairs, np.array([0, 0]), windows, windows[:0])
    >>> count_broken(conditions, np.array([True, True, False, False]))
    Broken(edge=1, face=1, vertex=0)
    """
    return Broken(
        edge=int(np.count_nonzero(broken_pairs(conditions.edge, twist))),
        face=int(np.count_nonzero(broken_windows(conditions.face, twist))),
        vertex=int(np.count_nonzero(broken_windows(conditions.vertex, twist))),
    )


def broken_at_turns(threads: Threads, twist: BoolArray) -> int:
    """Count the places where a thread turns back at a rim and loses its rhythm there.

    No condition reaches over a turn, but the eye follows a thread round it: of three crossings in a
    row along a thread with a turn between them, the first and the last twist alike.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.grids import tube
    >>> from fabweave.weave.threads import trace_threads
    >>> from fabweave.weave.twill.decide import decide_twill
    >>> halfedges = build_halfedges(tube(8, 4, 1.0, 1.0))
    >>> for turn in (True, False):
    ...     threads = trace_threads(halfedges, turn=turn)
    ...     twist = decide_twill(twill_conditions(halfedges, threads)).twist
    ...     print(broken_at_turns(threads, twist))
    16
    0
    """
    pairs, _, turned = _along_threads(threads)
    return int(np.count_nonzero(broken_pairs(pairs[turned], twist)))


def broken_pairs(pairs: IntArray, twist: BoolArray) -> BoolArray:
    """Return which edge conditions are broken: both ends twist the same way."""
    return np.asarray(twist[pairs[:, 0]] == twist[pairs[:, 1]])


def broken_windows(windows: IntArray, twist: BoolArray) -> BoolArray:
    """Return which face or vertex conditions are broken: middle and outer two differ."""
    a, b, c, d = twist[windows].T
    return np.asarray((b != c) & (a != d))


def _along_threads(threads: Threads) -> tuple[IntArray, IntArray, BoolArray]:
    """Pair each pass with the second after it along its thread.

    Returns
    -------
    pairs : (N, 2) int array
        Their crossings.
    thread : (N,) int array
        Their thread.
    turned : (N,) bool array
        Whether it turns back at the boundary between them: then a boundary edge lies there.
    """
    thread = threads.thread_of_pass
    after = np.arange(len(threads.crossing)) + 2
    end = threads.offsets[thread + 1]
    length = threads.lengths[thread]
    wraps = after >= end
    # A ring of one crossing meets it again at every step.
    around = threads.offsets[thread] + (after - threads.offsets[thread]) % np.maximum(length, 1)
    after = np.where(wraps, around, after)
    following = np.arange(len(threads.crossing)) + 1
    following = np.where(following == end, threads.offsets[thread], following)
    turns = flags(len(threads.crossing), threads.turn_pass)
    kept = ~wraps | threads.closed[thread]
    pairs = np.column_stack((threads.crossing, threads.crossing[np.where(kept, after, 0)]))
    return pairs[kept], thread[kept], turns[kept] | turns[following[kept]]


def _windows(turn: IntArray, halfedges: Halfedges, threads: Threads) -> IntArray:
    """Return the crossings of four half-edges consecutive under a (partial) permutation."""
    crossing = crossing_of_halfedges(halfedges, threads.crossing_halfedge)
    first = np.flatnonzero(crossing >= 0)
    steps = [first]
    for _ in range(3):
        after = turn[steps[-1]]
        # Round again too soon: fewer than four different places; -1: over the boundary.
        kept = (after >= 0) & (after != steps[0])
        kept[kept] = crossing[after[kept]] >= 0
        steps = [places[kept] for places in steps] + [after[kept]]
    return np.column_stack([crossing[places] for places in steps])
