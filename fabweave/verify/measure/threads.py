"""Lay walks of the mesh along threads, and find pieces' stations along them."""

from collections import Counter, defaultdict
from collections.abc import Hashable, Iterable

from fabweave.verify.crossing_map import CrossingMap, Piece, Thread
from fabweave.verify.measure.course import follows_walk, measure_panels
from fabweave.verify.measure.walks import (
    LoadedMesh,
    Pass,
    Walk,
    canonical,
    edge_keys,
    lay_walk,
    trace_walks,
)
from fabweave.verify.read.glb import Strip


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
    model: dict[str, Strip] | None = None,
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
        form = canonical([int(keys[step.side]) for step in walk.passes], walk.closed)[0]
        shelf[walk.closed, form].append(walk)
    result: dict[int, tuple[Pass, ...]] = {}
    for thread in plan.threads:
        claimed = [edges.get(crossing, -1) for crossing in thread.crossings]
        # No walk passes an edge more than twice; this also keeps the search short.
        if max(Counter(claimed).values(), default=0) > 2:
            continue
        walks = shelf.get((thread.closed, canonical(claimed, thread.closed)[0]), [])
        ways = [
            (at, passes)
            for at, walk in enumerate(walks)
            for passes in lay_walk(claimed, walk, keys, mesh)
        ]
        if ways:
            at, result[thread.id] = _followed(ways, thread, mesh, model or {})
            walks.pop(at)
    return result, [walk for walks in shelf.values() for walk in walks]


def _followed(
    ways: list[tuple[int, tuple[Pass, ...]]],
    thread: Thread,
    mesh: LoadedMesh,
    model: dict[str, Strip],
) -> tuple[int, tuple[Pass, ...]]:
    """Return the way that the thread's ribbon follows at most crossings; the first if equal."""
    strip = model.get(thread.label)
    if len(ways) == 1 or not thread.crossings:
        return ways[0]
    if strip is None or len(strip.entry) != len(thread.crossings):
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


def groups_of(pairs: Iterable[tuple[Hashable, Hashable]]) -> dict[Hashable, Hashable]:
    """Return for each thing one that stands for all that hang together with it, pair by pair.

    Examples
    --------
    >>> group = groups_of([("a", 1), ("b", 2), (2, "c")])
    >>> group["b"] == group["c"] != group["a"]
    True
    """
    above: dict[Hashable, Hashable] = {}

    def top(thing: Hashable) -> Hashable:
        while above.setdefault(thing, thing) != thing:
            above[thing] = above[above[thing]]
            thing = above[thing]
        return thing

    for one, other in pairs:
        above[top(one)] = top(other)
    return {thing: top(thing) for thing in above}
