"""Hold the speeds and prices of a material that costs were computed with."""

from fabweave.core.records import record
from fabweave.stock.machine import OneOrSpan, Span
from fabweave.stock.material import Material, machine_of


@record
class MaterialRates:
    """Speeds and prices of a material: millimetres and seconds, prices in its currency.

    Pairs are a least and a greatest value. What is None, or an empty source, is not known.
    """

    material: str
    thickness_mm: float
    machine: str
    speed_mm_s: Span | None
    engrave_mm_s: Span
    rapid_mm_s: Span
    acceleration_mm_s2: Span
    deviation_mm: float
    pierce_s: Span
    laser_on_s: Span
    speed_source: str
    price_per_m2: OneOrSpan | None
    machine_per_h: OneOrSpan | None
    currency: str
    price_source: str


def material_rates(material: Material) -> MaterialRates:
    """Return the speeds and prices of a material, with those of its machine."""
    machine = machine_of(material)
    return MaterialRates(
        material=material.name,
        thickness_mm=material.thickness_mm,
        machine=machine.name,
        speed_mm_s=material.speed_mm_s,
        engrave_mm_s=machine.engrave_mm_s,
        rapid_mm_s=machine.rapid_mm_s,
        acceleration_mm_s2=machine.acceleration_mm_s2,
        deviation_mm=machine.deviation_mm,
        pierce_s=machine.pierce_s,
        laser_on_s=machine.laser_on_s,
        speed_source=material.speed_source,
        price_per_m2=material.price_per_m2,
        machine_per_h=material.machine_per_h,
        currency=material.currency,
        price_source=material.price_source,
    )
