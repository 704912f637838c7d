"""Give strands of one colour a few tones, so that those that cross can be told apart."""

import heapq
from itertools import pairwise

import numpy as np

from fabweave.core.arrays import IntArray, offsets_of
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.shades import crossing_pairs, stretches

#: Where two tones leave more than this share of the crossings alike, three are taken: a kagome
#: weave has three directions.
_MOST_ALIKE = 0.25
#: What a change of tone along a thread costs, where two strands alike at a crossing cost 4.
_CHANGE = 2
#: How often all stretches are looked at again.
_SWEEPS = 50


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
    near = _neighbours(apart[apart[:, 0] != apart[:, 1]], along, int(stretch.max()) + 1)
    for count in (2, 3):
        tone = _assigned(near, count)[stretch]
        below, above = tone[place[same, 0]], tone[place[same, 1]]
        alike = np.any(below[:, :, None] == above[:, None, :], axis=(1, 2))
        if np.count_nonzero(alike) <= _MOST_ALIKE * len(alike):
            break
    order = np.argsort(-np.bincount(tone.ravel(), minlength=count), kind="stable")
    return np.asarray(np.argsort(order, kind="stable")[tone])


def _neighbours(apart: IntArray, along: IntArray, count: int) -> list[list[tuple[int, int]]]:
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
    for _ in range(_SWEEPS):
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
