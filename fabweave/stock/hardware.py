"""Hold what is sold to go through holes: which holes and which grips it fits."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from fabweave.core.entries import shipped_records
from fabweave.core.errors import InputError
from fabweave.core.messages import one_named
from fabweave.core.records import record
from fabweave.core.units import parse_length
from fabweave.stock.machine import Span

#: Screws are called by their thread alone, too.
_THREAD = re.compile(r"m\d(\.\d)?")
#: No fastener goes through a smaller or a larger hole.
LEAST_HOLE_MM, MOST_HOLE_MM = 0.001, 1000.0
#: Holes and grips agree to this, millimetres.
_SAME_MM = 1e-6


@record
class Hardware:
    """A sort of fastener, in millimetres and seconds; ``each`` is its price in euros.

    Parameters
    ----------
    tool : str
        What sets it, in words.
    hole_mm : (float, float)
        The least and the greatest hole that serves.
    cut_mm : float
        The hole to cut for it.
    grips_mm : tuple of (float, float)
        The thickness of a whole stack that each of its lengths holds.
    lengths : tuple of str
        How these lengths are called; empty where they have no names.
    outside : bool
        Whether it is set from one side, where no hand comes to the other.
    washer : bool
        Whether its back pulls through what is softer than metal, unless a washer lies there.
    search : str
        What shops call it.
    assumed : tuple of str
        Which of these are estimates.
    """

    name: str
    title: str
    tool: str
    hole_mm: Span
    cut_mm: float
    grips_mm: tuple[Span, ...]
    head_mm: float
    seconds: float
    each: Span
    lengths: tuple[str, ...] = ()
    outside: bool = False
    washer: bool = False
    search: str = ""
    assumed: tuple[str, ...] = ()

    def fits(self, hole_mm: float, grip_mm: float) -> bool:
        """Say whether it goes through a hole and holds a stack.

        Examples
        --------
        >>> rivet = hardware_named("blind-rivet-3.2")
        >>> rivet.fits(3.3, 1.2), rivet.fits(3.3, 0.4), rivet.fits(2.5, 1.2)
        (True, False, False)
        """
        low, high = self.hole_mm
        through = low - _SAME_MM <= hole_mm <= high + _SAME_MM
        return through and self.length_for(grip_mm) is not None

    def length_for(self, grip_mm: float) -> str | None:
        """Return what its shortest length for a stack is called; None if none holds it.

        Examples
        --------
        >>> hardware_named("blind-rivet-2.4").length_for(4.0)
        'blind rivet 2.4 x 9'
        """
        for number, (low, high) in enumerate(self.grips_mm):
            if low - _SAME_MM <= grip_mm <= high + _SAME_MM:
                return " ".join([self.title, *self.lengths[number : number + 1]])
        return None


@cache
def hardware_catalogue() -> Mapping[str, Hardware]:
    """Return the sorts of fasteners that fabweave knows, by name.

    Examples
    --------
    >>> [sort.name for sort in hardware_catalogue().values() if sort.fits(5.1, 3.0)]
    ['book-screw']
    """
    return shipped_records("fabweave.stock", "hardware.toml", Hardware)


def hardware_named(name: str) -> Hardware:
    """Return the sort of fastener with this name.

    Raises
    ------
    InputError
        If there is none; the message lists the names, closest first.
    """
    return one_named("hardware", name, hardware_catalogue())


@dataclass(frozen=True)
class Fastener:
    """What is asked for to hold crossings: a sort, a hole (0 for none), both, or neither."""

    sort: Hardware | None = None
    hole_mm: float | None = None


def parse_fastener(text: str | None) -> Fastener:
    """Read what is typed for a fastener: a sort, a hole, both with a comma between, or none.

    Raises
    ------
    InputError
        If there is no such sort, or it does not go through the hole.

    Examples
    --------
    >>> asked = parse_fastener("M3")
    >>> asked.sort.name, asked.hole_mm, parse_fastener("none").hole_mm
    ('screw-m3', 3.2, 0.0)
    """
    sort, hole = None, None
    for part in filter(None, (one.strip().lower() for one in (text or "").split(","))):
        if part == "none":
            hole = 0.0
        elif part[0].isdigit() or part[0] == ".":
            hole = parse_length(part, what="hole", zero_ok=True)
        else:
            sort = hardware_named(f"screw-{part}" if _THREAD.fullmatch(part) else part)
    if sort is not None and hole is None:
        hole = sort.cut_mm
    if hole is not None and not (hole == 0.0 or LEAST_HOLE_MM <= hole <= MOST_HOLE_MM):
        raise InputError(f"a hole of {hole:g} mm is none for a fastener")
    if sort is not None and hole is not None and not sort.hole_mm[0] <= hole <= sort.hole_mm[1]:
        raise InputError(
            f"a hole of {hole:g} mm is not for {sort.title}, which wants {sort.hole_mm[0]:g} to "
            f"{sort.hole_mm[1]:g} mm"
        )
    return Fastener(sort, hole)


def sort_asked(text: str | None) -> str | None:
    """Return the name of the sort that a text for a fastener asks for; None for any that fits."""
    sort = parse_fastener(text).sort
    return None if sort is None else sort.name
