"""Hold the material library and the rules that depend on a material."""

import itertools
import math
import tomllib
from dataclasses import dataclass, replace
from importlib import resources
from typing import Any

from fabweave.core.errors import InputError
from fabweave.core.messages import one_named


@dataclass(frozen=True)
class Material:
    """A sheet material with the defaults that a job takes from it.

    Parameters
    ----------
    name, title : str
        How it is called on the command line, and for people.
    thickness_mm, density_kg_m3, kerf_mm : float
        Measured thickness, density, and the width that the beam removes.
    gap_mm : float
        Least distance between pieces on a sheet.
    sheet_mm : (float, float)
        Width and height of the sheet that is taken unless another is asked for.
    min_bend_radius_t : float or None
        Tightest bend in multiples of the thickness, where that is the rule.
    bend_table_mm : tuple of (float, float)
        Else thickness and tightest bend in millimetres, by rising thickness.
    metal : bool
        Whether the rules for metal hold.
    speed_mm_s : (float, float) or None
        Slowest and fastest cutting speed, where known.
    price_per_m2 : float or None
        Price of a square metre in `currency`, where known.
    assumed : tuple of str
        The values that are engineering defaults and have no published source.
    notes : str
        What a person should know before cutting it.
    """

    name: str
    title: str
    thickness_mm: float
    density_kg_m3: float
    kerf_mm: float
    gap_mm: float
    sheet_mm: tuple[float, float]
    metal: bool
    min_bend_radius_t: float | None = None
    bend_table_mm: tuple[tuple[float, float], ...] = ()
    speed_mm_s: tuple[float, float] | None = None
    price_per_m2: float | None = None
    currency: str = ""
    assumed: tuple[str, ...] = ()
    notes: str = ""

    @property
    def caption(self) -> str:
        """Its name and thickness, in few letters."""
        return f"{self.name} {self.thickness_mm:g} mm"

    def __post_init__(self) -> None:
        """Refuse values that no material has."""
        for field, value, zero_ok in (
            ("thickness", self.thickness_mm, False),
            ("density", self.density_kg_m3, False),
            ("kerf", self.kerf_mm, True),
            ("gap", self.gap_mm, True),
        ):
            if not (math.isfinite(value) and (value > 0.0 or (zero_ok and value == 0.0))):
                least = "zero or more" if zero_ok else "positive"
                raise InputError(f"{field} of material {self.name!r} is {value}: must be {least}")
        if self.min_bend_radius_t is None and not self.bend_table_mm:
            raise InputError(f"material {self.name!r} has no rule for its bend radius")


def material_library() -> tuple[Material, ...]:
    """Return the materials that fabweave knows, thinnest family first as listed.

    Examples
    --------
    >>> [m.name for m in material_library() if m.metal][:2]
    ['aluminium-5052', 'stainless-304']
    """
    text = resources.files("fabweave.stock").joinpath("materials.toml").read_text("utf-8")
    return tuple(_material(name, entry) for name, entry in tomllib.loads(text).items())


def _material(name: str, entry: dict[str, Any]) -> Material:
    values = dict(entry)
    for key in ("sheet_mm", "speed_mm_s", "assumed"):
        if key in values:
            values[key] = tuple(values[key])
    values["bend_table_mm"] = tuple((t, r) for t, r in values.get("bend_table_mm", ()))
    return Material(name=name, **values)


def material_named(name: str) -> Material:
    """Return the material of the library with this name.

    Parameters
    ----------
    name : str
        A name of the library; upper and lower case are the same.

    Returns
    -------
    Material
        Its defaults.

    Raises
    ------
    InputError
        If there is none; the message lists the names, closest first.

    Examples
    --------
    >>> material_named("stainless-304").thickness_mm
    0.5
    """
    return one_named("material", name, {one.name: one for one in material_library()})


def with_thickness(material: Material, thickness_mm: float) -> Material:
    """Return the material with a measured thickness; the gap grows to the thickness if needed.

    Examples
    --------
    >>> with_thickness(material_named("birch-ply-3"), 3.9).gap_mm
    3.9
    """
    if not (math.isfinite(thickness_mm) and thickness_mm > 0.0):
        raise InputError(f"thickness {thickness_mm} mm of {material.name!r} must be positive")
    gap_mm = max(material.gap_mm, thickness_mm, 2.0 * material.kerf_mm)
    return replace(material, thickness_mm=thickness_mm, gap_mm=gap_mm)


def min_bend_radius_mm(material: Material) -> float:
    """Return the tightest radius to which the material bends without damage, in millimetres.

    A table is read piecewise linearly; outside it the ratio of radius to thickness is kept.

    Examples
    --------
    >>> min_bend_radius_mm(material_named("spring-shim-0.2"))
    20.0
    >>> min_bend_radius_mm(with_thickness(material_named("birch-veneer"), 1.78))
    132.0
    """
    thickness = material.thickness_mm
    if material.min_bend_radius_t is not None:
        return material.min_bend_radius_t * thickness
    table = material.bend_table_mm
    if thickness <= table[0][0]:
        return table[0][1] * thickness / table[0][0]
    for (t0, r0), (t1, r1) in itertools.pairwise(table):
        if thickness <= t1:
            return r0 + (r1 - r0) * (thickness - t0) / (t1 - t0)
    return table[-1][1] * thickness / table[-1][0]


def min_hole_mm(material: Material) -> float:
    """Return the smallest hole that a laser cuts well: the thickness, and at least 1 mm.

    Examples
    --------
    >>> min_hole_mm(material_named("card")), min_hole_mm(material_named("birch-ply-3"))
    (1.0, 3.1)
    """
    return max(material.thickness_mm, 1.0)


def hole_edge_mm(material: Material, hole_mm: float) -> float:
    """Return the least distance from the centre of a hole to the edge of its piece.

    Two diameters in metal (FAA AC 43.13-1B, single row of rivets); elsewhere two diameters and
    at least three thicknesses.

    Examples
    --------
    >>> hole_edge_mm(material_named("aluminium-5052"), 3.2)
    6.4
    >>> round(hole_edge_mm(material_named("birch-ply-3"), 4.0), 9)
    9.3
    """
    if not (math.isfinite(hole_mm) and hole_mm > 0.0):
        raise InputError(f"hole of {hole_mm} mm must have a positive diameter")
    return 2.0 * hole_mm if material.metal else max(2.0 * hole_mm, 3.0 * material.thickness_mm)


def sheet_mass_kg(material: Material, area_mm2: float) -> float:
    """Return the mass of an area of the material, in kilograms.

    Examples
    --------
    >>> round(sheet_mass_kg(material_named("aluminium-5052"), 1e6), 6)
    1.34
    """
    return area_mm2 * material.thickness_mm * material.density_kg_m3 * 1e-9
