"""Let the object of a planned job go, or foretell how far it would; and look for what holds it."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.finding import Note
from fabweave.form.body import body_of
from fabweave.form.hold import Foresight, pins_of
from fabweave.form.relaxed import relaxed_ribbons
from fabweave.form.settle import STANDS, Settled, settle
from fabweave.job.ask import brief_of
from fabweave.job.planned import PlannedJob
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.piece.joint.fastening import parse_fastening
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.remedy import Depth

#: Of larger objects, no cure is looked for: each that is tried takes as long as letting them go.
_MOST_TRIED = 1500
#: So many times thicker material is tried.
_THICKER = (1.5, 3.0)
_FASTENED = {"fasten": "all"}


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

    @property
    def notes(self) -> list[Note]:
        """What is not shown of it."""
        why = "no strips as they are cut were found that lie as it rests"
        missing = Note("form", f"form: there is no model_relaxed.glb, as {why}")
        return [missing] if self.bands is None else []


def let_job_go(planned: PlannedJob) -> LetGo | None:
    """Let the object of a job go; None where that would take minutes."""
    brief = brief_of(planned.settings, planned.supplies)
    woven, body = planned.woven, body_of(planned.woven, brief)
    if body is None:
        return None
    bound_mm = parse_fastening(brief.fasten).bound_mm
    settled = settle(body, pins_of(body, planned.piece_set), bound_mm)
    state = settled.states["let go"].state
    bands = relaxed_ribbons(woven.ribbons, planned.weave, body, state)
    return LetGo(settled, bands, _cure(planned) if settled.form.collapse else "")


def _cure(planned: PlannedJob) -> str:
    """Return what keeps the object of a job from collapsing: fasteners, or thicker material.

    Each is tried, the lesser first: it is planned and let go. What cannot be built is no cure.
    """
    if planned.weave.threads.n_crossings > _MOST_TRIED:
        return "no cure was looked for, as that would take long"
    fasten = {} if planned.fasten.startswith("all") else _FASTENED
    thick = [one.thickness_mm for one in planned.supplies.materials]
    thicker = [{"thickness_mm": round(times * thick[0], 2)} for times in _THICKER]
    for more in ({}, *thicker) if len(thick) == 1 else ({},):
        changes = {**fasten, **more}
        if changes and _holds(planned, planned.settings.but(**changes, force=False)):
            return f"{_words(changes)} holds it, as was tried"
    return "no cure was found among more fasteners and thicker material"


def _holds(planned: PlannedJob, settings: Settings) -> bool:
    """Return whether an object with other settings can be built and does not collapse."""
    # Its mesh and its weave are as they are.
    other = Stations(settings, depth=Depth.ALONG).know(loaded=planned.woven.source)
    try:
        planned = other.know(weave=planned.woven).buildable
    except (InputError, CannotMakeError):
        return False
    body = body_of(planned.woven, other.brief)
    if body is None:
        return False
    pins = pins_of(body, planned.piece_set)
    # What goes too far to first order takes long to be let go, and collapses.
    if Foresight(body)(pins, body.size_mm).most_mm > STANDS * body.size_mm:
        return False
    return settle(body, pins).form.stands


def _words(changes: Mapping[str, Any]) -> str:
    """Return changes of settings as options."""
    words = {"fasten": "--fasten {}", "thickness_mm": "--thickness {:g}mm"}
    return " ".join(words[name].format(value) for name, value in changes.items())
