"""Spin yarns along the threads: tubes that cross over and under and do not touch."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    any_normals,
    flags,
    frozen_value,
    no_progress,
    offsets_of,
)
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.ribbon.measures import size_for
from fabweave.ribbon.project import following_rung, number_rungs, portal_middles
from fabweave.ribbon.rules.clearance import segment_distances
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.threads import Threads

#: A yarn's radius grows by at most this share of the way that it goes.
_TAPER = 0.25
#: The middles of two yarns that cross are this much farther apart than they must be.
_LIFT = 1.08
#: Points of a span: one for each of these angles that it turns by, and one for each of these
#: lengths, in radii; at least and at most so many; and how many are tried to find where it turns.
_STEP_DEG, _STEP_RADII = 12.0, 4.0
_FEWEST, _MOST = 3, 48
_TRIAL = 24
#: No two points of a span are nearer than this share of it.
_NEAREST = 0.005


@frozen_value
class YarnGuides:
    """What the yarns pass on their way: *guides* at crossings, turns and open ends.

    Parameters
    ----------
    offsets : (T + 1,) int array
        Thread ``t`` owns the guides ``offsets[t]:offsets[t + 1]``; none if it has no crossing.
    closed : (T,) bool array
        Whether the thread is a ring.
    place : (G, 3) float array
        Points on the surface, in millimetres.
    rise : (G, 3) float array
        The direction in which the yarn leaves the surface: the outward normal of a crossing where
        it lies over, the inward one where it goes under, and nothing at a turn.
    half : (G, 3) float array
        The way from there straight on to where the yarn leaves the crossing's quad, which is as
        far as the way back; at right angles to ``rise``, and nothing at an open end.
    room_mm : (G,) float array
        Half the width of the strip that the thread has at the crossing, or less, so that it
        differs little from guide to guide, and not between the two guides of a crossing.
    twins : (X, 2) int array
        The two guides at each crossing.
    """

    offsets: IntArray
    closed: BoolArray
    place: FloatArray
    rise: FloatArray
    half: FloatArray
    room_mm: FloatArray
    twins: IntArray

    @property
    def spans(self) -> tuple[IntArray, IntArray]:
        """Guides from which a yarn goes on to another, and these others, (S,) each."""
        following = following_rung(self.offsets, self.closed)
        start = np.flatnonzero(following >= 0)
        return start, following[start]


@frozen_value
class Spines:
    """The middle lines of yarns as polylines.

    Parameters
    ----------
    offsets : (T + 1,) int array
        Thread ``t`` owns the points ``offsets[t]:offsets[t + 1]``.
    closed : (T,) bool array
        Whether its last point is followed by its first.
    point : (N, 3) float array
        Positions in millimetres.
    direction : (N, 3) float array
        The unit direction of the curve there, of which the polyline is a likeness.
    radius_mm : (N,) float array
        The yarn's radius at each point.
    guide : (N,) int array
        The guide at each point or before it.
    """

    offsets: IntArray
    closed: BoolArray
    point: FloatArray
    direction: FloatArray
    radius_mm: FloatArray
    guide: IntArray

    @property
    def thread(self) -> IntArray:
        """The thread of each point, (N,)."""
        return np.repeat(np.arange(len(self.closed)), np.diff(self.offsets))

    @property
    def following(self) -> IntArray:
        """The point after each point, (N,): -1 at an open end."""
        return following_rung(self.offsets, self.closed)


def lay_course(
    mesh: PolyMesh, halfedges: Halfedges, weave: Weave, portals: FloatArray | None = None
) -> YarnGuides:
    """Lay out what every yarn passes.

    At a crossing, the quad (tail, face centre, head, face centre) of its edge has two lines that
    join the middles of opposite sides. They are the directions of the two strands, they meet in
    the quad's middle, and the crossing's normal is at right angles to both. Where a thread turns
    back at the boundary, it passes midway between the edge and the centre of its face; where it
    ends there, it ends at the border of its last crossing's quad.

    Parameters
    ----------
    mesh, halfedges, weave
        A mesh, its connectivity, and the weave on it, whose ribbons can be laid: no quad is
        without area.
    portals : (H,) float array, optional
        Where the middles of strands cross the sides of these quads, from vertices to centres: then
        the lines join these places in place of the middles.
    """
    threads = weave.threads
    first = threads.crossing_halfedge
    centres = face_centres(mesh)
    tail, head = mesh.vertices[halfedges.tail[first]], mesh.vertices[halfedges.head[first]]
    left, right = centres[halfedges.face[first]], centres[halfedges.face[halfedges.twin[first]]]
    corners = np.stack([tail, right, head, left], axis=1)
    middles = np.full((len(first), 4), 0.5)
    if portals is not None:
        middles = portal_middles(portals, halfedges, first)
    passed = corners + middles[:, :, None] * (np.roll(corners, -1, axis=1) - corners)
    middle = passed.mean(axis=1)
    # From the side between tail and left centre to the one opposite, and from tail and right.
    rightward, leftward = passed[:, 1] - passed[:, 3], passed[:, 2] - passed[:, 0]
    area = np.cross(rightward, leftward)
    size = np.linalg.norm(area, axis=1)
    normal = area / size[:, None]
    longer = np.maximum(np.linalg.norm(rightward, axis=1), np.linalg.norm(leftward, axis=1))
    # As much as on the portal that is passed nearest to one of its ends.
    share = 2.0 * np.minimum(middles, 1.0 - middles).min(axis=1)

    crossing = threads.crossing
    # Seen from its first half-edge, a strand that arrives forward comes from the left.
    seen_first = first[crossing] == threads.halfedge
    across = np.where(threads.forward[:, None], rightward[crossing], leftward[crossing] * -1.0)
    across = np.where(seen_first[:, None], across, -across)

    offsets, guide = number_rungs(threads, 1, 1)
    count = int(offsets[-1])
    place, rise, half = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 3))
    room = np.zeros(count)
    place[guide], half[guide] = middle[crossing], across / 2
    rise[guide] = np.where(weave.over, 1.0, -1.0)[:, None] * normal[crossing]
    room[guide] = (share * size / longer / 2)[crossing]
    ends = np.flatnonzero(~threads.closed & threads.woven)
    for end, inner, way in ((offsets[ends], offsets[ends] + 1, -1.0),
                            (offsets[ends + 1] - 1, offsets[ends + 1] - 2, 1.0)):  # fmt: skip
        place[end] = place[inner] + way * half[inner]
        rise[end], room[end] = rise[inner], room[inner]
    if len(threads.turn_pass):
        earlier = np.arange(len(threads.turn_pass))
        earlier -= np.searchsorted(threads.turn_pass, threads.turn_pass)
        turn = guide[threads.turn_pass] + 1 + earlier
        place[turn], half[turn], room[turn] = _turns(mesh, halfedges, threads, centres, portals)
    twins = guide[strand_passes(weave)]
    return tapered(YarnGuides(offsets, threads.closed, place, rise, half, room, twins))


def _turns(
    mesh: PolyMesh,
    halfedges: Halfedges,
    threads: Threads,
    centres: FloatArray,
    portals: FloatArray | None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return place, half way and room of every turn: between its portals, parallel to the edge."""
    edge, forward = threads.turn_halfedge, threads.turn_forward[:, None]
    tail, head = mesh.vertices[halfedges.tail[edge]], mesh.vertices[halfedges.head[edge]]
    centre = centres[halfedges.face[edge]]
    base = np.linalg.norm(head - tail, axis=1)
    area = np.linalg.norm(np.cross(tail - centre, head - centre), axis=1)
    share = np.full((len(edge), 1), 0.5)
    if portals is not None:
        share = (portals[edge] + portals[halfedges.prev[edge]])[:, None] / 2
    place = (1.0 - share) * (tail + head) / 2 + share * centre
    half = (1.0 - share) * np.where(forward, head - tail, tail - head) / 2
    room = np.minimum(share, 1.0 - share)[:, 0] * area / np.maximum(base, 1e-300)
    return place, half, room


def tapered(course: YarnGuides) -> YarnGuides:
    """Return the course with rooms that differ little from guide to guide; none is larger."""
    start, end = course.spans
    slack = _TAPER * np.linalg.norm(course.place[end] - course.place[start], axis=1)
    room = course.room_mm.copy()
    # Each round carries a narrow place one guide farther, where it narrows less.
    for _ in range(len(room)):
        before = room.copy()
        np.minimum.at(room, end, before[start] + slack)
        np.minimum.at(room, start, before[end] + slack)
        room[course.twins] = room[course.twins].min(axis=1, keepdims=True)
        if np.array_equal(room, before):
            break
    return replace(course, room_mm=room)


def draw_spines(course: YarnGuides, radius_mm: FloatArray) -> Spines:
    """Draw the middle line of each yarn: smooth curves from guide to guide, without a kink.

    On the surface, the curve is a parabola from guide to guide whose tangents meet where the yarn
    leaves the one's quad for the other's: it runs as the straight lines between these places do,
    of which no two meet but at crossings. Over it, the yarn rises and falls evenly, and is level
    at the guides, a little more than its radius from the surface.

    Parameters
    ----------
    course : YarnGuides
    radius_mm : (G,) float array
        The radius at each guide.

    Returns
    -------
    Spines
        With points where the yarns turn, and near the guides, so that the polylines are level
        there, too.
    """
    trial = np.arange(len(course.spans[0]) * _TRIAL) / _TRIAL
    return _drawn(course, radius_mm, _samples(course, radius_mm, _drawn(course, radius_mm, trial)))


def _drawn(course: YarnGuides, radius_mm: FloatArray, samples: FloatArray) -> Spines:
    """Draw spines with points at the given samples: numbers of spans plus shares of them."""
    start, end = course.spans
    # An open end is where the yarn leaves the quad itself; there it goes straight on.
    ends = ~(course.half[start].any(axis=1) & course.half[end].any(axis=1))
    control = course.place[start] + course.half[start]
    control[ends] = (course.place[start[ends]] + course.place[end[ends]]) / 2
    lift = (_LIFT * radius_mm)[:, None] * course.rise
    span = np.floor(samples).astype(np.int64)
    t = samples - span
    a, b = start[span], end[span]
    ease = t * t * (3.0 - 2.0 * t)
    s, e = t[:, None], ease[:, None]
    curve = (1 - s) ** 2 * course.place[a] + 2 * s * (1 - s) * control[span]
    curve += s**2 * course.place[b] + (1 - e) * lift[a] + e * lift[b]
    slope = (1 - s) * (control[span] - course.place[a]) + s * (course.place[b] - control[span])
    slope += 3 * s * (1 - s) * (lift[b] - lift[a])
    radius = (1.0 - ease) * radius_mm[a] + ease * radius_mm[b]

    # The last guide of an open yarn starts no span, and is a point of its own.
    own = np.ones(len(course.place), dtype=np.int64)
    own[start] = np.bincount(span, minlength=len(start))
    first = offsets_of(own)
    point, way, thick = np.empty((first[-1], 3)), np.empty((first[-1], 3)), np.empty(first[-1])
    last = ~flags(len(own), start)
    point[first[:-1][last]], thick[first[:-1][last]] = (course.place + lift)[last], radius_mm[last]
    inside = ~flags(len(point), first[:-1][last])
    point[inside], way[inside], thick[inside] = curve, slope, radius
    way[~inside] = (course.place[end] - control)[last[end]]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    guide = np.repeat(np.arange(len(own)), own)
    return Spines(first[course.offsets], course.closed, point, way, thick, guide)


def _samples(course: YarnGuides, radius_mm: FloatArray, trial: Spines) -> FloatArray:
    """Return where spans need points to be smooth, each span's start among them.

    A span has points where it turns, one for each dozen degrees or so, others along its length,
    and one near either end: what crosses there is as near as can be.
    """
    start, end = course.spans
    following = trial.following
    here = np.flatnonzero(following >= 0)  # all but open ends: one for each of the trial's points
    ahead = following[here]
    way = np.zeros_like(trial.point)
    way[here] = trial.point[ahead] - trial.point[here]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    cosine = np.einsum("ij,ij->i", way[here], way[ahead])
    turn = np.where(following[ahead] >= 0, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), 0.0)
    # The angle at a point counts half for the stretch before and half for the one after.
    corner = np.zeros(len(trial.point))
    corner[ahead] = turn
    length = np.linalg.norm(trial.point[ahead] - trial.point[here], axis=1)
    load = (turn + corner[here]) / 2 / _STEP_DEG + length / (_STEP_RADII * trial.radius_mm[here])
    load = load.reshape(len(start), _TRIAL)
    counts = np.clip(np.ceil(load.sum(axis=1)), _FEWEST, _MOST)
    load *= (counts / load.sum(axis=1))[:, None]
    reached = np.concatenate(([0.0], np.cumsum(load)))
    at = np.interp(np.arange(int(counts.sum())), reached, np.arange(len(reached)) / _TRIAL)
    span = np.repeat(np.arange(len(start)), counts.astype(np.int64))
    share = np.clip(at - span, 0.0, 1.0)

    number = np.arange(len(start))
    near = [_near_share(course, radius_mm, guide) for guide in (start, end)]
    span = np.concatenate((span, number, number, number))
    share = np.concatenate((share, near[0], 1.0 - near[1], np.zeros(len(start))))
    order = np.lexsort((share, span))
    span, share = span[order], share[order]
    # Of points that nearly coincide, one does; none is near a span's end but the next one's start.
    kept = np.concatenate(([True], (np.diff(span) > 0) | (np.diff(share) > _NEAREST)))
    kept &= share < 1.0 - _NEAREST
    return span[kept] + share[kept]


def _near_share(course: YarnGuides, radius_mm: FloatArray, guide: IntArray) -> FloatArray:
    """Return which share of a span is about a radius long at the given guide."""
    speed = 2.0 * np.linalg.norm(course.half[guide], axis=1)
    return np.clip(radius_mm[guide] / np.maximum(speed, 1e-300), 2 * _NEAREST, 0.25)


#: Segments are looked up in batches of this many, which bounds the memory.
_BATCH = 4096


def bends_too_tightly(spines: Spines) -> IntArray:
    """Return the points at which a yarn's cross-sections would cut one another.

    Cross-sections stand at right angles to the curve. Each must lie wholly behind the next one's
    plane, and in front of the one before; then the stretches between them meet in the
    cross-sections only.

    Returns
    -------
    int array
        Points that are too near to the next one for the angles there.
    """
    following = spines.following
    here = np.flatnonzero(following >= 0)
    after = following[here]
    edge = spines.point[after] - spines.point[here]
    tangent, radius = spines.direction, spines.radius_mm
    # The sine of the angle between the two planes bounds what a section reaches towards the other.
    sine = np.linalg.norm(np.cross(tangent[here], tangent[after]), axis=1)
    ahead = np.einsum("ij,ij->i", edge, tangent[here])
    behind = np.einsum("ij,ij->i", edge, tangent[after])
    turned = np.einsum("ij,ij->i", tangent[here], tangent[after]) <= 0.0
    bad = (ahead <= radius[after] * sine) | (behind <= radius[here] * sine) | turned
    return here[bad]


def touching_points(spines: Spines, *, enough: int | None = None) -> IntArray:
    """Return where yarns touch that are not the same bit of yarn, (K, 2) pairs of points.

    Yarns whose middle lines are everywhere farther apart than both radii together do not touch,
    and nor do their facets: every point of a facet is nearer to the middle line than the radius.
    Along one and the same yarn, points nearer than half a turn of the tightest bend are left to
    ``bends_too_tightly``.

    Parameters
    ----------
    spines : Spines
    enough : int or None
        Of more pairs than these, not all need be found.

    Returns
    -------
    (K, 2) int array
        The stretches from these points to the next ones touch.
    """
    following = spines.following
    here = np.flatnonzero(following >= 0)
    ends = spines.point[here], spines.point[following[here]]
    length = np.linalg.norm(ends[1] - ends[0], axis=1)
    radius = np.maximum(spines.radius_mm[here], spines.radius_mm[following[here]])
    thread = spines.thread[here]
    past = np.cumsum(length)
    around = np.bincount(thread, weights=length, minlength=len(spines.closed))
    around = np.where(spines.closed, around, np.inf)
    middle = (ends[0] + ends[1]) / 2
    found, count = [np.zeros((0, 2), dtype=np.int64)], 0
    for first, second in _near_pairs(middle, radius + length / 2):
        same = thread[first] == thread[second]
        away = np.abs((past - length / 2)[first] - (past - length / 2)[second])
        away = np.minimum(away, around[thread[first]] - away) - (length[first] + length[second]) / 2
        reach = np.maximum(radius[first], radius[second])
        apart = np.flatnonzero(~same | (away >= np.pi * reach))
        first, second = first[apart], second[apart]  # noqa: PLW2901 - the batch, thinned out
        segments = (end[of].T for of in (first, second) for end in ends)
        distance, _ = segment_distances(*segments)
        bad = np.flatnonzero(distance <= radius[first] + radius[second])
        found.append(np.column_stack((here[first[bad]], here[second[bad]])))
        count += len(bad)
        if enough is not None and count > enough:
            break
    return np.concatenate(found)


def _near_pairs(middle: FloatArray, reach: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield pairs of balls that overlap, each once, in batches.

    Balls go in classes by half powers of two of their size, and each looks for others in its own
    class and in those of larger ones, so that small ones are not compared over large distances.
    """
    level = np.floor(2.0 * np.log2(np.maximum(reach, 1e-300)))
    for size in np.unique(level).tolist():
        own, upto = np.flatnonzero(level == size), np.flatnonzero(level <= size)
        tree, most = cKDTree(middle[own]), float(reach[own].max())
        for first in range(0, len(upto), _BATCH):
            rows = upto[first : first + _BATCH]
            found = tree.query_ball_point(middle[rows], reach[rows] + most)
            ball = np.repeat(rows, list(map(len, found)))
            other = own[np.concatenate(found).astype(np.int64)]
            away = middle[ball] - middle[other]
            overlapping = np.einsum("ij,ij->i", away, away) <= (reach[ball] + reach[other]) ** 2
            kept = overlapping & ((level[ball] < size) | (ball < other))
            yield ball[kept], other[kept]


def sweep(spines: Spines, sides: int) -> FloatArray:
    """Return the corners of a regular polygon around each point, turned as little as can be.

    From point to point the frame is carried on by two reflections, which turn it about the
    curve's direction as little as can be. Around a ring some angle is left over; it is spread
    evenly over the ring's length, so that the ends meet.

    Parameters
    ----------
    spines : Spines
        The middle lines.
    sides : int
        Corners of each polygon.

    Returns
    -------
    (N, sides, 3) float array
        Counter-clockwise around the walking direction, at the radius of each point.

    References
    ----------
    Wang, Jüttler, Zheng, Liu, "Computation of rotation minimizing frames", ACM TOG 27(1), 2008.
    """
    direction = spines.direction
    first = any_normals(direction)
    second = np.cross(direction, first)
    turn = _frame_angles(spines, direction, first, second)
    around = turn[:, None] + 2.0 * np.pi * np.arange(sides) / sides
    radius = spines.radius_mm[:, None]
    corner = (radius * np.cos(around))[:, :, None] * first[:, None, :]
    corner += (radius * np.sin(around))[:, :, None] * second[:, None, :]
    return np.asarray(spines.point[:, None, :] + corner, dtype=np.float64)


def _frame_angles(
    spines: Spines, direction: FloatArray, first: FloatArray, second: FloatArray
) -> FloatArray:
    """Return how far the least turned frame stands from the given one at each point, (N,)."""
    following = spines.following
    here = np.flatnonzero(following >= 0)
    after = following[here]
    edge = spines.point[after] - spines.point[here]
    carried = _carried(first[here], direction[here], direction[after], edge)
    step = np.zeros(len(direction))
    step[here] = np.arctan2(
        np.einsum("ij,ij->i", carried, second[after]), np.einsum("ij,ij->i", carried, first[after])
    )
    length = np.zeros(len(direction))
    length[here] = np.linalg.norm(edge, axis=1)
    turn, way = _running(step, spines.offsets), _running(length, spines.offsets)
    filled = np.flatnonzero(np.diff(spines.offsets) > 0)
    last = spines.offsets[filled + 1] - 1
    around, total = np.zeros(len(spines.closed)), np.ones(len(spines.closed))
    # What is left over after a ring, the nearer way round.
    left_over = np.remainder(turn[last] + step[last] + np.pi, 2.0 * np.pi) - np.pi
    around[filled] = np.where(spines.closed[filled], left_over, 0.0)
    total[filled] = np.maximum(way[last] + length[last], 1e-300)
    thread = spines.thread
    return turn - around[thread] * way / total[thread]


def _carried(
    normal: FloatArray, direction: FloatArray, onward: FloatArray, edge: FloatArray
) -> FloatArray:
    """Carry normals by two reflections: across each edge's middle, then into the new plane."""
    normal, reflected = _reflected(normal, edge), _reflected(direction, edge)
    return _reflected(normal, onward - reflected)


def _reflected(vector: FloatArray, mirror: FloatArray) -> FloatArray:
    """Reflect vectors in the planes across others; where these vanish, nothing changes."""
    size = np.einsum("ij,ij->i", mirror, mirror)
    share = np.einsum("ij,ij->i", vector, mirror) / np.where(size > 1e-300, size, 1.0)
    return np.asarray(vector - 2.0 * np.where(size > 1e-300, share, 0.0)[:, None] * mirror)


def _running(values: FloatArray, offsets: IntArray) -> FloatArray:
    """Return the sum of all values of the same thread before each one."""
    before = np.concatenate(([0.0], np.cumsum(values)))[:-1]
    filled = np.diff(offsets) > 0
    return before - np.repeat(before[offsets[:-1][filled]], np.diff(offsets)[filled])


#: Sides of a tube: fewer than three are none, and more than these are never seen.
FEWEST_SIDES, MOST_SIDES = 3, 128
#: Yarns without a radius are so thick, relative to the thickest that have room.
_THICKNESS = 0.95
#: No yarn is thicker than this share of its room; how much thinner the next one tried is; and how
#: finely the thickest is found.
_LARGEST, _SHRINK, _FINER = 0.75, 0.85, 4
#: The share of guides about which yarns may be thinner than the rest, and how much at a time.
_FEW, _THIN = 0.03, 0.85
#: No guide has more points about it, or pairs of stretches that touch, than these; more of them
#: belong to several guides.
_MOST_BENDS, _MOST_PAIRS = 100, 400
#: Thinner than this share of the room there is no yarn left.
_THINNEST = 0.01


@frozen_value
class Yarns:
    """Yarns as tubes.

    Parameters
    ----------
    offsets : (T + 1,) int array
        Thread ``t`` owns the cross-sections ``offsets[t]:offsets[t + 1]``; none if it has no
        crossing.
    closed : (T,) bool array
        Whether the yarn is a ring; others end in flat caps.
    spine : (N, 3) float array
        The middle of each cross-section, in millimetres.
    radius_mm : (N,) float array
        Its radius.
    rim : (N, S, 3) float array
        Its S corners, counter-clockwise around the walking direction.
    pass_offsets : (T + 1,) int array
        Thread ``t`` makes the passes ``pass_offsets[t]:pass_offsets[t + 1]``.
    entry : (P,) int array
        The cross-section at which each pass is at its crossing.
    most : float
        How many times as thick the yarns could be without touching, at least 1.
    """

    offsets: IntArray
    closed: BoolArray
    spine: FloatArray
    radius_mm: FloatArray
    rim: FloatArray
    pass_offsets: IntArray
    entry: IntArray
    most: float

    @property
    def sides(self) -> int:
        """Number of sides of the tubes."""
        return self.rim.shape[1]


def spin_yarns(
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    labels: Sequence[str],
    *,
    radius_mm: float | None = None,
    sides: int = 12,
    portals: FloatArray | None = None,
    progress: Progress = no_progress,
) -> Yarns:
    """Spin a tube along every thread, as thick as can be or as asked.

    Each tube follows a curve through the thread's crossings that lies a little more than its
    radius above or below the surface there. Without a radius, yarns are thick where the weave is
    wide and thin where it is narrow: the radius is a share of the room at each crossing, and the
    share is the largest at which hardly any yarns touch, less 5 %. About the
    few crossings where some still do, they are made thinner.

    Parameters
    ----------
    mesh, halfedges, weave
        A mesh, its connectivity, and the weave on it.
    labels : sequence of str
        Names of the threads, for messages.
    radius_mm : float or None
        One radius for all yarns, or None for the thickest that have room.
    sides : int
        Sides of the tubes, at least 3.
    portals : (H,) float array, optional
        Where yarns cross their portals, from vertices to centres; in the middle by default.
    progress : callable
        Told which radius is being tried.

    Returns
    -------
    Yarns
        Closed surfaces, one for each thread with a crossing, that touch neither themselves nor
        one another.

    Raises
    ------
    InputError
        If the radius or number of sides makes no sense.
    CannotMakeError
        If yarns of the radius touch, or yarns of any radius do.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects" (2011), section 9: yarns.
    Wang, Jüttler, Zheng, Liu, "Computation of rotation minimizing frames" (2008).

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = torus(8, 4, 35.0, 15.0)
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> yarns = spin_yarns(mesh, halfedges, weave, "ABCDEFGH", radius_mm=1.0, sides=6)
    >>> len(yarns.closed), yarns.sides, bool(yarns.most > 1.5)
    (8, 6, True)
    """
    if not FEWEST_SIDES <= sides <= MOST_SIDES:
        raise InputError(
            f"a yarn has {sides} sides; it needs {FEWEST_SIDES} at least, and {MOST_SIDES} do"
        )
    if radius_mm is not None and not (np.isfinite(radius_mm) and radius_mm > 0.0):
        raise InputError(f"the radius of the yarns is {radius_mm} mm; it must be positive")
    course = lay_course(mesh, halfedges, weave, portals)
    if len(course.place) == 0:
        raise CannotMakeError("there is nothing to spin: nothing crosses anything on this mesh")
    if radius_mm is None:
        few = int(_FEW * len(course.place))
        most, _ = _largest_share(course, course.room_mm, few, progress)
        course = _thinned(course, _THICKNESS * most, labels, progress)
        radii, times = _THICKNESS * most * course.room_mm, 1.0 / _THICKNESS
    else:
        radii, times = _even_radii(course, radius_mm, mesh, labels, progress)
    spines = draw_spines(course, radii)
    return Yarns(
        offsets=spines.offsets,
        closed=spines.closed,
        spine=spines.point,
        radius_mm=spines.radius_mm,
        rim=sweep(spines, sides),
        pass_offsets=weave.threads.offsets,
        entry=np.searchsorted(spines.guide, number_rungs(weave.threads, 1, 1)[1]),
        most=times,
    )


def _even_radii(
    course: YarnGuides,
    radius_mm: float,
    mesh: PolyMesh,
    labels: Sequence[str],
    progress: Progress,
) -> tuple[FloatArray, float]:
    """Return the same radius for all guides, if yarns have room for it; and how often it fits."""
    # Shares are those of the narrowest room.
    shape = np.full(len(course.place), float(course.room_mm.min()))
    share, hampered = _largest_share(course, shape, 0, progress)
    most_mm = share * float(shape[0])
    radii = np.full(len(shape), radius_mm)
    if radius_mm <= most_mm and len(_hampered(course, radii, allowed=0)) == 0:
        return radii, max(most_mm / radius_mm, 1.0)
    if len(hampered):
        raise _no_room(course, labels, hampered)
    size_mm = float(np.ptp(mesh.vertices, axis=0).max())
    raise CannotMakeError(
        f"yarns with a radius of {radius_mm:g} mm would touch: {most_mm:.3g} mm is the largest "
        f"that has room; use --yarn-radius {_rounded_down(most_mm):g}mm, or "
        f"--size {size_for(most_mm, radius_mm, size_mm)}mm, or leave the radius to fabweave"
    )


def _rounded_down(value: float) -> float:
    """Return a value with two digits that is not larger."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.round(np.floor(value / unit * (1 + 1e-9)) * unit, 9))


def _hampered(course: YarnGuides, radius_mm: FloatArray, *, allowed: int | None = None) -> IntArray:
    """Return the guides about which yarns of given radii (G,) get in their own or others' way.

    If these are more than allowed, only some of them are returned.
    """
    spines = draw_spines(course, radius_mm)
    following = spines.following
    bad = bends_too_tightly(spines)
    if allowed is None or len(bad) <= allowed * _MOST_BENDS:
        enough = None if allowed is None else _MOST_PAIRS * allowed
        bad = np.concatenate((bad, touching_points(spines, enough=enough).ravel()))
    return np.unique(spines.guide[np.concatenate((bad, following[bad]))])


def _largest_share(
    course: YarnGuides, shape: FloatArray, allowed: int, progress: Progress
) -> tuple[float, IntArray]:
    """Return the largest share of the room at which yarns touch about few guides, and these."""
    share, tried = _LARGEST, 0
    while True:
        progress("yarns", tried, tried + _FINER)
        hampered = _hampered(course, share * shape, allowed=allowed)
        if len(hampered) <= allowed or share < _THINNEST:
            break
        share *= _SHRINK
        tried += 1
    too_large = min(share / _SHRINK, _LARGEST)
    for step in range(_FINER if share >= _THINNEST else 0):
        progress("yarns", tried + step, tried + _FINER)
        middle = (share + too_large) / 2
        found = _hampered(course, middle * shape, allowed=allowed)
        if len(found) <= allowed:
            share, hampered = middle, found
        else:
            too_large = middle
    return share, hampered


def _thinned(
    course: YarnGuides, share: float, labels: Sequence[str], progress: Progress
) -> YarnGuides:
    """Return the course with less room about places where yarns would touch, so that none do.

    Raises
    ------
    CannotMakeError
        If they touch though hardly any room is left.
    """
    whole, tried = course.room_mm, 0
    while True:
        progress("yarns", tried, tried + 1)
        hampered = _hampered(course, share * course.room_mm)
        if len(hampered) == 0:
            return course
        room = course.room_mm.copy()
        room[hampered] *= _THIN
        course = tapered(replace(course, room_mm=room))
        tried += 1
        lost = hampered[room[hampered] < _THINNEST * whole[hampered]]
        if len(lost):
            raise _no_room(course, labels, lost)


def _no_room(course: YarnGuides, labels: Sequence[str], lost: IntArray) -> CannotMakeError:
    """Say where yarns touch however thin they are."""
    threads = np.searchsorted(course.offsets, lost, side="right") - 1
    names = " and ".join(sorted({labels[thread] for thread in threads[:4]}))
    x, y, z = course.place[lost[0]]
    return CannotMakeError(
        f"yarns of any radius would touch about {len(lost)} crossings (thread {names} at "
        f"{x:.1f}, {y:.1f}, {z:.1f} mm): the surface runs through itself there, or a face is too "
        "thin; move its vertices apart"
    )
