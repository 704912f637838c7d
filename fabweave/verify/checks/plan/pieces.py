"""Check the pieces by themselves: order along threads, holes, outlines."""

from collections import Counter

import numpy as np
import shapely

from fabweave.verify.checks.plan.cutouts import SAME_MM, check_cutouts
from fabweave.verify.crossing_map import CrossingMap, Hole, Piece, Thread
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.arcs import chords_of, ring_area, ring_points
from fabweave.verify.measure.geometry import distances
from fabweave.verify.measure.threads import station_run
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: No side of an outline is shorter (less rounding).
SHORTEST_SIDE_MM = 0.1 - 1e-3
#: What is cut leaves the outline for people and programs by no more than this.
PATH_MM = 0.02
#: Readers of SVG may take the wrong half of the circle of a longer arc.
MOST_ARC_DEG = 179.0
#: Lines are compared at points so far apart.
_LOOK_MM = 10.0
#: A hole keeps at least this clear of its outline and of other holes.
LEAST_WEB_MM = 0.01


def check_piece_order(job: Job, tally: Tally) -> None:
    """Check that pieces carry their thread once around, in order, sharing only joints."""
    plan = required(job.map)
    owners: dict[str, int] = {}
    ends: Counter[int | None] = Counter()
    for thread in plan.threads:
        place = tally.at(f"thread {thread.label}")
        for name in thread.pieces:
            place.expect(name not in owners, f"piece {name} is listed by two threads, or twice")
            owners[name] = thread.id
        _check_thread(thread, plan, place)
        ends.update(plan.piece[name].joints[1] for name in thread.pieces)
    for piece in plan.pieces:
        place = tally.at(f"piece {piece.id}")
        place.equal("its thread", piece.thread, owners.get(piece.id))
    for joint in plan.joints:
        place = tally.at(f"joint {joint.id}")
        place.equal("the number of pieces that it ends", ends[joint.id], 1)


def _check_thread(thread: Thread, plan: CrossingMap, place: Place) -> None:
    """Check one thread's pieces and the joints between them."""
    count = len(thread.crossings)
    pieces = [plan.piece[name] for name in thread.pieces]
    text = f"it has {count} crossings and {len(pieces)} pieces"
    if not (place.expect(bool(pieces) == bool(count), text) and pieces):
        return
    end = None
    for number, piece in enumerate(pieces):
        last = number == len(pieces) - 1
        begin = station_run(thread, piece)
        if not place.expect(
            begin is not None,
            f"the stations of piece {piece.id} are no run of the thread's crossings",
        ):
            end = None
            continue
        begin = int(begin or 0)
        expected = 0 if number == 0 and not thread.closed else end
        if expected is not None:
            place.equal(f"the crossing where piece {piece.id} begins", begin, expected % count)
        end = begin + len(piece.stations) - 1
        if last and not thread.closed:
            place.equal(f"the crossing where piece {piece.id} ends", end, count - 1)
        _check_flags(thread, piece, begin, place)
        follower = pieces[(number + 1) % len(pieces)] if thread.closed or not last else None
        _check_joint(thread, piece, follower, plan, place.at(f"end of piece {piece.id}"))
        if number == 0 and not thread.closed:
            place.equal(f"the joint where piece {piece.id} begins", piece.joints[0], None)
    place.equal(
        "the number of stations of its pieces",
        sum(len(piece.stations) for piece in pieces),
        # Two pieces share the crossing of a joint.
        count + len(pieces) - (0 if thread.closed else 1),
    )


def _check_flags(thread: Thread, piece: Piece, begin: int, place: Place) -> None:
    """Check over flags against the thread's, and that only ends carry joints."""
    start, end = piece.joints
    final = len(piece.stations) - 1
    for at, station in enumerate(piece.stations):
        here = place.at(f"piece {piece.id}", f"station {at} (crossing {station.crossing})")
        here.equal("over", station.over, thread.over[(begin + at) % len(thread.crossings)])
        joint = start if at == 0 else end if at == final else None
        if final == 0 and start is None:
            joint = end
        here.equal("its joint", station.joint, joint)


def _check_joint(
    thread: Thread, piece: Piece, follower: Piece | None, plan: CrossingMap, place: Place
) -> None:
    """Check the joint at the end of a piece."""
    number = piece.joints[1]
    if follower is None:
        place.equal("its joint", number, None)
        return
    joint = plan.joint.get(number) if number is not None else None
    if not place.expect(joint is not None, f"there is no joint to {follower.id}") or joint is None:
        return
    place = place.at(f"joint {joint.id}")
    place.equal(
        "its pieces, and the joint where the second one begins,",
        (joint.pieces, follower.joints[0]),
        ((piece.id, follower.id), joint.id),
    )
    end, begin = piece.stations[-1], follower.stations[0]
    place.equal(
        "the crossings where one piece ends and the other begins",
        (end.crossing, begin.crossing),
        (joint.crossing, joint.crossing),
    )
    # A thread that never goes under has no hidden place for its joints.
    place.expect(
        not (end.over or begin.over) or all(thread.over),
        f"it lies on top of crossing {joint.crossing}, not under",
    )


def check_crossing_holes(job: Job, tally: Tally) -> None:
    """Check that all layers at a crossing have the same hole diameter, or none."""
    plan = required(job.map)
    layers: dict[int, list[tuple[str, float | None]]] = {c.id: [] for c in plan.crossings}
    for piece in plan.pieces:
        for station in piece.stations:
            layers.setdefault(station.crossing, []).append((piece.id, station.hole_mm))
    for crossing, holes in layers.items():
        place = tally.at(f"crossing {crossing}")
        sizes = {size for _, size in holes}
        drilled = [size for size in sizes if size is not None]
        place.expect(
            not drilled or (len(drilled) == len(sizes) and max(drilled) - min(drilled) < SAME_MM),
            "its layers have different holes: "
            + ", ".join(f"{name} {'none' if d is None else f'{d:g} mm'}" for name, d in holes),
        )
        place.expect(all(size > 0.0 for size in drilled), "it has a hole of no size")
    check_cutouts(plan, tally)


def check_simple(job: Job, tally: Tally) -> None:
    """Check that what is cut is simple, counter-clockwise, near its outline, clear of its holes."""
    plan = required(job.map)
    if not plan.pieces:
        return
    cuts = [ring_points(piece.path) for piece in plan.pieces]
    for piece, cut in zip(plan.pieces, cuts, strict=True):
        place = tally.at(f"piece {piece.id}")
        place.expect(ring_area(piece.path) > 0.0, "its path runs clockwise or has no area")
        polygon = shapely.Polygon(cut)
        for what, ring, border in (
            ("path", piece.path[:, :2], polygon),
            ("outline", piece.outline, shapely.Polygon(piece.outline)),
        ):
            place.expect(
                border.is_valid, f"its {what} is not simple: {shapely.is_valid_reason(border)}"
            )
            lengths = np.hypot(*chords_of(ring).T)
            text = f"side {int(np.argmin(lengths))} of its {what} is {{}} long"
            place.at_least("side_mm", lengths.min(), SHORTEST_SIDE_MM, text)
        turn = float(np.max(np.degrees(4.0 * np.arctan(np.abs(piece.path[:, 2])))))
        place.at_most("arc_deg", turn, MOST_ARC_DEG, "an arc of its path turns by {}")
        _check_webs(polygon, plan.holes[piece.id], place)
    apart = shapely.hausdorff_distance(
        *(
            shapely.segmentize([shapely.LinearRing(ring) for ring in rings], _LOOK_MM)
            for rings in (cuts, [piece.outline for piece in plan.pieces])
        )
    )
    for piece, off in zip(plan.pieces, apart.tolist(), strict=True):
        place = tally.at(f"piece {piece.id}")
        place.at_most("path_mm", off, PATH_MM, "its path leaves its outline by {}")


def _check_webs(polygon: shapely.Polygon, holes: list[Hole], place: Place) -> None:
    """Check that holes are inside their outline and clear of it and of one another."""
    if not holes:
        return
    centres: Floats = np.array([(hole.x, hole.y) for hole in holes])
    radii = np.array([(hole.diameter or 0.0) / 2.0 for hole in holes])
    points = shapely.points(centres)
    depth = shapely.distance(points, polygon.exterior)
    webs = np.where(shapely.contains(shapely.make_valid(polygon), points), depth, -depth) - radii
    for hole, web in zip(holes, webs.tolist(), strict=True):
        place.at_least(
            "web_mm",
            web,
            LEAST_WEB_MM,
            f"the hole at ({hole.x:.3f}, {hole.y:.3f}) is {{}} clear of the outline",
        )
    if len(holes) > 1:
        apart = distances(centres, centres) - radii[:, None] - radii[None, :]
        first, second = np.triu_indices(len(holes), 1)
        worst = int(np.argmin(apart[first, second]))
        place.at_least(
            "hole_gap_mm",
            float(apart[first, second][worst]),
            LEAST_WEB_MM,
            f"its holes {first[worst]} and {second[worst]} are {{}} apart",
        )
