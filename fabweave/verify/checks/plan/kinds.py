"""Check that pieces of one kind superpose."""

import re
from collections import Counter
from math import ceil

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.geometry import distances, farthest, fit_motion
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: Pieces of one kind differ by no more than this; a little more than makers promise.
SAME_MM = 0.05
#: What is asked of spares: so many of each kind, or a share of its pieces.
_SPARES = re.compile(r"(\d+(?:\.\d+)?)(%?)")


def check_kinds(job: Job, tally: Tally) -> None:
    """Check that each piece covers the first one of its kind, turned end for end or not."""
    plan = required(job.map)
    _check_spares(job, plan, tally)
    first: dict[int, Piece] = {}
    for piece in plan.pieces:
        other = first.setdefault(piece.kind, piece)
        tally.count()
        if other is piece:
            continue
        place = tally.at(f"piece {piece.id}", f"of kind {piece.kind} as {other.id} is")
        same = job.supplies[piece.thread] == job.supplies[other.thread]
        place.expect(same, "it is of another material")
        by_kind = plan.cut.labels == "kinds"
        if piece.turned or by_kind:
            off = _apart(piece, other, plan, -1 if piece.turned else 1)
        else:
            off = off_by(piece, other, plan)
        what = "they differ by {}"
        if not np.isfinite(off):
            what = "stations, over and under, or holes differ"
        turned = ", turned end for end" if piece.turned else ""
        place.at_most("kind_mm", off, SAME_MM, f"it does not cover {other.id}{turned}: {what}")
        if by_kind:
            _check_labels(piece, other, place)


def _check_spares(job: Job, plan: CrossingMap, tally: Tally) -> None:
    """Check that of each kind as many spares are cut as job.toml asks for, and that they fit it.

    A spare has the shape of the piece that it is said to be of: what is drawn is checked by that.
    """
    asked = _SPARES.fullmatch(str(job.options.get("spares", "0")))
    if not tally.at("job.toml").expect(asked, "spares are no share and no number") or not asked:
        return
    number, share = float(asked[1]), asked[2] == "%"
    pieces = Counter(piece.kind for piece in plan.pieces)
    spares = Counter(plan.cut_piece[name].kind for name in plan.spare_of)
    for kind, count in sorted(pieces.items()):
        wanted = ceil(round(count * number / 100.0, 9)) if share else number
        tally.at(f"kind {kind}").equal("the number of its spares", spares[kind], wanted)
    if plan.cut.labels == "kinds":
        for name, origin in plan.spare_of.items():
            _check_labels(plan.cut_piece[name], plan.piece[origin], tally.at(f"piece {name}"))


def _check_labels(piece: Piece, other: Piece, place: Place) -> None:
    """Check that what tells the kind stands at the same place of both."""
    told = [sorted((label.kind, label.text) for label in one.labels) for one in (piece, other)]
    if not place.equal("what is engraved", *told) or not told[0]:
        return
    motion = fit_motion(piece.points[:: -1 if piece.turned else 1], other.points)
    ours, theirs = _arms(piece), _arms(other)
    off = max(farthest(motion.apply(one), there) for one, there in zip(ours, theirs, strict=True))
    place.at_most("kind_label_mm", off, SAME_MM, f"its label stands {{}} off that of {other.id}")


def _arms(piece: Piece) -> tuple[Floats, Floats]:
    """Return where each label of a piece stands, and the points a millimetre on along it."""
    labels = sorted(piece.labels, key=lambda label: (label.kind, label.text))
    middle = np.array([(label.x, label.y) for label in labels])
    turn = np.deg2rad([label.rotation_deg for label in labels])
    return middle, middle + np.stack((np.cos(turn), np.sin(turn)), axis=1)


def off_by(piece: Piece, other: Piece, plan: CrossingMap) -> float:
    """Return how far two pieces differ when superposed, turned end for end or not."""
    return min(_apart(piece, other, plan, way) for way in (1, -1))


def _apart(piece: Piece, other: Piece, plan: CrossingMap, way: int) -> float:
    """Return how far two pieces differ when superposed by their stations; infinite if at all."""
    ours, theirs = piece.stations[::way], other.stations
    if [s.over for s in ours] != [s.over for s in theirs]:
        return np.inf
    holes, there = plan.holes[piece.id], plan.holes[other.id]
    if len(holes) != len(there) or len(piece.slots) != len(other.slots):
        return np.inf
    source, target = piece.points[::way], other.points
    motion = fit_motion(source, target)
    outline = shapely.LinearRing(motion.apply(piece.outline))
    worst = max(
        farthest(motion.apply(source), target),
        float(outline.hausdorff_distance(shapely.LinearRing(other.outline))),
    )
    for slot in piece.slots:
        ring = shapely.LinearRing(motion.apply(slot))
        near = (ring.hausdorff_distance(shapely.LinearRing(twin)) for twin in other.slots)
        worst = max(worst, min(map(float, near)))
    if holes:
        places = motion.apply(np.array([(hole.x, hole.y) for hole in holes]))
        sizes = np.array([hole.diameter or 0.0 for hole in holes])
        wanted = np.array([(hole.x, hole.y, hole.diameter or 0.0) for hole in there])
        wider = np.abs(sizes[:, None] - wanted[None, :, 2])
        off = np.maximum(distances(places, wanted[:, :2]), wider)
        worst = max(worst, float(off.min(axis=1).max()))
    return worst
