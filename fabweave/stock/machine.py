"""Hold how fast machines are: speeds, acceleration and rests, by kind of machine and material."""

import math
from collections.abc import Mapping
from functools import cache
from typing import Any, TypeAlias

from fabweave.core.entries import Accept, Key, in_range, list_of, shipped_records
from fabweave.core.records import record

#: A least and a greatest value.
Span: TypeAlias = tuple[float, float]
#: One value, or a least and a greatest one.
OneOrSpan: TypeAlias = float | Span

CO2, FIBRE = "co2", "fibre"


@record
class Machine:
    """A kind of machine, in millimetres and seconds; pairs are a least and a greatest value.

    ``deviation_mm`` is how far the planner thinks a corner is cut short; the greater, the faster a
    corner is passed. ``pierce_s`` is the rest where a cut begins, and ``laser_on_s`` where an
    engraved line begins.
    """

    name: str
    title: str
    acceleration_mm_s2: Span
    deviation_mm: float
    rapid_mm_s: Span
    engrave_mm_s: Span
    pierce_s: Span
    laser_on_s: Span


def span_key(least: float, most: float) -> Key:
    """Return a key that takes a number in a range, or a list of two, the lesser first."""
    return Key(
        f"a number from {least:g} to {most:g}, or a list of two, the lesser first",
        _one_or_span(in_range(least, most)),
    )


def _one_or_span(one: Accept) -> Accept:
    """Return a function that accepts a number, or two in order."""

    def accept(value: Any) -> OneOrSpan | None:
        pair = list_of(value, one, count=2)
        if pair is not None:
            return pair if pair[0] <= pair[1] else None
        number: float | None = one(value)
        return number

    return accept


def as_span(value: OneOrSpan) -> Span:
    """Return a least and a greatest value, which are the same where there is but one.

    Examples
    --------
    >>> as_span(3.0), as_span((1.0, 2.0))
    ((3.0, 3.0), (1.0, 2.0))
    """
    return value if isinstance(value, tuple) else (value, value)


@cache
def machines() -> Mapping[str, Machine]:
    """Return the kinds of machines that fabweave knows, by name.

    Examples
    --------
    >>> list(machines())
    ['diode', 'co2', 'fibre']
    >>> machines()["co2"].acceleration_mm_s2
    (500.0, 2000.0)
    """
    return shipped_records("fabweave.stock", "machines.toml", Machine)


#: What one takes a practised hand, seconds, and what it is called. Taking up a strip (flexible, in
#: two hands), laying, sliding (obstructed, held) and aligning (obstructed): Boothroyd and Dewhurst,
#: as tabled by Whitney, Mechanical Assemblies, fig. 15-1, and in worked sheets, benthamopen.com
#: TOMEJ-10-173. Sorting, cutting, marking, finding and clips are estimates.
PRACTISED = {
    "sort": (5.0, "to take a piece out of its sheet and sort it"),
    "cut": (5.0, "to measure a strip off its roll and cut it"),
    "mark": (4.0, "to copy a mark from its tape"),
    "find": (5.0, "to find a piece"),
    "take": (4.5, "to take it up and turn it"),
    "over": (2.5, "to lay a strand over another"),
    "under": (8.5, "to slide one under"),
    "align": (6.0, "to bring holes or ends into line"),
    "clip": (4.0, "to put on a clip and take it off"),
    "tie": (40.0, "to tie a foot to the base"),
}
#: What holding a joint takes, by its kind: a brush and a clip, pressing (a snap that is hard to
#: align), threading (obstructed and held; what is tucked in, too), tape; the first and the last are
#: estimates. Fasteners are counted by themselves.
HOLDING_S = {"glue": 15.0, "tuck": 8.5, "dovetail": 5.0, "slot": 8.5, "none": 6.0}
#: A maker takes so many times as long as a practised hand that does nothing else: an estimate.
PACE: Span = (1.5, 3.0)
#: One number for both, where one is needed.
MIDDLE_PACE = math.sqrt(PACE[0] * PACE[1])
#: In this prices are told that no material and no list of stock names.
CURRENCY = "EUR"
#: An hour of the maker's own work; little more than a minimum wage.
LABOUR_EUR_H = 15.0
