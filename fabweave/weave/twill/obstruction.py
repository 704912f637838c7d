"""Say in words why a mesh has no exact 2/2 twill."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.irregular import interior_valences
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import TwillConditions
from fabweave.weave.twill.decide import Decision, decide_twill

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
    near = np.zeros(int(halfedges.face.max()) + 1, dtype=bool)
    near[halfedges.face[seed]] = True
    for _ in range(2):
        inside = np.zeros(conditions.n_crossings, dtype=bool)
        inside[near[halfedges.face[interior]] | near[halfedges.face[halfedges.twin[interior]]]] = (
            True
        )
        if not decide_twill(_restricted(conditions, inside)).twillable:
            return False
        touched = np.zeros(int(halfedges.tail.max()) + 1, dtype=bool)
        touched[halfedges.tail[near[halfedges.face]]] = True
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
