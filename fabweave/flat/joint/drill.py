"""Drill the pieces: holes and slots at their stations, where there is room for them."""

from collections.abc import Sequence

import numpy as np
import shapely

from fabweave.core.arc_path import Path
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.flat.joint.ends import CutStrips, Stations
from fabweave.flat.joint.holes import (
    PITCH_D,
    HoleRule,
    choose_rules,
    group_offsets,
    group_rooms,
    panel_axes,
)
from fabweave.flat.joint.planning import JointPlan
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

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
    joints have none.

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
