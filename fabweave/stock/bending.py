"""Tell how tightly a material bends: along its grain, and across it."""

import itertools
from dataclasses import replace

from fabweave.stock.material import Material


def laid_across(material: Material) -> Material:
    """Return a material whose pieces lie across its grain; the same if it has none that counts."""
    return replace(material, laid_across=bool(material.across_table_mm))


def min_bend_radius_mm(material: Material) -> float:
    """Return the tightest radius to which the material bends without damage, in millimetres.

    It is that of strips along the grain, which bend worse, unless they lie across it.

    Examples
    --------
    >>> from fabweave.stock.material import material_named, with_thickness
    >>> min_bend_radius_mm(material_named("spring-shim-0.2"))
    20.0
    >>> min_bend_radius_mm(with_thickness(material_named("birch-veneer"), 1.78))
    132.0
    >>> min_bend_radius_mm(laid_across(with_thickness(material_named("birch-veneer"), 1.78)))
    81.0
    """
    if material.laid_across:
        return radius_of_table(material.across_table_mm, material.thickness_mm)
    if material.min_bend_radius_t is not None:
        return material.min_bend_radius_t * material.thickness_mm
    return radius_of_table(material.bend_table_mm, material.thickness_mm)


def along_radius_mm(material: Material) -> float:
    """Return the tightest radius of a strip that lies along the grain; 0 if it has none.

    Examples
    --------
    >>> from fabweave.stock.material import material_named, with_thickness
    >>> veneer = with_thickness(material_named("birch-veneer"), 1.78)
    >>> along_radius_mm(laid_across(veneer)), along_radius_mm(material_named("card"))
    (132.0, 0.0)
    """
    if not material.across_table_mm:
        return 0.0
    return min_bend_radius_mm(replace(material, laid_across=False))


def radius_of_table(table: tuple[tuple[float, float], ...], thickness: float) -> float:
    """Return the radius that a table has for a thickness, in millimetres.

    It is read piecewise linearly; outside it the ratio of radius to thickness is kept.

    Examples
    --------
    >>> radius_of_table(((1.0, 50.0), (2.0, 120.0)), 1.5), radius_of_table(((1.0, 50.0),), 0.5)
    (85.0, 25.0)
    """
    if thickness <= table[0][0]:
        return table[0][1] * thickness / table[0][0]
    for (t0, r0), (t1, r1) in itertools.pairwise(table):
        if thickness <= t1:
            return r0 + (r1 - r0) * (thickness - t0) / (t1 - t0)
    return table[-1][1] * thickness / table[-1][0]
