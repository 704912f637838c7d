"""Check that ids are unique and every reference resolves."""

from collections import Counter

from fabweave.verify.checks.model.ribbons import check_markers, check_ribbon_references
from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.read.job_files import Job
from fabweave.verify.statement import Tally


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


def _check_unique(plan: CrossingMap, tally: Tally) -> None:
    """Require that ids of each kind are unique."""
    for kind, ids in (
        ("sheet numbers", [sheet.number for sheet in plan.sheets]),
        ("sheet names", [sheet.name for sheet in plan.sheets]),
        ("thread ids", [thread.id for thread in plan.threads]),
        ("thread labels", [thread.label for thread in plan.threads]),
        ("crossing ids", [crossing.id for crossing in plan.crossings]),
        ("piece ids", [piece.id for piece in plan.to_cut]),
        ("joint ids", [joint.id for joint in plan.joints]),
        ("step numbers", [step.step for step in plan.steps]),
    ):
        repeated = [key for key, count in Counter(ids).items() if count > 1]
        tally.at(kind).expect(not repeated, f"{repeated[:3]} are used more than once")


def _check_threads(plan: CrossingMap, tally: Tally) -> None:
    """Require that threads refer to crossings and pieces that exist."""
    for thread in plan.threads:
        place = tally.at(f"thread {thread.label}")
        place.equal("the number of over flags", len(thread.over), len(thread.crossings))
        lost = [key for key in thread.crossings if key not in plan.crossing]
        place.expect(not lost, f"it passes crossings that do not exist: {lost[:3]}")
        strange = [key for key in thread.pieces if key not in plan.piece]
        place.expect(not strange, f"it has pieces that do not exist: {strange[:3]}")


def _check_crossings(plan: CrossingMap, job: Job, tally: Tally) -> None:
    """Require that crossings refer to vertices, threads, pieces and stations that exist."""
    n_vertices = len(job.mesh.vertices) if job.mesh is not None else None
    for crossing in plan.crossings:
        place = tally.at(f"crossing {crossing.id}")
        if n_vertices is not None:
            place.expect(
                all(0 <= vertex < n_vertices for vertex in crossing.edge),
                f"it lies on edge {crossing.edge}, whose vertices do not exist",
            )
        for side, strand in (("over", crossing.over), ("under", crossing.under)):
            piece = plan.piece.get(strand.piece)
            place.expect(
                strand.thread in plan.thread
                and piece is not None
                and 0 <= strand.station < len(piece.stations),
                f"{side} refers to thread {strand.thread}, piece {strand.piece}, station "
                f"{strand.station}, which do not all exist",
            )


def _check_pieces(plan: CrossingMap, tally: Tally) -> None:
    """Require that pieces, joints and steps refer to things that exist."""
    for piece in plan.pieces:
        place = tally.at(f"piece {piece.id}")
        place.expect(piece.thread in plan.thread, f"there is no thread {piece.thread}")
        joints = [*piece.joints, *(station.joint for station in piece.stations)]
        lost = [key for key in joints if key is not None and key not in plan.joint]
        place.expect(not lost, f"there is no joint {lost[:3]}")
        for at, station in enumerate(piece.stations):
            place.at(f"station {at}").expect(
                station.crossing in plan.crossing and station.partner in plan.piece,
                f"crossing {station.crossing} or partner {station.partner} does not exist",
            )
    for piece in plan.to_cut:
        place = tally.at(f"piece {piece.id}")
        place.expect(piece.sheet in plan.sheet, f"there is no sheet {piece.sheet}")
    for joint in plan.joints:
        tally.at(f"joint {joint.id}").expect(
            joint.crossing in plan.crossing and all(key in plan.piece for key in joint.pieces),
            f"crossing {joint.crossing} or pieces {joint.pieces} do not exist",
        )
    for step in plan.steps:
        crossings = (*step.crossings, *step.over, *step.under, *step.fasten)
        tally.at(f"step {step.step}").expect(
            all(key in plan.piece for key in step.pieces)
            and all(key in plan.crossing for key in crossings)
            and all(key in plan.joint for key in step.joints),
            "it refers to pieces, crossings or joints that do not exist",
        )


def _check_model(plan: CrossingMap, job: Job, tally: Tally) -> None:
    """Require one strip for each thread that has crossings, with a panel for each."""
    for thread in plan.threads:
        if not thread.crossings:
            continue
        strip = (job.model or {}).get(thread.label)
        place = tally.at("model.glb", f"thread {thread.label}")
        if place.expect(strip is not None, "it has no node") and strip is not None:
            place.equal(
                "its number of panels, and whether it is closed,",
                (len(strip.entry), strip.closed),
                (len(thread.crossings), thread.closed),
            )
