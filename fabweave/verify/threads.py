"""Lay walks of the mesh along threads, and find pieces' stations along them."""

from collections import Counter, defaultdict

from fabweave.verify.crossing_map import CrossingMap, Piece, Thread
from fabweave.verify.walks import (
    Pass,
    Walk,
    WovenMesh,
    canonical,
    edge_keys,
    match_walk,
    trace_walks,
)


def edge_of_crossings(plan: CrossingMap, mesh: WovenMesh) -> dict[int, int]:
    """Return the edge (its lesser side) of each crossing that lies on an inner edge."""
    ends = {
        frozenset((int(mesh.corner[side]), int(mesh.corner[mesh.next[side]]))): int(side)
        for side in mesh.inner
    }
    found = {crossing.id: ends.get(frozenset(crossing.edge)) for crossing in plan.crossings}
    return {key: side for key, side in found.items() if side is not None}


def thread_passes(
    plan: CrossingMap, mesh: WovenMesh, edges: dict[int, int]
) -> tuple[dict[int, tuple[Pass, ...]], list[Walk]]:
    """Lay the mesh's walks along the threads.

    Returns
    -------
    passes : dict
        For each thread that is a walk of the mesh, its passes in the thread's order.
    rest : list of Walk
        The walks that no thread takes.
    """
    keys = edge_keys(mesh)
    shelf: dict[tuple[bool, tuple[int, ...]], list[Walk]] = defaultdict(list)
    for walk in trace_walks(mesh):
        form = canonical([int(keys[step.side]) for step in walk.passes], walk.closed)[0]
        shelf[walk.closed, form].append(walk)
    result: dict[int, tuple[Pass, ...]] = {}
    for thread in plan.threads:
        claimed = [edges.get(crossing, -1) for crossing in thread.crossings]
        # No walk passes an edge more than twice; this also keeps the search short.
        if max(Counter(claimed).values(), default=0) > 2:
            continue
        walks = shelf.get((thread.closed, canonical(claimed, thread.closed)[0]))
        if walks:
            laid = match_walk(claimed, walks.pop(), keys, mesh)
            if laid is not None:
                result[thread.id] = laid
    return result, [walk for walks in shelf.values() for walk in walks]


def station_run(thread: Thread, piece: Piece) -> int | None:
    """Return where along its thread a piece's stations begin; None if they are no run of it.

    Where the thread passes the first crossing twice, the over flag decides.
    """
    count, size = len(thread.crossings), len(piece.stations)
    limit = count + 1 if thread.closed else count
    if not 0 < size <= limit:
        return None
    found: list[tuple[bool, int]] = []
    for start in range(count):
        if thread.crossings[start] != piece.stations[0].crossing:
            continue
        if not thread.closed and start + size > count:
            continue
        if all(
            thread.crossings[(start + at) % count] == station.crossing
            for at, station in enumerate(piece.stations)
        ):
            found.append((thread.over[start] != piece.stations[0].over, start))
    return min(found)[1] if found else None
