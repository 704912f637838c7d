"""Check the pieces by themselves: order along threads, holes, outlines, and their unfolding."""

import re
from collections import Counter
from math import ceil

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.crossing_map import CrossingMap, Cutout, Joint, Piece, Thread
from fabweave.verify.drawing import Floats, chords_of, ring_area, ring_points
from fabweave.verify.measure.development import Development, Reach, kind_of, reaches
from fabweave.verify.measure.geometry import (
    distances,
    farthest,
    fit_motion,
    widest_miss,
)
from fabweave.verify.measure.walks import station_run
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally

STATION_MM = 0.02
OUTLINE_MM = 0.12
LENGTH_MM = 0.02
#: Less than half of the least play of a fastener, which is 0.1 mm: two pieces meet there.
FIT_MM = 0.041


def check_unfolding(job: Job, tally: Tally) -> None:
    """Check stations, lengths and outlines of every piece against the unfolded model."""
    plan, developments = required(job.map), job.developments
    for piece in plan.pieces:
        development = developments.get(piece.id)
        if development is None:
            tally.fail(
                f"piece {piece.id} is not unfolded: its stations are no run of its thread, or the "
                "model has not that thread's panels"
            )
            continue
        _check_piece(piece, development, reaches(plan, piece), tally.at(f"piece {piece.id}"))


def _check_piece(
    piece: Piece, development: Development, ends: tuple[Reach, Reach], place: Place
) -> None:
    """Check one piece against its development; what is fitted may be as far off as is said."""
    stations = piece.points
    place.at_most("fitted_mm", piece.fitted_mm, FIT_MM, "it is fitted to others by {}")
    slack_mm = development.slack_mm + piece.fitted_mm
    place.at_most(
        "station_mm",
        farthest(development.stations, stations),
        STATION_MM + slack_mm,
        "a station stands {} from where the unfolded model has it",
    )
    if len(stations) > 1:
        stated, true = (np.diff(points, axis=0) for points in (stations, development.stations))
        change = np.hypot(*stated.T) - np.hypot(*true.T)
        worst = int(np.argmax(np.abs(change)))
        place.at_most(
            "length_mm",
            abs(float(change[worst])),
            LENGTH_MM + slack_mm + piece.fitted_mm,
            f"stations {worst} and {worst + 1} are {{}} "
            + ("further apart" if change[worst] > 0.0 else "nearer to each other")
            + " than in the model",
        )
    rails = development.outline
    border, ring = shapely.LinearRing(piece.outline), shapely.LinearRing(rails)
    wanted, there = _along(rails), _along(piece.outline)
    outside = np.concatenate([shapely.distance(wanted, border), shapely.distance(there, ring)])
    # Where a joint shapes an end, its outline stays in the ribbon; how it fits is the joint's.
    shaped = [
        shapely.Polygon(development.panels[at][[0, 2, 3, 1]])
        for at, end in zip((0, -1), ends, strict=True)
        if end.shaped
    ]
    if shaped:
        whole = shapely.union_all(_facets(development.window))
        points = np.concatenate([wanted, there])
        free = shapely.dwithin(points, shapely.union_all(shaped), OUTLINE_MM)
        outside[free] = shapely.distance(points[free], whole)
    place.at_most(
        "outline_mm",
        float(np.max(outside)),
        OUTLINE_MM + slack_mm,
        "its outline leaves the unfolded ribbon by {}",
    )


def _along(ring: Floats) -> npt.NDArray[np.object_]:
    """Return the vertices of a ring and the middles of its sides."""
    shares = np.array([0.0, 0.5])[:, None, None]
    steps = np.roll(ring, -1, axis=0) - ring
    return np.asarray(shapely.points((ring + shares * steps).reshape(-1, 2)))


def _facets(rungs: Floats) -> npt.NDArray[np.object_]:
    """Return the quads between rungs as polygons: a border would part what comes over itself."""
    quads = np.stack([rungs[:-1, 0], rungs[1:, 0], rungs[1:, 1], rungs[:-1, 1]], axis=1)
    return shapely.make_valid(shapely.polygons(quads))


#: Two records of one hole agree to this, in its place and its diameter.
SAME_MM = 1e-3
#: Holes of one fastener coincide to this, layer on layer.
LAYER_MM = 0.02
#: A slot's round ends may be polygons, which lie inside their circle.
_ROUND_MM = 0.02


def check_cutouts(plan: CrossingMap, tally: Tally) -> None:
    """Check that the cut-outs of each piece are those of its stations and joints, and no others."""
    joint_at = {joint.crossing: joint for joint in plan.joints}
    for piece in plan.pieces:
        place = tally.at(f"piece {piece.id}")
        for cutout in piece.cutouts:
            place.expect(
                0 <= cutout.station < len(piece.stations),
                f"a cut-out is at station {cutout.station}, which does not exist",
            )
        for at, station in enumerate(piece.stations):
            here = place.at(f"station {at} (crossing {station.crossing})")
            _check_station(piece, at, joint_at.get(station.crossing), here)


def _check_station(piece: Piece, at: int, joint: Joint | None, place: Place) -> None:
    """Check the cut-outs of one station."""
    station, cutouts = piece.stations[at], piece.cut_at.get(at, [])
    slots = [cutout.path for cutout in cutouts if cutout.path is not None]
    circles = [(c.x, c.y, c.diameter_mm) for c in cutouts if c.path is None]
    if slots:
        tabbed = joint is not None and kind_of(joint).slotted and joint.pieces[1] == piece.id
        if tabbed and at == 0 and station.hole_mm is None:
            place.equal("the number of cut-outs at the slot of its joint", len(cutouts), 1)
        elif place.expect(
            len(cutouts) == 1 and joint is None and station.hole_mm is not None,
            "it has a slot where there is a joint, no fastener, or another cut-out",
        ):
            _check_slide(slots[0], (station.x, station.y), station.hole_mm or 0.0, place)
        return
    wanted, diameter = _wanted(piece, at, joint)
    if not place.equal("the number of holes", len(circles), len(wanted)) or not circles:
        return
    holes = np.array(circles)
    place.expect(
        diameter is not None and float(np.max(np.abs(holes[:, 2] - diameter))) < SAME_MM,
        f"its holes have diameters {sorted(set(holes[:, 2].tolist()))}, but should have {diameter}",
    )
    if np.all(np.isfinite(wanted)):
        place.at_most(
            "record_mm",
            widest_miss(distances(wanted, holes[:, :2])),
            SAME_MM,
            "a hole is cut {} from where its station or joint says",
        )


def _wanted(piece: Piece, at: int, joint: Joint | None) -> tuple[Floats, float | None]:
    """Return where a station wants holes, NaN where only layers below tell, and how large."""
    station = piece.stations[at]
    if station.hole_mm is not None:
        return np.array([[station.x, station.y]]), station.hole_mm
    if joint is None or not len(joint.holes):
        return np.zeros((0, 2)), None
    if at == len(piece.stations) - 1 and joint.pieces[0] == piece.id and not station.over:
        return joint.holes[:, 0], joint.hole_mm
    if at == 0 and joint.pieces[1] == piece.id and not station.over:
        return joint.holes[:, 1], joint.hole_mm
    return np.full((len(joint.holes), 2), np.nan), joint.hole_mm


def _check_slide(ring: Floats, middle: tuple[float, float], diameter: float, place: Place) -> None:
    """Check that a slot holds its fastener in the middle, and lets it move one way only."""
    slot = shapely.Polygon(ring_points(ring))
    if not place.expect(slot.is_valid and slot.area > 0.0, "its slot is not simple"):
        return
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(slot))
    width, length = sorted(np.hypot(*np.diff(box[:3], axis=0).T).tolist())
    place.expect(
        abs(width - diameter) < _ROUND_MM and length > 1.2 * diameter,
        f"its slot is {width:.3f} × {length:.3f} mm for a fastener of {diameter:g} mm",
    )
    off = float(np.hypot(slot.centroid.x - middle[0], slot.centroid.y - middle[1]))
    place.at_most("slot_mm", off, _ROUND_MM, "its slot is {} off its station")


def check_layers(plan: CrossingMap, developments: dict[str, Development], tally: Tally) -> None:
    """Check in space that the holes of all layers of a crossing lie on one another."""
    layers: dict[int, list[tuple[str, Floats, Floats, float]]] = {}
    for piece in plan.pieces:
        development = developments.get(piece.id)
        if development is None:
            continue
        for at, station in enumerate(piece.stations):
            drilled = station.hole_mm is not None
            cutouts = [one for one in piece.cut_at.get(at, ()) if one.path is None or drilled]
            if cutouts:
                panel, centres = development.space[at], [one.centre for one in cutouts]
                there = _lifted(np.array(centres), development.panels[at], panel)
                layers.setdefault(station.crossing, []).append(
                    (piece.id, there, panel, development.slack_mm + piece.fitted_mm)
                )
    for crossing, strands in layers.items():
        place = tally.at(f"crossing {crossing}")
        name, first, panel, slack = strands[0]
        normal = np.cross(panel[2] - panel[0], panel[1] - panel[0])
        normal = normal / np.linalg.norm(normal)
        for other, points, _, more in strands[1:]:
            if not place.equal(
                f"the number of holes of {other}, which lies on {name},", len(points), len(first)
            ):
                continue
            apart = points[None, :] - first[:, None]
            apart = apart - (apart @ normal)[:, :, None] * normal
            place.at_most(
                "layer_mm",
                widest_miss(np.linalg.norm(apart, axis=2)),
                LAYER_MM + slack + more,
                f"a hole of {other} is {{}} off that of {name}",
            )


def _lifted(points: Floats, flat: Floats, space: Floats) -> Floats:
    """Return points of a flat panel where they are in space, (N, 3)."""
    ones = np.ones((len(flat), 1))
    motion, *_ = np.linalg.lstsq(np.hstack([flat, ones]), space, rcond=None)
    return np.asarray(np.hstack([points, np.ones((len(points), 1))]) @ motion)


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
    joint = plan.joint.get(number)
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
        _check_webs(polygon, piece.holes, place)
    apart = shapely.hausdorff_distance(
        *(
            shapely.segmentize([shapely.LinearRing(ring) for ring in rings], _LOOK_MM)
            for rings in (cuts, [piece.outline for piece in plan.pieces])
        )
    )
    for piece, off in zip(plan.pieces, apart.tolist(), strict=True):
        place = tally.at(f"piece {piece.id}")
        place.at_most("path_mm", off, PATH_MM, "its path leaves its outline by {}")


def _check_webs(polygon: shapely.Polygon, holes: list[Cutout], place: Place) -> None:
    """Check that holes are inside their outline and clear of it and of one another."""
    if not holes:
        return
    centres: Floats = np.array([(hole.x, hole.y) for hole in holes])
    radii = np.array([hole.diameter_mm / 2.0 for hole in holes])
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


#: Pieces of one kind differ by no more than this; a little more than makers promise.
KIND_MM = 0.05
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
        ways = (-1,) if piece.turned else (1,) if plan.cut.labels == "kinds" else (1, -1)
        off = min(_apart(piece, other, way) for way in ways)
        what = "they differ by {}"
        if not np.isfinite(off):
            what = "stations, over and under, or holes differ"
        turned = ", turned end for end" if piece.turned else ""
        place.at_most("kind_mm", off, KIND_MM, f"it does not cover {other.id}{turned}: {what}")


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


def _apart(piece: Piece, other: Piece, way: int) -> float:
    """Return how far two pieces differ when superposed by their stations; infinite if at all."""
    ours, theirs = piece.stations[::way], other.stations
    if [s.over for s in ours] != [s.over for s in theirs]:
        return np.inf
    holes, there = piece.holes, other.holes
    if len(holes) != len(there) or len(piece.slots) != len(other.slots):
        return np.inf
    source, target = piece.points[::way], other.points
    if len(source) == 1:
        # One place tells no turn; each lies with its thread from left to right.
        ahead = np.array([[0.0, 0.0], [1.0, 0.0]])
        motion = fit_motion(source + way * ahead, target + ahead)
    else:
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
        sizes = np.array([hole.diameter_mm for hole in holes])
        wanted = np.array([(hole.x, hole.y, hole.diameter_mm) for hole in there])
        wider = np.abs(sizes[:, None] - wanted[None, :, 2])
        off = np.maximum(distances(places, wanted[:, :2]), wider)
        worst = max(worst, float(off.min(axis=1).max()))
    return worst
