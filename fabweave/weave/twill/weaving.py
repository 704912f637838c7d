"""Weave the 2/2 twill: exactly where it exists, else breaking as little as can be found."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, Progress, frozen_value, no_progress
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.pattern import Weave, over_of_passes
from fabweave.weave.threads import Threads
from fabweave.weave.twill.anneal import couple, optimise_twill
from fabweave.weave.twill.bound import WIDER_WORK, Bound, irregular_seeds, prove_bound
from fabweave.weave.twill.conditions import (
    EQUAL,
    Broken,
    TwillConditions,
    TwillWeights,
    broken_at_turns,
    count_broken,
    twill_conditions,
)
from fabweave.weave.twill.decide import Obstruction, decide_twill, explain
from fabweave.weave.twill.rows import TWISTS, ring_rows
from fabweave.weave.twill.voting import best_vote, literal_vote


@dataclass(frozen=True)
class TwillSearch:
    """How a twill is looked for.

    Parameters
    ----------
    method : {"search", "voting"}
        Whether to search, or to leave it at the paper's voting, for those who
        compare. An exact twill is woven by either.
    weights : TwillWeights
        What counts how much in the search, and in votes that are weighted. The bound counts
        conditions, all alike.
    effort : {"quick", "normal", "best"}
        How long to search, and how much work goes into the bound.
    seed : int
        Same seed, same weave.
    """

    method: str = "search"
    weights: TwillWeights = EQUAL
    effort: str = "normal"
    seed: int = 0


USUAL = TwillSearch()


@frozen_value
class Twill:
    """A 2/2 twill, and what is known about it.

    Parameters
    ----------
    weave : Weave
        The weave.
    n_conditions : int
        How many conditions the mesh has.
    obstruction : Obstruction or None
        Why there is no exact twill; None if this is one.
    voted : Broken or None
        What the paper's voting breaks, where it was needed.
    bound : Bound or None
        What every weave of the mesh breaks at least, where none is exact.
    rows : (X,) int array or None
        On a mesh of rings, the row of each crossing modulo 4, which gives its twist.
    """

    weave: Weave
    n_conditions: int
    obstruction: Obstruction | None = None
    voted: Broken | None = None
    bound: Bound | None = None
    rows: IntArray | None = None


def weave_twill(
    halfedges: Halfedges,
    threads: Threads,
    bunches: IntArray,
    labels: Sequence[str],
    how: TwillSearch = USUAL,
    *,
    progress: Progress = no_progress,
) -> Twill:
    """Weave a mesh in 2/2 twill.

    On a mesh of rings that end in fans and polygons the rows give it. Else whether an exact twill
    exists is decided first. Where there is none, the paper's voting starts a search, which never
    ends worse, and a lower bound says how far from the best it may be.

    Parameters
    ----------
    halfedges, threads
        The mesh and its threads.
    bunches : (T,) int array
        The bunch of each thread.
    labels : sequence of str
        Names of the threads, for the words.
    how : TwillSearch
        How it is looked for.
    progress : callable
        Told what is being done.

    Returns
    -------
    Twill

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), sections 5 and 6.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.mesh.shapes import grids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.torus(8, 4, 2.0, 1.0))
    >>> threads = trace_threads(halfedges)
    >>> weave_twill(halfedges, threads, np.zeros(8, dtype=int), "ABCDEFGH").weave.exact
    True
    """
    progress("twill", 0, 1)
    conditions = twill_conditions(halfedges, threads)
    # Where all faces are quads the decision finds it as fast, and as it always did.
    capped = bool(np.any(np.bincount(halfedges.face) != 4))
    if capped and (rows := ring_rows(halfedges)) is not None:
        rows = rows[halfedges.edge[threads.crossing_halfedge]]
        weave = twisted(threads, conditions, TWISTS[rows])
        if weave.exact:
            return Twill(weave, conditions.count, rows=rows)
    decision = decide_twill(conditions)
    if decision.twist is not None:
        return Twill(twisted(threads, conditions, decision.twist), conditions.count)
    obstruction = explain(halfedges, threads, conditions, decision, labels)
    vote = best_vote(conditions, threads, bunches)
    couplings = couple(conditions)
    bound = prove_bound(
        couplings,
        irregular_seeds(halfedges, threads),
        wider_work=WIDER_WORK[how.effort],
        progress=progress,
    )
    if how.method == "voting":
        vote = literal_vote(conditions, halfedges, threads, bunches, how.weights)
        twist = vote.twist
    else:
        optimise = partial(optimise_twill, effort=how.effort, seed=how.seed, progress=progress)
        twist = optimise(couplings, vote.twist, least=bound.least)
        if not how.weights.equal:
            # Where some weigh more, order is harder to come to: it begins where all weigh alike.
            twist = optimise(couple(conditions, how.weights), twist)
    weave = twisted(threads, conditions, twist)
    # What is not twillable breaks one condition at least, and what reaches the bound is the best.
    least = max(bound.least, 1)
    return Twill(
        weave,
        conditions.count,
        obstruction,
        vote.broken,
        Bound(least, optimum=bound.optimum or least == weave.broken.total),
    )


def twisted(
    threads: Threads, conditions: TwillConditions, twist: BoolArray, pattern: str = "twill"
) -> Weave:
    """Return the weave of some twists, with the conditions of a 2/2 twill that it breaks."""
    return Weave(
        threads,
        pattern,
        twist,
        over_of_passes(threads, twist),
        count_broken(conditions, twist),
        broken_at_turns(threads, twist),
    )
