"""Make the pieces of a model without nesting or drawing anything."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fabweave.app.request import complete_settings, hole_rules
from fabweave.app.settings import Settings
from fabweave.app.split_job import plan_pieces
from fabweave.app.woven_object import lay_ribbons, weave_object
from fabweave.flat.joint.kinds import parse_joint
from fabweave.flat.joint.planning import plan_joints
from fabweave.flat.pieces import PieceSet, build_pieces


@dataclass(frozen=True, eq=False)
class Model:
    made: PieceSet
    centres: np.ndarray
    normals: np.ndarray
    enclosed: bool


@cache
def model_of(mesh, size_mm=300.0, **changed):
    """Return the pieces of a model, once."""
    settings, supplies = complete_settings(Settings(mesh, size_mm=size_mm, **changed))
    woven = weave_object(settings, supplies)
    rules = hole_rules(settings, supplies)
    plan = plan_pieces(woven.ribbons, woven.weave, woven.labels, settings, rules, supplies)
    laps = plan.runs.laps(woven.weave.threads)
    ribbons = lay_ribbons(
        woven.source, woven.weave, settings, supplies.thickness_mm(woven.bunches), laps
    )
    rule, thickness = parse_joint(settings.joint), supplies.thickness_mm(woven.bunches)
    joints = plan_joints(ribbons, woven.weave, plan.runs, rule, thickness)
    made = build_pieces(ribbons, woven.weave, plan.runs, woven.labels, rules, joints)
    closed = bool(np.all(woven.halfedges.twin >= 0))
    return Model(made, ribbons.centre, ribbons.normal, closed)
