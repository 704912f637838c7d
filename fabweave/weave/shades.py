"""Give strands shades so that the two that cross differ, and threads change theirs seldom."""

import heapq
from itertools import pairwise

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value, offsets_of
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.threads import Threads

#: With more shades than this, threads may change theirs at every crossing, where few suffice.
_MOST_SHADES = 24
#: How often all stretches are looked at again.
_SWEEPS = 8


@frozen_value
class Shades:
    """The shades of the strands.

    Parameters
    ----------
    shade : (P, 2) int array
        With which shade each pass comes to its crossing, and with which it leaves.
    stretch : (P, 2) int array
        The stretch of thread that comes there, and the one that leaves: each has one shade.
    """

    shade: IntArray
    stretch: IntArray

    @property
    def n_shades(self) -> int:
        """Number of shades."""
        return int(self.shade.max(initial=-1)) + 1


def shade_strands(
    weave: Weave,
    *,
    breaks: BoolArray | None = None,
    distinct: bool = False,
) -> Shades:
    """Give every strand a shade so that at every crossing the strand above differs from the other.

    It differs from the strand below on either side of it. A thread changes its shade only where
    it lies below another one, so that the change is hidden; and as seldom as a greedy search with
    some improvement can bring about. On a mesh of quads that leaves warp and weft, and three
    directions on one of triangles, but for lines between irregular vertices.

    Parameters
    ----------
    weave : Weave
        Threads, and who is on top.
    breaks : (P,) bool array, optional
        The passes at which shades may change; without it, wherever the thread is below. Between
        them a thread that crosses itself changes elsewhere, too: below, and if need be above.
    distinct : bool
        Whether a thread takes another shade at every break.

    Returns
    -------
    Shades
        The most frequent shade is 0; the same for the same weave.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> ring = trace_threads(build_halfedges(parse_shape("shape:torus?m=9&n=7")))
    >>> shades = shade_strands(plain_weave(ring))
    >>> ring.n_threads, shades.n_shades
    (2, 2)
    """
    threads = weave.threads
    if len(threads.crossing) == 0:
        none = np.zeros((0, 2), dtype=np.int64)
        return Shades(none, none)
    broken = ~weave.over if breaks is None else np.asarray(breaks, dtype=np.bool_)
    stretch, conflicts = _parted(weave, broken)
    shade = _shaded(stretch, conflicts, distinct)
    if shade.max() >= _MOST_SHADES:
        stretch, conflicts = _parted(weave, np.ones(len(broken), dtype=np.bool_))
        shade = _shaded(stretch, conflicts, distinct=False)
    used = np.bincount(shade[stretch].ravel())
    number = np.empty(len(used), dtype=np.int64)
    number[np.argsort(-used, kind="stable")] = np.arange(len(used))
    return Shades(number[shade][stretch], stretch)


def _parted(weave: Weave, broken: BoolArray) -> tuple[IntArray, IntArray]:
    """Part threads until no stretch crosses itself; return stretches and pairs that must differ."""
    broken = broken.copy()
    for may_break in (~weave.over, np.ones(len(broken), dtype=np.bool_)):
        stretch = stretches(weave.threads, broken)
        pairs = np.unique(crossing_pairs(weave, stretch), axis=0)
        own = np.zeros(int(stretch.max()) + 1, dtype=np.bool_)
        own[pairs[pairs[:, 0] == pairs[:, 1], 0]] = True
        broken |= may_break & own[stretch].any(axis=1)
    stretch = stretches(weave.threads, broken)
    pairs = np.unique(crossing_pairs(weave, stretch), axis=0)
    return stretch, pairs[pairs[:, 0] != pairs[:, 1]]


def stretches(threads: Threads, broken: BoolArray) -> IntArray:
    """Give each stretch of thread between breaks a number; return it before and after each pass."""
    thread = threads.thread_of_pass
    after = np.cumsum(broken) + thread
    before = after - broken
    # A ring goes on from its last pass to its first.
    filled = np.flatnonzero(threads.woven)
    first, last = threads.offsets[filled], threads.offsets[filled + 1] - 1
    ring = threads.closed[filled]
    name = np.arange(int(after.max()) + 1)
    name[before[first[ring]]] = after[last[ring]]
    both = name[np.stack((before, after), axis=1)]
    return np.unique(both, return_inverse=True)[1].reshape(-1, 2)


def crossing_pairs(weave: Weave, stretch: IntArray) -> IntArray:
    """Return the stretches that meet at crossings: each of the one strand, and each of the other.

    Parameters
    ----------
    weave : Weave
    stretch : (P, 2) int array
        As ``stretches`` gives them.

    Returns
    -------
    (4X, 2) int array
        Four pairs for each crossing, the lower number first.
    """
    place = strand_passes(weave)
    below, above = stretch[place[:, 0]], stretch[place[:, 1]]
    pairs = np.stack((np.repeat(above, 2, axis=1), np.tile(below, 2)), axis=2).reshape(-1, 2)
    return np.asarray(np.sort(pairs, axis=1))


def _shaded(stretch: IntArray, conflicts: IntArray, distinct: bool) -> IntArray:
    """Return a shade for each stretch: those in conflict differ, neighbours agree if they can."""
    count = int(stretch.max()) + 1
    along = stretch[stretch[:, 0] != stretch[:, 1]]
    if distinct:
        conflicts, along = np.concatenate((conflicts, along)), along[:0]
    apart, alike = _neighbours(conflicts, count), _neighbours(along, count)
    shades = _spread(apart, alike)
    _improve(shades, apart, alike)
    return np.array(shades, dtype=np.int64)


def _neighbours(pairs: IntArray, count: int) -> list[list[int]]:
    """Return what is paired with each of so many."""
    both = np.unique(np.concatenate((pairs, pairs[:, ::-1])), axis=0)
    bounds = offsets_of(np.bincount(both[:, 0], minlength=count)).tolist()
    other = both[:, 1].tolist()
    return [other[low:high] for low, high in pairwise(bounds)]


def _spread(apart: list[list[int]], alike: list[list[int]]) -> list[int]:
    """Shade greedily from a first stretch outwards, that first which has the least choice.

    Of equals, that comes first which goes on from others, and then what was met first.
    """
    shades = [-1] * len(apart)
    seen: list[set[int]] = [set() for _ in apart]
    goes_on = [0] * len(apart)
    heap: list[tuple[int, int, int, int]] = []
    met = 0
    for start in range(len(apart)):
        if shades[start] >= 0:
            continue
        heap.append((0, 0, met, start))
        while heap:
            *_, here = heapq.heappop(heap)
            if shades[here] >= 0:
                continue
            shades[here] = _best(here, shades, seen[here], alike)
            for other in apart[here]:
                seen[other].add(shades[here])
            for other in alike[here]:
                goes_on[other] += 1
            for other in (*alike[here], *apart[here]):
                if shades[other] < 0:
                    met += 1
                    heapq.heappush(heap, (-len(seen[other]), -goes_on[other], met, other))
    return shades


def _best(here: int, shades: list[int], taken: set[int], alike: list[list[int]]) -> int:
    """Return the free shade that most stretches have which one goes on from; or the first."""
    told = [shades[other] for other in alike[here] if shades[other] >= 0]
    free = [shade for shade in told if shade not in taken]
    if free:
        return max(free, key=lambda shade: (free.count(shade), -shade))
    return next(shade for shade in range(len(taken) + 1) if shade not in taken)


def _improve(shades: list[int], apart: list[list[int]], alike: list[list[int]]) -> None:
    """Give stretches other shades as long as threads then change theirs less often."""
    for _ in range(_SWEEPS):
        moved = False
        for here, others in enumerate(alike):
            told = [shades[other] for other in others]
            kept = told.count(shades[here])
            if kept == len(told):
                continue
            taken = {shades[other] for other in apart[here]}
            gains = {shade: told.count(shade) for shade in told if shade not in taken}
            best = max(gains, key=lambda shade: (gains[shade], -shade), default=shades[here])
            if gains.get(best, 0) > kept:
                shades[here], moved = best, True
        if not moved:
            return


#: Where two tones leave more than this share of the crossings alike, three are taken: a kagome
#: weave has three directions.
_MOST_ALIKE = 0.25
#: What a change of tone along a thread costs, where two strands alike at a crossing cost 4.
_CHANGE = 2
#: How often all stretches are looked at again.
_SWEEPS_tones = 50


def strand_tones(weave: Weave, groups: IntArray) -> IntArray:
    """Give every strand one of two tones, or of three, so that strands that cross seldom have one.

    Tones follow directions: warp and weft on quads, three directions on triangles. A direction
    cannot be followed around an irregular vertex, so that lines are left between such vertices
    where a thread changes its tone. It does so where it lies below another, which hides the
    change; there it has the tone of the strand above on one side. Fewer such crossings are looked
    for greedily, then improved.

    Parameters
    ----------
    weave : Weave
    groups : (T,) int array
        Threads of different groups have different colours, and so need no tones where they cross.

    Returns
    -------
    (P, 2) int array
        The tone in which each pass comes to its crossing, and in which it leaves: 0 for that of
        most strands. All are 0 where no threads of one group cross.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> ring = trace_threads(build_halfedges(parse_shape("shape:torus?m=8&n=6")))
    >>> np.bincount(strand_tones(plain_weave(ring), np.zeros(ring.n_threads)).ravel()).tolist()
    [192, 192]
    """
    threads = weave.threads
    if len(threads.crossing) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    stretch = stretches(threads, ~weave.over)
    place = strand_passes(weave)
    group = groups[threads.thread_of_pass]
    same = group[place[:, 0]] == group[place[:, 1]]
    apart = crossing_pairs(weave, stretch)[np.repeat(same, 4)]
    along = stretch[stretch[:, 0] != stretch[:, 1]]
    near = _neighbours_tones(apart[apart[:, 0] != apart[:, 1]], along, int(stretch.max()) + 1)
    for count in (2, 3):
        tone = _assigned(near, count)[stretch]
        below, above = tone[place[same, 0]], tone[place[same, 1]]
        alike = np.any(below[:, :, None] == above[:, None, :], axis=(1, 2))
        if np.count_nonzero(alike) <= _MOST_ALIKE * len(alike):
            break
    order = np.argsort(-np.bincount(tone.ravel(), minlength=count), kind="stable")
    return np.asarray(np.argsort(order, kind="stable")[tone])


def _neighbours_tones(apart: IntArray, along: IntArray, count: int) -> list[list[tuple[int, int]]]:
    """Return for each stretch those it meets, and what it costs to have the same tone as they."""
    pairs = np.concatenate((apart, along))
    costs = np.repeat((1, -_CHANGE), (len(apart), len(along)))
    both, number = np.unique(np.concatenate((pairs, pairs[:, ::-1])), axis=0, return_inverse=True)
    total = np.bincount(number.ravel(), weights=np.tile(costs, 2)).astype(np.int64)
    bounds = offsets_of(np.bincount(both[:, 0], minlength=count)).tolist()
    listed = list(zip(both[:, 1].tolist(), total.tolist(), strict=True))
    return [listed[low:high] for low, high in pairwise(bounds)]


def _assigned(near: list[list[tuple[int, int]]], count: int) -> IntArray:
    """Return a tone for each stretch: that first whose choice is clearest, then improved."""
    tones = [-1] * len(near)
    costs = [[0] * count for _ in near]
    for start in range(len(near)):
        heap = [(0, start)]
        while heap:
            _, here = heapq.heappop(heap)
            if tones[here] >= 0:
                continue
            tones[here] = costs[here].index(min(costs[here]))
            for other, cost in near[here]:
                costs[other][tones[here]] += cost
                if tones[other] < 0:
                    ranked = sorted(costs[other])
                    heapq.heappush(heap, (ranked[0] - ranked[1], other))
    for _ in range(_SWEEPS_tones):
        moved = False
        for here, own in enumerate(costs):
            best = own.index(min(own))
            if own[best] < own[tones[here]]:
                for other, cost in near[here]:
                    costs[other][tones[here]] -= cost
                    costs[other][best] += cost
                tones[here], moved = best, True
        if not moved:
            break
    return np.array(tones, dtype=np.int64)
