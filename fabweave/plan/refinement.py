"""Try a finer mesh as a remedy for rules that ribbons break."""

from dataclasses import replace

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.options.settings import Settings
from fabweave.piece.joined_strands import split_object
from fabweave.plan.ask import brief_of, lay_asked, load_asked
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.ribbon_check import RibbonCheck, check_ribbons
from fabweave.stock.ribbon_limits import thread_limits
from fabweave.stock.supplies import Supplies

#: The refinements that are tried, one after the other: they round the shape, and divide every face.
REFINEMENTS = ("catmull-clark:1", "catmull-clark:2")
#: Each is tried if it comes to so many crossings at most, where every step makes four of one; and
#: in plain weave, which needs no search.
MOST_CROSSINGS = 2000
#: What comes of coarse faces: between them ribbons turn sharply.
_COARSE = frozenset(("bend", "twist", "crease", "clearance"))


def try_refinement(
    check: RibbonCheck, woven: WovenObject, settings: Settings, supplies: Supplies
) -> RibbonCheck:
    """Add refinement as a remedy to findings that one or two steps of it mend, as tried.

    The object is woven, planned and laid once more from the refined mesh, as a job would. A rule
    is mended if it holds there, and no rule is broken that is not broken now.

    Parameters
    ----------
    check : RibbonCheck
    woven, settings, supplies
        What was checked.

    Returns
    -------
    RibbonCheck
        With ``untried`` saying why, if refinement might be a remedy and was not tried.
    """
    broken = {finding.rule for finding in check.findings}
    if not broken & _COARSE:
        return check
    if settings.weave.pattern != "plain":
        return replace(check, untried="fabweave tries it for plain weave only")
    crossings, most = woven.weave.threads.n_crossings, MOST_CROSSINGS // 4
    if crossings > most:
        return replace(check, untried=f"there are more than {most} crossings")
    findings = check.findings
    for steps, refinement in enumerate(REFINEMENTS, start=1):
        waiting = {finding.rule for finding in findings if finding.refine is None}
        if not waiting & _COARSE or crossings * 4**steps > MOST_CROSSINGS:
            break
        before = f"{settings.mesh.refine}," if settings.mesh.refine else ""
        finer = settings.but(refine=before + refinement)
        still = _broken(finer, supplies)
        if still is not None and still <= broken:
            findings = tuple(
                finding
                if finding.refine is not None or finding.rule in still
                else replace(finding, refine=finer.mesh.refine)
                for finding in findings
            )
    return replace(check, findings=findings)


def _broken(settings: Settings, supplies: Supplies) -> set[str] | None:
    """Return the rules that are broken by what is made with some settings; None if nothing is."""
    try:
        woven = lay_asked(load_asked(settings), settings, supplies)
        woven = split_object(woven, brief_of(settings, supplies)).woven
    except (CannotMakeError, InputError):
        return None
    check = check_ribbons(
        woven.ribbons,
        woven.weave,
        woven.labels,
        thread_limits(supplies, woven.bunches, settings.ribbons.clearance_mm),
        size_mm=woven.size_mm,
        clearance=woven.narrowed.clearance if woven.narrowed is not None else None,
    )
    return None if check.refused else {finding.rule for finding in check.findings}
