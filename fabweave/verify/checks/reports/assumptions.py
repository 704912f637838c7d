"""Check the sentences on what costs rest on: they are those of the rates that were taken."""

from collections.abc import Iterator
from typing import Any

from fabweave.verify.checks.reports.hands import PACE, fastener_class
from fabweave.verify.measure.words import range_words
from fabweave.verify.statement import Place

#: What the kinds of machines are called.
_MACHINES = {
    "diode": "diode laser on a small frame",
    "co2": "CO2 laser",
    "fibre": "fibre laser",
}


def check_assumptions(waste: dict[str, Any], estimate: dict[str, Any], place: Place) -> None:
    """Check that each rate is told as it was taken, and nothing else is.

    Parameters
    ----------
    waste : dict
        waste.json.
    estimate : dict
        Of it.
    place : Place
    """
    told, wanted = estimate["assumptions"], [*_sentences(waste, estimate)]
    place.equal("the number of assumptions", len(told), len(wanted))
    for number, (said, due) in enumerate(zip(told, wanted, strict=False)):
        place.at(f"assumption {number}").equal("it", said, due)


def _sentences(waste: dict[str, Any], estimate: dict[str, Any]) -> Iterator[str]:
    """Yield what costs rest on."""
    rates = estimate["materials"]
    for one in rates:
        yield from _speeds(one)
    if estimate["calibration"] == 1.0:
        yield (
            "Nothing is measured on your machine: after a first job, --calibrate makes these times "
            "yours."
        )
    else:
        yield (
            f"Times of the machine are multiplied by {estimate['calibration']:g}, as one job was "
            "measured (--calibrate)."
        )
    yield (
        "Lines are followed one colour after another, with one acceleration, slowly round corners, "
        "and from rest to rest; loading sheets and focusing are not counted."
    )
    actions = (f"{one['each_s']:g} s {one['words']}" for one in estimate["assembly"]["actions"])
    quick, slow = PACE
    yield (
        f"Hands: {', '.join(actions)}, practised, times {quick:g} to {slow:g} for a maker; waiting "
        "for glue is not counted."
    )
    for one in rates:
        yield from _prices(one)
    if any(sheet.get("price") for sheet in waste["sheets"]):
        yield "Prices in the list of stock are taken to be in the currency of the material."
    for size in sorted({row["diameter_mm"] for row in waste["fasteners"]}):
        _, _, low, high, words = fastener_class(size)
        yield (
            f"A fastener for a hole of {size:g} mm ({words}) costs {range_words([low, high])} EUR, "
            "an estimate."
        )
    if waste["glue"]["joints"] or waste["tape"]["joints"]:
        yield "Glue and tape cost a cent or two a joint, an estimate."


def _source(text: str) -> str:
    return f" ({text})" if text else ""


def _speeds(rates: dict[str, Any]) -> Iterator[str]:
    """Yield how fast a material is cut and engraved."""
    name, cut = f"{rates['material']} {rates['thickness_mm']:g} mm", ""
    if rates["speed_mm_s"] is None:
        yield (
            f"No cutting speed of {name} is known: write speed_mm_s in a materials file of your "
            "own."
        )
    else:
        speed = range_words(rates["speed_mm_s"])
        cut = f" is cut at {speed} mm/s{_source(rates['speed_source'])},"
    engrave, rapid, gathers, rests = (
        range_words(rates[key])
        for key in ("engrave_mm_s", "rapid_mm_s", "acceleration_mm_s2", "pierce_s")
    )
    yield (
        f"{name}{cut} is engraved at {engrave} mm/s; a {_MACHINES.get(rates['machine'])} moves at "
        f"{rapid} mm/s, gathers speed at {gathers} mm/s², and rests {rests} s where a cut begins."
    )


def _prices(rates: dict[str, Any]) -> Iterator[str]:
    """Yield what a material and its machine cost."""
    name = f"{rates['material']} {rates['thickness_mm']:g} mm"
    if rates["price_per_m2"] is None:
        yield (
            f"No price of {name} is known: write price_per_m2 and currency in a materials file of "
            "your own."
        )
    else:
        price = f"{range_words(rates['price_per_m2'])} {rates['currency']}"
        yield f"{name} costs {price} a square metre{_source(rates['price_source'])}."
    if rates["machine_per_h"] is not None:
        rent = f"{range_words(rates['machine_per_h'])} {rates['currency']}"
        yield f"An hour of the machine costs {rent}."
