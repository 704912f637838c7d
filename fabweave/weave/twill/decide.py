"""Decide exactly whether a mesh can be woven in 2/2 twill, with a certificate either way."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, sparse

from fabweave.core.arrays import BoolArray, IntArray, flags, frozen_value
from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.topology import ParityClasses, label_links, solve_parity
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import TwillConditions

#: With at most this many free bits in a body of the mesh, all their choices are tried.
_ENUMERATED_BITS = 12


@frozen_value
class Decision:
    """Whether a 2/2 twill exists, and what shows it.

    Parameters
    ----------
    twist : (X,) bool array or None
        Twists that break no condition, or None if there are none.
    free_bits : int
        How many choices the edge conditions leave; -1 if they contradict one another.
    contradiction : (K,) int array
        Without a twill, an odd ring of crossings, each of which must twist against the next;
        empty if the edge conditions agree among themselves.
    clauses : (L,) int array
        Else, face and vertex conditions (rows of ``TwillConditions.gaps``) such that every choice
        of the free bits breaks at least one.
    """

    twist: BoolArray | None
    free_bits: int
    contradiction: IntArray
    clauses: IntArray

    @property
    def twillable(self) -> bool:
        """Whether there is an exact 2/2 twill."""
        return self.twist is not None


def decide_twill(conditions: TwillConditions) -> Decision:
    """Decide whether any choice of twists breaks no condition of a 2/2 twill.

    The edge conditions are equations over GF(2), c(e) + c(f) = 1. They either contradict one
    another, or fix all twists but for one free bit in each class of crossings that they link.
    The face and vertex conditions then become few clauses over those bits, which are tried out
    where they are few and handed to a mixed-integer solver where they are many.

    Parameters
    ----------
    conditions : TwillConditions
        The conditions of a mesh (or of any part of one).

    Returns
    -------
    Decision
        Twists that are the same for the same conditions, or what cannot be met.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), theorem 5.2, made exact by parity classes.

    Examples
    --------
    >>> from fabweave.mesh.shapes import grids, solids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.twill.conditions import twill_conditions
    >>> from fabweave.weave.threads import trace_threads
    >>> def decide(mesh):
    ...     halfedges = build_halfedges(mesh)
    ...     return decide_twill(twill_conditions(halfedges, trace_threads(halfedges))).twillable
    >>> [decide(grids.torus(m, 5, 2.0, 1.0)) for m in (4, 5, 6, 7)], decide(solids.cube())
    ([True, False, True, False], False)
    """
    none = np.zeros(0, dtype=np.int64)
    first, last = conditions.edge.T
    linked = solve_parity(conditions.n_crossings, first, last, np.ones(len(first), dtype=bool))
    if linked.odd_ring:
        return Decision(None, -1, np.array(linked.odd_ring, dtype=np.int64), none)
    values, clauses = _solve_classes(conditions, linked)
    if values is None:
        return Decision(None, linked.n_classes, none, clauses)
    return Decision(linked.opposite ^ values[linked.classes], linked.n_classes, none, none)


def _solve_classes(
    conditions: TwillConditions, linked: ParityClasses
) -> tuple[BoolArray | None, IntArray]:
    """Choose the free bits so that no face or vertex condition breaks, or show that none do.

    Returns
    -------
    values : (n_bits,) bool array or None
        The least such choice, body by body.
    clauses : (L,) int array
        Without one, conditions that every choice breaks at least one of.
    """
    gaps, n_bits = conditions.gaps, linked.n_classes
    # A million conditions are mostly a few dozen kinds: the first of each will do.
    literals = 2 * linked.classes[gaps] + linked.opposite[gaps]
    pairs = literals[:, 0::2] * (2 * n_bits) + literals[:, 1::2]
    first, second = (np.unique(column, return_inverse=True)[1] for column in pairs.T)
    rows = np.sort(np.unique(first * len(pairs) + second, return_index=True)[1])
    windows, signs = linked.classes[gaps[rows]], linked.opposite[gaps[rows]]
    body = label_links(np.repeat(windows[:, 0], 3), windows[:, 1:].ravel(), n_bits)[1]
    values = np.zeros(n_bits, dtype=bool)
    for number in range(int(body.max(initial=-1)) + 1):
        bits = np.flatnonzero(body == number)
        body_rows = np.flatnonzero(body[windows[:, 0]] == number)
        if not len(body_rows):
            continue
        local = np.searchsorted(bits, windows[body_rows])
        if len(bits) <= _ENUMERATED_BITS:
            chosen, certificate = _enumerate(local, signs[body_rows], len(bits))
        else:
            chosen, certificate = _solve_integer(local, signs[body_rows], len(bits))
        if chosen is None:
            return None, rows[body_rows[certificate]]
        values[bits] = chosen
    return values, gaps[:0, 0]


def _enumerate(
    windows: IntArray, signs: BoolArray, n_bits: int
) -> tuple[BoolArray | None, IntArray]:
    """Try all choices; return the first without a broken condition, or one broken for each."""
    choices = np.arange(1 << n_bits)
    values = (choices[:, None] >> np.arange(n_bits)) & 1 == 1
    broken_by = np.full(len(choices), -1, dtype=np.int64)
    for number, (window, sign) in enumerate(zip(windows, signs, strict=True)):
        a, b, c, d = (values[:, window] ^ sign).T
        broken_by[(broken_by < 0) & (b != c) & (a != d)] = number
    good = np.flatnonzero(broken_by < 0)
    if len(good):
        return np.asarray(values[good[0]]), windows[:0, 0]
    return None, np.unique(broken_by)


def _solve_integer(
    windows: IntArray, signs: BoolArray, n_bits: int
) -> tuple[BoolArray | None, IntArray]:
    """Solve the clauses as a feasibility problem in zeros and ones."""
    # A condition forbids four settings of its bits: b differs from c, and a from d.
    forbidden = np.array([(a, b, 1 - b, 1 - a) for a in (0, 1) for b in (0, 1)])
    wanted = (forbidden[None, :, :] ^ signs[:, None, :]).reshape(-1, 4)
    bits = np.repeat(windows, 4, axis=0)
    # Not all four bits may have the forbidden values: the sum of their differences is at least 1.
    row = np.repeat(np.arange(len(bits)), 4)
    weight = np.where(wanted == 1, -1.0, 1.0)
    matrix = sparse.coo_array(
        (weight.ravel(), (row, bits.ravel())), shape=(len(bits), n_bits)
    ).tocsr()
    least = 1.0 - wanted.sum(axis=1)
    # The same bit with both values in one clause can never be forbidden.
    result = optimize.milp(
        np.zeros(n_bits),
        constraints=optimize.LinearConstraint(matrix, least, np.inf),
        integrality=np.ones(n_bits, dtype=np.int64),
        bounds=optimize.Bounds(0, 1),
    )
    if result.x is None:
        return None, np.arange(len(windows))
    return np.asarray(np.round(result.x) > 0.5), windows[:0, 0]


#: So many irregular places are looked at, one by one, for one that obstructs by itself.
_LOOKED_AT = 40
_NAMED = 4


@dataclass(frozen=True)
class Obstruction:
    """What keeps a mesh from an exact 2/2 twill.

    Parameters
    ----------
    text : str
        The reason in a sentence.
    vertices, faces, threads : tuple of int
        What it names; each obstructs the twill by itself where it stands alone.
    """

    text: str
    vertices: tuple[int, ...] = ()
    faces: tuple[int, ...] = ()
    threads: tuple[int, ...] = ()


def explain(
    halfedges: Halfedges,
    threads: Threads,
    conditions: TwillConditions,
    decision: Decision,
    labels: Sequence[str],
) -> Obstruction | None:
    """Explain why there is no exact 2/2 twill, or return None if there is one.

    First come vertices and faces whose surroundings alone cannot be woven in twill, then threads
    that alone cannot, then the chain of crossings that comes back opposite to itself. What is
    named as the obstruction was decided by itself, so each reason is a proof.

    Examples
    --------
    >>> from fabweave.mesh.shapes import solids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.twill.conditions import twill_conditions
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(solids.cube())
    >>> threads = trace_threads(halfedges)
    >>> conditions = twill_conditions(halfedges, threads)
    >>> explain(halfedges, threads, conditions, decide_twill(conditions), "ABCD").text
    'vertex 0 has valence 3; in all, 8 vertices have a valence that is not a multiple of 4'
    """
    if decision.twillable:
        return None
    return (
        _irregular(halfedges, conditions)
        or _uneven_thread(threads, labels)
        or _chain(threads, conditions, decision, labels)
    )


def _irregular(halfedges: Halfedges, conditions: TwillConditions) -> Obstruction | None:
    """Find a vertex, or else a face, whose surroundings cannot be woven in twill."""
    vertices, valences = interior_valences(halfedges)
    sides = np.bincount(halfedges.face)
    for kind, owner, places, sizes, has, number in (
        ("vertices", halfedges.tail, vertices, valences, "vertex {} has valence {}", "a valence"),
        ("faces", halfedges.face, np.arange(len(sides)), sides, "face {} has {} sides",
         "a number of sides"),
    ):  # fmt: skip
        odd = np.flatnonzero(sizes % 4)
        for at in odd[:_LOOKED_AT].tolist():
            place = int(places[at])
            if not _weavable_around(halfedges, conditions, owner == place):
                text = has.format(place, sizes[at])
                if len(odd) > 1:
                    text += f"; in all, {len(odd)} {kind} have {number} that is not a multiple of 4"
                return Obstruction(text, **{kind: (place,)})
    return None


def _weavable_around(halfedges: Halfedges, conditions: TwillConditions, seed: np.ndarray) -> bool:
    """Decide the twill on the faces around some half-edges, and on those around them."""
    interior = halfedges.edge_halfedge[halfedges.twin[halfedges.edge_halfedge] >= 0]
    left, right = halfedges.face[interior], halfedges.face[halfedges.twin[interior]]
    near = flags(int(halfedges.face.max()) + 1, halfedges.face[seed])
    for _ in range(2):
        inside = near[left] | near[right]
        if not decide_twill(_restricted(conditions, inside)).twillable:
            return False
        touched = flags(int(halfedges.tail.max()) + 1, halfedges.tail[near[halfedges.face]])
        near[halfedges.face[touched[halfedges.tail]]] = True
    return True


def _restricted(conditions: TwillConditions, inside: np.ndarray) -> TwillConditions:
    """Return the conditions on some crossings only, renumbered."""
    number = np.cumsum(inside) - 1
    edge, face, vertex = (
        inside[rows].all(axis=1) for rows in (conditions.edge, conditions.face, conditions.vertex)
    )
    return TwillConditions(
        n_crossings=int(np.count_nonzero(inside)),
        edge=number[conditions.edge[edge]],
        thread=conditions.thread[edge],
        face=number[conditions.face[face]],
        vertex=number[conditions.vertex[vertex]],
    )


def _uneven_thread(threads: Threads, labels: Sequence[str]) -> Obstruction | None:
    """Find rings whose number of crossings is not a multiple of 4.

    Every second crossing of a ring must twist the other way; round an even ring that is half its
    length in steps, round an odd one the whole length: only multiples of 4 come out even. That is
    a proof for any ring, also for one that crosses itself.
    """
    uneven = np.flatnonzero(threads.closed & (threads.lengths % 4 != 0))
    if not len(uneven):
        return None
    named = [f"{labels[thread]} ({threads.lengths[thread]})" for thread in uneven.tolist()]
    return Obstruction(
        f"the number of crossings along a ring must be a multiple of 4, but for {len(uneven)} of "
        f"{agree(threads.n_threads, '{n} thread[|s]')} it is not: {few_of(named, _NAMED)}",
        threads=tuple(uneven[:_NAMED].tolist()),
    )


def _chain(
    threads: Threads, conditions: TwillConditions, decision: Decision, labels: Sequence[str]
) -> Obstruction:
    """Name the threads along which the pattern comes back opposite to itself."""
    if len(decision.contradiction):
        crossings = np.unique(decision.contradiction)
    else:
        crossings = np.unique(conditions.gaps[decision.clauses])
    involved = np.unique(threads.thread_of_pass[np.isin(threads.crossing, crossings)])
    named = few_of([labels[thread] for thread in involved.tolist()], _NAMED)
    how = (
        f"after {len(decision.contradiction)} steps the pattern comes back as its own opposite"
        if len(decision.contradiction)
        else f"whichever way the pattern starts, it fails at one of {len(decision.clauses)} gaps"
    )
    return Obstruction(
        f"along the threads {named}, {how} (crossings {few_of(crossings.tolist(), _NAMED)})",
        threads=tuple(involved.tolist()),
    )
