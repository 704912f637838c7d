"""Tell what a material asks of ribbons."""

import math

import numpy as np

from fabweave.arrays import IntArray
from fabweave.bybunch import by_bunch, format_by_bunch
from fabweave.ribbon.rules import Limits, twist_limit_deg
from fabweave.sheet.material import Material, min_bend_radius_mm, with_thickness
from fabweave.sheet.supplies import Supplies

#: Details narrower than this are fragile in anything.
_FRAGILE_MM = 1.0


def ribbon_limits(material: Material, clearance_mm: float = 0.0) -> Limits:
    """Return the limits that a material sets to ribbons, with the clearance that is wanted.

    A ribbon is at least as wide as the material is thick, and one millimetre.

    Examples
    --------
    >>> from fabweave.sheet.material import material_named
    >>> ribbon_limits(material_named("birch-ply-3")).width_mm
    3.1
    """
    thickness, bend = material.thickness_mm, min_bend_radius_mm(material)
    return Limits(
        thickness_mm=thickness,
        bend_mm=bend,
        width_mm=max(thickness, _FRAGILE_MM),
        twist_deg=twist_limit_deg(thickness, bend),
        clearance_mm=clearance_mm,
    )


def thread_limits(supplies: Supplies, bunches: IntArray, clearance_mm: float = 0.0) -> Limits:
    """Return the limits that each thread's own material sets to its ribbon.

    Parameters
    ----------
    supplies : Supplies
        What the bunches are cut from.
    bunches : (T,) int array
        The bunch of each thread.
    clearance_mm : float
        Air that is wanted between ribbons.

    Returns
    -------
    Limits
        Of numbers if there is one material, else of arrays, (T,).
    """
    each = [ribbon_limits(material, clearance_mm) for material in supplies.materials]
    if len(each) == 1:
        return each[0]
    thickness, bend, width, twist = (
        np.array([getattr(limits, name) for limits in each])
        for name in ("thickness_mm", "bend_mm", "width_mm", "twist_deg")
    )
    return Limits(thickness, bend, width, twist, clearance_mm).of(supplies.of(bunches))


def thickness_for_bend(material: Material, radius_mm: float) -> float | None:
    """Return the greatest thickness that bends to a radius, in steps of 0.05 mm; None if none.

    Examples
    --------
    >>> from fabweave.sheet.material import material_named
    >>> thickness_for_bend(material_named("stainless-304"), 100.0)
    0.2
    """
    steps = math.floor(material.thickness_mm / 0.05)
    for step in range(steps, 0, -1):
        thickness = round(0.05 * step, 2)
        if min_bend_radius_mm(with_thickness(material, thickness)) <= radius_mm:
            return thickness
    return None


def thinner_supply(supplies: Supplies, which: int, radius_mm: float) -> str | None:
    """Return the option that makes one material bend to a radius; None if it must be another.

    Examples
    --------
    >>> from fabweave.sheet.supply_plan import plan_supplies
    >>> none = (("", None),)
    >>> both = plan_supplies((("warp", "card"), ("weft", "stainless-304")), none, none, ())
    >>> thinner_supply(both, 1, 100.0)
    '--thickness warp=0.4mm,weft=0.2mm'
    """
    thin = thickness_for_bend(supplies.materials[which], radius_mm)
    if thin is None:
        return None
    told = supplies.by_bunch(
        lambda one: thin if one is supplies.each[which] else one.material.thickness_mm
    )
    return "--thickness " + format_by_bunch(by_bunch(told), lambda one: f"{one:g}mm")
