"""Tell how tightly a material bends once it is softened, where that is known."""

from fabweave.stock.bending import radius_of_table
from fabweave.stock.material import Material


def formed_radius_mm(material: Material) -> float | None:
    """Return the tightest radius of a material that was softened; None where it is not known.

    Examples
    --------
    >>> from fabweave.stock.material import material_named, with_thickness
    >>> formed_radius_mm(with_thickness(material_named("birch-veneer"), 1.78))
    38.0
    >>> formed_radius_mm(material_named("card")) is None
    True
    """
    table = material.formed_table_mm
    if material.laid_across and material.formed_across_table_mm:
        table = material.formed_across_table_mm
    if not table:
        return None
    return radius_of_table(table, material.thickness_mm)


def forming_advice(material: Material, wanted_mm: float) -> str | None:
    """Say how a material can be made to bend to a radius, if softening is enough.

    Parameters
    ----------
    material : Material
    wanted_mm : float
        The radius that is wanted, in millimetres; dry and cold it is too tight.

    Examples
    --------
    >>> from fabweave.stock.material import material_named
    >>> forming_advice(material_named("birch-veneer"), 30.0)
    'soaked in hot water and dried on a form, Birch veneer ply, 0.8 mm bends to a radius of 12 mm'
    >>> forming_advice(material_named("birch-veneer"), 5.0) is None
    True
    """
    radius = formed_radius_mm(material)
    if radius is None or radius > wanted_mm:
        return None
    how = material.formed or "softened"
    return f"{how}, {material.description} bends to a radius of {radius:.0f} mm"
