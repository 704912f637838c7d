"""Let the object of a planned job go, or foretell how far it would."""

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.form.body import Body, body_of, pin_stiffness
from fabweave.form.hold import Foresight
from fabweave.form.settle import Settled, settle
from fabweave.piece.joint.fastening import parse_fastening
from fabweave.plan.ask import brief_of
from fabweave.plan.planned_job import PlannedJob


def let_job_go(planned: PlannedJob) -> Settled | None:
    """Let the object of a job go; None where that would take minutes."""
    body = _body(planned)
    bound_mm = parse_fastening(planned.fasten).bound_mm
    return None if body is None else settle(body, _pins(planned), bound_mm)


def foretold_mm(planned: PlannedJob) -> float | None:
    """Return how far the object of a job goes, to first order; None where that takes minutes."""
    body = _body(planned)
    return None if body is None else Foresight(body)(_pins(planned), body.size_mm).most_mm


def _body(planned: PlannedJob) -> Body | None:
    return body_of(planned.woven, brief_of(planned.settings, planned.supplies))


def _pins(planned: PlannedJob) -> FloatArray:
    """Return how crossings resist turning, as they are fastened."""
    pieces = planned.piece_set
    riveted = [joint.crossing for joint in pieces.joints if len(joint.holes) > 1]
    return pin_stiffness(pieces.fastened, np.array(riveted, dtype=np.int64))
