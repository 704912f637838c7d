"""Let the object of a planned job go, or foretell how far it would."""

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.form.body import Body, body_of
from fabweave.form.hold import Foresight
from fabweave.form.settle import Settled, settle
from fabweave.piece.brief import Brief
from fabweave.piece.joint.fastening import parse_fastening
from fabweave.piece.pieces import PieceSet
from fabweave.plan.ask import brief_of
from fabweave.plan.planned_job import PlannedJob
from fabweave.ribbon.lay import WovenObject


def let_job_go(planned: PlannedJob) -> Settled | None:
    """Let the object of a job go; None where that would take minutes."""
    brief = brief_of(planned.settings, planned.supplies)
    body = body_of(planned.woven, brief)
    bound_mm = parse_fastening(brief.fasten).bound_mm
    return None if body is None else settle(body, _pins(body, planned.piece_set), bound_mm)


def foretold_mm(woven: WovenObject, brief: Brief, pieces: PieceSet) -> float | None:
    """Return how far an object goes, to first order; None where that would take minutes."""
    body = body_of(woven, brief)
    return None if body is None else Foresight(body)(_pins(body, pieces), body.size_mm).most_mm


def _pins(body: Body, pieces: PieceSet) -> FloatArray:
    """Return how crossings resist turning, as they are fastened."""
    riveted = [joint.crossing for joint in pieces.joints if len(joint.holes) > 1]
    return body.pins(pieces.fastened, np.array(riveted, dtype=np.int64))
