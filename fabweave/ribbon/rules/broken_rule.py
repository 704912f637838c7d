"""Describe which rule does not hold, how badly, where, how often, and what would fix it."""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from fabweave.core.records import optional

Severity: TypeAlias = Literal["refuse", "warn"]
#: A place with less than this share of what a rule wants is far from it: no coaxing helps there.
FAR = 0.6


@dataclass(frozen=True)
class BrokenRule:
    """One rule that does not hold: how badly, where, how often, and what would fix it.

    Parameters
    ----------
    rule : str
        ``width``, ``bend``, ``twist``, ``crease``, ``layers``, ``clearance``, ``hole`` or
        ``grain``.
    severity : "refuse" or "warn"
        Whether the object cannot be made, or can with care.
    value, limit : float
        The worst value there is, and what the material needs.
    unit : str
        Of both: ``mm`` or ``degrees``.
    thread : str
        Label of the thread with the worst value.
    station : int
        The place along that thread: the number, from 0, of the crossing of the thread at or before
        it.
    crossing : int
        The number of that crossing.
    other : str or None
        Label of the other thread, where two are concerned.
    position : (float, float, float)
        In space, millimetres.
    count, of : int
        In how many places the rule does not hold, out of how many.
    far : int
        In how many of them there is less than ``FAR`` of what is needed, or more than ``1 / FAR``
        times what is allowed; for clearance, in how many ribbons pass through each other.
    size_mm : int or None
        The smallest size at which the rule holds, if a larger size fixes it.
    may_be_mm : int or None
        The smallest size at which the object is no longer refused for this rule; not written.
    width_factor : float or None
        With ribbons this much narrower the rule holds, too.
    refine : str or None
        With the mesh refined like this the rule holds, and no other is newly broken; this was
        tried.
    cause : str or None
        Why the rule does not hold, where that is known.
    remedy, text : str
        What would fix it, and the whole finding in words, where it is written.
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
    far: int = 0
    size_mm: int | None = None
    may_be_mm: int | None = optional(default=None)
    width_factor: float | None = None
    refine: str | None = None
    cause: str | None = None
    remedy: str = ""
    text: str = ""


def sentence(finding: BrokenRule) -> str:
    """Return a sentence on what was found, where, and what would fix it.

    Examples
    --------
    >>> print(sentence(BrokenRule("bend", "warn", 30.0, 46.0, "mm", "A", 3, 17, None, (0, 0, 0), 5,
    ...     120, size_mm=412)))
    bend: a radius of 30.0 mm on thread A after crossing 17, but the material allows no less than \
46.0 mm; in 5 of 120 places. To fix it, use --size 412mm
    """
    advice = remedies(finding)
    return statement(finding) + (f". To fix it, use {advice}" if advice else "")


def statement(finding: BrokenRule) -> str:
    """Return what was found, and where, without what would fix it.

    Examples
    --------
    >>> near = BrokenRule("hole", "warn", 3.0, 4.0, "mm", "A", 3, 17, None, (0, 0, 0), 5, 9)
    >>> print(statement(near))
    hole: only 3.00 mm from its centre to an edge on thread A after crossing 17, but it needs \
4.00 mm; in 5 of 9 places
    """
    digits = _digits(finding)
    value, limit = f"{finding.value:.{digits}f}", f"{finding.limit:.{digits}f}"
    unit = "°" if finding.unit == "degrees" else f" {finding.unit}"
    where = f"on thread {finding.thread} after crossing {finding.crossing}"
    if finding.other is not None:
        where = (
            f"between threads {finding.thread} and {finding.other} near crossing {finding.crossing}"
        )
    what = {
        "width": f"only {value}{unit} {where}, but a ribbon needs {limit}{unit} to be handled",
        "bend": f"a radius of {value}{unit} {where}, but the material allows no less than "
        f"{limit}{unit}",
        "twist": f"{value}{unit} over a length equal to the width {where}, but the material allows "
        f"at most {limit}{unit}",
        "crease": f"{value}{unit} at one cross-line {where}, but the material allows at most "
        f"{limit}{unit} from crossing to crossing",
        "layers": f"only {value}{unit} from middle to middle {where}, but the layers need "
        f"{limit}{unit}",
        "hole": f"only {value}{unit} from its centre to an edge {where}, but it needs "
        f"{limit}{unit}",
        "clearance": f"only {value}{unit} from middle to middle {where}, but ribbons need "
        f"{limit}{unit}",
        "grain": f"a tight bend may lie {value}{unit} off the line across the grain {where}, but "
        f"strips bend better only up to {limit}{unit} off",
    }[finding.rule]
    if finding.rule == "clearance" and finding.value == 0:
        what = f"ribbons pass through each other {where}"
        if finding.other == finding.thread:
            what = f"the ribbon of thread {finding.thread} passes through itself near crossing "
            what += str(finding.crossing)
    places = f"in {finding.count} of {finding.of} places"
    if finding.rule == "clearance":
        places = f"in {finding.count} place{'' if finding.count == 1 else 's'}"
    if finding.cause is not None:
        places += f" ({finding.cause})"
    return f"{finding.rule}: {what}; {places}"


def _digits(finding: BrokenRule) -> int:
    """Return how many decimals show that the value is not the limit, four at most."""
    digits = 2 if finding.unit == "mm" and finding.limit < 5 else 1
    while digits < 4 and f"{finding.value:.{digits}f}" == f"{finding.limit:.{digits}f}":
        digits += 1
    return digits


def remedies(finding: BrokenRule) -> str:
    """Return what would fix a finding, as options of the command line; empty if nothing is known.

    Examples
    --------
    >>> remedies(BrokenRule("clearance", "warn", 0.1, 0.4, "mm", "A", 0, 0, "B", (0, 0, 0), 1, 9,
    ...     size_mm=500, width_factor=0.8))
    '--size 500mm, or ribbons 20 % narrower (--width)'
    """
    ways = []
    if finding.size_mm is not None:
        ways.append(f"--size {finding.size_mm}mm")
    if finding.width_factor is not None:
        ways.append(f"ribbons {round(100 * (1 - finding.width_factor))} % narrower (--width)")
    if finding.refine is not None:
        ways.append(f"--refine {finding.refine}")
    return ", or ".join(ways)


def written(finding: BrokenRule) -> BrokenRule:
    """Return a finding as ``ribbons.json`` holds it: rounded, with what would fix it, in words."""
    return replace(
        finding,
        value=round(finding.value, 4),
        limit=round(finding.limit, 4),
        may_be_mm=None,
        remedy=remedies(finding),
        text=sentence(finding),
    )
