"""Say which rule does not hold, how badly, where, how often, and what would mend it."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from fabweave.core.records import record

Severity: TypeAlias = Literal["refuse", "warn"]


@dataclass(frozen=True)
class Finding:
    """One rule that does not hold: how badly, where, how often, and what would mend it.

    Parameters
    ----------
    rule : str
        ``width``, ``bend``, ``twist``, ``crease``, ``layers``, ``clearance`` or ``hole``.
    severity : "refuse" or "warn"
        Whether the object cannot be made, or can with care.
    value, limit : float
        The worst value there is, and what the material wants.
    unit : str
        Of both: ``mm`` or ``degrees``.
    thread : str
        Label of the thread with the worst value.
    station : int
        The place along that thread: its how-manieth crossing, from 0, lies at or before it.
    crossing : int
        The number of that crossing.
    other : str or None
        Label of the other thread, where two are concerned.
    position : (float, float, float)
        In space, millimetres.
    count, of : int
        In how many places the rule does not hold, out of how many.
    size_mm : int or None
        The smallest size at which the rule holds, if a larger size mends it.
    may_be_mm : int or None
        The smallest size at which the object is no longer refused for this rule.
    width_factor : float or None
        Ribbons this much narrower hold the rule too.
    refine : str or None
        With the mesh refined like this the rule holds, and no other is broken anew: tried.
    cause : str or None
        Why the rule does not hold, where that is known.
    """

    rule: str
    severity: Severity
    value: float
    limit: float
    unit: str
    thread: str
    station: int
    crossing: int
    other: str | None
    position: tuple[float, float, float]
    count: int
    of: int
    size_mm: int | None = None
    may_be_mm: int | None = None
    width_factor: float | None = None
    refine: str | None = None
    cause: str | None = None


def sentence(found: Finding) -> str:
    """Say what was found, where, and what would mend it.

    Examples
    --------
    >>> print(sentence(Finding("bend", "warn", 30.0, 46.0, "mm", "A", 3, 17, None, (0, 0, 0), 5,
    ...     120, size_mm=412)))
    bend: 30.0 mm on thread A after crossing 17, where the material takes 46.0 mm; in 5 of 120 \
places. --size 412mm mends it
    """
    value, limit = f"{found.value:.{_digits(found)}f}", f"{found.limit:.{_digits(found)}f}"
    unit = "°" if found.unit == "degrees" else f" {found.unit}"
    where = f"on thread {found.thread} after crossing {found.crossing}"
    if found.other is not None:
        where = f"between threads {found.thread} and {found.other} near crossing {found.crossing}"
    what = {
        "width": f"{value}{unit} {where}, where {limit}{unit} is the least to handle",
        "bend": f"{value}{unit} {where}, where the material takes {limit}{unit}",
        "twist": f"{value}{unit} over one width {where}, where the material takes {limit}{unit}",
        "crease": f"{value}{unit} at one cross-line {where}, where the material takes "
        f"{limit}{unit} from crossing to crossing",
        "layers": f"{value}{unit} {where}, and the layers are {limit}{unit} thick",
        "hole": f"{value}{unit} from centre to edge {where}, where {limit}{unit} are wanted",
        "clearance": f"{value}{unit} {where}, middle to middle, where {limit}{unit} are wanted",
    }[found.rule]
    if found.rule == "clearance" and found.value == 0:
        what = f"ribbons run through one another {where}"
        if found.other == found.thread:
            what = f"the ribbon of thread {found.thread} runs through itself near crossing "
            what += str(found.crossing)
    places = f"in {found.count} of {found.of} places"
    if found.rule == "clearance":
        places = f"in {found.count} place{'' if found.count == 1 else 's'}"
    if found.cause is not None:
        places += f" ({found.cause})"
    advice = remedies(found)
    return f"{found.rule}: {what}; {places}" + (f". {advice} mends it" if advice else "")


def _digits(found: Finding) -> int:
    """Return how many decimals tell what was found from the limit, four at most."""
    digits = 2 if found.unit == "mm" and found.limit < 5 else 1
    while digits < 4 and f"{found.value:.{digits}f}" == f"{found.limit:.{digits}f}":
        digits += 1
    return digits


def remedies(found: Finding) -> str:
    """Return what would mend a finding, as options of the command line; empty if nothing is known.

    Examples
    --------
    >>> remedies(Finding("clearance", "warn", 0.1, 0.4, "mm", "A", 0, 0, "B", (0, 0, 0), 1, 9,
    ...     size_mm=500, width_factor=0.8))
    '--size 500mm, or ribbons 20 % narrower (--width)'
    """
    ways = []
    if found.size_mm is not None:
        ways.append(f"--size {found.size_mm}mm")
    if found.width_factor is not None:
        ways.append(f"ribbons {round(100 * (1 - found.width_factor))} % narrower (--width)")
    if found.refine is not None:
        ways.append(f"--refine {found.refine}")
    return ", or ".join(ways)


@record
class FindingRecord:
    """A finding as ``ribbons.json`` holds it: figures rounded, what mends it, and in words."""

    rule: str
    severity: Severity
    value: float
    limit: float
    unit: str
    thread: str
    station: int
    crossing: int
    other: str | None
    position: tuple[float, float, float]
    count: int
    of: int
    size_mm: int | None
    width_factor: float | None
    refine: str | None
    cause: str | None
    remedy: str
    text: str


def finding_record(found: Finding) -> FindingRecord:
    """Return a finding as it is written."""
    return FindingRecord(
        rule=found.rule,
        severity=found.severity,
        value=round(found.value, 4),
        limit=round(found.limit, 4),
        unit=found.unit,
        thread=found.thread,
        station=found.station,
        crossing=found.crossing,
        other=found.other,
        position=found.position,
        count=found.count,
        of=found.of,
        size_mm=found.size_mm,
        width_factor=found.width_factor,
        refine=found.refine,
        cause=found.cause,
        remedy=remedies(found),
        text=sentence(found),
    )
