"""Check that ids are unique and every reference resolves."""

from collections import Counter
from collections.abc import Hashable, Iterable

from fabweave.verify.checks.model.ribbons import check_markers, check_ribbon_references
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally


def check_references(job: Job, tally: Tally) -> None:
    """Check ids and references of the crossing map, the mesh and the model."""
    plan = job.map
    if plan is None:
        return
    _check_unique(plan, tally)
    _check_threads(plan, tally)
    _check_crossings(plan, job, tally)
    _check_pieces(plan, tally)
    if job.model is not None:
        _check_model(plan, job, tally)
    if job.ribbons is not None:
        check_ribbon_references(plan, job.ribbons, tally)
        check_markers(job, tally)


def _twice(ids: Iterable[Hashable]) -> list[Hashable]:
    """Return what appears more than once."""
    return [key for key, count in Counter(ids).items() if count > 1]


def _check_unique(plan: CrossingMap, tally: Tally) -> None:
    """Require that ids of each kind are unique."""
    for kind, ids in (
        ("sheet number", [sheet.number for sheet in plan.sheets]),
        ("sheet name", [sheet.name for sheet in plan.sheets]),
        ("thread id", [thread.id for thread in plan.threads]),
        ("thread label", [thread.label for thread in plan.threads]),
        ("crossing id", [crossing.id for crossing in plan.crossings]),
        ("piece id", [piece.id for piece in plan.pieces]),
        ("joint id", [joint.id for joint in plan.joints]),
        ("step number", [step.step for step in plan.steps]),
    ):
        twice = _twice(ids)
        tally.expect(not twice, f"{kind} {twice[:3]} is used more than once")


def _check_threads(plan: CrossingMap, tally: Tally) -> None:
    """Require that threads refer to crossings and pieces that exist."""
    for thread in plan.threads:
        where = f"thread {thread.label}"
        tally.expect(
            len(thread.over) == len(thread.crossings),
            f"{where} has {len(thread.crossings)} crossings but {len(thread.over)} over flags",
        )
        lost = [key for key in thread.crossings if key not in plan.crossing]
        tally.expect(not lost, f"{where} passes crossings that do not exist: {lost[:3]}")
        strange = [key for key in thread.pieces if key not in plan.piece]
        tally.expect(not strange, f"{where} has pieces that do not exist: {strange[:3]}")


def _check_crossings(plan: CrossingMap, job: Job, tally: Tally) -> None:
    """Require that crossings refer to vertices, threads, pieces and stations that exist."""
    n_vertices = len(job.mesh.vertices) if job.mesh is not None else None
    for crossing in plan.crossings:
        where = f"crossing {crossing.id}"
        if n_vertices is not None:
            tally.expect(
                all(0 <= vertex < n_vertices for vertex in crossing.edge),
                f"{where} lies on edge {crossing.edge}, whose vertices do not exist",
            )
        for side, strand in (("over", crossing.over), ("under", crossing.under)):
            piece = plan.piece.get(strand.piece)
            tally.expect(
                strand.thread in plan.thread
                and piece is not None
                and 0 <= strand.station < len(piece.stations),
                f"{where}: {side} refers to thread {strand.thread}, piece {strand.piece}, station "
                f"{strand.station}, which do not all exist",
            )


def _check_pieces(plan: CrossingMap, tally: Tally) -> None:
    """Require that pieces, joints and steps refer to things that exist."""
    numbers = {sheet.number for sheet in plan.sheets}
    for piece in plan.pieces:
        where = f"piece {piece.id}"
        tally.expect(piece.thread in plan.thread, f"{where}: no thread {piece.thread}")
        tally.expect(piece.sheet in numbers, f"{where}: no sheet {piece.sheet}")
        joints = [*piece.joints, *(station.joint for station in piece.stations)]
        lost = [key for key in joints if key is not None and key not in plan.joint]
        tally.expect(not lost, f"{where}: no joint {lost[:3]}")
        for at, station in enumerate(piece.stations):
            tally.expect(
                station.crossing in plan.crossing and station.partner in plan.piece,
                f"{where}, station {at}: crossing {station.crossing} or partner "
                f"{station.partner} does not exist",
            )
    for joint in plan.joints:
        tally.expect(
            joint.crossing in plan.crossing and all(key in plan.piece for key in joint.pieces),
            f"joint {joint.id}: crossing {joint.crossing} or pieces {joint.pieces} do not exist",
        )
    for step in plan.steps:
        tally.expect(
            all(key in plan.piece for key in step.pieces)
            and all(
                key in plan.crossing
                for key in (*step.crossings, *step.over, *step.under, *step.fasten)
            )
            and all(key in plan.joint for key in step.joints),
            f"step {step.step} refers to pieces, crossings or joints that do not exist",
        )


def _check_model(plan: CrossingMap, job: Job, tally: Tally) -> None:
    """Require one strip for each thread that has crossings, with a panel for each."""
    model = job.model or {}
    for thread in plan.threads:
        strip = model.get(thread.label)
        if not thread.crossings:
            continue
        if not tally.expect(strip is not None, f"model.glb has no node for thread {thread.label}"):
            continue
        agrees = strip is not None and (
            len(strip.entry) == len(thread.crossings) and strip.closed == thread.closed
        )
        tally.expect(
            agrees,
            f"model.glb: thread {thread.label} does not have {len(thread.crossings)} panels, or "
            "is not closed as the map says",
        )
