"""Check the pieces by themselves: order along threads, holes, outlines."""

import numpy as np
import shapely

from fabweave.verify.checks.plan.cutouts import check_cutouts
from fabweave.verify.crossing_map import CrossingMap, Hole, Piece, Thread
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.arcs import along, chords_of, ring_area, ring_length
from fabweave.verify.measure.threads import station_run
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

#: No side of an outline is shorter (less rounding).
SHORTEST_SIDE_MM = 0.1 - 1e-3
#: What is cut leaves the outline for people and programs by no more than this.
PATH_MM = 0.02
#: Readers of SVG may take the wrong half of the circle of a longer arc.
MOST_ARC_DEG = 179.0
#: Lines are compared at points so far apart.
_LOOK_MM = 0.5
#: A hole keeps at least this clear of its outline and of other holes.
LEAST_WEB_MM = 0.01
#: Two records of one hole agree to this, in its place and its diameter.
SAME_MM = 1e-3


def check_piece_order(job: Job, tally: Tally) -> None:
    """Check that pieces carry their thread once around, in order, sharing only joints."""
    plan = job.map
    if plan is None:
        return
    owned: dict[str, int] = {}
    used: dict[int, int] = {}
    for thread in plan.threads:
        for name in thread.pieces:
            tally.expect(name not in owned, f"piece {name} is listed by two threads, or twice")
            owned[name] = thread.id
        _check_thread(thread, plan, tally)
        for name in thread.pieces:
            end = plan.piece[name].joints[1]
            if end is not None:
                used[end] = used.get(end, 0) + 1
    for piece in plan.pieces:
        tally.expect(
            owned.get(piece.id) == piece.thread,
            f"piece {piece.id} says thread {piece.thread}, but is listed by {owned.get(piece.id)}",
        )
    for joint in plan.joints:
        tally.expect(
            used.get(joint.id) == 1, f"joint {joint.id} ends {used.get(joint.id, 0)} pieces"
        )


def _check_thread(thread: Thread, plan: CrossingMap, tally: Tally) -> None:
    """Check one thread's pieces and the joints between them."""
    where = f"thread {thread.label}"
    count = len(thread.crossings)
    pieces = [plan.piece[name] for name in thread.pieces]
    if not tally.expect(
        bool(pieces) == bool(count), f"{where} has {count} crossings and {len(pieces)} pieces"
    ):
        return
    if not pieces:
        return
    place = None
    for number, piece in enumerate(pieces):
        last = number == len(pieces) - 1
        start = station_run(thread, piece)
        if not tally.expect(
            start is not None,
            f"{where}: the stations of piece {piece.id} are no run of the thread's crossings",
        ):
            place = None
            continue
        begin = int(start or 0)
        expected = 0 if number == 0 and not thread.closed else place
        if expected is not None:
            tally.expect(
                begin == expected % count,
                f"{where}: piece {piece.id} begins at place {begin}, not {expected % count}, "
                "where the piece before it ends",
            )
        place = begin + len(piece.stations) - 1
        if last and not thread.closed:
            tally.expect(place == count - 1, f"{where}: piece {piece.id} does not reach its end")
        _check_flags(thread, piece, begin, tally)
        follower = pieces[(number + 1) % len(pieces)] if thread.closed or not last else None
        _check_joint(thread, piece, follower, plan, tally)
        if number == 0 and not thread.closed:
            tally.expect(
                piece.joints[0] is None, f"{where}: open, but piece {piece.id} begins at a joint"
            )
    total = sum(len(piece.stations) for piece in pieces)
    wanted = count + len(pieces) - (0 if thread.closed else 1)
    tally.expect(
        total == wanted,
        f"{where}: its pieces have {total} stations, where {count} crossings and the joints "
        f"between {len(pieces)} pieces make {wanted}",
    )


def _check_flags(thread: Thread, piece: Piece, begin: int, tally: Tally) -> None:
    """Check over flags against the thread's, and that only ends carry joints."""
    count = len(thread.crossings)
    final = len(piece.stations) - 1
    for at, station in enumerate(piece.stations):
        where = f"piece {piece.id}, station {at}"
        tally.expect(
            station.over == thread.over[(begin + at) % count],
            f"{where} (crossing {station.crossing}) is {'over' if station.over else 'under'}, "
            "its thread is not",
        )
        wanted = piece.joints[0] if at == 0 else piece.joints[1] if at == final else None
        if final == 0 and at == 0:
            wanted = piece.joints[0] if piece.joints[0] is not None else piece.joints[1]
        tally.expect(
            station.joint == wanted, f"{where} carries joint {station.joint}, not {wanted}"
        )


def _check_joint(
    thread: Thread, piece: Piece, follower: Piece | None, plan: CrossingMap, tally: Tally
) -> None:
    """Check the joint at the end of a piece."""
    number = piece.joints[1]
    where = f"thread {thread.label}, end of piece {piece.id}"
    if follower is None:
        tally.expect(number is None, f"{where}: joint {number} leads nowhere")
        return
    joint = plan.joint.get(number) if number is not None else None
    if not tally.expect(joint is not None, f"{where}: there is no joint to {follower.id}"):
        return
    if joint is None:
        return
    tally.expect(
        joint.pieces == (piece.id, follower.id) and follower.joints[0] == joint.id,
        f"{where}: joint {joint.id} joins {joint.pieces}, not {(piece.id, follower.id)}, or "
        f"{follower.id} begins at joint {follower.joints[0]}",
    )
    end, begin = piece.stations[-1], follower.stations[0]
    tally.expect(
        joint.crossing == end.crossing == begin.crossing,
        f"{where}: joint {joint.id} is at crossing {joint.crossing}, the pieces end at "
        f"{end.crossing} and begin at {begin.crossing}",
    )
    # A thread that never goes under has no hidden place for its joints.
    tally.expect(
        not (end.over or begin.over) or all(thread.over),
        f"{where}: joint {joint.id} lies on top of crossing {joint.crossing}, not under",
    )


def check_crossing_holes(job: Job, tally: Tally) -> None:
    """Check that all layers at a crossing have the same hole diameter, or none."""
    plan = job.map
    if plan is None:
        return
    layers: dict[int, list[tuple[str, float | None]]] = {c.id: [] for c in plan.crossings}
    for piece in plan.pieces:
        for station in piece.stations:
            layers.setdefault(station.crossing, []).append((piece.id, station.hole_mm))
    for crossing, holes in layers.items():
        sizes = {size for _, size in holes}
        drilled = [size for size in sizes if size is not None]
        tally.expect(
            not drilled or (len(drilled) == len(sizes) and max(drilled) - min(drilled) < SAME_MM),
            f"crossing {crossing} has holes: "
            + ", ".join(f"{name} {'none' if d is None else f'{d:g} mm'}" for name, d in holes),
        )
        tally.expect(
            all(size > 0.0 for size in drilled),
            f"crossing {crossing} has a hole of no size",
        )
    check_cutouts(plan, tally)


def check_simple(job: Job, tally: Tally) -> None:
    """Check that what is cut is simple, counter-clockwise, near its outline, clear of its holes."""
    plan = job.map
    if plan is None or not plan.pieces:
        return
    runs = [_ring(piece.path) for piece in plan.pieces]
    cuts = [along(run[:, :2], run[:, 2])[0] for run in runs]
    for piece, cut in zip(plan.pieces, cuts, strict=True):
        where = f"piece {piece.id}"
        area = ring_area(piece.path[:, :2], piece.path[:, 2])
        tally.expect(area > 0.0, f"{where}: its path runs clockwise or has no area")
        polygon = shapely.Polygon(cut)
        for what, ring, border in (
            ("path", piece.path[:, :2], polygon),
            ("outline", piece.outline, shapely.Polygon(piece.outline)),
        ):
            tally.expect(
                border.is_valid,
                f"{where}: its {what} is not simple: {shapely.is_valid_reason(border)}",
            )
            lengths = np.hypot(*chords_of(ring).T)
            short = int(np.argmin(lengths))
            tally.measure(
                "side_mm",
                lengths[short],
                SHORTEST_SIDE_MM,
                f"{where}: side {short} of its {what} is {lengths[short]:.4f} mm long",
                least=True,
            )
        turn = float(np.max(np.degrees(4.0 * np.arctan(np.abs(piece.path[:, 2])))))
        tally.measure(
            "arc_deg", turn, MOST_ARC_DEG, f"{where}: an arc of its path turns by {turn:.1f}°"
        )
        _check_webs(piece, polygon, plan.holes[piece.id], tally)
    outlines = [_ring(piece.outline) for piece in plan.pieces]
    apart = np.maximum(_off(cuts, outlines), _off(outlines, cuts))
    for piece, off in zip(plan.pieces, apart.tolist(), strict=True):
        tally.measure(
            "path_mm",
            off,
            PATH_MM,
            f"piece {piece.id}: its path leaves its outline by {off:.4f} mm",
        )


def _ring(points: Floats) -> Floats:
    """Return a closed run with its first point at its end again."""
    return np.concatenate([points, points[:1]])


def _off(runs: list[Floats], others: list[Floats]) -> Floats:
    """Return how far each run is from another at most, looked at every half millimetre."""
    count = np.arange(len(runs))
    lines = shapely.linestrings(
        np.concatenate(others), indices=np.repeat(count, [len(run) for run in others])
    )
    dense, owner = shapely.get_coordinates(
        shapely.segmentize(
            shapely.linestrings(
                np.concatenate(runs), indices=np.repeat(count, [len(run) for run in runs])
            ),
            _LOOK_MM,
        ),
        return_index=True,
    )
    shapely.prepare(lines)
    distance = shapely.distance(shapely.points(dense), lines[owner])
    return np.maximum.reduceat(distance, np.searchsorted(owner, count))


def _check_webs(piece: Piece, polygon: shapely.Polygon, holes: list[Hole], tally: Tally) -> None:
    """Check that holes are inside their outline and clear of it and of one another."""
    if not holes:
        return
    centres: Floats = np.array([(hole.x, hole.y) for hole in holes])
    radii = np.array([(hole.diameter or 0.0) / 2.0 for hole in holes])
    points = shapely.points(centres)
    depth = shapely.distance(points, polygon.exterior)
    webs = np.where(shapely.contains(shapely.make_valid(polygon), points), depth, -depth) - radii
    for at, web in enumerate(webs.tolist()):
        tally.measure(
            "web_mm",
            web,
            LEAST_WEB_MM,
            f"piece {piece.id}: the hole at ({holes[at].x:.3f}, {holes[at].y:.3f}) is {web:.4f} mm "
            "clear of the outline",
            least=True,
        )
    if len(holes) > 1:
        apart = np.hypot(*(centres[:, None] - centres[None, :]).transpose(2, 0, 1))
        apart = apart - radii[:, None] - radii[None, :]
        first, second = np.triu_indices(len(holes), 1)
        worst = int(np.argmin(apart[first, second]))
        gap = float(apart[first, second][worst])
        tally.measure(
            "hole_gap_mm",
            gap,
            LEAST_WEB_MM,
            f"piece {piece.id}: its holes {first[worst]} and {second[worst]} are {gap:.4f} mm "
            "apart",
            least=True,
        )


def areas_of(piece: Piece, plan: CrossingMap) -> tuple[float, float, float]:
    """Return outline area, area of holes and slots, and the length of all its cuts."""
    diameters = np.array([hole.diameter or 0.0 for hole in plan.holes[piece.id]])
    points, bulges = piece.path[:, :2], piece.path[:, 2]
    slots = [(slot[:, :2], slot[:, 2]) for slot in piece.slots]
    return (
        abs(ring_area(points, bulges)),
        float(np.sum(np.pi * diameters**2 / 4.0)) + sum(abs(ring_area(*slot)) for slot in slots),
        ring_length(points, bulges)
        + float(np.sum(np.pi * diameters))
        + sum(ring_length(*slot) for slot in slots),
    )
