"""Try whether a finer mesh mends what was found of ribbons."""

from dataclasses import replace

from fabweave.errors import CannotMakeError, InputError
from fabweave.lapped import hole_rules, lay_job
from fabweave.ribbon.findings import RibbonCheck, check_ribbons
from fabweave.settings import JobSettings
from fabweave.sheet.limits import thread_limits
from fabweave.sheet.supplies import Supplies
from fabweave.woven import WovenObject

#: The refinement that is tried: it rounds the shape, and divides every face.
REFINEMENT = "catmull-clark:1"
#: It is tried on objects of so many crossings at most, and in plain weave, which needs no search.
MOST_CROSSINGS = 500
#: What comes of coarse faces: between them ribbons turn sharply.
_COARSE = frozenset(("bend", "twist", "crease", "clearance"))


def try_refinement(
    check: RibbonCheck, thing: WovenObject, settings: JobSettings, supplies: Supplies
) -> RibbonCheck:
    """Add refinement as a remedy to findings that one step of it mends, as tried.

    The object is woven, planned and laid once more from the refined mesh, as a job would. A rule
    is mended if it holds there, and no rule is broken that is not broken now.

    Parameters
    ----------
    check : RibbonCheck
    thing, settings, supplies
        What was checked.

    Returns
    -------
    RibbonCheck
        With ``untried`` saying why, if refinement might be a remedy and was not tried.
    """
    broken = {found.rule for found in check.findings}
    if not broken & _COARSE:
        return check
    if settings.pattern != "plain":
        return replace(check, untried="it is tried in plain weave only")
    if thing.weave.threads.n_crossings > MOST_CROSSINGS:
        return replace(check, untried=f"there are more than {MOST_CROSSINGS} crossings")
    before = f"{settings.refine}," if settings.refine else ""
    finer = replace(settings, refine=before + REFINEMENT)
    try:
        laid = lay_job(finer, supplies, hole_rules(finer, supplies)).object
    except (CannotMakeError, InputError):
        return check
    clearance = laid.narrowed.clearance if laid.narrowed is not None else None
    after = check_ribbons(
        laid.ribbons,
        laid.weave,
        laid.labels,
        thread_limits(supplies, laid.bunches, settings.clearance_mm),
        size_mm=laid.size_mm,
        clearance=clearance,
    )
    still = {found.rule for found in after.findings}
    if after.refused or not still <= broken:
        return check
    findings = tuple(
        found if found.rule in still else replace(found, refine=finer.refine)
        for found in check.findings
    )
    return replace(check, findings=findings)
