"""Cut strips off where their pieces end, and shape ends that hold one another."""

import numpy as np
import shapely

from fabweave.core.arc_path import Path, straight_path
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.piece.development import (
    Runs,
    Strips,
    first_and_last_rung,
    rail_at,
    run_rungs,
    trim_strips,
    unfold,
)
from fabweave.piece.joint.planning import JointPlan
from fabweave.piece.outline import (
    SHORTEST_SIDE_MM,
    inscribed_polygon,
    raw_outlines,
    ring_paths,
    simple,
)
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave

#: Marks keep this clear of the edge; a cross has arms of at most 1 mm.
_CLEAR_MM, _ARM_MM = 0.35, 1.0
#: Of a tick: its length as a share of the room across, at most, and at least; and what two leave
#: between them for letters and their clearance, millimetres.
_TICK_SHARE, _TICK_MM, _TICK_LEAST_MM, _LANE_MM = 0.2, 2.0, 0.6, 2.7
#: What is cut off reaches so far over the rails, from which thinned outlines differ a little.
_OVERLAP_MM = 0.2
#: Figures with almost common edges are only laid over one another soundly on a grid.
_GRID_MM = 1e-7
#: Shorter marks do not help.
_SHORTEST_MM = 0.3


@frozen_value
class Stations:
    """Stations of all pieces one after another, each piece in its strip's frame.

    Parameters
    ----------
    offsets : (N + 1,) int array
        Piece ``i`` has the stations ``offsets[i]:offsets[i + 1]``.
    piece, passes, crossing : (S,) int arrays
        The piece, the pass and the crossing of each.
    point : (S, 2) float array
        The middle of the crossing panel.
    way : (S, 2) float array
        Unit vector along the thread.
    rails : (S, 2, 2) float array
        The points of the right and the left rail abreast of the middle.
    left : (S, 2) float array
        Unit vector along the cross-line where the ribbon enters the panel, to the left.
    panel : (S, 4, 2) float array
        The corners of the crossing panel, counter-clockwise from where the right rail enters.
    """

    offsets: IntArray
    piece: IntArray
    passes: IntArray
    crossing: IntArray
    point: FloatArray
    way: FloatArray
    rails: FloatArray
    left: FloatArray
    panel: FloatArray


@frozen_value
class CutStrips:
    """Every piece in its strip's frame: its stations, outline, slots and guides.

    Parameters
    ----------
    before, after : (N,) int arrays
        The joints at the beginning and the end of each piece, 0 where there is none.
    stations : Stations
    strips : Strips
        As far as whole rungs go; pieces may end between two of them.
    entered, left_by : (N,) int arrays
        The strips' rungs where each piece enters its first panel and its last one.
    paths : tuple of Path
        What is cut.
    outlines : tuple of (K, 2) float arrays
        Polygons inscribed in the paths.
    ends : (N, 2, 2) float array
        The middle of the first and of the last cross-line of each piece.
    slots : tuple of (K, 2) float array or None
        The slot that each piece has at its first station.
    """

    before: IntArray
    after: IntArray
    stations: Stations
    strips: Strips
    entered: IntArray
    left_by: IntArray
    paths: tuple[Path, ...]
    outlines: tuple[FloatArray, ...]
    ends: FloatArray
    slots: tuple[FloatArray | None, ...]


def cut_strips(ribbons: Ribbons, weave: Weave, runs: Runs, plan: JointPlan) -> CutStrips:
    """Unfold every piece, as far as its joints want it, and shape its ends.

    Parameters
    ----------
    ribbons, weave, runs, plan
        The ribbons, who is on top, which passes each piece carries, and the joints.
    """
    before, after = joint_numbers(runs, weave)
    first, last = first_and_last_rung(ribbons, runs)
    begin, end = first.astype(np.float64), last.astype(np.float64)
    starts, stops = np.flatnonzero(before), np.flatnonzero(after)
    entered = local_entry(ribbons, runs.thread, runs.first)
    left_by = local_entry(ribbons, runs.thread, runs.last)
    begin[starts] = entered[starts] + plan.begin[before[starts] - 1]
    end[stops] = left_by[stops] + plan.end[after[stops] - 1]
    # Stations need their whole panels, wherever the piece is cut off.
    low = np.minimum(np.floor(begin).astype(np.int64), first)
    high = np.maximum(np.ceil(end).astype(np.int64), last)
    strips = unfold(ribbons, *run_rungs(ribbons, runs.thread, low, high))
    stations = _lay_stations(ribbons, weave, runs, strips, low)
    trimmed = trim_strips(strips, begin - low, end - low)
    rings, middle = raw_outlines(trimmed), (trimmed.right + trimmed.left) / 2
    ends = np.stack((middle[trimmed.offsets[:-1]], middle[trimmed.offsets[1:] - 1]), axis=1)
    slots = _shape_ends(rings, stations, plan, before, after)
    paths = ring_paths(rings)
    outlines = [inscribed_polygon(path) for path in paths]
    for piece in np.flatnonzero(~simple(outlines)).tolist():
        # In a narrow notch the polygon may cross itself though the path does not.
        paths[piece], outlines[piece] = straight_path(rings[piece]), rings[piece]
    to_strip = strips.offsets[:-1] - low
    return CutStrips(
        before,
        after,
        stations,
        strips,
        entered + to_strip,
        left_by + to_strip,
        tuple(paths),
        tuple(outlines),
        ends,
        slots,
    )


def _shape_ends(
    outlines: list[FloatArray],
    stations: Stations,
    plan: JointPlan,
    before: IntArray,
    after: IntArray,
) -> tuple[FloatArray | None, ...]:
    """Shape the outlines, in place, where joints interlock; return the slots.

    Those that cross themselves are left alone: they will not be cut.
    """
    slots: list[FloatArray | None] = [None] * len(outlines)
    sound = simple(outlines).tolist()
    for piece, (second, first) in enumerate(zip(before.tolist(), after.tolist(), strict=True)):
        if not sound[piece]:
            continue
        shape = plan.ends[first - 1] if first else None
        if shape is not None:
            at = int(stations.offsets[piece + 1]) - 1
            rest = _cut_square(outlines[piece], stations, at, shape.end_mm, 1.0)
            if shape.tongue is not None:
                tongue = _placed(shape.tongue, stations, at)
                rest = shapely.union(rest, shapely.Polygon(tongue), grid_size=_GRID_MM)
            outlines[piece] = _ring(rest)
        shape = plan.ends[second - 1] if second else None
        at = int(stations.offsets[piece])
        if shape is not None and shape.begin_mm is not None:
            rest = _cut_square(outlines[piece], stations, at, shape.begin_mm, -1.0)
            if shape.socket is not None:
                socket = _placed(shape.socket, stations, at)
                rest = shapely.difference(rest, shapely.Polygon(socket), grid_size=_GRID_MM)
            outlines[piece] = _ring(rest)
        if shape is not None and shape.slot is not None:
            slots[piece] = _placed(shape.slot, stations, at)
    return tuple(slots)


def _placed(shape: FloatArray, stations: Stations, at: int) -> FloatArray:
    """Bring a shape from a station's frame to its strip's frame."""
    along = stations.way[at]
    return np.asarray(stations.point[at] + shape @ np.array([along, [-along[1], along[0]]]))


def _cut_square(
    outline: FloatArray, stations: Stations, at: int, stop_mm: float, side: float
) -> shapely.Geometry:
    """Return a piece without the part of its last panel that lies beyond a line across.

    ``side`` is 1 to cut off what lies ahead of the line, -1 for what lies behind it.
    """
    panel = stations.panel[at]
    ring = shapely.buffer(shapely.Polygon(panel), _OVERLAP_MM, join_style="mitre")
    size = 2 * float(np.hypot(*np.ptp(panel, axis=0)))
    ahead = np.array([(0.0, -size), (size, -size), (size, size), (0.0, size)]) * (side, 1.0)
    beyond = _placed(ahead + np.array([stop_mm, 0.0]), stations, at)
    off = shapely.intersection(ring, shapely.Polygon(beyond), grid_size=_GRID_MM)
    return shapely.difference(shapely.Polygon(outline), off, grid_size=_GRID_MM)


def _ring(polygon: shapely.Polygon) -> FloatArray:
    """Return the ring of the largest polygon, counter-clockwise, without points that coincide."""
    parts = shapely.get_parts(polygon)
    polygon = parts[np.argmax(shapely.area(parts))]
    ring = shapely.get_coordinates(shapely.normalize(polygon).exterior)[:-1][::-1]
    steps = np.hypot(*(ring - np.roll(ring, 1, axis=0)).T)
    return np.asarray(ring[steps >= SHORTEST_SIDE_MM])


def joint_numbers(runs: Runs, weave: Weave) -> tuple[IntArray, IntArray]:
    """Return the joints before and after each piece, numbered from 1 in order of threads."""
    count = len(runs.thread)
    final = weave.threads.lengths[runs.thread] - 1
    joined = weave.threads.closed[runs.thread] | (runs.last < final)
    after = np.where(joined, np.cumsum(joined), 0)
    starts = np.ones(count, dtype=bool)
    starts[1:] = runs.thread[1:] != runs.thread[:-1]
    begin = np.flatnonzero(starts)
    end = np.append(begin[1:], count) - 1 if count else begin
    before = np.zeros(count, dtype=np.int64)
    before[1:] = after[:-1]
    before[begin] = after[end]  # a ring's first piece follows its last; 0 on an open thread
    return before, after


def guide_lines(cut: CutStrips, plan: JointPlan, marked: BoolArray) -> list[list[FloatArray]]:
    """Return lines to lay joined pieces by, for each piece in its strip's frame.

    A tick inside either edge shows where the other piece's end comes to lie, and a cross in the
    middle of the crossing lies on the other piece's cross.

    Parameters
    ----------
    cut, plan
        What came of :func:`cut_strips`, and the joints.
    marked : (J,) bool array
        Which joints have such lines.
    """
    before, after = cut.before, cut.after
    guides: list[list[FloatArray]] = [[] for _ in before]
    for joints, where, mate, station in (
        (before, cut.entered, plan.end, cut.stations.offsets[:-1]),
        (after, cut.left_by, plan.begin, cut.stations.offsets[1:] - 1),
    ):
        pieces = np.flatnonzero(joints)
        pieces = pieces[marked[joints[pieces] - 1]]
        place = mate[joints[pieces] - 1]
        right = rail_at(cut.strips.right, where[pieces], place)
        left = rail_at(cut.strips.left, where[pieces], place)
        for piece, ends, at in zip(
            pieces.tolist(), zip(right, left, strict=True), station[pieces].tolist(), strict=True
        ):
            guides[piece] += [*edge_ticks(*ends, _CLEAR_MM), *_cross(cut.stations, at)]
    return guides


def edge_ticks(right: FloatArray, left: FloatArray, clear_mm: float = 0.0) -> list[FloatArray]:
    """Return a tick inward from either end of a line across a piece; none where it is too short.

    Parameters
    ----------
    right, left : (2,) float arrays
        The ends of the line, in millimetres.
    clear_mm : float
        How far from these the ticks begin.

    Examples
    --------
    >>> [tick.tolist() for tick in edge_ticks(np.zeros(2), np.array([10.0, 0.0]))]
    [[[0.0, 0.0], [2.0, 0.0]], [[10.0, 0.0], [8.0, 0.0]]]
    >>> edge_ticks(np.zeros(2), np.array([1.0, 0.0]))
    []
    """
    width = float(np.hypot(*(left - right)))
    room = width - 2.0 * clear_mm
    length = max(min(_TICK_SHARE * room, _TICK_MM, (room - _LANE_MM) / 2.0), _TICK_LEAST_MM)
    if room <= 2.0 * length + _CLEAR_MM:
        return []
    inward = (left - right) / width
    ends = right + clear_mm * inward, left - clear_mm * inward
    return [
        np.array([end, end + length * way])
        for end, way in zip(ends, (inward, -inward), strict=True)
    ]


def _cross(stations: Stations, at: int) -> list[FloatArray]:
    """Return a cross in the middle of a crossing."""
    arm = min(_ARM_MM, float(np.hypot(*(stations.rails[at, 1] - stations.rails[at, 0]))) / 2
              - 2 * _CLEAR_MM)  # fmt: skip
    if 2 * arm < _SHORTEST_MM:
        return []
    along, point = stations.way[at], stations.point[at]
    return [
        np.array([point - arm * way, point + arm * way])
        for way in (along, np.array([-along[1], along[0]]))
    ]


def _lay_stations(
    ribbons: Ribbons, weave: Weave, runs: Runs, strips: Strips, low: IntArray
) -> Stations:
    """Find the stations of every strip; ``low`` is the thread's rung with which it begins."""
    threads = weave.threads
    counts = runs.last - runs.first + 1
    offsets = offsets_of(counts)
    piece = np.repeat(np.arange(len(counts)), counts)
    thread = runs.thread[piece]
    position = runs.first[piece] + np.arange(len(piece)) - offsets[:-1][piece]
    passes = threads.offsets[thread] + position % threads.lengths[thread]
    rung = strips.offsets[:-1][piece] + local_entry(ribbons, thread, position) - low[piece]
    rails = np.stack((strips.right, strips.left), axis=1)
    middle = rails.mean(axis=1)
    way = middle[rung + 1] - middle[rung]
    left = rails[rung, 1] - rails[rung, 0]
    return Stations(
        offsets=offsets,
        piece=piece,
        passes=passes,
        crossing=threads.crossing[passes],
        point=(middle[rung] + middle[rung + 1]) / 2,
        way=way / np.hypot(way[:, 0], way[:, 1])[:, None],
        rails=(rails[rung] + rails[rung + 1]) / 2,
        left=left / np.hypot(left[:, 0], left[:, 1])[:, None],
        panel=np.stack(
            (rails[rung, 0], rails[rung + 1, 0], rails[rung + 1, 1], rails[rung, 1]), axis=1
        ),
    )


#: What they may cover of one another, in the mean over the width of the ribbon.
_MOST_MM = 0.03
_FINE_MM = 1e-6


def overlapping_ends(cut: CutStrips, plan: JointPlan) -> IntArray:
    """Return the crossings of joints without a lap whose pieces would overlap when laid flat.

    A ribbon that bends sharply in its plane beside the crossing comes back to it: then both
    pieces want the same place beside their seam.

    Parameters
    ----------
    cut : CutStrips
        The pieces as they are cut.
    plan : JointPlan

    Returns
    -------
    (K,) int array
        Crossings.
    """
    flush = plan.where(lambda kind: not kind.laps)
    begins = {int(joint): piece for piece, joint in enumerate(cut.before) if joint}
    found = [
        int(plan.crossing[joint - 1])
        for piece, joint in enumerate(cut.after.tolist())
        if joint and flush[joint - 1] and begins[joint] != piece
        if _covered_mm(cut, piece, begins[joint]) > _MOST_MM
    ]
    return np.array(found, dtype=np.int64)


def _covered_mm(cut: CutStrips, ends: int, begins: int) -> float:
    """Return what two pieces cover of one another near the panel that both have."""
    stations = cut.stations
    last, first = int(stations.offsets[ends + 1]) - 1, int(stations.offsets[begins])
    panel = stations.panel[last]
    centre, width = panel.mean(axis=0), float(np.hypot(*(panel[3] - panel[0])))
    reach = float(np.hypot(*(panel - centre).T).max()) + 0.5 * width
    turn = complex(*stations.way[last]) * complex(*stations.way[first]).conjugate()
    moved = (cut.outlines[begins] - stations.point[first]) @ _turned(turn) + stations.point[last]
    near = shapely.Point(centre).buffer(reach)
    parts = [
        shapely.intersection(shapely.make_valid(shapely.Polygon(outline)), near, grid_size=_FINE_MM)
        for outline in (cut.outlines[ends], moved)
    ]
    return float(shapely.area(shapely.intersection(*parts, grid_size=_FINE_MM))) / width


def _turned(turn: complex) -> FloatArray:
    """Return the matrix by which rows of points are turned."""
    return np.array([[turn.real, turn.imag], [-turn.imag, turn.real]])
