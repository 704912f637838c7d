"""Check that fasteners go through the crossings that were to take one, and through no others."""

import re

import numpy as np
from scipy.cluster.hierarchy import DisjointSet

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.walks import LoadedMesh
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Tally

_EVERY = re.compile(r"every:(\d+)")


def check_fastening(job: Job, tally: Tally) -> None:
    """Check what the map calls fastened against the settings, the holes and the weave."""
    plan = required(job.map)
    stated = [crossing.fastened for crossing in plan.crossings]
    if all(one is None for one in stated):
        return
    outcome = (job.settings or {}).get("outcome")
    chosen = outcome.get("fasten") if isinstance(outcome, dict) else None
    asked = job.options.get("fasten", chosen)
    tally.at("job.toml").equal("which crossings are said to be fastened", chosen, asked)
    wanted = _wanted(str(asked), plan, job)
    if not tally.at("job.toml").expect(
        wanted is not None, f"{asked!r} does not say which crossings are fastened"
    ):
        return
    drilled = {
        station.crossing
        for piece in plan.pieces
        for at, station in enumerate(piece.stations)
        if station.hole_mm is not None
        or any(cutout.circle and cutout.station == at for cutout in piece.cutouts or ())
    }
    allowed = _allowed(plan, {one.id for one in plan.crossings if one.fastened}, job)
    for crossing in plan.crossings:
        place = tally.at(f"crossing {crossing.id}")
        due, there = crossing.id in (wanted or ()), crossing.id in drilled
        # Where there is no room for a hole, there is no fastener either.
        place.equal("whether it is fastened", crossing.fastened, due and there)
        place.expect(
            due or not there or crossing.id in allowed,
            "it has holes, but is not to be fastened",
        )


def _allowed(plan: CrossingMap, fastened: set[int], job: Job) -> set[int]:
    """Return the crossings that may have holes: all, or those like fastened ones, or these."""
    options = job.options
    by_kind = options.get("labels") == "kinds" or options.get("profile") == "service"
    usual = "alike" if by_kind or options.get("kinds") == "fewest" else "fastened"
    holes = options.get("holes", usual)
    if holes == "all":
        return {one.id for one in plan.crossings}
    if holes != "alike":
        return set(fastened)
    # The same station of two pieces of one kind is alike, seen from either end; so are all
    # crossings that such pairs lead to.
    alike: DisjointSet = DisjointSet(("crossing", one.id, 0) for one in plan.crossings)
    for piece in plan.pieces:
        for at, station in enumerate(piece.stations):
            place = ("kind", piece.kind, min(at, len(piece.stations) - 1 - at))
            alike.add(place)
            alike.merge(("crossing", station.crossing, 0), place)
    roots = {alike[("crossing", crossing, 0)] for crossing in fastened}
    return {one.id for one in plan.crossings if alike[("crossing", one.id, 0)] in roots}


def _wanted(asked: str, plan: CrossingMap, job: Job) -> set[int] | None:
    """Return the crossings that are to take a fastener; None if nobody can tell."""
    every = _EVERY.fullmatch(asked)
    if asked == "none":
        return set()
    if asked == "all":
        return {crossing.id for crossing in plan.crossings}
    wanted = {joint.crossing for joint in plan.joints}
    if asked == "rim":
        rim = _beside_the_boundary(required(job.mesh))
        wanted |= {one.id for one in plan.crossings if tuple(sorted(one.edge)) in rim}
    elif every is not None:
        for thread in plan.threads:
            walk = zip(thread.crossings, thread.over, strict=True)
            wanted |= set([crossing for crossing, over in walk if over][:: int(every[1])])
    elif asked != "joints":
        return None
    return wanted


def _beside_the_boundary(mesh: LoadedMesh) -> set[tuple[int, int]]:
    """Return the edges that follow, or are followed by, an edge of the boundary around a face."""
    bare = mesh.twin < 0
    beside = np.flatnonzero(bare[mesh.next] | bare[mesh.prev])
    ends = np.column_stack((mesh.corner[beside], mesh.corner[mesh.next[beside]]))
    return {(min(pair), max(pair)) for pair in ends.tolist()}
