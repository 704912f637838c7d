"""Lay the ribbons of an object as they are cut: with room for laps where its pieces are joined."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen_value,
    no_progress,
)
from fabweave.core.errors import CannotMakeError, TooFineError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.polymesh import PolyMesh
from fabweave.nest.item_shape import shape_of
from fabweave.piece.brief import Brief
from fabweave.piece.development import Runs, unfold_runs
from fabweave.piece.joint.ends import CutStrips, cut_strips, overlapping_ends
from fabweave.piece.joint.kinds import parse_joint
from fabweave.piece.joint.planning import JointPlan, plan_joints
from fabweave.piece.outline import resting_frame, simple, strip_outlines
from fabweave.piece.split.length_curve import SplitPlan
from fabweave.piece.split.repeats import Repeats
from fabweave.piece.split.split_plan import object_repeats, plan_pieces
from fabweave.piece.split.splitting import find_self_crossing, joined_runs, some_runs
from fabweave.piece.stock_fit import outlines_with_place
from fabweave.ribbon.lay import (
    WovenObject,
    check_object,
    keep_clear,
    lay_ribbons,
    require_stiffness,
    require_wide,
    resized,
)
from fabweave.ribbon.measures import ribbon_widths
from fabweave.ribbon.project import require_no_loop
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.ribbon_limits import by_thread, thread_limits

#: So much narrower is the next width tried where a ribbon crosses itself.
_STEP = 0.9


@frozen_value
class JoinedObject:
    """A woven object with its ribbons as they are cut, where they are joined, and their strips.

    No strip crosses itself, and each has a place on an empty sheet.
    """

    woven: WovenObject
    plan: SplitPlan
    joints: JointPlan
    cut: CutStrips
    repeats: Repeats | None


def split_object(
    woven: WovenObject,
    brief: Brief,
    progress: Progress = no_progress,
) -> JoinedObject:
    """Plan where threads are cut into pieces and how these are joined; lay the ribbons for that.

    Pieces are planned on ribbons as wide as asked. Those that cross themselves when they are cut
    as planned, or no longer fit on a sheet, are cut elsewhere; where that does not help against a
    crossing, their ribbons get narrower.

    Parameters
    ----------
    woven : WovenObject
        With ribbons as wide as asked.
    brief : Brief
    progress : callable
        Told what is being done.

    Raises
    ------
    InputError
        For bad input or settings.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.
    """
    supplies = brief.supplies
    require_wide(woven)
    require_no_loop(woven.weave.threads, woven.halfedges)
    require_stiffness(woven, brief.ribbons, supplies)
    progress("pieces", 0, 1)
    ribbons, weave, labels = woven.ribbons, woven.weave, woven.labels
    repeats = object_repeats(woven, brief.pieces, supplies)
    plan = plan_pieces(ribbons, weave, labels, brief, bunches=woven.bunches, repeats=repeats)
    even = repeats is not None or plan.likes
    barred, most, apart = None, None, None
    lapped = np.zeros(0, dtype=np.int64)
    while True:
        laid, joints = _with_joints(woven, plan.runs, brief, even, most, lapped)
        cut = cut_strips(laid.ribbons, weave, plan.runs, joints)
        crossing = find_self_crossing(laid.ribbons, weave, plan.runs, cut.outlines)
        if not crossing:
            crowded = overlapping_ends(cut, joints)
            if len(crowded):
                lapped = np.union1d(lapped, crowded)
                continue
            placed = _placed(cut, plan.runs, woven, brief)
            if placed.all():
                # With laps elsewhere they bend otherwise, maybe just too much now.
                require_stiffness(laid, brief.ribbons, supplies)
                return JoinedObject(replace(laid, apart=apart), plan, joints, cut, repeats)
            whole = some_runs(plan.runs, ~placed)
        elif len(crossing.kinks.thread):
            # Loops are looked for afterwards: with a kink, a thread seems to have more of them.
            most = _narrower(laid, crossing.kinks, brief)
            if apart is None and laid.narrowed is not None:
                apart = laid.narrowed.factor
            continue
        else:
            whole = crossing.loops
        # No piece carried what is barred already, so that there is an end.
        barred = whole if barred is None else joined_runs(barred, whole)
        try:
            plan = plan_pieces(
                ribbons,
                weave,
                labels,
                brief,
                barred,
                bunches=woven.bunches,
                repeats=repeats,
                earlier=plan,
            )
        except CannotMakeError as error:
            if crossing:
                raise
            raise CannotMakeError(_too_large(woven, whole, cut.outlines, placed)) from error


def relaid(
    joined: JoinedObject, mesh: PolyMesh, brief: Brief, more: IntArray | None = None
) -> JoinedObject:
    """Return an object on a mesh whose vertices were moved, its ribbons laid anew.

    Threads are cut where they were, and ribbons are no wider for what they had room for; strips are
    those of before, until :func:`recut` cuts them. Pieces lap where they did, and at ``more``.
    """
    was = joined.woven
    woven = replace(was, source=replace(was.source, mesh=mesh))
    most = None if was.narrowed is None else was.narrowed.factor
    even = joined.repeats is not None or joined.plan.likes
    joints = joined.joints
    lapped = joints.crossing[joints.where(lambda kind: kind.laps)]
    lapped = lapped if more is None else np.union1d(lapped, more)
    laid, joints = _with_joints(woven, joined.plan.runs, brief, even, most, lapped)
    return replace(joined, woven=replace(laid, apart=was.apart), joints=joints)


def recut(joined: JoinedObject, brief: Brief) -> JoinedObject | None:
    """Return an object that was laid anew with its strips; None if they cannot be cut.

    Threads are cut elsewhere where strips as they were cut would cross themselves now.
    """
    found = _cut_as_before(joined, brief)
    if found is not None:
        return found
    woven = joined.woven
    thickness = brief.supplies.thickness_mm(woven.bunches)
    ribbons = lay_ribbons(woven.source, woven.weave, brief.ribbons, thickness)
    asked = replace(woven, ribbons=ribbons, laps=None, narrowed=None, apart=None)
    try:
        return split_object(asked, brief)
    except CannotMakeError:
        return None


def _cut_as_before(joined: JoinedObject, brief: Brief) -> JoinedObject | None:
    """Return an object with its threads cut where they were; None if they cannot be cut so."""
    while True:
        woven, runs, joints = joined.woven, joined.plan.runs, joined.joints
        cut = cut_strips(woven.ribbons, woven.weave, runs, joints)
        if find_self_crossing(woven.ribbons, woven.weave, runs, cut.outlines):
            return None
        crowded = overlapping_ends(cut, joints)
        lapped = joints.crossing[joints.where(lambda kind: kind.laps)]
        if not len(crowded):
            placed = _placed(cut, runs, woven, brief).all()
            return replace(joined, cut=cut) if placed else None
        if not len(np.setdiff1d(crowded, lapped)):
            return None
        joined = relaid(joined, woven.mesh, brief, crowded)


def _placed(cut: CutStrips, runs: Runs, woven: WovenObject, brief: Brief) -> BoolArray:
    """Return which pieces have a place on an empty sheet."""
    # Where angles are few, it matters how a piece lies.
    resting = [
        resting_frame(outline, *ends).apply(outline)
        for outline, ends in zip(cut.outlines, cut.ends, strict=True)
    ]
    return outlines_with_place(resting, runs.thread, brief.supplies, woven.bunches, brief.effort)


def laid_at_size(
    woven: WovenObject,
    brief: Brief,
    size_mm: float,
    repeats: Repeats | None,
) -> WovenObject:
    """Plan the pieces of an object at another size, and lay its ribbons for them, as a job does.

    Where no pieces can be planned (none may fit the sheet), there is room for a lap everywhere.

    Parameters
    ----------
    woven : WovenObject
        As it is.
    brief
        As for :func:`split_object`.
    size_mm : float
        The largest dimension that it gets.
    repeats : Repeats or None
        Which stretches repeat others, as at any size.
    """
    other = resized(woven, size_mm)
    thickness = brief.supplies.thickness_mm(other.bunches)
    ribbons = lay_ribbons(other.source, other.weave, brief.ribbons, thickness)
    try:
        plan = plan_pieces(
            ribbons,
            other.weave,
            other.labels,
            brief,
            bunches=other.bunches,
            repeats=repeats,
        )
        laid = replace(other, ribbons=ribbons)
        even = repeats is not None or plan.likes
        return _with_joints(laid, plan.runs, brief, even)[0]
    except CannotMakeError:
        return keep_clear(other, brief.ribbons, brief.supplies)


def check_joined(
    woven: WovenObject,
    brief: Brief,
    repeats: Repeats | None,
    depth: Depth = Depth.SEARCHED,
) -> RibbonCheck:
    """Check the ribbons of an object, and confirm the sizes that are proposed on what is made.

    ``repeats`` are those of :class:`JoinedObject`: which stretches are cut alike at any size.
    """
    return check_object(
        woven,
        brief.ribbons,
        brief.supplies,
        lambda size: laid_at_size(woven, brief, size, repeats),
        depth,
    )


def _with_joints(
    woven: WovenObject,
    runs: Runs,
    brief: Brief,
    even: bool,
    most: FloatArray | None = None,
    lapped: IntArray | None = None,
) -> tuple[WovenObject, JointPlan]:
    """Plan the joints, and lay the ribbons again with room for laps where they are.

    Where pieces are to repeat, ``even``, there is room for a lap everywhere: else a piece would
    differ from its like by the joints of the strands that it crosses.

    If the width is left to fabweave, they are no wider than by factors ``most`` at each pass. At
    the crossings ``lapped``, pieces lap whatever is asked.
    """
    rule = parse_joint(brief.pieces.joint)
    thickness = brief.supplies.thickness_mm(woven.bunches)
    if even:
        woven = keep_clear(woven, brief.ribbons, brief.supplies, None, most)
        return woven, plan_joints(woven.ribbons, woven.weave, runs, rule, thickness, lapped)
    laps = plan_joints(woven.ribbons, woven.weave, runs, rule, thickness, lapped).laps
    while True:
        woven = keep_clear(woven, brief.ribbons, brief.supplies, laps, most)
        joints = plan_joints(woven.ribbons, woven.weave, runs, rule, thickness, lapped)
        # Panels keep their shape when the strands move apart; but where ribbons were narrowed,
        # there may be room for nothing but a lap.
        more = np.setdiff1d(joints.laps, laps)
        if not len(more):
            return woven, joints
        laps = np.concatenate((laps, more))


def _narrower(woven: WovenObject, kinks: Runs, brief: Brief) -> FloatArray:
    """Return factors on the width at each pass with which some stretches do not cross themselves.

    Raises
    ------
    TooFineError
        If ribbons must not be narrower, or would be too narrow to be handled.
    """
    narrowed, threads = woven.narrowed, woven.weave.threads
    if narrowed is None:
        raise _kinked(woven, kinks, "a smaller --width, or none")
    # The panels stay wide enough to be handled. What lies in a sharp bend between them gets wider
    # with narrower panels, not narrower.
    entry, factor = woven.ribbons.entry, narrowed.factor.copy()
    widths = ribbon_widths(woven.ribbons)
    width = np.minimum(widths[entry], widths[entry + 1])
    limits = thread_limits(brief.supplies, woven.bunches, brief.ribbons.clearance_mm)
    floor = factor * by_thread(limits.width_mm, threads.thread_of_pass) / np.maximum(width, 1e-9)
    thickness = brief.supplies.thickness_mm(woven.bunches)
    while len(kinks.thread):
        ends = np.stack((kinks.first, kinks.last)) % threads.lengths[kinks.thread]
        passes = threads.offsets[kinks.thread] + ends
        stuck = np.asarray(np.all(factor[passes] <= floor[passes], axis=0))
        if stuck.any():
            raise _kinked(woven, some_runs(kinks, stuck), "a larger --size")
        passes = np.unique(passes)
        factor[passes] = np.maximum(_STEP * factor[passes], np.minimum(floor, factor)[passes])
        ribbons = lay_ribbons(
            woven.source, woven.weave, brief.ribbons, thickness, woven.laps, factor
        )
        kinks = some_runs(kinks, ~simple(strip_outlines(unfold_runs(ribbons, kinks))))
    return factor


def _too_large(
    woven: WovenObject, runs: Runs, outlines: Sequence[FloatArray], placed: BoolArray
) -> str:
    """Say which pieces fit on no sheet as they are cut, though they did as they were planned."""
    shapes = [shape_of(outlines[piece])[0] for piece in np.flatnonzero(~placed).tolist()]
    pieces = [
        f"{woven.labels[thread]} from its crossing {first} to its crossing "
        f"{last % woven.weave.threads.lengths[thread]} ({shape.length_mm:.1f} × "
        f"{shape.width_mm:.1f} mm)"
        for (thread, first, last), shape in zip(runs.rows, shapes, strict=True)
    ]
    return (
        agree(len(pieces), "{n} piece[ fits|s fit] on no sheet with [its|their] laps, and ")
        + agree(len(pieces), "[its thread|their threads] can be cut nowhere else: ")
        + f"{few_of(pieces, 4)}; a larger --sheet, a smaller --margin, a smaller --size or a "
        "shorter lap (--joint rivet,lap=20mm) would help"
    )


def _kinked(woven: WovenObject, kinks: Runs, remedy: str) -> TooFineError:
    """Say which stretches of threads would cross themselves however they are cut."""
    threads = woven.weave.threads
    places = []
    for thread, first, last in kinks.rows:
        ends = np.array([first, last]) % threads.lengths[thread]
        centre = woven.ribbons.centre[threads.crossing[threads.offsets[thread] + ends]].mean(axis=0)
        place = ", ".join(f"{value:.0f}" for value in centre)
        places.append(
            f"{woven.labels[thread]} between its crossings {ends[0]} and {ends[1]}, near ({place})"
        )
    text = (
        "{n} stretch[|es] of thread bend[s|] so sharply that [it|they] would cross "
        "[itself|themselves] when unfolded: "
    )
    return TooFineError(
        f"{agree(len(kinks.thread), text)}{few_of(places, 4)} mm",
        f"{remedy} would help, or a smoother mesh (--fair, --refine or --remesh)",
    )
