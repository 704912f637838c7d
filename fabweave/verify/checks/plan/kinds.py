"""Check that pieces of one kind superpose."""

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.geometry import fit_motion
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

#: Pieces of one kind differ by no more than this; a little more than makers promise.
SAME_MM = 0.05


def check_kinds(job: Job, tally: Tally) -> None:
    """Check that each piece covers the first one of its kind, turned end for end or not."""
    plan = job.map
    if plan is None:
        return
    first: dict[int, Piece] = {}
    for piece in plan.pieces:
        other = first.setdefault(piece.kind, piece)
        tally.count()
        if other is piece:
            continue
        tally.expect(
            job.supplies[piece.thread] == job.supplies[other.thread],
            f"piece {piece.id} is of kind {piece.kind} as {other.id} is, but of another material",
        )
        off = min(apart(piece, other, plan, way) for way in (1, -1))
        tally.measure(
            "kind_mm",
            off,
            SAME_MM,
            f"piece {piece.id} is of kind {piece.kind} as {other.id} is, but does not cover it: "
            + (
                f"they differ by {off:.3f} mm"
                if np.isfinite(off)
                else "stations, over and under, or holes differ"
            ),
        )


def apart(piece: Piece, other: Piece, plan: CrossingMap, way: int) -> float:
    """Return how far two pieces differ when superposed by their stations; infinite if at all."""
    ours, theirs = piece.stations[::way], other.stations
    if [s.over for s in ours] != [s.over for s in theirs]:
        return np.inf
    holes, there = plan.holes[piece.id], plan.holes[other.id]
    if len(holes) != len(there) or len(piece.slots) != len(other.slots):
        return np.inf
    source, target = _figure(piece)[::way], _figure(other)
    motion = fit_motion(source, target)
    worst = float(np.hypot(*(motion.apply(source) - target).T).max())
    for moved, still in [(motion.apply(piece.outline), other.outline)]:
        ring = shapely.LinearRing(moved)
        worst = max(worst, float(ring.hausdorff_distance(shapely.LinearRing(still))))
    for slot in piece.slots:
        ring = shapely.LinearRing(motion.apply(slot))
        near = (ring.hausdorff_distance(shapely.LinearRing(one)) for one in other.slots)
        worst = max(worst, min(map(float, near)))
    if holes:
        places = motion.apply(np.array([(hole.x, hole.y) for hole in holes]))
        sizes = np.array([hole.diameter or 0.0 for hole in holes])
        wanted = np.array([(hole.x, hole.y, hole.diameter or 0.0) for hole in there])
        off = np.hypot(*(places[:, None] - wanted[None, :, :2]).transpose(2, 0, 1))
        off = np.maximum(off, np.abs(sizes[:, None] - wanted[None, :, 2]))
        worst = max(worst, float(off.min(axis=1).max()))
    return worst


def _figure(piece: Piece) -> Floats:
    """Return the stations of a piece."""
    return np.array([(station.x, station.y) for station in piece.stations])
