"""Make the pieces of a model without nesting or drawing anything."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jobs import laid

from fabweave.job.ask import brief_of
from fabweave.piece.joint.kinds import parse_joint
from fabweave.piece.joint.planning import plan_joints
from fabweave.piece.pieces import PieceSet, build_pieces
from fabweave.piece.split.split_plan import plan_pieces
from fabweave.ribbon.lay import lay_ribbons


@dataclass(frozen=True, eq=False)
class Model:
    made: PieceSet
    centres: np.ndarray
    normals: np.ndarray
    enclosed: bool


@cache
def model_of(mesh, size_mm=300.0, **changed):
    """Return the pieces of a model, once."""
    woven, settings, supplies = laid(mesh, size_mm=size_mm, **changed)
    rules = brief_of(settings, supplies).rules
    plan = plan_pieces(woven.ribbons, woven.weave, woven.labels, brief_of(settings, supplies))
    laps = plan.runs.laps(woven.weave.threads)
    ribbons = lay_ribbons(
        woven.source, woven.weave, settings.ribbons, supplies.thickness_mm(woven.bunches), laps
    )
    rule, thickness = parse_joint(settings.pieces.joint), supplies.thickness_mm(woven.bunches)
    joints = plan_joints(ribbons, woven.weave, plan.runs, rule, thickness)
    made = build_pieces(ribbons, woven.weave, plan.runs, woven.labels, rules, joints)
    closed = bool(np.all(woven.halfedges.twin >= 0))
    return Model(made, ribbons.centre, ribbons.normal, closed)


def twice(pieces, crossings):
    """Return the pieces of an object, and of another one just like it that is not joined to it."""
    return [
        *pieces,
        *(
            replace(
                piece,
                crossings=piece.crossings + crossings,
                start_joint=piece.start_joint + 100,
                end_joint=piece.end_joint + 100,
                thread=piece.thread + 100,
            )
            for piece in pieces
        ),
    ]
