"""Build pieces from runs: outlines, stations, cut-outs and joints."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import shapely

from fabweave.core.arc_path import Path, straight_path
from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    flags,
    frozen_value,
    places_in_groups,
)
from fabweave.piece.brief import Brief
from fabweave.piece.congruence import (
    DECIMALS,
    FIT_MM,
    SAME_MM,
    Kinds,
    alike_crossings,
    compare_pieces,
    equal_pieces,
)
from fabweave.piece.development import Runs
from fabweave.piece.joined_object import JoinedObject
from fabweave.piece.joint.ends import CutStrips, Stations, cut_strips, guide_lines
from fabweave.piece.joint.fastening import (
    fastened_crossings,
    foot_crossings,
    hanging_crossings,
    parse_fastening,
    parse_hanging,
)
from fabweave.piece.joint.holes import Drilled, HoleRule, drill, middle_room, slot_path
from fabweave.piece.joint.kinds import GLUE, JointKind, JointRule, parse_joint
from fabweave.piece.joint.planning import JointPlan, plan_joints
from fabweave.piece.outline import RigidMotion, resting_frame
from fabweave.piece.piece import Joint, Piece, Slot
from fabweave.piece.rim_ring import RimRing, beside_rims, plan_rings, rim_rungs
from fabweave.piece.split.preferences import KIND_PRICES
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave, strand_passes

#: Says which crossings take a fastener, as :func:`build_pieces` has it.
FastenerChoice: TypeAlias = Callable[[BoolArray, IntArray, BoolArray], BoolArray]
#: Less of a panel than this is no cover, square millimetres.
_LEAST_MM2 = 0.01
_POLYGON = shapely.GeometryType.POLYGON


def covered_parts(
    ribbons: Ribbons, weave: Weave, stations: Stations
) -> tuple[FloatArray | None, ...]:
    """Return the part of each crossing panel that the strand above covers.

    Both panels of a crossing are level, so the upper one is dropped along their normal. What lies
    beyond the panel, where the ribbon is folded, counts as seen.

    Parameters
    ----------
    ribbons, weave
        The ribbons in space, and who is on top.
    stations : Stations
        Where the panels lie on the strips.

    Returns
    -------
    tuple of (K, 2) float array or None
        For each station a simple polygon in its strip's frame; None where the piece is on top.
    """
    parts: list[FloatArray | None] = [None] * len(stations.passes)
    under = np.flatnonzero(~weave.over[stations.passes])
    if not len(under):
        return tuple(parts)
    above = strand_passes(weave)[:, 1]
    own = _panels(ribbons, stations.passes[under])
    other = _panels(ribbons, above[stations.crossing[under]])
    panel = stations.panel[under]
    below, over = shapely.polygons(panel), shapely.polygons(_dropped(other, own, panel))
    sound = shapely.is_valid(below) & shapely.is_valid(over)
    shared = shapely.intersection(below[sound], over[sound])
    whole = (shapely.get_type_id(shared) == _POLYGON) & (shapely.area(shared) > _LEAST_MM2)
    for at, part in zip(under[sound][whole].tolist(), shared[whole].tolist(), strict=True):
        parts[at] = shapely.get_coordinates(part.exterior)[:-1]
    return tuple(parts)


def _panels(ribbons: Ribbons, passes: IntArray) -> FloatArray:
    """Return the corners of crossing panels, (N, 4, 3), in the order of ``Stations.panel``."""
    entry = ribbons.entry[passes]
    leave = entry + 1
    return np.stack(
        (ribbons.right[entry], ribbons.right[leave], ribbons.left[leave], ribbons.left[entry]),
        axis=1,
    )


def _dropped(other: FloatArray, own: FloatArray, panel: FloatArray) -> FloatArray:
    """Drop the corners of panels in space on others, and return where they fall on these, flat."""
    sides = np.stack((own[:, 1] - own[:, 0], own[:, 3] - own[:, 0]), axis=1)
    flat = np.stack((panel[:, 1] - panel[:, 0], panel[:, 3] - panel[:, 0]), axis=1)
    gram = sides @ np.swapaxes(sides, 1, 2)
    away = (other - own[:, :1]) @ np.swapaxes(sides, 1, 2)
    shares = np.linalg.solve(gram, np.swapaxes(away, 1, 2))
    return np.asarray(np.swapaxes(shares, 1, 2) @ flat + panel[:, :1])


#: Pieces that rotations carry onto one another differ by less; the files by no more than a digit.
_ROUNDED_MM = 1e-3


@frozen_value
class PieceSet:
    """All pieces and joints of a job.

    Parameters
    ----------
    pieces : tuple of Piece
        In order of threads and along each thread.
    joints : tuple of Joint
    rules : tuple of HoleRule
        The holes that were chosen, the largest first; empty if no crossing has room for any.
    size_mm : (X,) float array
        Diameter of the holes of each crossing, NaN where there are none.
    room_mm : (X,) float array
        For each crossing the largest distance from a hole's centre to an edge that every layer
        there has room for; infinite where no hole is wanted.
    plan : JointPlan
        What was asked of the joints, and what they have room for.
    fastened : (X,) bool array
        Through which crossings a fastener goes.
    kinds : Kinds
        Which pieces are the same; those that are, are equal to the last digit but for what is
        engraved, if they were as near as ``fit_mm``.
    fit_mm : float
    rings : tuple of RimRing
        The rings along rims.
    hanging : (X,) bool array or None
        The crossings that carry something besides the weave, if that is known.
    glued : bool
        Whether all crossings are glued.
    tied : int
        How many crossings are tied to a base.
    """

    pieces: tuple[Piece, ...]
    joints: tuple[Joint, ...]
    rules: tuple[HoleRule, ...]
    size_mm: FloatArray
    room_mm: FloatArray
    plan: JointPlan
    fastened: BoolArray
    kinds: Kinds
    fit_mm: float
    rings: tuple[RimRing, ...] = ()
    hanging: BoolArray | None = None
    glued: bool = False
    tied: int = 0

    @property
    def fitted_mm(self) -> FloatArray:
        """How far each piece was moved to be equal to others, (N,): 0 where it was not."""
        off = self.kinds.off_mm
        return np.where(off <= self.fit_mm, off, 0.0)


def build_pieces(
    ribbons: Ribbons,
    weave: Weave,
    runs: Runs,
    labels: Sequence[str],
    rules: Sequence[HoleRule],
    plan: JointPlan | None = None,
    *,
    slots: bool = False,
    cut: CutStrips | None = None,
    fastened: BoolArray | None = None,
    hold: FastenerChoice | None = None,
    holed: BoolArray | None = None,
    alike: bool = False,
    supply: IntArray | None = None,
    fit: bool = False,
) -> PieceSet:
    """Build every piece with its stations, holes and joints.

    Pieces that are the same but for rounding are made equal to the first of them.

    Each crossing has the largest of a few chosen holes for which it has room in all its layers,
    those of pieces that are alike the same one.

    Parameters
    ----------
    ribbons, weave, runs
        The ribbons, who is on top, and which passes each piece carries.
    labels : sequence of str
        Names of the threads; pieces are numbered along each thread: ``A1``, ``A2``, ...
    rules : sequence of HoleRule
        Holes to choose from, the preferred first; empty for no holes.
    plan : JointPlan, optional
        The joints; without it, riveted laps with one fastener.
    slots : bool
        Whether strands that lie under have slots in place of holes where they have no joint.
    cut : CutStrips, optional
        The strips as they are cut, if they are known.
    fastened, holed
        Which crossings are to take a fastener, and which are to have holes, as for
        :func:`fabweave.piece.joint.holes.drill`.
    hold : callable, optional
        Returns which crossings are to take a fastener, and takes those that do in any case, numbers
        of crossings, which alike ones share, and where there is room for the smallest hole.
    alike : bool
        Whether pieces that are the same but for their holes have holes at the same stations, too,
        so that they are of one kind; ``holed`` does not count then.
    supply : (T,) int array, optional
        What each thread is cut from; pieces of different supplies are different. By default all
        are from one.
    fit : bool
        Whether pieces that differ by less than the play of a fastener are made equal, too, where
        joints are laps that fasteners or glue hold.
    """
    plan = plan_joints(ribbons, weave, runs, JointRule()) if plan is None else plan
    cut = cut_strips(ribbons, weave, runs, plan) if cut is None else cut
    covers = covered_parts(ribbons, weave, cut.stations)
    of_piece = None if supply is None else supply[runs.thread].tolist()

    def drilled_at(crossings: BoolArray | None) -> Drilled:
        return drill(
            ribbons, weave, plan, cut, rules,
            slots=slots, fastened=fastened, holed=crossings, alike=group,
        )  # fmt: skip

    def laid(drilled: Drilled) -> tuple[Piece, ...]:
        return _pieces(labels, runs, weave, cut, plan, drilled, covers)

    # What may be of one kind is known before there are holes: those are to be alike there.
    bare = laid(drill(ribbons, weave, plan, cut, (), slots=slots))
    same_mm = max(FIT_MM if fit else _ROUNDED_MM, SAME_MM)
    twins = compare_pieces(bare, of_piece, same_mm=same_mm)
    group = alike_crossings(bare, twins, weave.threads.n_crossings, same_mm=same_mm)
    if hold is not None and rules:
        held = np.zeros(len(group), dtype=np.bool_) if fastened is None else fastened
        least_mm = min(rule.edge_mm for rule in rules)
        fastened = hold(held, group, middle_room(cut, len(group)) >= least_mm)
    drilled = drilled_at(holed)
    play = fit and all(kind.laps and kind.shape is None for kind in _joint_kinds(plan, drilled))
    fit_mm = FIT_MM if play else _ROUNDED_MM
    same_mm = max(fit_mm, SAME_MM)
    if alike:
        wanted = drilled.fastened
        # Where there is no room for the hole that some twins have, they are not of one kind, and no
        # longer ask one another for holes: each turn tells more of them apart.
        twins = compare_pieces(bare, of_piece, same_mm=same_mm)
        while True:
            numbers = alike_crossings(bare, twins, len(wanted), same_mm=same_mm)
            drilled = drilled_at(np.isin(numbers, numbers[wanted]))
            pieces = laid(drilled)
            same = compare_pieces(pieces, of_piece, same_mm=same_mm)
            pairs = np.stack((twins.number, same.number), axis=1)
            found, finer = np.unique(pairs, axis=0, return_inverse=True)
            # More holes may have made another size the best, for which fewer have room.
            kept = wanted & drilled.fastened
            if len(found) == len(twins.first) and np.array_equal(kept, wanted):
                break
            wanted = kept
            twins = compare_pieces(bare, finer.ravel().tolist(), same_mm=same_mm)
    else:
        pieces = laid(drilled)
        same = compare_pieces(pieces, of_piece, same_mm=same_mm)
    kinds = _joint_kinds(plan, drilled)
    pieces = equal_pieces(pieces, same, fit_mm)
    joints = _join(pieces, plan, kinds)
    return PieceSet(
        pieces,
        joints,
        drilled.rules,
        drilled.size_mm,
        drilled.room_mm,
        plan,
        drilled.fastened,
        same,
        fit_mm,
    )


def joined_pieces(
    joined: JoinedObject, brief: Brief, hold: FastenerChoice | None = None
) -> PieceSet:
    """Build the pieces of an object, with their holes and joints; ``hold`` may add fasteners."""
    woven, asked, supplies = joined.woven, brief.pieces, brief.supplies
    asked_for = parse_fastening(brief.fasten)
    fastened = fastened_crossings(asked_for, woven.weave, woven.halfedges, joined.joints.crossing)
    loops = rim_rungs(woven.halfedges, woven.weave.threads) if woven.source.rim != "none" else []
    fastened |= beside_rims(loops, len(fastened))
    hanging = np.zeros_like(fastened)
    if asked.hang is not None:
        hanging = hanging_crossings(parse_hanging(asked.hang), woven.ribbons.centre)
    if asked.base == "on":
        hanging = foot_crossings(woven.weave.threads, woven.halfedges, woven.wished)
    fastened |= hanging
    piece_set = build_pieces(
        woven.ribbons,
        woven.weave,
        joined.plan.runs,
        woven.labels,
        brief.rules,
        joined.joints,
        slots=parse_joint(asked.joint).slots,
        cut=joined.cut,
        fastened=fastened,
        hold=hold,
        holed=np.ones_like(fastened) if brief.holes == "all" else None,
        alike=brief.holes == "alike",
        supply=supplies.of(woven.bunches),
        fit=KIND_PRICES[asked.kinds] is not None,
    )
    rings = plan_rings(woven, brief, loops, piece_set.fastened, piece_set.rules, piece_set.size_mm)
    return replace(
        piece_set,
        rings=rings,
        hanging=hanging,
        glued=asked_for.kind == "glue",
        tied=int(hanging.sum()) if asked.base == "on" else 0,
    )


def _joint_kinds(plan: JointPlan, drilled: Drilled) -> list[JointKind]:
    """Return the kind of each joint: those that could not be given their fasteners are glued."""
    return [
        GLUE if kind.most_fasteners and not held else kind
        for kind, held in zip(plan.kind, drilled.held.tolist(), strict=True)
    ]


def _pieces(
    labels: Sequence[str],
    runs: Runs,
    weave: Weave,
    cut: CutStrips,
    plan: JointPlan,
    drilled: Drilled,
    covers: Sequence[FloatArray | None],
) -> tuple[Piece, ...]:
    """Lay all pieces to rest, with their names, joints and holes."""
    marked = np.array([kind.marked for kind in _joint_kinds(plan, drilled)], dtype=np.bool_)
    guides = guide_lines(cut, plan, marked)
    numbers = 1 + places_in_groups(np.bincount(runs.thread))
    stations, pieces = cut.stations, []
    turns = flags(len(weave.over), weave.threads.turn_pass)
    for index, number in enumerate(numbers.tolist()):
        thread, path, outline = int(runs.thread[index]), cut.paths[index], cut.outlines[index]
        rows = slice(stations.offsets[index], stations.offsets[index + 1])
        frame = resting_frame(outline, *cut.ends[index])
        pieces.append(
            Piece(
                id=f"{labels[thread]}{number}",
                thread=thread,
                path=Path(frame.apply(path.points), path.bulges),
                outline=frame.apply(outline),
                crossings=stations.crossing[rows],
                points=frame.apply(stations.point[rows]),
                directions=frame.apply(stations.way[rows]) - frame.shift,
                rails=frame.apply(stations.rails[rows].reshape(-1, 2)).reshape(-1, 2, 2),
                over=weave.over[stations.passes[rows]],
                hole_mm=drilled.hole_mm[rows],
                start_joint=int(cut.before[index]) or None,
                end_joint=int(cut.after[index]) or None,
                more_holes=_more_holes(drilled, rows, frame),
                slots=_slots(index, cut, drilled, rows, frame),
                guides=tuple(frame.apply(guide) for guide in guides[index]),
                covers=tuple(frame.apply(part) for part in covers[rows] if part is not None),
                rim_turns=np.flatnonzero(turns[stations.passes[rows]][:-1]),
            )
        )
    return tuple(pieces)


def _more_holes(drilled: Drilled, rows: slice, frame: RigidMotion) -> FloatArray:
    """Return the holes of a piece that are not in the middle of a crossing, (H, 4)."""
    low, high = np.searchsorted(drilled.more_station, (rows.start, rows.stop))
    points = drilled.more_point[low:high]
    station = np.repeat(drilled.more_station[low:high] - rows.start, points.shape[1])
    placed = frame.apply(points.reshape(-1, 2))
    diameter = np.repeat(drilled.more_mm[low:high], points.shape[1])
    return np.column_stack((station, placed, diameter))


def _slots(
    index: int, cut: CutStrips, drilled: Drilled, rows: slice, frame: RigidMotion
) -> tuple[Slot, ...]:
    """Return the slots of a piece."""
    stations, slots = cut.stations, []
    tab = cut.slots[index]
    if tab is not None:
        slots.append(Slot(0, straight_path(frame.apply(tab))))
    for at in (rows.start + np.flatnonzero(drilled.slotted[rows])).tolist():
        path = slot_path(float(drilled.hole_mm[at]), stations.point[at], stations.way[at])
        slots.append(Slot(int(at - rows.start), Path(frame.apply(path.points), path.bulges)))
    return tuple(slots)


def _join(
    pieces: Sequence[Piece], plan: JointPlan, kinds: Sequence[JointKind]
) -> tuple[Joint, ...]:
    """Pair the pieces at their joints and their holes on one another."""
    begins = {piece.start_joint: index for index, piece in enumerate(pieces) if piece.start_joint}
    joints = []
    for index, piece in enumerate(pieces):
        number = piece.end_joint
        if number is None:
            continue
        mate = begins[number]
        first, second = _holes_at(piece, len(piece.crossings) - 1), _holes_at(pieces[mate], 0)
        joints.append(
            Joint(
                id=number,
                crossing=int(piece.crossings[-1]),
                pieces=(index, mate),
                kind=kinds[number - 1],
                holes=np.stack((first[:, :2], second[:, :2]), axis=1),
                hole_mm=float(first[0, 2]) if len(first) else np.nan,
                lap_mm=float(plan.lap_mm[number - 1]),
                ahead_mm=float(plan.ahead_mm[number - 1]),
            )
        )
    return tuple(joints)


def _holes_at(piece: Piece, station: int) -> FloatArray:
    """Return the round holes at a station, (n, 3): x, y, diameter."""
    holes = piece.holes
    return np.asarray(holes[holes[:, 0] == station, 1:])


def count_layers(piece_set: PieceSet) -> IntArray:
    """Return how many layers lie on one another at each crossing, (X,): three at a lap.

    Those of rings along rims count, too.
    """
    return np.bincount(
        np.concatenate(
            [
                *(piece.crossings for piece in piece_set.pieces),
                *(ring.crossings for ring in piece_set.rings),
            ]
        ),
        minlength=len(piece_set.room_mm),
    )


def grips_mm(piece_set: PieceSet) -> FloatArray:
    """Return how thick the layers at each crossing are together, (X,): the grip of a fastener.

    Each layer counts with the thickness of its own thread's material.
    """
    stations = [len(piece.crossings) for piece in piece_set.pieces]
    thread = np.repeat([piece.thread for piece in piece_set.pieces], stations)
    crossing = np.concatenate([piece.crossings for piece in piece_set.pieces])
    grip = np.bincount(crossing, piece_set.plan.thickness_mm[thread], len(piece_set.room_mm))
    for ring in piece_set.rings:
        grip = grip + ring.thickness_mm * np.bincount(ring.crossings, minlength=len(grip))
    return np.asarray(np.round(grip, DECIMALS))
