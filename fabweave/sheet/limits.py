"""Tell what a material asks of ribbons."""

import math

from fabweave.ribbon.rules import Limits, twist_limit_deg
from fabweave.sheet.material import Material, min_bend_radius_mm, with_thickness

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
