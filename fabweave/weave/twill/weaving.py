"""Weave the 2/2 twill: exactly where it exists, else breaking as little as can be found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, Progress, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.symmetry import Symmetry, find_symmetry, orbits
from fabweave.weave.pattern import Weave, over_of_passes
from fabweave.weave.threads import Threads, crossing_of_halfedges
from fabweave.weave.twill.anneal import couple, optimise_twill
from fabweave.weave.twill.bound import WIDER_WORK, Bound, irregular_seeds, prove_bound
from fabweave.weave.twill.conditions import (
    EQUAL,
    Broken,
    TwillConditions,
    TwillWeights,
    count_broken,
    twill_conditions,
)
from fabweave.weave.twill.decide import Obstruction, decide_twill, explain
from fabweave.weave.twill.voting import best_vote, literal_vote

#: At most so many groups of rotations are tried, those of the fewest rotations first.
_MOST_GROUPS = 12
#: Rotations of larger groups are joined by twos no more: only rings of turns are tried, and all.
_MOST_JOINED = 200
#: Half-edges whose images tell motions apart.
_SAMPLES = 8


@frozen_value
class Tie:
    """Crossings that some rotations carry to one another.

    Parameters
    ----------
    order : int
        How many rotations there are, the identity among them.
    orbit : (X,) int array
        The orbit of each crossing, numbered from 0.
    """

    order: int
    orbit: IntArray


def rotation_ties(
    mesh: PolyMesh, halfedges: Halfedges, threads: Threads, least: int
) -> tuple[Tie, ...]:
    """Return the orbits of crossings under groups of rotations of a mesh.

    A rotation keeps the sense of every twist, so a weave has it as a symmetry exactly where all
    crossings of each orbit are twisted alike. (A reflection turns each sense over; none is asked
    for.)

    Parameters
    ----------
    mesh, halfedges, threads
        The mesh that is woven, and its threads.
    least : int
        How many rotations the groups must have, the identity among them. Of groups that hold one
        another only the smallest is returned, and of those that are alike, as seen from elsewhere
        on the mesh, one.

    Raises
    ------
    CannotMakeError
        If the mesh has not so many.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import cube
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(cube())
    >>> ties = rotation_ties(cube(), halfedges, trace_threads(halfedges), 3)
    >>> [(tie.order, int(tie.orbit.max()) + 1) for tie in ties]
    [(3, 4), (4, 3), (4, 4), (4, 3)]
    """
    group = find_symmetry(mesh, halfedges, reflections=False)
    if group.order < least:
        raise CannotMakeError(
            f"the weave is to keep {least} rotations, but the mesh has only {group.order} (with "
            "the one that leaves all in place); ask for fewer with --twill-symmetry, or for a mesh "
            "with more"
        )
    crossing = crossing_of_halfedges(halfedges, threads.crossing_halfedge)
    there = crossing[group.images(threads.crossing_halfedge)]
    return tuple(
        Tie(len(part), orbits(there[sorted(part)], threads.n_crossings))
        for part in _groups(group, least)
    )


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
    ties : sequence of Tie
        Of which one must hold: crossings that rotations carry to one another are twisted alike.
    """

    method: str = "search"
    weights: TwillWeights = EQUAL
    effort: str = "normal"
    seed: int = 0
    ties: Sequence[Tie] = ()


USUAL = TwillSearch()


def tied_twill(
    conditions: TwillConditions, how: TwillSearch, least: int, progress: Progress = no_progress
) -> BoolArray:
    """Return twists that are alike on each orbit, and break as few conditions as can be found.

    With a variable for each orbit, instead of each crossing, the conditions are those of a smaller
    weave, and so is the decision whether it can be exact, and the search.

    Parameters
    ----------
    conditions : TwillConditions
        Of the whole mesh.
    how : TwillSearch
        With the groups to compare, one at least.
    least : int
        No twist breaks fewer.
    progress : callable
        Told what is being done.

    Returns
    -------
    (X,) bool array
        Of those that break the fewest conditions, the ones of the most rotations.
    """
    best: tuple[tuple[int, int], BoolArray] | None = None
    for tie in how.ties:
        small = TwillConditions(
            n_crossings=int(tie.orbit.max(initial=-1)) + 1,
            edge=tie.orbit[conditions.edge],
            thread=conditions.thread,
            face=tie.orbit[conditions.face],
            vertex=tie.orbit[conditions.vertex],
        )
        exact = decide_twill(small).twist
        if exact is None:
            start = np.ones(small.n_crossings, dtype=bool)
            couplings = couple(small, how.weights)
            exact = optimise_twill(
                couplings, start, effort=how.effort, seed=how.seed, least=least, progress=progress
            )
        found = exact[tie.orbit]
        broken = count_broken(conditions, found)
        edge, face, vertex = how.weights.whole
        weight = edge * broken.edge + face * broken.face + vertex * broken.vertex
        rank = weight, -tie.order
        if best is None or rank < best[0]:
            best = rank, found
    if best is None:
        raise ValueError("there must be ties")
    return best[1]


def _groups(group: Symmetry, least: int) -> list[frozenset[int]]:
    """Return the smallest groups of enough rotations, one of each sort, the smallest first."""
    table = _products(group)
    cyclic = {_generated(table, [one]) for one in range(group.order)}
    known = set(cyclic) | {frozenset(range(group.order))}
    if group.order <= _MOST_JOINED:
        known |= {
            _generated(table, [*one, *two])
            for one, two in combinations(sorted(cyclic, key=sorted), 2)
        }
    enough = [part for part in known if len(part) >= least]
    enough.sort(key=lambda part: (len(part), sorted(part)))
    inverse = np.argmax(table == 0, axis=1)
    found: list[frozenset[int]] = []
    sorts: set[frozenset[int]] = set()
    for part in enough:
        if part in sorts or any(smaller < part for smaller in sorts):
            continue
        found.append(part)
        for by in range(group.order):
            sorts.add(frozenset(table[table[by, one], inverse[by]].item() for one in part))
    return found[:_MOST_GROUPS]


def _products(group: Symmetry) -> IntArray:
    """Return which element is each one after each other, (G, G)."""
    count = group.generators.shape[1]
    sample = np.unique(np.linspace(0, count - 1, _SAMPLES).astype(np.int64))
    images = group.images(sample)
    number = {image.tobytes(): at for at, image in enumerate(images)}
    table = np.empty((group.order, group.order), dtype=np.int64)
    for at, image in enumerate(images):
        for by, product in enumerate(group.images(image)):
            table[by, at] = number[product.tobytes()]
    return table


def _generated(table: IntArray, generators: Sequence[int]) -> frozenset[int]:
    """Return the group that some elements generate."""
    found = {0}
    fresh = [0]
    while fresh:
        made = set(table[np.ix_(sorted(set(generators)), fresh)].ravel().tolist())
        fresh = sorted(made - found)
        found |= made
    return frozenset(found)


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
    how: TwillSearch = USUAL,
    *,
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
    decision = decide_twill(conditions)
    if decision.twist is not None:
        exact = Twill(_twill(threads, decision.twist, Broken(0, 0, 0)), conditions.count)
        return _tied(exact, conditions, threads, how, progress)
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
    return _tied(free, conditions, threads, how, progress)


def _tied(
    free: Twill,
    conditions: TwillConditions,
    threads: Threads,
    how: TwillSearch,
    progress: Progress,
) -> Twill:
    """Return a twill that keeps rotations in place of a free one, if that is asked for."""
    if not how.ties:
        return free
    least = 0 if free.bound is None else free.bound.least
    twist = tied_twill(conditions, how, least, progress)
    kept = Kept(min(tie.order for tie in how.ties), free.weave.broken or Broken(0, 0, 0))
    broken = count_broken(conditions, twist)
    return replace(free, weave=_twill(threads, twist, broken), kept=kept)


def _twill(threads: Threads, twist: BoolArray, broken: Broken) -> Weave:
    return Weave(threads, "twill", twist, over_of_passes(threads, twist), broken)
