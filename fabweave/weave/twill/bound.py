"""Prove how few conditions of a twill any weave of a mesh must break."""

import heapq
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, Progress, frozen_value, no_progress
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.one_rings import interior_valences
from fabweave.weave.threads import Threads, crossing_of_halfedges
from fabweave.weave.twill.anneal import Couplings

#: How many conditions are broken, for all twists of a few crossings: one axis for each.
_Table = npt.NDArray[np.int32]

#: Tables of a region usually have at most this many axes: 2**18 numbers.
REGION_WIDTH = 18
#: A condition as near to several regions is split into so many parts; 12 is divided by 2, 3, 4, 6.
PARTS = 12
#: Work is counted in numbers of tables that are computed; to look up a condition or a table takes
#: as long as so many.
_LOOK_UP = 10_000

_PAIR = np.eye(2, dtype=np.int32)
_WINDOW = np.einsum("ab,cd->abcd", 1 - _PAIR, 1 - _PAIR)


@dataclass
class Work:
    """How much may still be computed."""

    left: float

    def spend(self, amount: float) -> None:
        """Take off what something cost."""
        self.left -= amount

    @property
    def done(self) -> bool:
        """Whether nothing is left."""
        return self.left <= 0


@dataclass(frozen=True, eq=False)
class Region:
    """Conditions that count for one part of the mesh, and how many parts of each do.

    Each field holds first the pairs and then the windows, as rows of
    :attr:`~fabweave.weave.twill.anneal.Couplings.tables`.
    """

    rows: tuple[IntArray, ...]
    parts: tuple[IntArray, ...]

    def some(self, chosen: Sequence[BoolArray]) -> "Region":
        """Return a region of some of the conditions."""
        return Region(
            tuple(rows[some] for rows, some in zip(self.rows, chosen, strict=True)),
            tuple(parts[some] for parts, some in zip(self.parts, chosen, strict=True)),
        )

    def and_also(self, other: "Region") -> "Region":
        """Return a region of the parts of both."""
        joint = map(_together, self.rows, self.parts, other.rows, other.parts)
        rows, parts = zip(*joint, strict=True)
        return Region(rows, parts)


def _whole(rows: Sequence[IntArray]) -> Region:
    """Return a region in which all parts of its conditions count."""
    return Region(tuple(rows), tuple(np.full(len(some), PARTS) for some in rows))


def _together(
    rows: IntArray, parts: IntArray, more: IntArray, more_parts: IntArray
) -> tuple[IntArray, IntArray]:
    """Add parts of conditions up: each row once, with all its parts."""
    every, place = np.unique(np.concatenate((rows, more)), return_inverse=True)
    added = np.bincount(place, np.concatenate((parts, more_parts)), minlength=len(every))
    return every, added.astype(np.int64)


def crossings_of(couplings: Couplings, region: Region) -> IntArray:
    """Return the crossings that a region's conditions touch."""
    tables = zip(couplings.tables, region.rows, strict=True)
    return np.unique(np.concatenate([table[rows].ravel() for (table, _), rows in tables]))


def shared_tables(
    couplings: Couplings, region: Region
) -> tuple[list[tuple[tuple[int, ...], _Table]], list[set[int]]]:
    """Return a region's costs as tables over its own crossings, and who shares a table."""
    crossings = crossings_of(couplings, region)
    tables: list[tuple[tuple[int, ...], _Table]] = []
    for (conditions, weight), rows, parts, table in zip(
        couplings.tables, region.rows, region.parts, (_PAIR, _WINDOW), strict=True
    ):
        local = np.searchsorted(crossings, conditions[rows]).tolist()
        for scope, times in zip(local, (weight[rows] * parts).tolist(), strict=True):
            # A condition that meets a crossing twice is left out, which keeps the bound a bound.
            if len(set(scope)) == len(scope):
                tables.append((tuple(scope), table * times))
    sharing: list[set[int]] = [set() for _ in crossings]
    for scope, _ in tables:
        for crossing in scope:
            sharing[crossing].update(scope)
    for crossing, others in enumerate(sharing):
        others.discard(crossing)
    return tables, sharing


def elimination_order(
    sharing: list[set[int]], width: int, most: float = math.inf
) -> list[int] | None:
    """Order the crossings for elimination, the least connected first.

    None if tables have more axes than the width, or come to more numbers than the most.
    """
    around = [set(others) for others in sharing]
    waiting = [(len(others), crossing) for crossing, others in enumerate(around)]
    heapq.heapify(waiting)
    order: list[int] = []
    gone = [False] * len(around)
    while waiting:
        degree, crossing = heapq.heappop(waiting)
        if gone[crossing] or degree != len(around[crossing]):
            continue
        most -= 1 << degree + 1
        if degree > width or most < 0:
            return None
        for other in around[crossing]:
            around[other] |= around[crossing]
            around[other] -= {other, crossing}
            heapq.heappush(waiting, (len(around[other]), other))
        gone[crossing] = True
        order.append(crossing)
    return order


def least_parts(
    couplings: Couplings, region: Region, width: int, work: Work | None = None
) -> int | None:
    """Return how many parts of a region's conditions must break; None if that is too much work."""
    tables, sharing = shared_tables(couplings, region)
    if work is not None:
        work.spend(_LOOK_UP * len(tables))
    # Larger tables than usual are begun only if there is work left for all of them.
    most = work.left if work is not None and width > REGION_WIDTH else math.inf
    order = elimination_order(sharing, width, most)
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
        total: _Table = np.zeros((2,) * len(axis), dtype=np.int32)
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


#: Tables for a whole mesh have at most this many axes: 2**24 numbers.
_WHOLE_WIDTH = 24
#: Regions that were too large for that are solved once more, with larger and larger tables.
_WIDER = (20, 22, 24)
#: So far from a seed conditions are split, on meshes of at most so many crossings times seeds.
_FARTHEST = 14
_MOST_SPLIT = 5e7
#: Work for larger tables by effort, in numbers of tables (see prove_bound).
WIDER_WORK = {"quick": 0.0, "normal": 2e9, "best": 2e10}
#: Larger meshes are not tried as a whole; regions grow no larger by merging.
_MOST_WHOLE = 200
_MOST_MERGED = 160

#: On a grid of at most so many crossings rings of conditions are sought.
_MOST_RINGED = 2000

#: Work to look up a table where regions are only tried for merging.
_TRIAL = 2500


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


def prove_bound(
    couplings: Couplings,
    seeds: Sequence[IntArray],
    *,
    most_work: int | None = None,
    wider_work: float = 0.0,
    progress: Progress = no_progress,
) -> Bound:
    """Prove a lower bound on the number of broken conditions.

    A small mesh is solved as a whole, by eliminating one crossing after the other from tables of
    costs. Else the conditions are dealt out to regions around the seeds, each condition to the
    region of the seed that it is nearest to; what each region must break by itself, found in the
    same way, adds up to what the mesh must break. Where several seeds are as near, the condition
    goes to one of them, or is split in equal parts between all: the better sum of the two counts.
    Neighbouring regions are merged while the tables stay small, and conditions far from a seed are
    left out where they do not: both can only make the sum too low.

    Without seeds, rings of an odd number of edge conditions are counted, each of which breaks one.

    Whether the number of broken conditions is odd or even often does not depend on the twists: on
    a closed mesh it is always even. Then the sum is rounded up to what is possible.

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
    wider_work : float
        Work that may be spent on larger tables, all regions together, where more of a region could
        then be solved.
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
    everything = _whole([np.arange(len(table)) for table, _ in couplings.tables])
    if couplings.n_crossings <= _MOST_WHOLE:
        optimum = least_parts(couplings, everything, _WHOLE_WIDTH)
        if optimum is not None:
            return Bound(optimum // PARTS, optimum=True)
    remainder = _parity(couplings)
    if not seeds:
        # On a grid only the lengths of threads are in the way.
        few = couplings.n_crossings <= _MOST_RINGED
        return Bound(_rounded_up(_odd_rings(couplings) if few else 0, remainder), optimum=False)
    most = math.inf if most_work is None else most_work
    nearness = _nearness(couplings, seeds)
    far = [nearness.distance[table].max(axis=1) for table, _ in couplings.tables]
    deals = [_deal(couplings, nearness, len(seeds))]
    if most_work is None and len(seeds) * couplings.n_crossings <= _MOST_SPLIT:
        deals.append(_split(couplings, seeds))
    parts, cut_short = 0, False
    for deal in deals:
        merging, solving = Work(most), Work(most)
        regions = _merged(couplings, deal, merging)
        proved = 0
        for number, region in enumerate(regions):
            progress("twill bound", number, len(regions))
            if solving.done:
                break
            wider = Work(wider_work / len(regions))
            proved += _least_within(couplings, region, far, solving, wider)
        parts = max(parts, proved)
        cut_short |= merging.done or solving.done
    least = _rounded_up(-(-parts // PARTS), remainder)
    return Bound(least, optimum=False, cut_short=cut_short)


def _rounded_up(least: int, remainder: int | None) -> int:
    """Return the least number that is as odd or even as it must be."""
    return least if remainder is None else least + (least - remainder) % 2


def _odd_rings(couplings: Couplings) -> int:
    """Count rings of an odd number of edge conditions, none of which is in two of them.

    Around each, twists cannot all differ: one condition breaks. The shortest are taken first.
    """
    near: list[Counter[int]] = [Counter() for _ in range(couplings.n_crossings)]
    for (a, b), weight in zip(
        couplings.pairs.tolist(), couplings.pair_weight.tolist(), strict=True
    ):
        for here, there in {(a, b), (b, a)}:
            near[here][there] += weight
    waiting = [(0, crossing) for crossing in range(couplings.n_crossings)]
    count = 0
    while waiting:
        length, start = heapq.heappop(waiting)
        ring = _odd_ring(near, start)
        if len(ring) > length:
            heapq.heappush(waiting, (len(ring), start))
        elif ring and len(set(ring)) == len(ring):
            count += 1
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
                for here, there in {(a, b), (b, a)}:
                    near[here][there] -= 1
            heapq.heappush(waiting, (length, start))
    return count


def _odd_ring(near: list[Counter[int]], start: int) -> list[int]:
    """Return the crossings of a shortest walk of odd length back to one; none if there is none."""
    before: dict[tuple[int, bool], tuple[int, bool]] = {(start, False): (-1, False)}
    queue = [(start, False)]
    for here in queue:
        for other, times in near[here[0]].items():
            there = other, not here[1]
            if times > 0 and there not in before:
                before[there] = here
                queue.append(there)
        if (start, True) in before:
            ring, at = [], before[start, True]
            while at[0] >= 0:
                ring.append(at[0])
                at = before[at]
            return ring
    return []


def irregular_seeds(halfedges: Halfedges, threads: Threads) -> list[IntArray]:
    """Return the crossings around each vertex and face that breaks the rhythm of a twill.

    These are the vertices inside the surface whose valence is not a multiple of 4, and the faces
    whose number of sides is not.
    """
    crossing = crossing_of_halfedges(halfedges, threads.crossing_halfedge)
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
            around = crossing[order[a:b]]
            if np.any(around >= 0):
                seeds.append(np.unique(around[around >= 0]))
    return seeds


@frozen_value
class _Nearness:
    """Which seed is nearest to each crossing, and how far it is.

    Crossings in bodies of the mesh without a seed are not ``reached``, and have distance 0.
    """

    reached: BoolArray
    distance: IntArray
    source: IntArray


def _nearness(couplings: Couplings, seeds: Sequence[IntArray]) -> _Nearness:
    """Walk from all seeds at once, from condition to condition."""
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
    walked, _, source = csgraph.dijkstra(
        links,
        indices=np.arange(count, count + len(seeds)),
        min_only=True,
        unweighted=True,
        return_predecessors=True,
    )
    reached = np.isfinite(walked[:count])
    distance = np.where(reached, walked[:count], 0).astype(np.int64)
    return _Nearness(reached, distance, source[:count].astype(np.int64) - count)


def _deal(couplings: Couplings, nearness: _Nearness, n_seeds: int) -> list[Region]:
    """Deal each condition to the seed that is nearest to any of its crossings."""
    dealt = []
    for rows, _ in couplings.tables:
        nearest = np.argmin(
            nearness.distance[rows] * (len(nearness.distance) + n_seeds) + nearness.source[rows],
            axis=1,
        )
        owner = nearness.source[rows[np.arange(len(rows)), nearest]]
        owner = np.where(nearness.reached[rows[:, 0]], owner, -1)
        order = np.argsort(owner, kind="stable")
        bounds = np.searchsorted(owner[order], np.arange(n_seeds + 1))
        dealt.append([order[bounds[k] : bounds[k + 1]] for k in range(n_seeds)])
    return [_whole(rows) for rows in zip(*dealt, strict=True)]


def _split(couplings: Couplings, seeds: Sequence[IntArray]) -> list[Region]:
    """Split each condition between the seeds whose distance to all its crossings is least."""
    tables = [table for table, _ in couplings.tables]
    least = [np.full(len(table), _FARTHEST + 1) for table in tables]
    found: list[list[tuple[IntArray, IntArray]]] = [[] for _ in tables]
    for seed in seeds:
        steps = csgraph.dijkstra(
            couplings.neighbours, indices=seed, min_only=True, unweighted=True, limit=_FARTHEST
        )
        steps = np.minimum(steps, _FARTHEST + 1).astype(np.int64)
        for table, nearest, near_seeds in zip(tables, least, found, strict=True):
            distance = steps[table].max(axis=1)
            near = np.flatnonzero(distance <= np.minimum(nearest, _FARTHEST))
            nearest[near] = distance[near]
            near_seeds.append((near, distance[near]))
    dealt = []
    for table, nearest, near_seeds in zip(tables, least, found, strict=True):
        owned = [near[distance == nearest[near]] for near, distance in near_seeds]
        owners = np.bincount(np.concatenate(owned), minlength=len(table))
        # A remainder is lost, which keeps the sum a bound.
        dealt.append([(rows, PARTS // owners[rows]) for rows in owned])
    return [Region(*zip(*both, strict=True)) for both in zip(*dealt, strict=True)]


def _parity(couplings: Couplings) -> int | None:
    """Return the number of broken conditions modulo 2; None if it depends on the twists.

    Over GF(2) a pair a, b is broken if 1 + a + b is 1, a window a, b, c, d if (a + b)(c + d) is:
    their sum is one number if all terms in a, b, c and d cancel.
    """
    odd = couplings.pair_weight % 2 == 1
    pairs, windows = couplings.pairs[odd], couplings.windows[couplings.window_weight % 2 == 1]
    products = np.sort(
        np.concatenate([windows[:, [i, j]] for i in (0, 1) for j in (2, 3)]).reshape(-1, 2), axis=1
    )
    same = products[:, 0] == products[:, 1]
    single = np.bincount(
        np.concatenate((pairs.ravel(), products[same, 0])), minlength=couplings.n_crossings
    )
    _, times = np.unique(products[~same], axis=0, return_counts=True)
    if np.any(single % 2) or np.any(times % 2):
        return None
    return len(pairs) % 2


def _merged(couplings: Couplings, regions: list[Region], work: Work) -> list[Region]:
    """Merge neighbouring regions, each with each that it can be, in their order."""
    result: list[Region | None] = list(regions)
    owner: dict[int, set[int]] = {}
    inside = [set(crossings_of(couplings, region).tolist()) for region in regions]
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
        both = one.and_also(other)
        tables, sharing = shared_tables(couplings, both)
        work.spend(_TRIAL * len(tables))
        if elimination_order(sharing, REGION_WIDTH) is not None:
            result[first], result[second] = both, None
            inside[first] |= inside[second]
            members[first] += members[second]
            for number in members[second]:
                now[number] = first
    return [region for region in result if region is not None]


def _least_within(
    couplings: Couplings, region: Region, far: list[IntArray], work: Work, wider: Work
) -> int:
    """Return what a region must break, without its farthest conditions if they are too many."""
    away = [distance[rows] for distance, rows in zip(far, region.rows, strict=True)]
    reach = max(int(distance.max(initial=0)) for distance in away)
    least = 0
    # From the seed outwards: of a large region only the middle is ever looked at.
    for limit in range(1, reach + 1):
        part = region.some([distance <= limit for distance in away])
        more = least_parts(couplings, part, REGION_WIDTH, work)
        for width in _WIDER:
            if more is None and not wider.done:
                more = least_parts(couplings, part, width, wider)
        if more is None or work.done:
            return least if more is None else more
        least = more
    return least
