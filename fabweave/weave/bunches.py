"""Part the threads into bunches, sets of threads that do not cross one another."""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.mesh.topology import solve_parity
from fabweave.weave.threads import Threads

#: The vertices next to each vertex, in rising order.
Neighbours = Sequence[Sequence[int]]


@dataclass(frozen=True)
class Colouring:
    """Colours of vertices, and how few there could be.

    Parameters
    ----------
    colours : tuple of int
        The colour of each vertex, 0 upwards.
    at_least : int
        No colouring has fewer colours: a clique of this size was found, or a search was complete.
    """

    colours: tuple[int, ...]
    at_least: int


def colour_graph(neighbours: Neighbours, *, effort: int = 2_000_000) -> Colouring:
    """Colour a graph so that neighbours differ, with as few colours as can be found.

    First by saturation (DSATUR), then by emptying the smallest classes along Kempe chains, then
    by exhaustive search below that, down to the largest clique found. The result depends on
    nothing but the graph and the effort.

    Parameters
    ----------
    neighbours : sequence of sequences of int
        The vertices next to each; symmetric, without loops.
    effort : int
        How many vertices each of the searches (for a clique, along chains, exhaustive) may look
        at.

    Returns
    -------
    Colouring

    References
    ----------
    Brélaz, "New methods to color the vertices of a graph", CACM 22(4), 1979.

    Examples
    --------
    >>> pentagon = [[1, 4], [0, 2], [1, 3], [2, 4], [0, 3]]
    >>> found = colour_graph(pentagon)
    >>> max(found.colours) + 1, found.at_least
    (3, 3)
    """
    if not neighbours:
        return Colouring((), 0)
    clique = find_clique(neighbours, effort=effort)
    colours = _by_saturation(neighbours)
    at_least = len(clique)
    if max(colours) + 1 > at_least:
        colours = _without_rare_colours(neighbours, colours, effort)
    while max(colours) + 1 > at_least:
        fewer, effort = _with_colours(neighbours, max(colours), clique, effort)
        if fewer is None:
            # With effort left, the search was complete: one colour fewer is not enough.
            at_least = max(colours) + 1 if effort > 0 else at_least
            break
        colours = fewer
    return Colouring(tuple(colours), at_least)


def find_clique(neighbours: Neighbours, *, effort: int) -> list[int]:
    """Return the largest set of vertices found that are all next to one another.

    Branch and bound, with a greedy colouring of the candidates as the bound.

    References
    ----------
    Tomita, Seki, "An efficient branch-and-bound algorithm for finding a maximum clique", 2003.
    """
    masks = [_mask(row, len(neighbours)) for row in neighbours]
    best: list[int] = [0]
    # Vertices with few neighbours first: what remains for the late ones is small and dense.
    order = sorted(range(len(masks)), key=lambda vertex: (len(neighbours[vertex]), vertex))
    later = (1 << len(masks)) - 1
    for vertex in order:
        later &= ~(1 << vertex)
        candidates = masks[vertex] & later
        if candidates.bit_count() + 1 <= len(best):
            continue
        stack = [([vertex], _bounded(masks, candidates))]
        while stack and effort > 0:
            members, rest = stack[-1]
            if not rest or len(members) + rest[-1][1] <= len(best):
                stack.pop()
                continue
            chosen, _, among = rest.pop()
            effort -= 1 + len(rest)
            larger = [*members, chosen]
            if len(larger) > len(best):
                best = larger
            if masks[chosen] & among:
                stack.append((larger, _bounded(masks, masks[chosen] & among)))
    return best


def _mask(row: Sequence[int], size: int) -> int:
    """Return a number whose bits are set at the given vertices."""
    bits = np.zeros(size, dtype=np.uint8)
    bits[list(row)] = 1
    return int.from_bytes(np.packbits(bits, bitorder="little").tobytes(), "little")


def _bounded(masks: list[int], candidates: int) -> list[tuple[int, int, int]]:
    """Return the candidates in order of a greedy colouring: vertex, its colour, those up to it."""
    bounded: list[tuple[int, int, int]] = []
    left, upto, colour = candidates, 0, 0
    while left:
        colour += 1
        free = left
        while free:
            vertex = (free & -free).bit_length() - 1
            free &= ~((1 << vertex) | masks[vertex])
            left &= ~(1 << vertex)
            upto |= 1 << vertex
            bounded.append((vertex, colour, upto))
    return bounded


def _by_saturation(neighbours: Neighbours) -> list[int]:
    """Colour greedily, the vertex whose neighbours have most colours first."""
    colours = [-1] * len(neighbours)
    seen: list[set[int]] = [set() for _ in neighbours]
    heap = [(0, -len(row), vertex) for vertex, row in enumerate(neighbours)]
    heapq.heapify(heap)
    while heap:
        saturation, _, vertex = heapq.heappop(heap)
        if colours[vertex] >= 0 or -saturation < len(seen[vertex]):
            continue
        colours[vertex] = _first_free(seen[vertex])
        for other in neighbours[vertex]:
            if colours[other] < 0 and colours[vertex] not in seen[other]:
                seen[other].add(colours[vertex])
                heapq.heappush(heap, (-len(seen[other]), -len(neighbours[other]), other))
    return colours


def _first_free(taken: set[int]) -> int:
    """Return the smallest number that is not taken."""
    return next(number for number in range(len(taken) + 1) if number not in taken)


def _without_rare_colours(neighbours: Neighbours, colours: list[int], effort: int) -> list[int]:
    """Empty the smallest classes along Kempe chains for as long as that succeeds."""
    while True:
        count = max(colours) + 1
        sizes = [colours.count(colour) for colour in range(count)]
        rare = min(range(count), key=lambda colour: (sizes[colour], -colour))
        trial = list(colours)
        for vertex in [vertex for vertex, colour in enumerate(colours) if colour == rare]:
            effort = _leave(neighbours, trial, vertex, count, effort)
            if trial[vertex] == rare:
                return colours
        colours = [colour - (colour > rare) for colour in trial]


def _leave(neighbours: Neighbours, colours: list[int], vertex: int, count: int, effort: int) -> int:
    """Give a vertex another colour, if need be by swapping two colours along a chain.

    Returns the effort that is left; the vertex keeps its colour if none will do.
    """
    colour = colours[vertex]
    beside: dict[int, list[int]] = {}
    for other in neighbours[vertex]:
        beside.setdefault(colours[other], []).append(other)
    free = next((c for c in range(count) if c != colour and c not in beside), -1)
    if free >= 0:
        colours[vertex] = free
        return effort
    for first in (c for c in range(count) if c != colour):
        for second in (c for c in range(count) if c not in (colour, first)):
            chain, rest = set(beside[first]), list(beside[first])
            while rest and effort > 0:
                row = neighbours[rest.pop()]
                effort -= len(row)
                for other in row:
                    if colours[other] in (first, second) and other not in chain:
                        chain.add(other)
                        rest.append(other)
            if effort <= 0:
                return 0
            if not chain.isdisjoint(beside[second]):
                continue
            for other in chain:
                colours[other] = first + second - colours[other]
            colours[vertex] = first
            return effort
    return effort


def _with_colours(
    neighbours: Neighbours, count: int, clique: list[int], effort: int
) -> tuple[list[int] | None, int]:
    """Search for a colouring with ``count`` colours; return it and the effort that is left."""
    # A vertex with fewer neighbours than colours can wait: one colour will be free for it.
    degree = [len(row) for row in neighbours]
    waiting: list[int] = [vertex for vertex, size in enumerate(degree) if size < count]
    waits = [size < count for size in degree]
    for vertex in waiting:  # grows while it is walked
        for other in neighbours[vertex]:
            degree[other] -= 1
            if degree[other] < count and not waits[other]:
                waits[other] = True
                waiting.append(other)
    colours = [-1] * len(neighbours)
    core = {vertex for vertex, wait in enumerate(waits) if not wait}
    first = [vertex for vertex in clique if vertex in core]
    found, effort = _exhaust(neighbours, core, first, count, colours, effort)
    if not found:
        return None, effort
    for vertex in reversed(waiting):
        colours[vertex] = _first_free({colours[other] for other in neighbours[vertex]} - {-1})
    return colours, effort


def _exhaust(
    neighbours: Neighbours,
    core: set[int],
    first: list[int],
    count: int,
    colours: list[int],
    effort: int,
) -> tuple[bool, int]:
    """Colour the core by backtracking, the most bounded vertex first, those of a clique at once."""
    blocked = {vertex: [0] * count for vertex in core}
    saturation = dict.fromkeys(core, 0)
    left = set(core)

    def put(vertex: int, colour: int, step: int) -> None:
        colours[vertex] = colour if step > 0 else -1
        for other in neighbours[vertex]:
            if other in blocked:
                before = blocked[other][colour]
                blocked[other][colour] = before + step
                saturation[other] += (before + step > 0) - (before > 0)

    stack: list[list[int]] = []  # vertex, the next colour to try, colours used before it
    used = 0
    while left or stack:
        if not left:
            return True, effort
        effort -= len(left)
        if effort <= 0:
            return False, 0
        vertex = (
            first[len(stack)]
            if len(stack) < len(first)
            else max(left, key=lambda v: (saturation[v], len(neighbours[v]), -v))
        )
        left.discard(vertex)
        stack.append([vertex, 0, used])
        while stack:
            vertex, colour, used = stack[-1]
            # A colour that is new is as good as any other new one.
            free = (c for c in range(colour, min(used + 1, count)) if not blocked[vertex][c])
            choice = next(free, -1)
            if choice >= 0:
                stack[-1][1] = choice + 1
                put(vertex, choice, 1)
                used = max(used, choice + 1)
                break
            stack.pop()
            left.add(vertex)
            if not stack:
                return False, effort
            put(stack[-1][0], stack[-1][1] - 1, -1)
    return True, effort


#: How many threads the searches of ``colour_graph`` may look at; a few seconds at the most.
_EFFORT = 1_000_000


@frozen_value
class Bunches:
    """A partition of the threads into bunches.

    Parameters
    ----------
    bunch : (T,) int array
        The bunch of each thread, 0 upwards; with more than two, the first has most crossings.
    at_least : int
        No partition has fewer bunches: so many threads were found that all cross one another, or
        a search was complete.
    crosses_itself : (T,) bool array
        Threads that cross themselves. In their bunch they count as if they did not.
    """

    bunch: IntArray
    at_least: int
    crosses_itself: BoolArray

    @property
    def n_bunches(self) -> int:
        """Number of bunches."""
        return int(self.bunch.max(initial=-1)) + 1

    @property
    def fewest(self) -> bool:
        """Whether it is proved that there cannot be fewer."""
        return self.n_bunches == self.at_least

    @property
    def warp_and_weft(self) -> bool:
        """Whether there are two bunches, and no thread crosses itself."""
        return self.n_bunches == 2 and not self.crosses_itself.any()


def thread_graph(threads: Threads) -> sparse.csr_array:
    """Return which threads cross which: a symmetric (T, T) matrix that counts crossings.

    A thread that crosses itself has an entry on the diagonal, two for each crossing.
    """
    by_crossing = np.argsort(threads.crossing, kind="stable")
    pairs = threads.thread_of_pass[by_crossing].reshape(-1, 2)
    rows = np.concatenate((pairs[:, 0], pairs[:, 1]))
    columns = np.concatenate((pairs[:, 1], pairs[:, 0]))
    size = threads.n_threads
    counts = np.ones(len(rows), dtype=np.int64)
    return sparse.coo_array((counts, (rows, columns)), shape=(size, size)).tocsr()


def count_bodies(threads: Threads) -> int:
    """Count the parts of a weave that no crossing joins: each falls away from the others.

    Threads without a crossing are left out.

    Parameters
    ----------
    threads : Threads

    Returns
    -------
    int
        One for a weave that hangs together.
    """
    number, label = csgraph.connected_components(thread_graph(threads), directed=False)
    return int(number - np.count_nonzero(~threads.woven)) if len(label) else 0


def find_bunches(threads: Threads) -> Bunches:
    """Part the threads into as few bunches as can be found, and say how few there could be.

    Two bunches, warp and weft, are found whenever two suffice. Otherwise the graph of threads
    is coloured: see ``colour_graph``.

    Parameters
    ----------
    threads : Threads
        The walks.

    Returns
    -------
    Bunches
        The same for the same threads.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects" (2011), section 6.1.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.threads import trace_threads
    >>> bunches = find_bunches(trace_threads(build_halfedges(parse_shape("shape:cube"))))
    >>> bunches.bunch.tolist(), bunches.fewest
    ([0, 1, 2, 3], True)
    """
    graph = thread_graph(threads)
    crosses_itself = np.asarray(graph.diagonal() > 0)
    two = _two_bunches(graph)
    if two is not None:
        return Bunches(two, len(np.unique(two)), crosses_itself)
    rows = [graph.indices[low:high].tolist() for low, high in pairwise(graph.indptr.tolist())]
    neighbours = [
        sorted(other for other in row if other != thread) for thread, row in enumerate(rows)
    ]
    colouring = colour_graph(neighbours, effort=_EFFORT)
    colours = np.array(colouring.colours, dtype=np.int64)
    return Bunches(_longest_first(colours, threads.lengths), colouring.at_least, crosses_itself)


def part_bunches(threads: Threads) -> IntArray:
    """Give each thread a bunch number, 0 upwards, so that threads of one bunch never cross.

    Returns
    -------
    (T,) int array
        Bunch numbers; see ``find_bunches``.
    """
    return find_bunches(threads).bunch


def _longest_first(colours: IntArray, lengths: IntArray) -> IntArray:
    """Renumber bunches by how many passes they have, the most first."""
    total = np.bincount(colours, weights=lengths)
    return np.argsort(np.argsort(-total, kind="stable"))[colours]


def _two_bunches(graph: sparse.csr_array) -> IntArray | None:
    """Two-colour the graph, or return None: connected components of its double cover."""
    entries = graph.tocoo()
    apart = entries.row != entries.col
    first, second = (ends[apart].astype(np.int64) for ends in (entries.row, entries.col))
    sides = solve_parity(graph.shape[0], first, second, np.ones(len(first), dtype=bool))
    return None if sides.odd_ring else sides.opposite.astype(np.int64)
