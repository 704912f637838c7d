"""Weave the 2/2 twill: exactly where it exists, else breaking as little as can be found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fabweave.core.arrays import BoolArray, IntArray, Progress, frozen_value, no_progress
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.pattern import Weave, over_of_passes
from fabweave.weave.threads import Threads
from fabweave.weave.twill.anneal import couple
from fabweave.weave.twill.bound import WIDER_WORK, Bound, irregular_seeds, prove_bound
from fabweave.weave.twill.conditions import (
    Broken,
    TwillConditions,
    count_broken,
    twill_conditions,
)
from fabweave.weave.twill.decide import decide_twill
from fabweave.weave.twill.obstruction import Obstruction, explain
from fabweave.weave.twill.optimise import optimise_twill
from fabweave.weave.twill.tied import Tie, tied_twill
from fabweave.weave.twill.voting import best_vote, literal_vote
from fabweave.weave.twill.weights import EQUAL, TwillWeights


@dataclass(frozen=True)
class Kept:
    """A symmetry that a twill was asked to keep.

    Parameters
    ----------
    least : int
        How many rotations it keeps at least.
    free : Broken
        What a weave breaks that need not keep any.
    """

    least: int
    free: Broken


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
    kept : Kept or None
        The symmetry that was asked for.
    """

    weave: Weave
    n_conditions: int
    obstruction: Obstruction | None = None
    voted: Broken | None = None
    bound: Bound | None = None
    kept: Kept | None = None


def weave_twill(
    halfedges: Halfedges,
    threads: Threads,
    bunches: IntArray,
    labels: Sequence[str],
    *,
    method: str = "search",
    weights: TwillWeights = EQUAL,
    effort: str = "normal",
    seed: int = 0,
    ties: Sequence[Tie] = (),
    progress: Progress = no_progress,
) -> Twill:
    """Weave a mesh in 2/2 twill.

    Whether an exact twill exists is decided first. Where there is none, the paper's voting starts
    a search, which never ends worse, and a lower bound says how far from the best it may be.

    Parameters
    ----------
    halfedges, threads
        The mesh and its threads.
    bunches : (T,) int array
        The bunch of each thread.
    labels : sequence of str
        Names of the threads, for the words.
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
    ties : sequence of Tie
        Of which one must hold: crossings that rotations carry to one another are twisted alike.
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
    decision = decide_twill(conditions)
    if decision.twist is not None:
        exact = Twill(_twill(threads, decision.twist, Broken()), conditions.count)
        return _tied(exact, conditions, threads, ties, weights, effort, seed, progress)
    obstruction = explain(halfedges, threads, conditions, decision, labels)
    vote = best_vote(conditions, threads, bunches)
    couplings = couple(conditions)
    bound = prove_bound(
        couplings,
        irregular_seeds(halfedges, threads),
        wider_work=WIDER_WORK[effort],
        progress=progress,
    )
    if method == "voting":
        vote = literal_vote(conditions, halfedges, threads, bunches, weights)
        twist = vote.twist
    else:
        twist = optimise_twill(
            couplings, vote.twist, effort=effort, seed=seed, least=bound.least, progress=progress
        )
        if not weights.equal:
            # Where some weigh more, order is harder to come to: it begins where all weigh alike.
            weighed = couple(conditions, weights)
            twist = optimise_twill(weighed, twist, effort=effort, seed=seed, progress=progress)
    broken = count_broken(conditions, twist)
    # What is not twillable breaks one condition at least, and what reaches the bound is the best.
    least = max(bound.least, 1)
    free = Twill(
        _twill(threads, twist, broken),
        conditions.count,
        obstruction,
        vote.broken,
        Bound(least, optimum=bound.optimum or least == broken.total),
    )
    return _tied(free, conditions, threads, ties, weights, effort, seed, progress)


def _tied(
    free: Twill, conditions: TwillConditions, threads: Threads, ties: Sequence[Tie],
    weights: TwillWeights, effort: str, seed: int, progress: Progress,
) -> Twill:  # fmt: skip
    """Return a twill that keeps rotations in place of a free one, if that is asked for."""
    if not ties:
        return free
    least = 0 if free.bound is None else free.bound.least
    twist = tied_twill(
        conditions, ties, weights=weights, effort=effort, seed=seed, least=least, progress=progress
    )
    kept = Kept(min(tie.order for tie in ties), free.weave.broken or Broken())
    broken = count_broken(conditions, twist)
    return replace(free, weave=_twill(threads, twist, broken), kept=kept)


def _twill(threads: Threads, twist: BoolArray, broken: Broken) -> Weave:
    return Weave(threads, "twill", twist, over_of_passes(threads, twist), broken)
