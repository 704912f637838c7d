"""Tell what a material asks of ribbons."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.stock.material import Material, along_radius_mm, min_bend_radius_mm, with_thickness
from fabweave.stock.per_bunch import by_bunch, format_by_bunch
from fabweave.stock.supplies import Supplies

#: Details narrower than this are fragile in anything.
_FRAGILE_MM = 1.0


@dataclass(frozen=True)
class Limits:
    """What the material of all threads takes, or that of each.

    Parameters
    ----------
    thickness_mm : float or (T,) float array
        Two middle surfaces that are nearer collide; of two thicknesses, half of either counts.
    bend_mm : float or (T,) float array
        The tightest radius to which it bends without damage.
    width_mm : float or (T,) float array
        Anything narrower is too weak to handle.
    twist_deg : float or (T,) float array
        How far it may be twisted over a length that equals its width.
    clearance_mm : float
        Air between ribbons that do not cross; that is wanted, not what the material takes.
    along_mm : float or (T,) float array
        The tightest radius of a strip that lies along the grain; 0 if the grain does not count.
    """

    thickness_mm: float | FloatArray
    bend_mm: float | FloatArray
    width_mm: float | FloatArray
    twist_deg: float | FloatArray
    clearance_mm: float = 0.0
    along_mm: float | FloatArray = 0.0

    def of(self, threads: IntArray) -> "Limits":
        """Return the limits of some threads, one after another."""
        own: dict[str, Any] = {key: by_thread(value, threads) for key, value in vars(self).items()}
        return Limits(**own)

    def between(self, first: IntArray, second: IntArray) -> float | FloatArray:
        """Return half the thickness of either of two threads, together, pair by pair."""
        if not isinstance(self.thickness_mm, np.ndarray):
            return self.thickness_mm
        return np.asarray(self.thickness_mm[first] + self.thickness_mm[second]) / 2


def by_thread(value: float | FloatArray, threads: IntArray) -> float | FloatArray:
    """Return a value of all threads as it is, or those of some threads.

    Examples
    --------
    >>> by_thread(0.5, np.array([1])), by_thread(np.array([0.5, 0.8]), np.array([1])).tolist()
    (0.5, [0.8])
    """
    return value[threads] if isinstance(value, np.ndarray) else value


def twist_limit_deg(thickness_mm: float, bend_mm: float) -> float:
    """Return how far a strip may be twisted over a length that equals its width, in degrees.

    A strip of width w that turns by q in each unit of length stretches its edges by
    q^2 w^2 / 12 against its mean. The sheet's surface, bent to its tightest radius r, stretches by
    t / 2r: the edges may do the same. So q w = sqrt(6 t / r).

    Examples
    --------
    >>> round(twist_limit_deg(0.4, 8.0), 1)
    31.4
    """
    return float(np.degrees(np.sqrt(6 * thickness_mm / bend_mm)))


def ribbon_limits(material: Material, clearance_mm: float = 0.0) -> Limits:
    """Return the limits that a material sets to ribbons, with the clearance that is wanted.

    A ribbon is at least as wide as the material is thick, and one millimetre.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
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
        along_mm=along_radius_mm(material),
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
    thickness, bend, width, twist, along = (
        np.array([getattr(limits, name) for limits in each])
        for name in ("thickness_mm", "bend_mm", "width_mm", "twist_deg", "along_mm")
    )
    return Limits(thickness, bend, width, twist, clearance_mm, along).of(supplies.of(bunches))


def thickness_for_bend(material: Material, radius_mm: float) -> float | None:
    """Return the greatest thickness that bends to a radius, in steps of 0.05 mm; None if none.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
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
    >>> from fabweave.stock.supplies import plan_supplies
    >>> none = (("", None),)
    >>> both = plan_supplies((("warp", "card"), ("weft", "stainless-304")), none, none, ())
    >>> thinner_supply(both, 1, 100.0)
    '--thickness warp=0.4mm,weft=0.2mm'
    """
    thin = thickness_for_bend(supplies.materials[which], radius_mm)
    if thin is None:
        return None
    thickness_mm = supplies.by_bunch(
        lambda supply: thin if supply is supplies.each[which] else supply.material.thickness_mm
    )
    return "--thickness " + format_by_bunch(by_bunch(thickness_mm), "{:g}mm".format)
