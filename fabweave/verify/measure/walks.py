"""Read the woven mesh and trace the straight-ahead walks of its medial graph.

An *arc* is a corner of a face: it joins the middles of the two edges that meet there. Arc ``c``
has two ends, ``2 c`` on the edge that enters the corner and ``2 c + 1`` on the edge that leaves
it. Four arcs meet at the middle of an inner edge; a strand goes straight on into the opposite one.
"""

from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fabweave.verify.crossing_map import CrossingMap, Piece, Thread
from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.mesh import LoadedMesh, edge_keys


@dataclass(frozen=True)
class Pass:
    """A strand crossing an edge.

    ``side`` is the mesh side of the face it comes from; ``forward`` says that it comes from the
    corner before that side, so from near the side's start. Both strands at an edge differ in it,
    and it is the same for both walking directions.
    """

    side: int
    forward: bool


@dataclass(frozen=True)
class Walk:
    """A straight-ahead walk: whether it returns, and its passes in order."""

    closed: bool
    passes: tuple[Pass, ...]


def trace_walks(mesh: LoadedMesh, *, turning: bool = False) -> list[Walk]:
    """Trace every straight-ahead walk once, those that end at the boundary first.

    A corner between two boundary edges is an open walk without passes. On a closed mesh the
    passes are two for each edge. With ``turning``, the two arcs at the middle of a boundary edge
    join, so that every walk returns.
    """
    n_arcs = len(mesh.corner)
    opposite = np.full(2 * n_arcs, -1, dtype=np.int64)
    sides = np.flatnonzero(mesh.twin >= 0)
    twins = mesh.twin[sides]
    opposite[2 * mesh.prev[sides] + 1] = 2 * mesh.prev[twins] + 1
    opposite[2 * sides] = 2 * twins
    rim = np.flatnonzero(mesh.twin < 0)
    if turning:
        opposite[2 * mesh.prev[rim] + 1] = 2 * rim
        opposite[2 * rim] = 2 * mesh.prev[rim] + 1
    inner = (mesh.twin >= 0).tolist()
    jump = opposite.tolist()
    following = mesh.next.tolist()
    seen = [False] * n_arcs

    def follow(arc: int, leaving: int) -> list[Pass]:
        """Walk from an arc through one of its ends until a boundary or a walked arc."""
        passes: list[Pass] = []
        while True:
            seen[arc] = True
            entering = jump[leaving]
            if entering < 0:
                return passes
            forward = leaving % 2 == 1
            side = following[arc] if forward else arc
            if inner[side]:
                passes.append(Pass(side, forward))
            arc, leaving = entering // 2, entering ^ 1
            if seen[arc]:
                return passes

    walks = []
    for end in np.flatnonzero(opposite < 0).tolist():
        if not seen[end // 2]:
            walks.append(Walk(False, tuple(follow(end // 2, end ^ 1))))
    for arc in range(n_arcs):
        if not seen[arc]:
            walks.append(Walk(True, tuple(follow(arc, 2 * arc + 1))))
    return walks


def turns_back(passes: Sequence[Pass], mesh: LoadedMesh) -> Flags:
    """Say after which passes a strand comes to the boundary, to turn back or end there.

    Having crossed a side forward, a strand goes on to the side before that in the face beyond, and
    otherwise to the one after.
    """
    beyond = mesh.twin[np.array([step.side for step in passes], dtype=np.int64)]
    forward = np.array([step.forward for step in passes], dtype=np.bool_)
    onward = np.where(forward, mesh.prev[beyond], mesh.next[beyond])
    return np.asarray(mesh.twin[onward] < 0)


def turned(step: Pass, mesh: LoadedMesh) -> Pass:
    """Return the same pass walked the other way."""
    return Pass(int(mesh.twin[step.side]), step.forward)


def lay_walk(
    claimed: Sequence[int], walk: Walk, keys: Ints, mesh: LoadedMesh
) -> Iterator[tuple[Pass, ...]]:
    """Lay a walk along a claimed sequence of edges, in every way in which the edges agree.

    Nearly always there is one way or none. There are more where the sequence reads the same
    backwards: a walk over one edge only, or a short ring.

    Yields
    ------
    tuple of Pass
        The passes in the claimed order and direction.
    """
    wanted = list(claimed)
    for passes in (walk.passes, tuple(turned(step, mesh) for step in reversed(walk.passes))):
        edges = [int(keys[step.side]) for step in passes]
        starts = [0]
        if walk.closed and wanted:
            starts = [at for at, edge in enumerate(edges) if edge == wanted[0]]
        for start in starts:
            if edges[start:] + edges[:start] == wanted:
                yield passes[start:] + passes[:start]


@dataclass(frozen=True, eq=False)
class Panels:
    """The crossing panels of one thread: middle, walking direction, and how both ends look outward.

    ``outward`` has, for the first and the last rung, the area between the walking direction and
    the way from right to left, as a vector: their mean is that of the panel.
    """

    centre: Floats
    outward: Floats
    along: Floats


def measure_panels(strip: Strip) -> Panels:
    """Measure the crossing panels of a strip."""
    start, end = strip.rungs[strip.entry], strip.rungs[strip.exit]
    along = (end - start).mean(axis=1)
    across = np.stack((start[:, 1] - start[:, 0], end[:, 1] - end[:, 0]), axis=1)
    return Panels((start + end).mean(axis=1) / 2.0, np.cross(along[:, None], across), along)


@dataclass(frozen=True, eq=False)
class EdgeQuads:
    """What the mesh says about a crossing's edge, seen from one side of it.

    The size is the sum of the corners' distances from the middle: that of both diagonals where
    they halve each other, and more in a dart, whose diagonals may lie far from each other.
    """

    normal: Floats
    middle: Floats
    size: Floats


def _diagonals(mesh: LoadedMesh, sides: Ints) -> tuple[tuple[Floats, Floats], ...]:
    """Return both ends of each edge, and the centres of the face on this side and beyond."""
    return (
        (mesh.vertices[mesh.corner[sides]], mesh.vertices[mesh.corner[mesh.next[sides]]]),
        (mesh.centres[mesh.face[sides]], mesh.centres[mesh.face[mesh.twin[sides]]]),
    )


def edge_quads(mesh: LoadedMesh, sides: Ints) -> EdgeQuads:
    """Return normals, middles and sizes for sides of inner edges."""
    (tail, head), (here, there) = _diagonals(mesh, sides)
    area = np.cross(head - tail, here - there)
    corners = np.stack((tail, here, head, there), axis=1)
    middle = corners.mean(axis=1)
    return EdgeQuads(
        normal=area / np.maximum(np.linalg.norm(area, axis=1), 1e-300)[:, None],
        middle=middle,
        size=np.linalg.norm(corners - middle[:, None], axis=2).sum(axis=1),
    )


def follows_walk(panels: Panels, passes: tuple[Pass, ...], mesh: LoadedMesh) -> Flags:
    """Say at which crossings a ribbon runs across the edge as the passes of a walk do.

    It has to run to the face beyond; and from near the side's start towards its end, or the other
    way. Where on the edge it does so, and how askew, does not matter.
    """
    sides = np.array([step.side for step in passes], dtype=np.int64)
    forward = np.array([step.forward for step in passes], dtype=np.bool_)
    (tail, head), (here, there) = _diagonals(mesh, sides)
    edge, beyond = head - tail, there - here
    area = np.cross(edge, beyond)
    # Shares of both directions in the panel's, times a positive factor.
    along_edge = np.einsum("ij,ij->i", np.cross(panels.along, beyond), area)
    to_beyond = np.einsum("ij,ij->i", np.cross(edge, panels.along), area)
    return (to_beyond > 0.0) & np.where(forward, along_edge > 0.0, along_edge < 0.0)


def thread_strips(plan: CrossingMap, model: dict[str, Strip]) -> dict[int, Strip]:
    """Return the strip of each thread, if it has a panel for each crossing."""
    strips = {}
    for thread in plan.threads:
        strip = model.get(thread.label)
        if strip is not None and 0 < len(strip.entry) == len(thread.crossings):
            strips[thread.id] = strip
    return strips


def edge_of_crossings(plan: CrossingMap, mesh: LoadedMesh) -> dict[int, int]:
    """Return the edge (its lesser side) of each crossing that lies on an inner edge."""
    ends = {
        frozenset((int(mesh.corner[side]), int(mesh.corner[mesh.next[side]]))): int(side)
        for side in mesh.inner
    }
    sides = {crossing.id: ends.get(frozenset(crossing.edge)) for crossing in plan.crossings}
    return {key: side for key, side in sides.items() if side is not None}


def thread_passes(
    plan: CrossingMap,
    mesh: LoadedMesh,
    edges: dict[int, int],
    strips: dict[int, Strip],
    *,
    turning: bool = False,
) -> tuple[dict[int, tuple[Pass, ...]], list[Walk]]:
    """Lay the mesh's walks along the threads.

    A sequence of crossings leaves open which walk is meant, or in which direction, where several
    read the same (walks over a single edge do). Then the one that the model's ribbon follows is
    taken. With ``turning``, walks turn back at the boundary.

    Returns
    -------
    passes : dict
        For each thread that is a walk of the mesh, its passes in the thread's order.
    rest : list of Walk
        The walks that no thread takes.
    """
    keys = edge_keys(mesh)
    shelf: dict[tuple[bool, tuple[int, ...]], list[Walk]] = defaultdict(list)
    for walk in trace_walks(mesh, turning=turning):
        form = tuple(sorted(int(keys[step.side]) for step in walk.passes))
        shelf[walk.closed, form].append(walk)
    result: dict[int, tuple[Pass, ...]] = {}
    for thread in plan.threads:
        claimed = [edges.get(crossing, -1) for crossing in thread.crossings]
        walks = shelf.get((thread.closed, tuple(sorted(claimed))), [])
        ways = [
            (at, passes)
            for at, walk in enumerate(walks)
            for passes in lay_walk(claimed, walk, keys, mesh)
        ]
        if ways:
            at, result[thread.id] = _followed(ways, strips.get(thread.id), mesh)
            walks.pop(at)
    return result, [walk for walks in shelf.values() for walk in walks]


def _followed(
    ways: list[tuple[int, tuple[Pass, ...]]], strip: Strip | None, mesh: LoadedMesh
) -> tuple[int, tuple[Pass, ...]]:
    """Return the way that the thread's ribbon follows at most crossings; the first if equal."""
    if len(ways) == 1 or strip is None:
        return ways[0]
    panels = measure_panels(strip)
    return max(ways, key=lambda way: int(follows_walk(panels, way[1], mesh).sum()))


def station_run(thread: Thread, piece: Piece) -> int | None:
    """Return where along its thread a piece's stations begin; None if they are no run of it.

    Where the thread passes the first crossing twice, the over flag decides.
    """
    count, size = len(thread.crossings), len(piece.stations)
    limit = count + 1 if thread.closed else count
    if not 0 < size <= limit:
        return None
    starts: list[tuple[bool, int]] = []
    for start in thread.places.get(piece.stations[0].crossing, ()):
        if not thread.closed and start + size > count:
            continue
        if all(
            thread.crossings[(start + at) % count] == station.crossing
            for at, station in enumerate(piece.stations)
        ):
            starts.append((thread.over[start] != piece.stations[0].over, start))
    return min(starts)[1] if starts else None


def joined(links: Ints, count: int) -> Ints:
    """Return numbers, (count,), that those have alike which links, (N, 2), join."""
    ones = np.ones(len(links), dtype=np.float64)
    graph = coo_array((ones, (links[:, 0], links[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def groups_of(pairs: Iterable[tuple[Hashable, Hashable]]) -> dict[Hashable, int]:
    """Return for each thing a number that all have which hang together with it, pair by pair.

    Examples
    --------
    >>> group = groups_of([("a", 1), ("b", 2), (2, "c")])
    >>> group["b"] == group["c"] != group["a"]
    True
    """
    number: dict[Hashable, int] = {}
    links = [[number.setdefault(thing, len(number)) for thing in pair] for pair in pairs]
    groups = joined(np.array(links, dtype=np.int64).reshape(-1, 2), len(number))
    return dict(zip(number, groups.tolist(), strict=True))
