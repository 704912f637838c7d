"""Decide where fasteners go: few sizes of holes for a job, and their places at every crossing."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from fabweave.core.arc_path import Path
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.piece.joint.ends import CutStrips, Stations
from fabweave.piece.joint.planning import JointPlan
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads

#: Joints are looked for where there is room for a hole that this share of all crossings has.
WANTED_SHARE = 0.9
#: A job has at most so many sizes. What one more has to save, and what it costs a crossing or a
#: joint to have no hole, all as shares of a hole: where 19 crossings hold a large one, another that
#: holds a small one is worth a size, and a joint is worth five crossings. Estimates of a maker's
#: trouble.
_MOST_SIZES, _ONE_MORE, _NO_HOLE, _NO_FASTENER = 3, 0.2, 5.0, 25.0
#: Holes are this many diameters apart, from centre to centre (AC 43.13-1B: 3 D or more).
PITCH_D = 3.0
#: A group of fasteners is tried in this many turns.
_TURNS = 24


@dataclass(frozen=True)
class HoleRule:
    """A hole diameter and how far its centre must keep from every edge, in millimetres."""

    hole_mm: float
    edge_mm: float


@frozen_value
class Groups:
    """Where the fasteners of each joint may go, if there are several.

    All of them go through every layer at the crossing: both laps and the strand above.

    Parameters
    ----------
    angle : (J,) float array
        The turn, in radians, that leaves the first of them most room.
    room_mm : (J,) float array
        Their least distance from the rails of both strands and the ends of the laps.
    """

    angle: FloatArray
    room_mm: FloatArray


def group_offsets(count: int, hole_mm: float, angle: FloatArray) -> FloatArray:
    """Return where fasteners of a group stand about the middle of their crossing.

    They stand evenly on a circle, three diameters from one another: two in a line, three in a
    triangle, four in a square.

    Parameters
    ----------
    count : int
        Two or more.
    hole_mm : float
    angle : (N,) float array
        Of the first one, in radians from the direction of the thread.

    Returns
    -------
    (N, count, 2) float array
        Along the thread that goes under, and to its left.

    Examples
    --------
    >>> group_offsets(2, 2.0, np.zeros(1)).round(9).tolist()
    [[[3.0, 0.0], [-3.0, 0.0]]]
    """
    radius = PITCH_D * hole_mm / (2 * np.sin(np.pi / count))
    turns = angle[:, None] + 2 * np.pi * np.arange(count) / count
    return np.asarray(radius * np.stack((np.cos(turns), np.sin(turns)), axis=2))


def panel_axes(
    ribbons: Ribbons, threads: Threads, passes: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors in space along passes and to their left, in their crossing panels.

    The left one is the direction of the cross-line where a pass enters its panel.
    """
    entry = ribbons.entry[passes]
    left = ribbons.left[entry] - ribbons.right[entry]
    left = left / np.linalg.norm(left, axis=1, keepdims=True)
    normal = ribbons.normal[threads.crossing[passes]]
    return np.cross(left, normal), left


def group_rooms(ribbons: Ribbons, threads: Threads, plan: JointPlan, rule: HoleRule) -> Groups:
    """Find for each joint the turn in which its group of fasteners has most room.

    The room is measured to the straight lines of the panels' sides, of both strands, and to the
    ends of the laps.
    """
    count = plan.rule.fasteners
    angles = np.pi * np.arange(_TURNS) / _TURNS
    room = np.full((len(plan.passes), _TURNS), np.inf)
    along, left = panel_axes(ribbons, threads, plan.passes)
    centre = ribbons.centre[plan.crossing]
    offsets = group_offsets(count, rule.hole_mm, angles).reshape(-1, 2)
    for passes in (plan.passes, other_passes(threads)[plan.passes]):
        entry = ribbons.entry[passes]
        for rail in (ribbons.right, ribbons.left):
            ends = [rail[at] - centre for at in (entry, entry + 1)]
            flat = [np.column_stack([np.einsum("ij,ij->i", end, axis) for axis in (along, left)])
                    for end in ends]  # fmt: skip
            distance = _inside(flat[0], flat[1], offsets).reshape(-1, _TURNS, count)
            room = np.minimum(room, distance.min(axis=2))
    reach = np.abs(offsets[:, 0]).reshape(_TURNS, count).max(axis=1)
    room = np.minimum(room, (plan.lap_mm / 2)[:, None] - reach)
    # Rounding makes ties fall the same way on every machine.
    best = np.argmax(np.round(room, 6), axis=1)
    return Groups(angles[best], room[np.arange(len(room)), best])


def _inside(start: FloatArray, end: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far points (P, 2) are on the origin's side of lines (J, 2), (J, P)."""
    way = end - start
    normal = np.column_stack((-way[:, 1], way[:, 0])) / np.hypot(*way.T)[:, None]
    height = -np.einsum("ij,ij->i", start, normal)
    normal[height < 0] *= -1
    return np.asarray(normal @ points.T + np.abs(height)[:, None])


def other_passes(threads: Threads) -> IntArray:
    """Return for each pass the other one at its crossing."""
    order = np.argsort(threads.crossing, kind="stable").reshape(-1, 2)
    other = np.empty(len(threads.crossing), dtype=np.int64)
    other[order[:, 0]], other[order[:, 1]] = order[:, 1], order[:, 0]
    return other


def choose_rules(
    fits: BoolArray, rules: Sequence[HoleRule], joined: BoolArray | None = None
) -> tuple[int, ...]:
    """Choose the holes for a job: as large as crossings have room for, in few sizes.

    A crossing with a smaller hole than it has room for loses the share by which it is smaller; one
    without a hole loses ``_NO_HOLE``, and a joint, which is glued then, ``_NO_FASTENER``. A size
    more must save ``_ONE_MORE`` of a hole in the mean.

    Parameters
    ----------
    fits : (N, R) bool array
        Which crossings that want a hole have room for each.
    rules : sequence of R HoleRule
        The largest first.
    joined : (N,) bool array, optional
        Which of them have joints; by default none.

    Returns
    -------
    tuple of int
        Numbers of the rules, at most ``_MOST_SIZES``, the largest first; empty if none fits.

    Examples
    --------
    >>> rules = [HoleRule(hole, 2 * hole) for hole in (4.1, 3.3, 1.6)]
    >>> choose_rules(np.array([[True, True, True]] * 5 + [[False, False, True]] * 5), rules)
    (0, 2)
    >>> choose_rules(np.array([[True, True, True]] * 5 + [[False, True, True]] * 5), rules)
    (1,)
    """
    some_fit = fits.any(axis=1)
    without = np.full(len(fits), _NO_HOLE)
    without[np.zeros(len(fits), dtype=np.bool_) if joined is None else joined] = _NO_FASTENER
    fits, without = fits[some_fit], without[some_fit]
    hole = np.array([rule.hole_mm for rule in rules])
    cost = {}
    for count in range(1, min(_MOST_SIZES, len(rules)) + 1):
        for some in combinations(range(len(rules)), count):
            if fits[:, some].any():
                had = (fits[:, some] * hole[list(some)]).max(axis=1)
                lost = np.where(had > 0.0, 1.0 - had / (fits * hole).max(axis=1), without)
                cost[some] = round(float(lost.mean()) + _ONE_MORE * count, 9)
    return min(cost, key=cost.__getitem__, default=())


#: A slot lets its fastener move by this share of its diameter to either side.
SLIDE_D = 0.5


@frozen_value
class Drilled:
    """All holes of a job, in the frames of the strips.

    Parameters
    ----------
    rules : tuple of HoleRule
        The holes that were chosen, the largest first; empty if no crossing has room for any.
    room_mm : (X,) float array
        The distance from the middle of each crossing to every edge; infinite where no hole in
        the middle is wanted.
    size_mm : (X,) float array
        Diameter of the holes of each crossing, NaN where there are none.
    hole_mm : (S,) float array
        Diameter of the fastener in the middle of each station, NaN where there is none.
    slotted : (S,) bool array
        Where a slot takes the place of the round hole.
    more_station : (H,) int array
        The stations of holes that are not in the middle.
    more_point : (H, n, 2) float array
        Their places, in the same order in all layers of a crossing.
    more_mm : (H,) float array
        Their diameter.
    held : (J,) bool array
        Which joints have fasteners.
    fastened : (X,) bool array
        Through which crossings a fastener goes.
    """

    rules: tuple[HoleRule, ...]
    room_mm: FloatArray
    size_mm: FloatArray
    hole_mm: FloatArray
    slotted: BoolArray
    more_station: IntArray
    more_point: FloatArray
    more_mm: FloatArray
    held: BoolArray
    fastened: BoolArray


def drill(
    ribbons: Ribbons,
    weave: Weave,
    plan: JointPlan,
    cut: CutStrips,
    rules: Sequence[HoleRule],
    *,
    slots: bool,
    fastened: BoolArray | None = None,
    holed: BoolArray | None = None,
    alike: IntArray | None = None,
) -> Drilled:
    """Choose few sizes of holes and drill every crossing and joint that has room for one.

    A crossing has a hole in its middle, through both strands, the largest that has room. A riveted
    joint has all the fasteners that were asked for, through both laps and the strand above; where
    there is no room for several it has one, and where there is none for that it has none. Other
    joints have none, nor have the crossings beside over which they lap.

    Parameters
    ----------
    ribbons, weave, plan, cut
        The ribbons, who is on top, the joints, and the pieces as they are cut off.
    rules : sequence of HoleRule
        The preferred first; empty for no holes.
    slots : bool
        Whether a strand that lies under has a slot along it in place of its hole, where it has no
        joint and does not end.
    fastened : (X,) bool array, optional
        Which crossings are to take a fastener; by default all.
    holed : (X,) bool array, optional
        Which crossings are to have holes, whether they are fastened or not; by default those that
        are fastened.
    alike : (X,) int array, optional
        Numbers of crossings, which those share that are to have the same hole.
    """
    stations, threads = cut.stations, weave.threads
    room = middle_room(cut, threads.n_crossings)
    room[plan.crossing[plan.where(lambda kind: not kind.most_fasteners)]] = np.inf
    room[plan.beside] = np.inf
    wanted = np.ones(len(room), dtype=np.bool_) if fastened is None else fastened
    # A joint that takes none is glued: a hole would weaken its lap.
    idle = plan.crossing[~wanted[plan.crossing]]
    room[idle] = np.inf
    asked = wanted if holed is None else wanted | holed
    room[~asked] = np.inf
    alike = np.arange(len(room)) if alike is None else alike
    edges = np.array([rule.edge_mm for rule in rules])
    bounded = np.where(np.isfinite(room), room, -1.0)
    single = _fit_alike(np.asarray(bounded[:, None] >= edges), alike)
    fits, several = single.copy(), plan.rule.fasteners > 1 and not len(idle)
    groups = [_groups(ribbons, weave, plan, cut, rule) for rule in rules if several]
    if several and rules:
        held = np.stack([np.isin(plan.crossing, stations.crossing[g[0]]) for g in groups], axis=1)
        fits[plan.crossing[held.any(axis=1)]] = held[held.any(axis=1)]
    chosen = choose_rules(fits, rules, np.isin(np.arange(len(room)), plan.crossing))
    size = np.full(len(room), np.nan)
    for at in reversed(chosen):
        size[single[:, at]] = rules[at].hole_mm
    hole = size[stations.crossing]
    more_station, more_point = np.zeros(0, dtype=np.int64), np.zeros((0, plan.rule.fasteners, 2))
    more_mm = np.zeros(0)
    for at in chosen if several else ():
        station, point = groups[at]
        # A joint has the largest for which all its fasteners have room.
        new = ~np.isin(stations.crossing[station], stations.crossing[more_station])
        size[stations.crossing[station[new]]] = rules[at].hole_mm
        more_station = np.concatenate((more_station, station[new]))
        more_point = np.concatenate((more_point, point[new]))
        more_mm = np.concatenate((more_mm, np.full(new.sum(), rules[at].hole_mm)))
    order = np.argsort(more_station, kind="stable")
    hole[np.isin(stations.crossing, stations.crossing[more_station])] = np.nan
    inner = np.ones(len(hole), dtype=bool)
    inner[stations.offsets[:-1]] = inner[stations.offsets[1:] - 1] = False
    drilled = ~np.isnan(size)
    return Drilled(
        rules=tuple(rules[at] for at in chosen),
        room_mm=room,
        size_mm=size,
        hole_mm=hole,
        slotted=~np.isnan(hole) & inner & ~weave.over[stations.passes] & slots,
        more_station=more_station[order],
        more_point=more_point[order],
        more_mm=more_mm[order],
        held=drilled[plan.crossing],
        fastened=drilled & wanted,
    )


def _fit_alike(fits: BoolArray, alike: IntArray) -> BoolArray:
    """Leave crossings that are alike the holes that fit all of them, if any fits them at all."""
    held = np.asarray(fits.any(axis=1))
    all_fit = np.ones((int(alike.max(initial=0)) + 1, fits.shape[1]), dtype=np.bool_)
    np.logical_and.at(all_fit, alike[held], fits[held])
    return np.asarray(all_fit[alike] & held[:, None])


def middle_room(cut: CutStrips, n_crossings: int) -> FloatArray:
    """Return for each crossing the edge distance that the middle of all its layers has, (X,).

    Holes three diameters apart want two thirds of the way to the next station, as an edge wants
    two diameters.
    """
    stations = cut.stations
    distance = _edge_distance(cut, np.arange(len(stations.piece)), stations.point)
    step = np.hypot(*np.diff(stations.point, axis=0).T) * (2 / 3)
    same = stations.piece[1:] == stations.piece[:-1]
    distance[1:][same] = np.minimum(distance[1:][same], step[same])
    distance[:-1][same] = np.minimum(distance[:-1][same], step[same])
    room = np.full(n_crossings, np.inf)
    np.minimum.at(room, stations.crossing, distance)
    return room


def _edge_distance(cut: CutStrips, station: IntArray, point: FloatArray) -> FloatArray:
    """Return how far points of stations' pieces are from the pieces' outlines."""
    rings = np.array([shapely.LinearRing(outline) for outline in cut.outlines], dtype=object)
    return np.asarray(shapely.distance(shapely.points(point), rings[cut.stations.piece[station]]))


def _groups(
    ribbons: Ribbons, weave: Weave, plan: JointPlan, cut: CutStrips, rule: HoleRule
) -> tuple[IntArray, FloatArray]:
    """Return the stations with several fasteners, and where these are: (H,), (H, n, 2)."""
    threads, stations, count = weave.threads, cut.stations, plan.rule.fasteners
    groups = group_rooms(ribbons, threads, plan, rule)
    offsets = group_offsets(count, rule.hole_mm, groups.angle)
    joint_of = np.full(threads.n_crossings, -1)
    roomy = groups.room_mm >= rule.edge_mm
    joint_of[plan.crossing[roomy]] = np.flatnonzero(roomy)
    station = np.flatnonzero(joint_of[stations.crossing] >= 0)
    joint = joint_of[stations.crossing[station]]
    point = _in_layers(ribbons, weave, plan, stations, station, joint, offsets[joint])
    owner = np.repeat(station, count)
    distance = _edge_distance(cut, owner, point.reshape(-1, 2)).reshape(-1, count).min(axis=1)
    # Towards the next stations of its piece a group needs a pitch, too.
    reach = float(np.hypot(*offsets[0, 0])) if len(offsets) else 0.0
    steps = np.hypot(*np.diff(stations.point, axis=0).T)
    steps = np.where(stations.piece[1:] == stations.piece[:-1], steps, np.inf)
    nearest = np.minimum(np.append(steps, np.inf), np.append(np.inf, steps))[station]
    fits = (distance >= rule.edge_mm) & (nearest >= 2 * reach + PITCH_D * rule.hole_mm)
    good = np.ones(len(plan.passes), dtype=bool)
    good[joint[~fits]] = False
    return station[good[joint]], point[good[joint]]


def _in_layers(
    ribbons: Ribbons,
    weave: Weave,
    plan: JointPlan,
    stations: Stations,
    station: IntArray,
    joint: IntArray,
    offsets: FloatArray,
) -> FloatArray:
    """Return offsets, which are in the frames of joints, as points of stations, (H, n, 2)."""
    threads = weave.threads
    under = panel_axes(ribbons, threads, plan.passes[joint])
    axes = panel_axes(ribbons, threads, stations.passes[station])
    space = offsets[:, :, :1] * under[0][:, None] + offsets[:, :, 1:] * under[1][:, None]
    left = stations.left[station]
    along = left[:, ::-1] * (1.0, -1.0)
    return np.asarray(
        stations.point[station][:, None]
        + np.einsum("hnk,hk->hn", space, axes[0])[:, :, None] * along[:, None]
        + np.einsum("hnk,hk->hn", space, axes[1])[:, :, None] * left[:, None]
    )


def slot_path(hole_mm: float, point: FloatArray, way: FloatArray) -> Path:
    """Return a slot with round ends: its fastener may move half a diameter to either side.

    Examples
    --------
    >>> slot = slot_path(2.0, np.zeros(2), np.array([1.0, 0.0]))
    >>> np.ptp(slot.points, axis=0).round(9).tolist()
    [4.0, 2.0]
    """
    radius, slide = hole_mm / 2, SLIDE_D * hole_mm
    right = np.array([(slide, -radius), (slide + radius, 0.0), (slide, radius)])
    ring = np.concatenate((right, -right))
    quarter = np.tan(np.pi / 8)
    return Path(
        point + ring @ np.array([way, [-way[1], way[0]]]),
        np.array([quarter, quarter, 0.0, quarter, quarter, 0.0]),
    )
