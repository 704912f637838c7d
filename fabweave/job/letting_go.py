"""Let the object of a planned job go; where it collapses, with what would make it stand."""

from typing import NamedTuple

from fabweave.core.arrays import IntArray
from fabweave.core.finding import Note
from fabweave.form.body import body_of
from fabweave.form.building import homing_note, homings
from fabweave.form.hold import pins_of
from fabweave.form.relaxed import relaxed_ribbons
from fabweave.form.settle import Settled, settle
from fabweave.job.ask import brief_of
from fabweave.job.cures import cure_of
from fabweave.job.planned import PlannedJob
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.piece.joint.fastening import parse_fastening
from fabweave.ribbon.project import Ribbons


class LetGo(NamedTuple):
    """What becomes of a job's object when it is let go.

    Parameters
    ----------
    settled : Settled
    bands : Ribbons or None
        Its strips then, see :func:`~fabweave.form.relaxed.relaxed_ribbons`.
    cure : str
        If it collapses: what holds it, as was tried; or that nothing was found.
    """

    settled: Settled
    bands: Ribbons | None
    cure: str

    def notes(self, planned: PlannedJob, order: IntArray) -> list[Note]:
        """Return what is not shown of it, and what its pieces ask for as they are placed."""
        settled, threads = self.settled, planned.weave.threads
        runs = planned.split_plan.runs
        late = homings(settled.body, settled.pins, threads, runs, order)
        why = "no strips as they are cut were found that lie as it rests"
        missing = Note("form", f"form: there is no model_relaxed.glb, as {why}")
        hard = [Note("building", homing_note(late), detail=True)] if late else []
        return hard if self.bands is not None else [missing, *hard]


def let_job_go(planned: PlannedJob, asked: Settings, given: PolyMesh | None = None) -> LetGo | None:
    """Let the object of a job go; None where that would take minutes.

    Parameters
    ----------
    planned : PlannedJob
    asked : Settings
        What it was planned by, as was asked.
    given : PolyMesh, optional
        A mesh from memory, in place of the file that these name.
    """
    brief = brief_of(planned.settings, planned.supplies)
    woven, body = planned.woven, body_of(planned.woven, brief)
    if body is None:
        return None
    bound_mm = parse_fastening(brief.fasten).bound_mm
    pins, begun = pins_of(body, planned.piece_set), planned.begun
    settled = settle(body, pins, bound_mm, begun=begun.by(pins) if begun else ())
    state = settled.states["let go"].state
    bands = relaxed_ribbons(woven.ribbons, planned.weave, body, state)
    return LetGo(settled, bands, cure_of(planned, asked, given) if settled.form.collapse else "")
