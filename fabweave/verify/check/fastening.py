"""Check that fasteners go through the crossings that were to take one, and through no others."""

import re

import numpy as np

from fabweave.verify.check.rim import rim_crossings
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Flags, Floats
from fabweave.verify.measure.walks import groups_of
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.mesh import LoadedMesh
from fabweave.verify.report import Tally

_FORM = re.compile(r"form(:\d.*)?")
_EVERY = re.compile(r"every:(\d+)")
#: Heights and directions that differ by less are the same.
_LEVEL_MM, _SAME_TURN = 1e-3, 1e-6


def check_fastening(job: Job, tally: Tally) -> None:
    """Check what the map calls fastened against the settings, the holes and the weave."""
    plan = required(job.map)
    outcome = (job.settings or {}).get("outcome")
    chosen = outcome.get("fasten") if isinstance(outcome, dict) else None
    asked = job.options.get("fasten", chosen)
    tally.at("job.toml").equal("which crossings are said to be fastened", chosen, asked)
    wanted = _wanted(str(asked), plan, job)
    if not tally.at("job.toml").expect(
        wanted is not None, f"{asked!r} does not say which crossings are fastened"
    ):
        return
    if job.options.get("rim", "none") != "none":
        wanted = (wanted or set()) | rim_crossings(required(job.mesh), plan)
    hung = {crossing.id for crossing in plan.crossings if crossing.hang}
    tally.at("crossings that carry").same("something", hung, carrying(job))
    wanted = (wanted or set()) | hung
    drilled = {
        station.crossing
        for piece in plan.pieces
        for at, station in enumerate(piece.stations)
        if station.hole_mm is not None
        or any(cutout.path is None for cutout in piece.cut_at.get(at, ()))
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


def carrying(job: Job) -> set[int]:
    """Return the crossings that settings hang it from, or tie to a base: those beside low rims."""
    plan = required(job.map)
    if not job.based:
        return hanging(str(job.options.get("hang", "")), plan)
    mesh = required(job.wished)
    rim = _beside(mesh, mesh.twin < 0)
    ends = mesh.vertices[np.stack([mesh.corner, mesh.corner[mesh.next]])]
    high_mm = float(np.linalg.norm(ends[1] - ends[0], axis=1).mean()) / 2.0
    beside = [one for one in plan.crossings if tuple(sorted(one.edge)) in rim]
    height = np.array([mesh.vertices[list(one.edge), 2].mean() for one in beside])
    low = height <= height.min(initial=np.inf) + high_mm
    return {one.id for one, is_low in zip(beside, low.tolist(), strict=True) if is_low}


def hanging(asked: str, plan: CrossingMap) -> set[int]:
    """Return the crossings that settings name: by number, or at a side."""
    due = set()
    for part in filter(None, asked.split(",")):
        side, _, count = part.partition(":")
        if side.isdigit():
            due.add(int(side))
        else:
            points = np.array([one.position for one in plan.crossings]).reshape(-1, 3)
            rows = _outermost(points, int(count or 1), 1.0 if side == "top" else -1.0)
            due |= {plan.crossings[row].id for row in rows}
    return due


def _outermost(points: Floats, count: int, up: float) -> list[int]:
    """Return which point is highest; of several sectors, that of each, well off the middle."""
    offset = points[:, :2] - (points[:, :2].min(axis=0) + points[:, :2].max(axis=0)) / 2.0
    away = np.hypot(offset[:, 0], offset[:, 1])
    turn = (np.arctan2(offset[:, 1], offset[:, 0]) / (2.0 * np.pi) + _SAME_TURN) % 1.0
    height = np.rint(up * points[:, 2] / _LEVEL_MM)
    if count == 1:
        return [int(np.argmax(height))]
    far = away >= away.max() / 3.0
    sectors = (np.flatnonzero(far & (np.floor(turn * count) == n)) for n in range(count))
    return [int(rows[np.argmax(height[rows])]) for rows in sectors if len(rows)]


def _allowed(plan: CrossingMap, fastened: set[int], job: Job) -> set[int]:
    """Return the crossings that may have holes: all, or those like fastened ones, or these."""
    options = job.options
    holes = options.get("holes", "alike")
    if holes == "all":
        return {one.id for one in plan.crossings}
    if holes != "alike":
        return set(fastened)
    # The same station of two pieces of one kind is alike, seen from either end; so are all
    # crossings that such pairs lead to.
    places = (
        (station.crossing, ("kind", piece.kind, min(at, len(piece.stations) - 1 - at)))
        for piece in plan.pieces
        for at, station in enumerate(piece.stations)
    )
    group = groups_of(places)
    groups = {group.get(crossing) for crossing in fastened} - {None}
    return {one.id for one in plan.crossings if group.get(one.id) in groups}


def _wanted(asked: str, plan: CrossingMap, job: Job) -> set[int] | None:
    """Return the crossings that are to take a fastener; None if nobody can tell."""
    asked, *numbers = asked.split(",")
    every = _EVERY.fullmatch(asked)
    wanted = {int(number) for number in numbers}
    if asked == "none":
        return wanted
    if asked == "all":
        return {crossing.id for crossing in plan.crossings}
    wanted |= {joint.crossing for joint in plan.joints}
    if asked == "rim":
        mesh = required(job.mesh)
        rim = _beside(mesh, mesh.twin < 0)
        wanted |= {one.id for one in plan.crossings if tuple(sorted(one.edge)) in rim}
    elif every is not None:
        for thread in plan.threads:
            walk = zip(thread.crossings, thread.over, strict=True)
            wanted |= set([crossing for crossing, over in walk if over][:: int(every[1])])
    elif _FORM.fullmatch(asked):
        # Which more there are is for the form to say.
        for thread in plan.threads:
            wanted |= set() if thread.closed else {*thread.crossings[:1], *thread.crossings[-1:]}
        wanted |= {one.id for one in plan.crossings if one.fastened}
    elif asked not in ("joints", "glue"):
        return None
    return wanted


def _beside(mesh: LoadedMesh, bare: Flags) -> set[tuple[int, int]]:
    """Return the edges that follow, or are followed by, some edge around a face."""
    beside = np.flatnonzero(bare[mesh.next] | bare[mesh.prev])
    ends = np.column_stack((mesh.corner[beside], mesh.corner[mesh.next[beside]]))
    return {(min(pair), max(pair)) for pair in ends.tolist()}
