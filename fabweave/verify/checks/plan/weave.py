"""Check threads, over and under, and the pattern of the weave."""

from collections import Counter, defaultdict

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Strand
from fabweave.verify.measure.fabric import check_fabric
from fabweave.verify.measure.twill import broken_conditions
from fabweave.verify.measure.walks import LoadedMesh, Pass, edge_keys
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

_TWILLS = ("twill", "triaxial")


def check_walks(job: Job, tally: Tally) -> None:
    """Check that threads are the walks of the mesh and crossings its inner edges."""
    plan, mesh = job.map, job.mesh
    if plan is None or mesh is None:
        return
    tally.expect(
        job.boundary in ("end", "turn"),
        f"job.toml says that threads {job.boundary!r} at the boundary, not 'end' or 'turn'",
    )
    edges = job.edges
    for crossing in plan.crossings:
        tally.expect(
            crossing.id in edges,
            f"crossing {crossing.id}: {crossing.edge} is no inner edge of the woven mesh",
        )
    taken = Counter(edges.values())
    for side in mesh.inner:
        count = taken.get(int(side), 0)
        tally.expect(
            count == 1,
            f"edge {_edge_name(mesh, int(side))} has {count} crossings instead of one",
        )
    passes, rest = job.passes
    for thread in plan.threads:
        kind = "closed" if thread.closed else "open"
        tally.expect(
            thread.id in passes,
            f"thread {thread.label} ({kind}, {len(thread.crossings)} crossings) is no walk of the "
            "woven mesh that another thread has not taken",
        )
    for walk in rest:
        first = _edge_name(mesh, walk.passes[0].side) if walk.passes else "none"
        tally.fail(
            f"a walk of {len(walk.passes)} crossings (first edge {first}) is no thread of the map"
        )


def _edge_name(mesh: LoadedMesh, side: int) -> str:
    """Name an edge by its vertices."""
    return f"{mesh.corner[side]}-{mesh.corner[mesh.next[side]]}"


def check_over_under(job: Job, tally: Tally) -> None:
    """Check that threads, crossings and stations agree on who is on top."""
    plan = job.map
    if plan is None:
        return
    strands: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for thread in plan.threads:
        for key, over in zip(thread.crossings, thread.over, strict=False):
            strands[key].append((thread.id, over))
    named: dict[tuple[str, int], tuple[int, bool]] = {}
    for crossing in plan.crossings:
        passes = sorted(strands[crossing.id], key=lambda one: not one[1])
        tally.expect(
            [over for _, over in passes] == [True, False],
            f"crossing {crossing.id} is passed {len(passes)} times, "
            f"{sum(over for _, over in passes)} of them over",
        )
        tally.expect(
            [thread for thread, _ in passes] == [crossing.over.thread, crossing.under.thread],
            f"crossing {crossing.id} names threads {crossing.over.thread} over "
            f"{crossing.under.thread}, but the threads' flags say "
            f"{' over '.join(str(thread) for thread, _ in passes)}",
        )
        for strand, over in ((crossing.over, True), (crossing.under, False)):
            named[strand.piece, strand.station] = (crossing.id, over)
            _check_strand(plan, crossing.id, strand, over, tally)
    _check_stations(plan, named, tally)


def _check_strand(
    plan: CrossingMap, crossing: int, strand: Strand, over: bool, tally: Tally
) -> None:
    """Check that the piece and station that a crossing names are what it says."""
    piece = plan.piece[strand.piece]
    station = piece.stations[strand.station]
    side = "over" if over else "under"
    tally.expect(
        piece.thread == strand.thread and station.crossing == crossing and station.over == over,
        f"crossing {crossing} names station {strand.station} of piece {piece.id} as {side}, but "
        f"that is crossing {station.crossing} of thread {piece.thread}, "
        f"{'over' if station.over else 'under'}",
    )


def _check_stations(
    plan: CrossingMap, named: dict[tuple[str, int], tuple[int, bool]], tally: Tally
) -> None:
    """Check that every station is named by its crossing, and the partners mutually."""
    for piece in plan.pieces:
        for at, station in enumerate(piece.stations):
            where = f"piece {piece.id}, station {at} (crossing {station.crossing})"
            crossing = plan.crossing[station.crossing]
            own = crossing.over if station.over else crossing.under
            other = crossing.under if station.over else crossing.over
            begins = False
            if at == 0 and station.joint is not None and station.joint in plan.joint:
                # Where a piece begins, the crossing names the piece that ends there.
                begins = plan.joint[station.joint].pieces == (own.piece, piece.id)
            tally.expect(
                named.get((piece.id, at)) == (station.crossing, station.over)
                or (begins and own.thread == piece.thread),
                f"{where} is {'over' if station.over else 'under'}, but the crossing names "
                f"station {own.station} of piece {own.piece} there",
            )
            tally.expect(
                station.partner == other.piece,
                f"{where} has partner {station.partner}, but the crossing names {other.piece}",
            )


def check_pattern(job: Job, tally: Tally) -> None:
    """Check the pattern that is claimed against over and under along the walks."""
    plan, mesh = job.map, job.mesh
    if plan is None or mesh is None:
        return
    passes, _ = job.passes
    for thread in plan.threads:
        if thread.id not in passes:
            tally.fail(f"thread {thread.label} is not checked, because it is no walk of the mesh")
    sense, torn = _senses(plan, mesh, passes)
    tally.expect(not torn, f"{len(torn)} crossings have two strands over or two under: {torn[:4]}")
    if plan.pattern == "plain":
        _check_plain(plan, sense, tally)
        counts = (0, 0, 0)
    elif plan.pattern in _TWILLS:
        counts = broken_conditions(plan, mesh, job.edges, passes, sense, tally)
    else:
        check_fabric(plan, mesh, job.edges, edge_keys(mesh).tolist(), tally)
        counts = (0, 0, 0)
    for name, claimed, counted in zip(("edge", "face", "vertex"), plan.broken, counts, strict=True):
        tally.expect(
            claimed == counted,
            f"{claimed} broken {name} conditions are claimed, but there are {counted}",
        )
    tally.expect(
        plan.exact == (sum(counts) == 0),
        f"exact is {plan.exact}, but {sum(counts)} conditions are broken",
    )


def _senses(
    plan: CrossingMap, mesh: LoadedMesh, passes: dict[int, tuple[Pass, ...]]
) -> tuple[dict[int, bool], list[int]]:
    """Return each edge's twist sense (true: forward strand on top) and the torn crossings."""
    keys = edge_keys(mesh)
    sense: dict[int, bool] = {}
    torn = []
    for thread in plan.threads:
        steps = passes.get(thread.id, ())
        for step, over, crossing in zip(steps, thread.over, thread.crossings, strict=False):
            value = step.forward == over
            if sense.setdefault(int(keys[step.side]), value) != value:
                torn.append(crossing)
    return sense, torn


def _check_plain(plan: CrossingMap, sense: dict[int, bool], tally: Tally) -> None:
    """Check that every thread alternates and that all crossings have one helical sense."""
    for thread in plan.threads:
        flags = np.array(thread.over, dtype=bool)
        following = np.roll(flags, -1) if thread.closed else flags[1:]
        same = np.flatnonzero(flags[: len(following)] == following)
        tally.expect(
            len(same) == 0,
            f"thread {thread.label} does not alternate over and under at {len(same)} places, "
            f"first after crossing {thread.crossings[same[0]] if len(same) else None}",
        )
    tally.count(len(sense))
    ones = sum(sense.values())
    if 0 < ones < len(sense):
        tally.fail(f"{ones} crossings twist one way and {len(sense) - ones} the other")
