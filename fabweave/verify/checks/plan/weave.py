"""Check threads, over and under, and the pattern of the weave."""

from collections import Counter, defaultdict

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Strand
from fabweave.verify.measure.fabric import check_fabric
from fabweave.verify.measure.symmetry import count_rotations
from fabweave.verify.measure.twill import broken_conditions
from fabweave.verify.measure.walks import LoadedMesh, Pass, edge_keys
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Tally

_TWILLS = ("twill", "triaxial", "twists")


def check_walks(job: Job, tally: Tally) -> None:
    """Check that threads are the walks of the mesh and crossings its inner edges."""
    plan, mesh = required(job.map), required(job.mesh)
    tally.at("job.toml").expect(
        job.boundary in ("end", "turn"),
        f"threads {job.boundary!r} at the boundary, which is neither 'end' nor 'turn'",
    )
    edges = job.edges
    for crossing in plan.crossings:
        tally.at(f"crossing {crossing.id}").expect(
            crossing.id in edges, f"{crossing.edge} is no inner edge of the woven mesh"
        )
    taken = Counter(edges.values())
    for side in mesh.inner.tolist():
        place = tally.at(f"edge {_edge_name(mesh, side)}")
        place.equal("its number of crossings", taken.get(side, 0), 1)
    passes, rest = job.passes
    for thread in plan.threads:
        kind = "closed" if thread.closed else "open"
        tally.at(f"thread {thread.label}").expect(
            thread.id in passes,
            f"{kind}, with {len(thread.crossings)} crossings, it is no walk of the woven mesh that "
            "another thread has not taken",
        )
    for walk in rest:
        first = _edge_name(mesh, walk.passes[0].side) if walk.passes else "none"
        tally.fail(
            f"a walk of {len(walk.passes)} crossings (first edge {first}) is no thread of the map"
        )


def _edge_name(mesh: LoadedMesh, side: int) -> str:
    """Name an edge by its vertices."""
    return f"{mesh.corner[side]}-{mesh.corner[mesh.next[side]]}"


def _way(over: bool) -> str:
    """Return the word for how a strand lies."""
    return "over" if over else "under"


def check_over_under(job: Job, tally: Tally) -> None:
    """Check that threads, crossings and stations agree on who is on top."""
    plan = required(job.map)
    strands: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for thread in plan.threads:
        for key, over in zip(thread.crossings, thread.over, strict=False):
            strands[key].append((thread.id, over))
    named: dict[tuple[str, int], tuple[int, bool]] = {}
    for crossing in plan.crossings:
        place = tally.at(f"crossing {crossing.id}")
        passes = sorted(strands[crossing.id], key=lambda strand: not strand[1])
        place.equal("the way it is passed", [_way(over) for _, over in passes], ["over", "under"])
        place.equal(
            "threads over and under",
            [crossing.over.thread, crossing.under.thread],
            [thread for thread, _ in passes],
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
    tally.at(f"piece {piece.id}", f"station {strand.station}").equal(
        "its thread, crossing and way",
        (piece.thread, station.crossing, _way(station.over)),
        (strand.thread, crossing, _way(over)),
    )


def _check_stations(
    plan: CrossingMap, named: dict[tuple[str, int], tuple[int, bool]], tally: Tally
) -> None:
    """Check that every station is named by its crossing, and the partners mutually."""
    for piece in plan.pieces:
        for at, station in enumerate(piece.stations):
            place = tally.at(f"piece {piece.id}", f"station {at} (crossing {station.crossing})")
            crossing = plan.crossing[station.crossing]
            strand = crossing.over if station.over else crossing.under
            other = crossing.under if station.over else crossing.over
            begins = False
            if at == 0 and station.joint is not None and station.joint in plan.joint:
                # Where a piece begins, the crossing names the piece that ends there.
                begins = plan.joint[station.joint].pieces == (strand.piece, piece.id)
            place.expect(
                named.get((piece.id, at)) == (station.crossing, station.over)
                or (begins and strand.thread == piece.thread),
                f"it lies {_way(station.over)}, but the crossing names station {strand.station} of "
                f"piece {strand.piece} there",
            )
            place.equal("its partner", station.partner, other.piece)


def check_pattern(job: Job, tally: Tally) -> None:
    """Check the pattern that is claimed against over and under along the walks."""
    plan, mesh = required(job.map), required(job.mesh)
    passes, _ = job.passes
    for thread in plan.threads:
        if thread.id not in passes:
            tally.fail(f"thread {thread.label} is not checked, because it is no walk of the mesh")
    weave = tally.at("crossing_map.json", "weave")
    sense, torn = _senses(plan, mesh, passes)
    weave.expect(not torn, f"crossings have two strands over or two under: {torn[:4]}")
    counts = (0, 0, 0)
    if plan.weave.pattern == "plain":
        _check_plain(plan, sense, tally)
    elif plan.weave.pattern in _TWILLS:
        counts = broken_conditions(plan, mesh, job.edges, passes, sense, tally)
    else:
        check_fabric(plan, mesh, job.edges, edge_keys(mesh).tolist(), tally)
    for (name, claimed), counted in zip(sorted(plan.weave.broken.items()), counts, strict=True):
        weave.equal(f"the number of broken {name} conditions", claimed, counted)
    weave.equal("exact", plan.weave.exact, sum(counts) == 0)
    if plan.weave.pattern == "twill":
        _check_rotations(job, sense, tally)


def _check_rotations(job: Job, sense: dict[int, bool], tally: Tally) -> None:
    """Check that as many rotations carry the weave onto itself as are asked for, and told."""
    plan, asked = required(job.map), job.options.get("twill_symmetry", 1)
    if plan.weave.rotations is None and asked == 1:
        return
    wanted, told = tally.at("job.toml", "twill_symmetry"), plan.weave.rotations or 0
    if wanted.expect(type(asked) is int and asked >= 1, f"{asked!r} is no number of rotations"):
        tally.at("crossing_map.json", "weave").expect(
            told >= asked,
            f"its rotations are {plan.weave.rotations}, but job.toml asks for {asked} or more",
        )
    found = count_rotations(required(job.mesh), sense, told)
    tally.count(len(sense))
    tally.at("crossing_map.json", "weave").expect(
        found >= told,
        f"its rotations are {told}, but only {found} carry the mesh onto itself, over and under "
        "kept",
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
        tally.at(f"thread {thread.label}").expect(
            len(same) == 0,
            f"it does not alternate over and under at {len(same)} places, first after crossing "
            f"{thread.crossings[same[0]] if len(same) else None}",
        )
    tally.count(len(sense))
    ones = sum(sense.values())
    if 0 < ones < len(sense):
        tally.fail(f"{ones} crossings twist one way and {len(sense) - ones} the other")
