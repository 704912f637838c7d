"""Lay the courses of yarns: smooth curves through the crossings, over and under."""

from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.ribbon.project import following_rung, number_rungs, portal_middles
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
class Course:
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
) -> Course:
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
    return tapered(Course(offsets, threads.closed, place, rise, half, room, twins))


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


def tapered(course: Course) -> Course:
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


def draw_spines(course: Course, radius_mm: FloatArray) -> Spines:
    """Draw the middle line of each yarn: smooth curves from guide to guide, without a kink.

    On the surface, the curve is a parabola from guide to guide whose tangents meet where the yarn
    leaves the one's quad for the other's: it runs as the straight lines between these places do,
    of which no two meet but at crossings. Over it, the yarn rises and falls evenly, and is level
    at the guides, a little more than its radius from the surface.

    Parameters
    ----------
    course : Course
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


def _drawn(course: Course, radius_mm: FloatArray, samples: FloatArray) -> Spines:
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
    last = np.ones(len(own), dtype=bool)
    last[start] = False
    point[first[:-1][last]], thick[first[:-1][last]] = (course.place + lift)[last], radius_mm[last]
    inside = np.ones(len(point), dtype=bool)
    inside[first[:-1][last]] = False
    point[inside], way[inside], thick[inside] = curve, slope, radius
    way[~inside] = (course.place[end] - control)[last[end]]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    guide = np.repeat(np.arange(len(own)), own)
    return Spines(first[course.offsets], course.closed, point, way, thick, guide)


def _samples(course: Course, radius_mm: FloatArray, trial: Spines) -> FloatArray:
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


def _near_share(course: Course, radius_mm: FloatArray, guide: IntArray) -> FloatArray:
    """Return which share of a span is about a radius long at the given guide."""
    speed = 2.0 * np.linalg.norm(course.half[guide], axis=1)
    return np.clip(radius_mm[guide] / np.maximum(speed, 1e-300), 2 * _NEAREST, 0.25)
