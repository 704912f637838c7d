"""Vote for twists where there is no exact twill, as the paper does."""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import Broken, TwillConditions, count_broken


@dataclass(frozen=True)
class VotingRule:
    """How votes are weighed.

    Parameters
    ----------
    name : str
        What the rule is called in reports.
    groups : bool
        Whether crossings are decided bunch pair by bunch pair, the longest bunches first, and the
        votes along a thread weigh as much as its bunch is long (section 6.3).
    gap : float
        Weight of a face or vertex vote (section 6.4); that of an edge vote is 1.
    """

    name: str
    groups: bool = False
    gap: float = 1.0


#: The paper's rules: sections 6.2, 6.3 and 6.4.
RULES = (
    VotingRule("extension"),
    VotingRule("groups", groups=True),
    VotingRule("weighted", gap=2.0),
    VotingRule("weighted groups", groups=True, gap=2.0),
)


@frozen_value
class Vote:
    """The outcome of a vote: the rule, its twists, and what they break."""

    rule: VotingRule
    twist: BoolArray
    broken: Broken


def best_vote(conditions: TwillConditions, threads: Threads, bunches: IntArray) -> Vote:
    """Vote by every rule of the paper and return the outcome that breaks least.

    Parameters
    ----------
    conditions : TwillConditions
        The conditions of the mesh.
    threads : Threads
        Its threads.
    bunches : (T,) int array
        The bunch of each thread.

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
    for rule in RULES:
        twist = _extend(ballot, _ranks(threads, bunches, rule), _weights(conditions, bunches, rule))
        votes.append(Vote(rule, twist, count_broken(conditions, twist)))
        if votes[-1].broken.total == 0:
            break
    return min(votes, key=lambda vote: vote.broken.total)


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
        gaps = conditions.gaps
        windows = np.concatenate((gaps, gaps[:, ::-1]))
        #: The crossing voted on at the end of a condition, and the three others in order.
        self.windows = _grouped(
            self.count, windows[:, 1:].T.ravel(), np.concatenate((windows, windows, windows))
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
    rank = np.empty(len(pairs), dtype=np.int64)
    rank[np.lexsort((pairs, -together))] = np.arange(len(pairs))
    return rank[group].tolist()


def _weights(
    conditions: TwillConditions, bunches: IntArray, rule: VotingRule
) -> tuple[list[float], float]:
    """Return the weight of each edge vote, and of every face or vertex vote."""
    weight: FloatArray = np.ones(len(conditions.edge))
    if rule.groups and len(weight):
        length = np.bincount(bunches[conditions.thread], minlength=int(bunches.max()) + 1)
        bunch_length = length[bunches[conditions.thread]]
        weight = weight * bunch_length / bunch_length.mean()
    return weight.tolist(), rule.gap


def _extend(
    ballot: _Ballot, rank: Sequence[int], weights: tuple[Sequence[float], float]
) -> BoolArray:
    """Decide one crossing after the other, breadth first, the least contested first.

    The frontier holds the crossings that have votes. The next to be decided is of the first group
    on the frontier and has the least weight of votes against its majority, then the greatest
    majority, and has waited longest.
    """
    edge_weight, gap_weight = weights
    twist = [-1] * ballot.count
    votes = ([0.0] * ballot.count, [0.0] * ballot.count)
    standing: list[tuple[float, float] | None] = [None] * ballot.count
    turn = 0
    for seed in np.argsort(rank, kind="stable").tolist():
        if twist[seed] >= 0:
            continue
        # Nothing speaks for either sense at the first crossing of a body.
        standing[seed] = (0.0, 0.0)
        frontier = [(0, 0.0, 0.0, 0, seed)]
        while frontier:
            _, least, most, _, crossing = heapq.heappop(frontier)
            if twist[crossing] >= 0 or standing[crossing] != (least, most):
                continue
            twist[crossing] = sense = int(votes[1][crossing] >= votes[0][crossing])
            heard = {}
            for other, row in ballot.opposites[crossing]:
                votes[1 - sense][other] += edge_weight[row]
                heard[other] = True
            for other, near, middle, far in ballot.windows[crossing]:
                if twist[near] + twist[middle] == 1 and twist[far] >= 0:
                    votes[twist[far]][other] += gap_weight
                    heard[other] = True
            for other in heard:
                if twist[other] < 0:
                    against, in_favour = votes[0][other], votes[1][other]
                    now = (min(against, in_favour), -max(against, in_favour))
                    standing[other] = now
                    turn += 1
                    heapq.heappush(frontier, (rank[other], *now, turn, other))
    return np.array(twist, dtype=np.int64) == 1
