"""Say in sentences what costs rest on, and what is not known."""

from collections.abc import Iterator, Sequence

from fabweave.flat.bill_of_materials import BillOfMaterials
from fabweave.report.costs.assembly_time import AssemblyTime, hardware_for
from fabweave.report.costs.money import fastener_price
from fabweave.report.costs.rates import MaterialRates
from fabweave.stock.labour import CURRENCY, PACE
from fabweave.stock.machine import OneOrSpan, as_span, machines


def assumptions_of(
    rates: Sequence[MaterialRates],
    hands: AssemblyTime,
    bill: BillOfMaterials,
    *,
    calibration: float,
    planned: bool,
    stock: bool,
) -> tuple[str, ...]:
    """Return what costs rest on.

    Parameters
    ----------
    rates : sequence of MaterialRates
    hands : AssemblyTime
    bill : BillOfMaterials
    calibration : float
    planned : bool
        Whether pieces are not nested yet.
    stock : bool
        Whether a list of stock has prices.
    """
    told = [text for one in rates for text in _speeds(one)]
    if calibration != 1.0:
        told.append(
            f"Times of the machine are multiplied by {calibration:g}, as one job was measured "
            "(--calibrate)."
        )
    else:
        told.append(
            "Nothing is measured on your machine: after a first job, --calibrate makes these times "
            "yours."
        )
    told += [
        "Lines are followed one colour after another, with one acceleration, slowly round corners, "
        "and from rest to rest; loading sheets and focusing are not counted.",
        f"Hands: {', '.join(f'{each.each_s:g} s {each.words}' for each in hands.actions)}, "
        f"practised, times {PACE[0]:g} to {PACE[1]:g} for a maker; waiting for glue is not "
        "counted.",
        *(text for one in rates for text in _prices(one)),
    ]
    if stock:
        told.append("Prices in the list of stock are taken to be in the currency of the material.")
    told += _hardware(bill)
    if planned:
        told.append(
            "Pieces are not nested yet: ways between them, the area of sheets and the strands that "
            "are slid under others are predicted, and sheets are not counted whole."
        )
    return tuple(told)


def _span(value: OneOrSpan) -> str:
    """Return a range in words."""
    low, high = as_span(value)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _speeds(rates: MaterialRates) -> Iterator[str]:
    """Say how fast a material is cut."""
    name = f"{rates.material} {rates.thickness_mm:g} mm"
    machine = machines()[rates.machine].title
    if rates.speed_mm_s is None:
        yield (
            f"No cutting speed of {name} is known: write speed_mm_s in a materials file of your "
            "own."
        )
        cut = ""
    else:
        source = f" ({rates.speed_source})" if rates.speed_source else ""
        cut = f" is cut at {_span(rates.speed_mm_s)} mm/s{source},"
    yield (
        f"{name}{cut} is engraved at {_span(rates.engrave_mm_s)} mm/s; a {machine} moves at "
        f"{_span(rates.rapid_mm_s)} mm/s, gathers speed at {_span(rates.acceleration_mm_s2)} "
        f"mm/s², and rests {_span(rates.pierce_s)} s where a cut begins."
    )


def _prices(rates: MaterialRates) -> Iterator[str]:
    """Say what a material and its machine cost."""
    name = f"{rates.material} {rates.thickness_mm:g} mm"
    if rates.price_per_m2 is None:
        yield (
            f"No price of {name} is known: write price_per_m2 and currency in a materials file of "
            "your own."
        )
    else:
        source = f" ({rates.price_source})" if rates.price_source else ""
        yield f"{name} costs {_span(rates.price_per_m2)} {rates.currency} a square metre{source}."
    if rates.machine_per_h is not None:
        yield f"An hour of the machine costs {_span(rates.machine_per_h)} {rates.currency}."


def _hardware(bill: BillOfMaterials) -> Iterator[str]:
    """Say what fasteners, glue and tape cost."""
    for size in sorted({row.diameter_mm for row in bill.fasteners}):
        sorts = ", ".join(sort.title for sort in hardware_for(size, bill))
        yield (
            f"A fastener for a hole of {size:g} mm ({sorts}) costs "
            f"{_span(fastener_price(size, bill))} {CURRENCY}, an estimate."
        )
    if bill.glue.joints or bill.tape.joints:
        yield "Glue and tape cost a cent or two a joint, an estimate."
