"""Check that ids are unique and every reference resolves."""

from collections import Counter
from collections.abc import Container, Iterator, Sequence

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally


def check_references(job: Job, tally: Tally) -> None:
    """Check ids and references of the crossing map, the mesh and the model."""
    plan = job.map
    if plan is None:
        return
    for what, ids in (
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
        tally.at(what).expect(not repeated, f"{repeated[:3]} are used more than once")
    known: dict[str, Container[object]] = {
        "thread": plan.thread, "crossing": plan.crossing, "piece": plan.piece,
        "joint": {None, *plan.joint}, "sheet": plan.sheet,
        "vertex": range(len(job.mesh.vertices) if job.mesh is not None else 0),
    }  # fmt: skip
    for where, what, names in _references(plan):
        if what != "vertex" or job.mesh is not None:
            lost = [name for name in names if name not in known[what]]
            tally.at(where).expect(not lost, f"there is no {what} {lost[:3]}")
    for thread in plan.threads:
        place = tally.at(f"thread {thread.label}")
        place.equal("the number of over flags", len(thread.over), len(thread.crossings))
        if job.model is not None and thread.crossings:
            strip = job.model.get(thread.label)
            place.at("model.glb").equal(
                "its number of panels, and whether it is closed,",
                strip and (len(strip.entry), strip.closed),
                (len(thread.crossings), thread.closed),
            )
    for crossing in plan.crossings:
        for strand in (crossing.over, crossing.under):
            piece = plan.piece.get(strand.piece)
            tally.at(f"crossing {crossing.id}").expect(
                piece is not None and 0 <= strand.station < len(piece.stations),
                f"piece {strand.piece} has no station {strand.station}",
            )


def _references(plan: CrossingMap) -> Iterator[tuple[str, str, Sequence[object]]]:
    """Yield where the map names things, what they are, and their names."""
    for thread in plan.threads:
        yield f"thread {thread.label}", "crossing", thread.crossings
        yield f"thread {thread.label}", "piece", thread.pieces
    for crossing in plan.crossings:
        strands = crossing.over, crossing.under
        yield f"crossing {crossing.id}", "vertex", crossing.edge
        yield f"crossing {crossing.id}", "thread", [strand.thread for strand in strands]
    for piece in plan.pieces:
        where = f"piece {piece.id}"
        yield where, "thread", [piece.thread]
        yield where, "joint", [*piece.joints, *(station.joint for station in piece.stations)]
        yield where, "crossing", [station.crossing for station in piece.stations]
        yield where, "piece", [station.partner for station in piece.stations]
    for piece in plan.to_cut:
        yield f"piece {piece.id}", "sheet", [piece.sheet]
    for joint in plan.joints:
        yield f"joint {joint.id}", "crossing", [joint.crossing]
        yield f"joint {joint.id}", "piece", joint.pieces
    for step in plan.steps:
        where = f"step {step.step}"
        yield where, "piece", step.pieces
        yield where, "crossing", (*step.crossings, *step.over, *step.under, *step.fasten)
        yield where, "joint", step.joints
