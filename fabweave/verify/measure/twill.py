"""Count the broken conditions of a 2/2 twill."""

from collections.abc import Sequence

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.walks import LoadedMesh, Pass, edge_keys
from fabweave.verify.statement import Tally


def broken_conditions(
    plan: CrossingMap,
    mesh: LoadedMesh,
    edges: dict[int, int],
    passes: dict[int, tuple[Pass, ...]],
    sense: dict[int, bool],
    tally: Tally,
) -> tuple[int, int, int]:
    """Count the broken edge, face and vertex conditions of a 2/2 twill.

    Three consecutive edges of a thread want the first and last to differ. Four consecutive edges
    of a face or around a vertex want: where the middle two differ, the outer two agree. Windows
    with a boundary edge do not count, also where a thread turns back at one; nor do those of
    triangles and three-valent vertices, whose outer edges are the same.

    References
    ----------
    Akleman et al., "Cyclic twill-woven objects" (2011), definition 5.1.
    """
    keys = edge_keys(mesh).tolist()
    broken = 0
    for thread in plan.threads:
        twists = [sense.get(edges.get(crossing, -1)) for crossing in thread.crossings]
        windows = _windows(twists, 3, thread.closed)
        straight = _straight(passes.get(thread.id, ()), mesh)
        whole = [
            window
            for at, window in enumerate(windows)
            if not straight or (straight[at] and straight[(at + 1) % len(straight)])
        ]
        tally.count(len(whole))
        broken += sum(a == c for a, _, c in whole)
    totals = [broken]
    for orbits in gap_orbits(mesh):
        broken = 0
        for orbit, closed in orbits:
            twists = [sense.get(keys[side]) for side in orbit]
            for run, ring in _inner_runs(twists, closed):
                windows = _windows(run, 4, ring) if len(run) >= 4 else []
                tally.count(len(windows))
                broken += sum(b != c and a != d for a, b, c, d in windows)
        totals.append(broken)
    return totals[0], totals[1], totals[2]


def _straight(steps: tuple[Pass, ...], mesh: LoadedMesh) -> list[bool]:
    """Return for each pass whether the next one follows without a turn at the boundary."""
    result = []
    for step, after in zip(steps, (*steps[1:], *steps[:1]), strict=True):
        across = int(mesh.twin[step.side])
        side = mesh.prev[across] if step.forward else mesh.next[across]
        result.append(after == Pass(int(side), not step.forward))
    return result


def gap_orbits(
    mesh: LoadedMesh,
) -> tuple[list[tuple[list[int], bool]], list[tuple[list[int], bool]]]:
    """Return the sides around each face, and those that leave each vertex, in turning order.

    Each comes with whether it closes; fans of sides at the boundary do not.
    """
    following, twin, previous = mesh.next.tolist(), mesh.twin.tolist(), mesh.prev.tolist()
    starts = np.flatnonzero(np.diff(mesh.face, prepend=-1)).tolist()
    # Turning around a vertex: the side before this one in its face, seen from across.
    turn = [twin[previous[side]] for side in range(len(following))]
    return [_orbit(start, following) for start in starts], _vertex_orbits(turn)


def _windows(
    values: Sequence[bool | None], size: int, closed: bool
) -> list[tuple[bool | None, ...]]:
    """Return all runs of consecutive values, around the end if closed."""
    count = len(values)
    starts = range(count if closed else count - size + 1)
    return [tuple(values[(at + k) % count] for k in range(size)) for at in starts]


def _orbit(start: int, following: Sequence[int]) -> tuple[list[int], bool]:
    """Follow a permutation from one place round to it."""
    orbit = [start]
    while (side := following[orbit[-1]]) != start:
        orbit.append(side)
    return orbit, True


def _vertex_orbits(turn: Sequence[int]) -> list[tuple[list[int], bool]]:
    """Return the sides that leave each vertex in turning order; fans at the boundary are open."""
    reached = np.zeros(len(turn), dtype=bool)
    inner = np.array([side for side in turn if side >= 0], dtype=np.int64)
    reached[inner] = True
    seen = [False] * len(turn)
    orbits = []
    for start in [*np.flatnonzero(~reached).tolist(), *range(len(turn))]:
        if seen[start]:
            continue
        orbit: list[int] = []
        side = start
        while side >= 0 and not seen[side]:
            seen[side] = True
            orbit.append(side)
            side = turn[side]
        orbits.append((orbit, side >= 0))
    return orbits


def _inner_runs(
    twists: Sequence[bool | None], closed: bool
) -> list[tuple[list[bool | None], bool]]:
    """Split a cycle or run at boundary edges, which have no twist."""
    if None not in twists:
        return [(list(twists), closed)]
    gap = twists.index(None)
    line = [*twists[gap + 1 :], *twists[:gap]] if closed else list(twists)
    runs: list[list[bool | None]] = [[]]
    for twist in line:
        if twist is None:
            runs.append([])
        else:
            runs[-1].append(twist)
    return [(run, False) for run in runs]
