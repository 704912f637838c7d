"""Complete what is asked of a job, take its first steps, and try whether refining would help."""

from dataclasses import replace
from pathlib import Path

from fabweave.core.arrays import Progress, no_progress
from fabweave.mesh.fair.energy import Wish
from fabweave.mesh.given import GivenMesh
from fabweave.mesh.load import LoadedMesh, load_mesh
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.options.settings import Settings
from fabweave.piece.brief import Brief, hole_rules
from fabweave.plan.crossing_map import read_crossing_map
from fabweave.sheet.kerf import check_kerf
from fabweave.stock.per_bunch import by_bunch
from fabweave.stock.ribbon_limits import ribbon_limits
from fabweave.stock.rotations import AUTO, parse_rotations
from fabweave.stock.sheet_size import check_stock
from fabweave.stock.supplies import Supplies, Supply, parse_materials, plan_supplies
from fabweave.weave.weave_pattern import NAMED_PATTERNS

#: What a former is cut from, where strips are of something thinner than this, millimetres.
FORMER_BOARD, _STIFF_MM = "museum-board", 1.2


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
    if settings.weave.boundary == "auto" and ends_at_rims(settings):
        settings = settings.but(boundary="end")
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


def ends_at_rims(settings: Settings) -> bool:
    """Tell whether threads end at rims whatever the mesh, where that is left to fabweave.

    Straight strips cannot turn back, a ring lies over the ends, and a thread that turns back is
    warp here and weft there.
    """
    stock, weave = settings.stock, settings.weave
    told = by_bunch(stock.thickness_mm) + by_bunch(stock.gap_mm)
    named = [*(name for name, _ in told), *(name for name, _ in parse_materials(stock.material))]
    parted = any(named) or any(sheet.bunch for sheet in stock.sheets)
    fabric = weave.pattern not in NAMED_PATTERNS
    return settings.ribbons.straight or settings.mesh.rim != "none" or parted or fabric


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
    pieces, effort = settings.pieces, settings.search.effort
    return Brief(settings.ribbons, pieces, supplies, effort, hole_rules(pieces, supplies))


def load_asked(
    settings: Settings,
    given: GivenMesh,
    progress: Progress = no_progress,
    remeshed: Remeshed | None = None,
) -> LoadedMesh:
    """Load the mesh of a job, see :func:`fabweave.mesh.load.load_mesh`."""
    limits = [ribbon_limits(material) for material in supplies_of(settings).materials]
    return load_mesh(
        settings.mesh,
        given,
        progress,
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
