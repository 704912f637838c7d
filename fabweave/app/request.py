"""Complete the settings of a job: what is left to fabweave comes from the materials."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fabweave.app.settings import Settings
from fabweave.core.arrays import IntArray
from fabweave.core.errors import InputError
from fabweave.cut.kerf import check_kerf
from fabweave.flat.crossing_map import read_crossing_map
from fabweave.flat.joint.holes import HoleRule
from fabweave.report.grain import tight_along
from fabweave.ribbon.project import Ribbons
from fabweave.stock.hardware import hardware_catalogue, hardware_named
from fabweave.stock.material import hole_edge_mm, min_hole_mm
from fabweave.stock.per_bunch import by_bunch
from fabweave.stock.ribbon_limits import thread_limits
from fabweave.stock.rotations import AUTO, parse_rotations
from fabweave.stock.sheet_size import check_stock
from fabweave.stock.supplies import Supplies, parse_materials, plan_supplies

#: Hole diameters to choose from, in millimetres: a fastener of a common size and its clearance.
HOLES_MM = (4.1, 3.3, 2.5, 2.0, 1.6, 1.3, 1.0)
#: How pieces lie where bends ask for it; as pieces are wavy, some places are off by more.
ACROSS = "across:10deg"


def complete_settings(settings: Settings) -> tuple[Settings, Supplies]:
    """Fill in what was left to fabweave: thickness, gap, sheet and width.

    Raises
    ------
    InputError
        If settings by bunch name other bunches than the rest, the kerf wants a larger gap, the
        hole is too small to burn, the margin leaves nothing of a sheet, or the layout to be taken
        cannot be read.
    """
    supplies = plan_supplies(
        parse_materials(settings.material),
        by_bunch(settings.thickness_mm),
        by_bunch(settings.gap_mm),
        settings.sheets,
        settings.materials,
    )
    if parse_rotations(settings.rotations).across:
        supplies = supplies.across()
    check_kerf(settings.kerf_mm, min(supply.gap_mm for supply in supplies.each))
    # What cannot be is refused before the work, though it is needed only later.
    hole_rules(settings, supplies)
    for supply in supplies.each:
        check_stock(supply.sheets, settings.margin_mm)
    if settings.layout is not None:
        read_crossing_map(Path(settings.layout))
    return (
        replace(
            settings,
            thickness_mm=supplies.by_bunch(lambda supply: supply.material.thickness_mm),
            sheets=supplies.sheets,
            gap_mm=supplies.by_bunch(lambda supply: supply.gap_mm),
            width=settings.width_rule if settings.open is None else None,
        ),
        supplies,
    )


def chosen_grain(
    ribbons: Ribbons, bunches: IntArray, settings: Settings, supplies: Supplies
) -> tuple[Settings, Supplies]:
    """Lay pieces across the grain if that is left to fabweave, and bends ask for it.

    They do where a ribbon must bend, from crossing to crossing, more tightly than a strip along the
    grain can, if its material bends better across.

    Parameters
    ----------
    ribbons : Ribbons
        As wide as asked.
    bunches : (T,) int array
        The bunch of each thread.
    settings, supplies
        Complete.

    Returns
    -------
    Settings, Supplies
        The same, or with rotations ``across:10deg`` and the radius of strips that lie so.
    """
    limits = thread_limits(supplies, bunches)
    if settings.rotations != AUTO or not tight_along(ribbons, limits).any():
        return settings, supplies
    return replace(settings, rotations=ACROSS), supplies.across()


def _is_sold_for(hole_mm: float, supplies: Supplies) -> bool:
    """Say whether there is hardware for a hole through two layers, and through three at a lap."""
    thickness = [material.thickness_mm for material in supplies.materials]
    return all(
        any(sort.fits(hole_mm, grip_mm) for sort in hardware_catalogue().values())
        for grip_mm in (2.0 * min(thickness), 3.0 * max(thickness))
    )


def chosen_holes(settings: Settings) -> str:
    """Return which crossings have holes: what was asked for, or what suits the job.

    Where pieces of one kind are to be interchangeable, they have the same holes.
    """
    if settings.holes is not None:
        return settings.holes
    by_kind = settings.labels == "kinds" or settings.profile == "service"
    return "alike" if by_kind or settings.kinds == "fewest" else "fastened"


def hole_rules(settings: Settings, supplies: Supplies) -> tuple[HoleRule, ...]:
    """Return the holes that may be used, the largest first; none if none are wanted.

    A fastener goes through both strands of a crossing, so a hole suits all materials. Where no
    size is asked for, holes are left out for which nothing is sold that holds so thin a stack.
    """
    if settings.hole_mm == 0 or (settings.fasten == "none" and chosen_holes(settings) != "all"):
        return ()
    material = max(supplies.materials, key=min_hole_mm)
    least = min_hole_mm(material)
    sort = hardware_named(settings.hardware) if settings.hardware is not None else None
    hole = settings.hole_mm if sort is None or settings.hole_mm is not None else sort.cut_mm
    if sort is not None and hole is not None and not sort.hole_mm[0] <= hole <= sort.hole_mm[1]:
        raise InputError(
            f"a hole of {hole:g} mm is not for {sort.title}, which wants "
            f"{sort.hole_mm[0]:g} to {sort.hole_mm[1]:g} mm: leave out --hole, or --hardware"
        )
    if hole is not None:
        if hole < least:
            raise InputError(
                f"a hole of {hole:g} mm is too small for a laser in "
                f"{material.description}: use {least:g} mm or more, "
                "or --hole none"
            )
        holes: Sequence[float] = (hole,)
    else:
        holes = [hole for hole in HOLES_MM if hole >= least] or [least]
        holes = [hole for hole in holes if _is_sold_for(hole, supplies)] or holes
    # A head that reached over the edge would show, and hold nothing there.
    head = 0.0 if sort is None else sort.head_mm / 2.0
    return tuple(
        HoleRule(each, max(head, *(hole_edge_mm(one, each) for one in supplies.materials)))
        for each in holes
    )
