"""Vote for twists where there is no exact twill, as the paper does."""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.threads import Threads, crossing_of_halfedges
from fabweave.weave.twill.conditions import (
    EQUAL,
    Broken,
    TwillConditions,
    TwillWeights,
    count_broken,
)


@dataclass(frozen=True)
class VotingRule:
    """How votes are weighed.

    Parameters
    ----------
    groups : bool
        Whether crossings are decided bunch pair by bunch pair, the longest bunches first, and the
        votes along a thread weigh as much as its bunch is long (section 6.3).
    face, vertex : float
        Weights of face and vertex votes (section 6.4); that of an edge vote is 1.
    """

    groups: bool = False
    face: float = 1.0
    vertex: float = 1.0


#: The paper's rules: sections 6.2, 6.3 and 6.4.
RULES = (
    VotingRule(),
    VotingRule(groups=True),
    VotingRule(face=2.0, vertex=2.0),
    VotingRule(groups=True, face=2.0, vertex=2.0),
)


@frozen_value
class Vote:
    """The outcome of a vote: its twists, and what they break."""

    twist: BoolArray
    broken: Broken


def best_vote(
    conditions: TwillConditions,
    threads: Threads,
    bunches: IntArray,
    rules: Sequence[VotingRule] = RULES,
    around: list[list[int]] | None = None,
) -> Vote:
    """Vote by every rule and return the outcome that breaks least.

    Parameters
    ----------
    conditions : TwillConditions
        The conditions of the mesh.
    threads : Threads
        Its threads.
    bunches : (T,) int array
        The bunch of each thread.
    rules : sequence of VotingRule
        Those of the paper by default.
    around : list, optional
        For each crossing, those that begin with it, twisted alike, if it is the first, as in the
        paper; then the power of a bunch is in face and vertex votes, too. Else one crossing begins,
        and their power is in edge votes alone, which mostly breaks less.

    Returns
    -------
    Vote
        Among equals, the first in the order of the sections; rules after one that breaks nothing
        are not tried.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 6.

    Examples
    --------
    >>> from fabweave.mesh.shapes import grids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.bunches import part_bunches
    >>> from fabweave.weave.twill.conditions import twill_conditions
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.torus(4, 4, 2.0, 1.0))
    >>> threads = trace_threads(halfedges)
    >>> best_vote(twill_conditions(halfedges, threads), threads, part_bunches(threads)).broken
    Broken(edge=0, face=0, vertex=0)
    """
    ballot = _Ballot(conditions)
    votes = []
    for rule in rules:
        powers = _powers(conditions, threads, bunches, rule, literal=around is not None)
        twist = _extend(ballot, _ranks(threads, bunches, rule), powers, around)
        votes.append(Vote(twist, count_broken(conditions, twist)))
        if votes[-1].broken.total == 0:
            break
    return min(votes, key=lambda vote: vote.broken.total)


def literal_vote(
    conditions: TwillConditions,
    halfedges: Halfedges,
    threads: Threads,
    bunches: IntArray,
    weights: TwillWeights = EQUAL,
) -> Vote:
    """Vote as the paper does, and return the outcome that breaks least.

    The edges around the first vertex get one sense of twist. Then the frontier advances, the least
    contested edge first; with groups, the power of a bunch, its length, is in all votes.

    Parameters
    ----------
    conditions, threads, bunches
        As for `best_vote`.
    halfedges : Halfedges
        Connectivity of the mesh.
    weights : TwillWeights, optional
        Weights of the votes of section 6.4; if all are equal, the votes of faces and vertices
        weigh twice as much there.

    Returns
    -------
    Vote

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 6.
    """
    face, vertex = float(weights.face), float(weights.vertex)
    rules = [
        rule if weights.equal or rule.face == 1.0 else replace(rule, face=face, vertex=vertex)
        for rule in RULES
    ]
    return best_vote(conditions, threads, bunches, rules, _around_vertices(halfedges, threads))


def _around_vertices(halfedges: Halfedges, threads: Threads) -> list[list[int]]:
    """Return for each crossing the crossings around the first vertex of its edge."""
    crossing = crossing_of_halfedges(halfedges, threads.crossing_halfedge)
    around: list[list[int]] = [[] for _ in range(int(halfedges.tail.max(initial=-1)) + 1)]
    for tail, one in zip(halfedges.tail.tolist(), crossing.tolist(), strict=True):
        if one >= 0:
            around[tail].append(one)
    ends = np.minimum(halfedges.tail, halfedges.head)[threads.crossing_halfedge]
    return [around[end] for end in ends.tolist()]


class _Ballot:
    """For each crossing, on whom it votes; lists, for a sequential search.

    A crossing gets up to 4 edge votes (from its neighbours at two steps along both strands), 4
    face and 4 vertex votes (from the three edges on each side of it around both faces and both
    vertices).
    """

    def __init__(self, conditions: TwillConditions) -> None:
        self.count = conditions.n_crossings
        first, last = conditions.edge.T
        row = np.arange(len(first))
        #: The crossing voted on, and the edge condition by which.
        self.opposites = _grouped(
            self.count,
            np.concatenate((first, last)),
            np.column_stack((np.concatenate((last, first)), np.concatenate((row, row)))),
        )
        gaps = np.column_stack((conditions.gaps, np.arange(len(conditions.gaps))))
        windows = np.concatenate((gaps, gaps[:, [3, 2, 1, 0, 4]]))
        #: The crossing voted on at the end of a condition, the three others in order, and which
        #: condition it is.
        self.windows = _grouped(
            self.count, windows[:, 1:4].T.ravel(), np.concatenate((windows, windows, windows))
        )


def _grouped(count: int, keys: IntArray, rows: IntArray) -> list[list[tuple[int, ...]]]:
    """Return for each key its rows as tuples."""
    order = np.argsort(keys, kind="stable")
    bounds = np.searchsorted(keys[order], np.arange(count + 1)).tolist()
    flat = [tuple(row) for row in rows[order].tolist()]
    return [flat[a:b] for a, b in pairwise(bounds)]


def _ranks(threads: Threads, bunches: IntArray, rule: VotingRule) -> list[int]:
    """Return the rank of each crossing's group: pairs of long bunches come first."""
    if not rule.groups:
        return [0] * threads.n_crossings
    weight = np.bincount(bunches, weights=threads.lengths)
    bunch = bunches[threads.thread_of_pass]
    sides = np.empty((threads.n_crossings, 2), dtype=np.int64)
    for side, passes in enumerate((threads.forward, ~threads.forward)):
        sides[threads.crossing[passes], side] = bunch[passes]
    sides.sort(axis=1)
    pairs, group = np.unique(sides[:, 0] * len(weight) + sides[:, 1], return_inverse=True)
    together = weight[pairs // len(weight)] + weight[pairs % len(weight)]
    rank = np.argsort(np.lexsort((pairs, -together)))
    return rank[group].tolist()


#: The weight of each edge vote, of each face or vertex vote, and of the crossing that votes.
_Powers: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]


def _powers(
    conditions: TwillConditions,
    threads: Threads,
    bunches: IntArray,
    rule: VotingRule,
    *,
    literal: bool,
) -> _Powers:
    """Return what each vote weighs by a rule."""
    edge: FloatArray = np.ones(len(conditions.edge))
    voter: FloatArray = np.ones(threads.n_crossings)
    gap = np.repeat((rule.face, rule.vertex), (len(conditions.face), len(conditions.vertex)))
    if rule.groups and len(edge):
        length = np.bincount(bunches[conditions.thread], minlength=int(bunches.max()) + 1)
        bunch_length = length[bunches[conditions.thread]]
        edge = edge * bunch_length / bunch_length.mean()
        if literal:
            # A crossing has the power of both bunches that cross there.
            of_pass = length[bunches[threads.thread_of_pass]]
            power = np.bincount(threads.crossing, of_pass, minlength=threads.n_crossings)
            voter = power / power.mean()
    return edge, gap, voter


def _extend(
    ballot: _Ballot, rank: Sequence[int], powers: _Powers, around: list[list[int]] | None
) -> BoolArray:
    """Decide one crossing after the other, breadth first, the least contested first.

    The frontier holds the crossings that have votes. The next to be decided is of the first group
    on the frontier and has the least weight of votes against its majority, then the greatest
    majority, and has waited longest. ``around`` names the crossings that begin together.
    """
    edge_weight, gap_weight, voter = (power.tolist() for power in powers)
    twist = [-1] * ballot.count
    votes = ([0.0] * ballot.count, [0.0] * ballot.count)
    standing: list[tuple[float, float] | None] = [None] * ballot.count
    turn = 0
    for seed in np.argsort(rank, kind="stable").tolist():
        if twist[seed] >= 0:
            continue
        # Nothing speaks for either sense at the first crossings of a body.
        first = [one for one in ([seed] if around is None else around[seed]) if twist[one] < 0]
        frontier = [(-1, 0.0, 0.0, number, one) for number, one in enumerate(first)]
        while frontier:
            group, least, most, _, crossing = heapq.heappop(frontier)
            if twist[crossing] >= 0 or (group >= 0 and standing[crossing] != (least, most)):
                continue
            favoured = group < 0 or votes[1][crossing] >= votes[0][crossing]
            twist[crossing] = sense = int(favoured)
            heard = {}
            for other, row in ballot.opposites[crossing]:
                votes[1 - sense][other] += edge_weight[row]
                heard[other] = True
            for other, near, middle, far, row in ballot.windows[crossing]:
                if twist[near] + twist[middle] == 1 and twist[far] >= 0:
                    votes[twist[far]][other] += gap_weight[row] * voter[far]
                    heard[other] = True
            for other in heard:
                if twist[other] < 0:
                    against, in_favour = votes[0][other], votes[1][other]
                    now = (min(against, in_favour), -max(against, in_favour))
                    standing[other] = now
                    turn += 1
                    heapq.heappush(frontier, (rank[other], *now, turn, other))
    return np.array(twist, dtype=np.int64) == 1
