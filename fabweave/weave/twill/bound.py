"""Prove how few conditions of a twill any weave of a mesh must break."""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import IntArray, Progress, frozen_value, no_progress
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.irregular import interior_valences
from fabweave.weave.threads import Threads
from fabweave.weave.twill.anneal import Couplings

#: How many conditions are broken, for all twists of a few crossings: one axis for each.
_Table = npt.NDArray[np.int16]

#: Tables of at most this many axes are used: 2**18 numbers in a region, 2**24 for a whole mesh.
_REGION_WIDTH = 18
_WHOLE_WIDTH = 24
#: Larger meshes are not tried as a whole; regions grow no larger by merging.
_MOST_WHOLE = 200
_MOST_MERGED = 160

#: Work is counted in numbers of tables that are computed; to look up a condition or a table takes
#: as long as so many, where it is computed and where regions are only tried for merging.
_LOOK_UP, _TRIAL = 10_000, 2500

_PAIR = np.eye(2, dtype=np.int16)
_WINDOW = np.einsum("ab,cd->abcd", 1 - _PAIR, 1 - _PAIR)


@dataclass(frozen=True)
class Bound:
    """A proved least number of broken conditions.

    Parameters
    ----------
    least : int
        No weave of the mesh breaks fewer.
    optimum : bool
        Whether some weave breaks just as many, so that this is the optimum.
    cut_short : bool
        Whether more work than was allowed might have proved more.
    """

    least: int
    optimum: bool
    cut_short: bool = False


@dataclass
class _Work:
    """How much may still be computed."""

    left: float

    def spend(self, amount: float) -> None:
        """Take off what something cost."""
        self.left -= amount

    @property
    def done(self) -> bool:
        """Whether nothing is left."""
        return self.left <= 0


@frozen_value
class _Region:
    """Conditions that count for one part of the mesh, as rows, and how far each is from it."""

    pairs: IntArray
    windows: IntArray


def prove_bound(
    couplings: Couplings,
    seeds: Sequence[IntArray],
    *,
    most_work: int | None = None,
    progress: Progress = no_progress,
) -> Bound:
    """Prove a lower bound on the number of broken conditions.

    A small mesh is solved as a whole, by eliminating one crossing after the other from tables of
    costs. Else the conditions are dealt out to regions around the seeds, each condition to one
    region; what each region must break by itself, found in the same way, adds up to what the mesh
    must break. Neighbouring regions are merged while the tables stay small, and conditions far
    from a seed are left out where they do not: both can only make the sum too low.

    Parameters
    ----------
    couplings : Couplings
        The conditions.
    seeds : sequence of int arrays
        Crossings around each place where the twill is likely to break, such as
        ``irregular_seeds``.
    most_work : int, optional
        Stop merging regions after the work of so many numbers in tables, and solving them after
        as much again: regions that were not solved by then count for nothing. The same on every
        machine.
    progress : callable
        Told which region is being solved.

    Returns
    -------
    Bound

    References
    ----------
    Bertelè and Brioschi, "Nonserial Dynamic Programming" (1972): elimination.

    Examples
    --------
    >>> from fabweave.mesh.shapes import grids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.twill.anneal import couple
    >>> from fabweave.weave.twill.conditions import twill_conditions
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.sphere(2, 50.0))
    >>> prove_bound(couple(twill_conditions(halfedges, trace_threads(halfedges))), [])
    Bound(least=16, optimum=True, cut_short=False)
    """
    everything = _Region(np.arange(len(couplings.pairs)), np.arange(len(couplings.windows)))
    if couplings.n_crossings <= _MOST_WHOLE:
        optimum = _least(couplings, everything, _WHOLE_WIDTH)
        if optimum is not None:
            return Bound(optimum, optimum=True)
    if not seeds:
        return Bound(0, optimum=False)
    most = math.inf if most_work is None else most_work
    regions, far = _deal(couplings, seeds)
    merging, solving = _Work(most), _Work(most)
    progress("twill bound", 0, len(regions))
    merged = _merged(couplings, regions, merging)
    least = 0
    for number, region in enumerate(merged):
        progress("twill bound", number, len(merged))
        if solving.done:
            break
        least += _least_within(couplings, region, far, solving)
    return Bound(least, optimum=False, cut_short=merging.done or solving.done)


def irregular_seeds(halfedges: Halfedges, threads: Threads) -> list[IntArray]:
    """Return the crossings around each vertex and face that breaks the rhythm of a twill.

    These are the vertices inside the surface whose valence is not a multiple of 4, and the faces
    whose number of sides is not.
    """
    crossing = np.full(halfedges.n_edges, -1, dtype=np.int64)
    crossing[halfedges.edge[threads.crossing_halfedge]] = np.arange(threads.n_crossings)
    vertices, valences = interior_valences(halfedges)
    sizes = np.bincount(halfedges.face)
    seeds = []
    for owner, irregular in (
        (halfedges.tail, vertices[valences % 4 != 0]),
        (halfedges.face, np.flatnonzero(sizes % 4 != 0)),
    ):
        order = np.argsort(owner, kind="stable")
        starts = np.searchsorted(owner[order], irregular)
        ends = np.searchsorted(owner[order], irregular, side="right")
        for a, b in zip(starts.tolist(), ends.tolist(), strict=True):
            around = crossing[halfedges.edge[order[a:b]]]
            if np.any(around >= 0):
                seeds.append(np.unique(around[around >= 0]))
    return seeds


def _deal(couplings: Couplings, seeds: Sequence[IntArray]) -> tuple[list[_Region], list[IntArray]]:
    """Deal each condition to the seed nearest to it; return regions, and distances by row."""
    count = couplings.n_crossings
    start = np.repeat(np.arange(count, count + len(seeds)), [len(seed) for seed in seeds])
    near = couplings.neighbours.tocoo()
    links = sparse.coo_array(
        (
            np.ones(len(start) + near.nnz),
            (np.concatenate((start, near.row)), np.concatenate((*seeds, near.col))),
        ),
        shape=(count + len(seeds), count + len(seeds)),
    ).tocsr()
    distance, _, source = csgraph.dijkstra(
        links,
        indices=np.arange(count, count + len(seeds)),
        min_only=True,
        unweighted=True,
        return_predecessors=True,
    )
    # Bodies of the mesh without a seed are out of reach and deal nothing to anyone.
    reached = np.isfinite(distance[:count])
    distance = np.where(reached, distance[:count], 0)
    dealt, far = [], []
    for rows in (couplings.pairs, couplings.windows):
        nearest = np.argmin(distance[rows] * len(links.indptr) + source[rows], axis=1)
        owner = np.where(
            reached[rows[:, 0]], source[rows[np.arange(len(rows)), nearest]] - count, -1
        )
        order = np.argsort(owner, kind="stable")
        bounds = np.searchsorted(owner[order], np.arange(len(seeds) + 1))
        dealt.append([order[bounds[k] : bounds[k + 1]] for k in range(len(seeds))])
        far.append(distance[rows].max(axis=1).astype(np.int64))
    return [_Region(p, w) for p, w in zip(*dealt, strict=True)], far


def _merged(couplings: Couplings, regions: list[_Region], work: _Work) -> list[_Region]:
    """Merge neighbouring regions, each with each that it can be, in their order."""
    result: list[_Region | None] = list(regions)
    owner: dict[int, set[int]] = {}
    inside = [set(_crossings(couplings, region).tolist()) for region in regions]
    for number, crossings in enumerate(inside):
        for crossing in crossings:
            owner.setdefault(crossing, set()).add(number)
    touching = sorted(
        {(a, b) for numbers in owner.values() for a in numbers for b in numbers if a < b}
    )
    now = list(range(len(regions)))
    members = [[number] for number in now]
    #: Pairs that could not be merged, until one of them grows.
    apart: set[tuple[int, int, int, int]] = set()
    for a, b in touching:
        if work.done:
            break
        first, second = now[a], now[b]
        one, other = result[first], result[second]
        pair = (first, second, len(members[first]), len(members[second]))
        if first == second or one is None or other is None or pair in apart:
            continue
        apart.add(pair)
        if len(inside[first] | inside[second]) > _MOST_MERGED:
            continue
        both = _Region(
            np.concatenate((one.pairs, other.pairs)), np.concatenate((one.windows, other.windows))
        )
        tables, sharing = _scopes(couplings, both)
        work.spend(_TRIAL * len(tables))
        if _order(sharing, _REGION_WIDTH) is not None:
            result[first], result[second] = both, None
            inside[first] |= inside[second]
            members[first] += members[second]
            for number in members[second]:
                now[number] = first
    return [region for region in result if region is not None]


def _least_within(couplings: Couplings, region: _Region, far: list[IntArray], work: _Work) -> int:
    """Return what a region must break, without its farthest conditions if they are too many."""
    near_pairs, near_windows = far[0][region.pairs], far[1][region.windows]
    reach = max(int(near_pairs.max(initial=0)), int(near_windows.max(initial=0)))
    least = 0
    # From the seed outwards: of a large region only the middle is ever looked at.
    for limit in range(1, reach + 1):
        part = _Region(region.pairs[near_pairs <= limit], region.windows[near_windows <= limit])
        more = _least(couplings, part, _REGION_WIDTH, work)
        if more is None or work.done:
            return least if more is None else more
        least = more
    return least


def _crossings(couplings: Couplings, region: _Region) -> IntArray:
    """Return the crossings that a region's conditions touch."""
    return np.unique(
        np.concatenate(
            (couplings.pairs[region.pairs].ravel(), couplings.windows[region.windows].ravel())
        )
    )


def _scopes(
    couplings: Couplings, region: _Region
) -> tuple[list[tuple[tuple[int, ...], _Table]], list[set[int]]]:
    """Return a region's costs as tables over its own crossings, and who shares a table."""
    crossings = _crossings(couplings, region)
    tables: list[tuple[tuple[int, ...], _Table]] = []
    for rows, weights, table in (
        (couplings.pairs[region.pairs], couplings.pair_weight[region.pairs], _PAIR),
        (couplings.windows[region.windows], couplings.window_weight[region.windows], _WINDOW),
    ):
        local = np.searchsorted(crossings, rows).tolist()
        for scope, weight in zip(local, weights.tolist(), strict=True):
            # A condition that meets a crossing twice is left out, which keeps the bound a bound.
            if len(set(scope)) == len(scope):
                tables.append((tuple(scope), table * weight))
    sharing: list[set[int]] = [set() for _ in crossings]
    for scope, _ in tables:
        for crossing in scope:
            sharing[crossing].update(scope)
    for crossing, others in enumerate(sharing):
        others.discard(crossing)
    return tables, sharing


def _order(sharing: list[set[int]], width: int) -> list[int] | None:
    """Order the crossings for elimination, the least connected first; None if tables get large."""
    around = [set(others) for others in sharing]
    waiting = [(len(others), crossing) for crossing, others in enumerate(around)]
    heapq.heapify(waiting)
    order: list[int] = []
    gone = [False] * len(around)
    while waiting:
        degree, crossing = heapq.heappop(waiting)
        if gone[crossing] or degree != len(around[crossing]):
            continue
        if degree > width:
            return None
        for other in around[crossing]:
            around[other] |= around[crossing]
            around[other] -= {other, crossing}
            heapq.heappush(waiting, (len(around[other]), other))
        gone[crossing] = True
        order.append(crossing)
    return order


def _least(
    couplings: Couplings, region: _Region, width: int, work: _Work | None = None
) -> int | None:
    """Return the least number of a region's conditions that must break; None if too wide."""
    tables, sharing = _scopes(couplings, region)
    if work is not None:
        work.spend(_LOOK_UP * len(tables))
    order = _order(sharing, width)
    if order is None:
        return None
    least = 0
    held: list[dict[int, tuple[tuple[int, ...], _Table]]] = [{} for _ in sharing]
    for number, (scope, table) in enumerate(tables):
        for crossing in scope:
            held[crossing][number] = (scope, table)
    for step, crossing in enumerate(order, start=len(tables)):
        gathered = held[crossing]
        joint = sorted({other for scope, _ in gathered.values() for other in scope} - {crossing})
        axis = {other: place for place, other in enumerate([crossing, *joint])}
        total: _Table = np.zeros((2,) * len(axis), dtype=np.int16)
        if work is not None:
            work.spend((total.size + _LOOK_UP) * len(gathered))
        for number, (scope, table) in gathered.items():
            places = [axis[other] for other in scope]
            shape = [1] * len(axis)
            for place in places:
                shape[place] = 2
            total += table.transpose(np.argsort(places)).reshape(shape)
            for other in scope:
                if other != crossing:
                    del held[other][number]
        rest = total.min(axis=0)
        if not joint:
            least += int(rest)
        for other in joint:
            held[other][step] = (tuple(joint), rest)
    return least
