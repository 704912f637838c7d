"""Complete what is asked of a job, take its first steps, and try whether refining would help."""

from dataclasses import replace
from pathlib import Path

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.form.straight import lay_strips
from fabweave.mesh.fair.energy import Wish
from fabweave.mesh.load import LoadedMesh, load_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.options.settings import Settings
from fabweave.piece.brief import Brief, chosen_grain, make_brief
from fabweave.piece.joined_strands import split_object
from fabweave.plan.crossing_map import read_crossing_map
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.ribbon_check import RibbonCheck, check_ribbons
from fabweave.sheet.kerf import check_kerf
from fabweave.stock.per_bunch import by_bunch
from fabweave.stock.ribbon_limits import ribbon_limits, thread_limits
from fabweave.stock.rotations import AUTO, parse_rotations
from fabweave.stock.sheet_size import check_stock
from fabweave.stock.supplies import Supplies, Supply, parse_materials, plan_supplies
from fabweave.weave.weave_mesh import weave_mesh

#: The refinements that are tried, one after the other: they round the shape, and divide every face.
REFINEMENTS = ("catmull-clark:1", "catmull-clark:2")
#: Each is tried if it comes to so many crossings at most, where every step makes four of one; and
#: in plain weave, which needs no search.
MOST_CROSSINGS = 2000
#: What a former is cut from, where strips are of something thinner than this, millimetres.
FORMER_BOARD, _STIFF_MM = "museum-board", 1.2
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


def complete_settings(settings: Settings) -> tuple[Settings, Supplies]:
    """Fill in what was left to fabweave: thickness, gap, sheet and width.

    Raises
    ------
    InputError
        If settings by bunch name other bunches than the rest, the kerf wants a larger gap, the
        hole is too small to burn, the margin leaves nothing of a sheet, or the layout to be taken
        cannot be read.
    """
    if settings.stock.rolls:
        # Strips fill a roll's width, and lie along it, however its grain runs.
        along = "free" if settings.stock.rotations == AUTO else settings.stock.rotations
        settings = settings.but(margin_mm=0.0, gap_mm=0.0, rotations=along)
    stock = settings.stock
    supplies = replace(
        supplies_of(settings),
        margin_mm=stock.margin_mm,
        rotations=stock.rotations,
        mirrored=settings.pieces.mirrored,
    )
    if parse_rotations(stock.rotations).across:
        supplies = supplies.across()
    if settings.pieces.former is not None:
        supplies = replace(supplies, former=former_supply(settings, supplies))
    if not settings.common_cuts:
        check_kerf(settings.machine.kerf_mm, min(supply.gap_mm for supply in supplies.each))
    # What cannot be is refused before the work, though it is needed only later.
    brief_of(settings, supplies)
    for supply in supplies.each:
        check_stock(supply.sheets, stock.margin_mm)
    if settings.search.layout is not None:
        read_crossing_map(Path(settings.search.layout))
    completed = settings.but(
        thickness_mm=supplies.by_bunch(lambda supply: supply.material.thickness_mm),
        sheets=supplies.sheets,
        gap_mm=supplies.by_bunch(lambda supply: supply.gap_mm),
        width=settings.width_rule,
    )
    return completed, supplies


def supplies_of(settings: Settings) -> Supplies:
    """Return the materials and sheets of a job, as they are asked for."""
    stock = settings.stock
    return plan_supplies(
        parse_materials(stock.material),
        by_bunch(stock.thickness_mm),
        by_bunch(settings.machine.kerf_mm if settings.common_cuts else stock.gap_mm),
        stock.sheets,
        stock.library,
        settings.machine.bed,
    )


def former_supply(settings: Settings, supplies: Supplies) -> Supply:
    """Return what a former is cut from; its sheets and gap are the material's own."""
    own, asked = supplies.each[0], settings.pieces.former
    if asked == "auto" and not supplies.rolls and own.material.thickness_mm >= _STIFF_MM:
        return own
    material = FORMER_BOARD if asked in (None, "auto") else str(asked)
    stock, bed = settings.stock, settings.machine.bed
    none = (("", None),)
    return plan_supplies((("", material),), none, none, (), stock.library, bed).each[0]


def brief_of(settings: Settings, supplies: Supplies) -> Brief:
    """Return what the pieces of a job are made by."""
    return make_brief(settings.ribbons, settings.pieces, supplies, settings.search.effort)


def settle_grain(
    woven: WovenObject, settings: Settings, supplies: Supplies
) -> tuple[Settings, Supplies]:
    """Lay pieces across the grain if that is left to fabweave, and bends ask for it."""
    supplies = chosen_grain(woven.ribbons, woven.bunches, supplies)
    return settings.but(rotations=supplies.rotations), supplies


def load_asked(
    settings: Settings,
    progress: Progress = no_progress,
    given_mesh: PolyMesh | None = None,
    remeshed: Remeshed | None = None,
) -> LoadedMesh:
    """Load the mesh of a job, see :func:`fabweave.mesh.load.load_mesh`."""
    limits = [ribbon_limits(material) for material in supplies_of(settings).materials]
    return load_mesh(
        settings.mesh,
        progress,
        given_mesh,
        remeshed,
        course=settings.weave.course,
        triaxial=settings.weave.triaxial,
        seed=settings.search.seed,
        # Of several materials, what suits the stiffest.
        wish=Wish(
            radius_mm=max(float(one.bend_mm) for one in limits),
            twist_deg=min(float(one.twist_deg) for one in limits),
        ),
    )


def lay_asked(
    loaded: LoadedMesh, settings: Settings, supplies: Supplies, progress: Progress = no_progress
) -> WovenObject:
    """Weave the loaded mesh of a job, and lay its ribbons as wide as asked.

    Raises
    ------
    InputError
        For bad settings.
    CannotMakeError
        For what cannot be made as asked; the message says what would help.
    """
    woven = weave_mesh(loaded, settings.weave, settings.search, supplies, progress)
    return lay_strips(woven, settings.ribbons, supplies, progress)
