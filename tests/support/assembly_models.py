"""Make the pieces of a model without nesting or drawing anything."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fabweave.app.joined_object import hole_rules
from fabweave.app.pipeline import complete_settings
from fabweave.app.settings import JobSettings
from fabweave.app.split_job import plan_pieces
from fabweave.app.woven_object import lay_ribbons, weave_object
from fabweave.flat.joint.kinds import parse_joint
from fabweave.flat.joint.planning import plan_joints
from fabweave.flat.pieces import Pieces, build_pieces


@dataclass(frozen=True, eq=False)
class Model:
    made: Pieces
    centres: np.ndarray
    enclosed: bool


@cache
def model_of(mesh, size_mm=300.0, **changed):
    """Return the pieces of a model, once."""
    settings, supplies = complete_settings(JobSettings(mesh, size_mm=size_mm, **changed))
    thing = weave_object(settings, supplies)
    rules = hole_rules(settings, supplies)
    plan = plan_pieces(thing.ribbons, thing.weave, thing.labels, settings, rules, supplies)
    laps = plan.runs.laps(thing.weave.threads)
    ribbons = lay_ribbons(
        thing.woven, thing.weave, settings, supplies.thickness_mm(thing.bunches), laps
    )
    rule, thickness = parse_joint(settings.joint), supplies.thickness_mm(thing.bunches)
    joints = plan_joints(ribbons, thing.weave, plan.runs, rule, thickness)
    made = build_pieces(ribbons, thing.weave, plan.runs, thing.labels, rules, joints)
    closed = bool(np.all(thing.woven.halfedges.twin >= 0))
    return Model(made, ribbons.centre, closed)
