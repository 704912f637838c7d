"""Lay the walks of the woven mesh along the threads of the crossing map."""

from collections import Counter, defaultdict

from fabweave.verify.crossing_map import CrossingMap
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
    plan: CrossingMap, mesh: WovenMesh
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
    edges = edge_of_crossings(plan, mesh)
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
