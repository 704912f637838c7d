"""Lay the ribbons of a job as they are cut: with room for laps where its pieces are joined."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.app.request import hole_rules
from fabweave.app.settings import Settings
from fabweave.app.split_job import plan_pieces
from fabweave.app.woven_object import (
    WovenObject,
    check_object,
    keep_clear,
    lay_ribbons,
    require_stiffness,
    resized,
)
from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.flat.joint.holes import HoleRule
from fabweave.flat.joint.kinds import parse_joint
from fabweave.flat.joint.planning import JointPlan, plan_joints
from fabweave.flat.split.runs import Runs
from fabweave.flat.split.split_plan import SplitPlan
from fabweave.ribbon.boundary_turns import require_no_loop
from fabweave.ribbon.measures import require_width
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.supplies import Supplies


@frozen_value
class JoinedObject:
    """A woven object with its ribbons as they are cut, and where they are cut and joined."""

    woven: WovenObject
    plan: SplitPlan
    joints: JointPlan


def split_object(
    woven: WovenObject,
    settings: Settings,
    supplies: Supplies,
    rules: Sequence[HoleRule],
    progress: Progress = no_progress,
) -> JoinedObject:
    """Plan where threads are cut into pieces and how these are joined; lay the ribbons for that.

    Parameters
    ----------
    woven : WovenObject
        With ribbons as wide as asked.
    settings : Settings
        Complete.
    supplies : Supplies
        Materials and sheets.
    rules : sequence of HoleRule
        The holes that may be used, from :func:`hole_rules`.
    progress : callable
        Told what is being done.

    Raises
    ------
    InputError
        For bad input or settings.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.
    """
    require_width(woven.ribbons, woven.labels, woven.size_mm)
    require_no_loop(woven.weave.threads, woven.halfedges)
    require_stiffness(woven, settings, supplies)
    progress("pieces", 0, 1)
    plan = plan_pieces(woven.ribbons, woven.weave, woven.labels, settings, rules, supplies)
    woven, joints = _with_joints(woven, plan.runs, settings, supplies)
    return JoinedObject(woven, plan, joints)


def remake(
    woven: WovenObject,
    settings: Settings,
    supplies: Supplies,
    rules: Sequence[HoleRule],
    size_mm: float,
) -> WovenObject:
    """Plan the pieces of an object at another size, and lay its ribbons for them, as a job does.

    Where no pieces can be planned (none may fit the sheet), there is room for a lap everywhere.

    Parameters
    ----------
    woven : WovenObject
        As it is.
    settings, supplies, rules
        As for :func:`split_object`.
    size_mm : float
        The largest dimension that it gets.
    """
    other = resized(woven, size_mm)
    ribbons = lay_ribbons(other.source, other.weave, settings, supplies.thickness_mm(other.bunches))
    try:
        plan = plan_pieces(ribbons, other.weave, other.labels, settings, rules, supplies)
        return _with_joints(replace(other, ribbons=ribbons), plan.runs, settings, supplies)[0]
    except CannotMakeError:
        return keep_clear(other, settings, supplies)


def check_joined(
    woven: WovenObject, settings: Settings, supplies: Supplies, depth: Depth = Depth.SEARCHED
) -> RibbonCheck:
    """Check the ribbons of an object, and confirm the sizes that are proposed on what is made."""
    rules = hole_rules(settings, supplies)
    return check_object(
        woven,
        settings,
        supplies,
        lambda size: remake(woven, settings, supplies, rules, size),
        depth,
    )


def _with_joints(
    woven: WovenObject, runs: Runs, settings: Settings, supplies: Supplies
) -> tuple[WovenObject, JointPlan]:
    """Plan the joints, and lay the ribbons again with room for laps where they are."""
    rule = parse_joint(settings.joint, lap_mm=settings.lap_mm)
    thickness = supplies.thickness_mm(woven.bunches)
    laps = plan_joints(woven.ribbons, woven.weave, runs, rule, thickness).laps
    while True:
        woven = keep_clear(woven, settings, supplies, laps)
        joints = plan_joints(woven.ribbons, woven.weave, runs, rule, thickness)
        # Panels keep their shape when the strands move apart; but where ribbons were narrowed,
        # there may be room for nothing but a lap.
        more = np.setdiff1d(joints.laps, laps)
        if not len(more):
            return woven, joints
        laps = np.concatenate((laps, more))
