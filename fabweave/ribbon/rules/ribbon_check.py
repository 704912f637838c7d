"""Find where ribbons break the rules of their material, and compute what would fix it."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, frozen_value
from fabweave.core.errors import TooFineError
from fabweave.ribbon.measures import COARSER, NEAR_SIZE
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.broken_rule import FAR, BrokenRule
from fabweave.ribbon.rules.clearance import Nearness
from fabweave.ribbon.rules.remedy import (
    ROUNDING_MM,
    TOO_STIFF,
    Depth,
    Lay,
    Search,
    Settle,
    is_too_stiff,
    stiffest,
)
from fabweave.ribbon.rules.rules import Measured, measure_along, measure_clearance, measure_layers
from fabweave.stock.ribbon_limits import Limits
from fabweave.weave.pattern import Weave

#: Ribbons that are too near to one another can be pushed aside, unless they pass through.
_FAR = {"clearance": 1e-9}
#: A material is not said to do, with care, where all is well only at so many times the size.
_FAR_SIZE = 3.0


@frozen_value
class RibbonCheck:
    """What was measured of ribbons, and what was found.

    Parameters
    ----------
    limits : Limits
    size_mm : float
        Largest dimension of the object.
    measured : dict of str to Measured
        By rule; no clearance where a material is refused as too stiff, or the check does not go
        so far.
    findings : tuple of BrokenRule
        Refusals first.
    smallest_mm : int or None
        The smallest size at which every rule that a size can mend holds; None if there is none,
        or none was looked for.
    still : tuple of str
        The rules that do not hold even at that size.
    untried : str or None
        Why refinement was not tried as a remedy, where it might be one.
    depth : Depth
        How far the check went.
    """

    limits: Limits
    size_mm: float
    measured: dict[str, Measured]
    findings: tuple[BrokenRule, ...]
    smallest_mm: int | None
    still: tuple[str, ...] = ()
    untried: str | None = None
    depth: Depth = Depth.SEARCHED

    @property
    def refused(self) -> tuple[BrokenRule, ...]:
        """The findings for which the object cannot be made."""
        return tuple(finding for finding in self.findings if finding.severity == "refuse")


def check_ribbons(
    ribbons: Ribbons,
    weave: Weave,
    labels: Sequence[str],
    limits: Limits,
    *,
    size_mm: float,
    lay: Lay | None = None,
    clearance: tuple[Measured, Nearness] | None = None,
    settle: Settle | None = None,
    auto: bool = False,
    clashing: BoolArray | None = None,
    depth: Depth = Depth.SEARCHED,
) -> RibbonCheck:
    """Check ribbons against every rule.

    The rules: a ribbon is nowhere narrower than ``limits.width_mm``; between two crossings it need
    not bend more tightly than the material takes; it is not twisted more than its edges can
    stretch, nor creased more than can be softened; at a crossing the strands are at least one
    thickness apart, middle to middle, and ribbons that do not cross there one thickness and the
    clearance. Where threads are of several
    materials, each is held to its own, and one thickness is half of either's.

    Parameters
    ----------
    ribbons : Ribbons
    weave : Weave
        What goes over and what under.
    labels : sequence of str
        Names of the threads.
    limits : Limits
    size_mm : float
        Largest dimension of the object.
    lay : callable, optional
        Lays the ribbons again at another size and width. Without it, no remedy is computed.
    clearance : (Measured, Nearness), optional
        What is too near, if that is known already.
    settle : callable, optional
        Lays the ribbons as they would be made at another size.
    auto : bool
        Whether the width is left to fabweave: then no width is proposed.
    clashing : (X,) bool array, optional
        The crossings beside faces of the mesh that run through other faces.
    depth : Depth
        How far the check goes.
    """
    measured = measure_along(ribbons, limits)
    measured["layers"] = measure_layers(ribbons, weave, limits)
    near: Nearness | None = None
    # What is far too stiff may be thicker than the ribbons are wide, and all is near to all.
    if depth > Depth.ALONG and not is_too_stiff(measured["bend"]):
        known = clearance if clearance is not None else measure_clearance(ribbons, weave, limits)
        measured["clearance"], near = known
    search = None
    if lay is not None:
        search = Search(weave, limits, size_mm, lay, near, settle=settle, auto=auto, depth=depth)
    findings = []
    for quantity in measured.values():
        if len(quantity.broken):
            finding = _worst(quantity, weave, labels)
            if quantity.rule == "clearance":
                finding = replace(
                    finding, cause=_why_near(quantity, weave, limits, clashing, auto=auto)
                )
            findings.append(finding)
    findings.sort(key=lambda finding: finding.severity != "refuse")
    if search is None:
        return RibbonCheck(limits, size_mm, measured, tuple(findings), None, depth=depth)
    findings, smallest = search.remedies(findings)
    still = search.broken_at(smallest, ("twist",)) if smallest is not None else ()
    return RibbonCheck(limits, size_mm, measured, tuple(findings), smallest, still, depth=depth)


def _why_near(
    near: Measured,
    weave: Weave,
    limits: Limits,
    clashing: BoolArray | None,
    *,
    auto: bool,
) -> str | None:
    """Return why ribbons are too near: the mesh runs through itself, or they cannot be narrower."""
    causes = []
    if clashing is not None:
        crossing = weave.threads.crossing
        first, second = crossing[near.passes[near.broken]], crossing[near.others[near.broken]]
        count = int(np.count_nonzero(clashing[first] & clashing[second]))
        if count:
            causes.append(f"in {count} of them the mesh intersects itself, so repair the mesh")
    if auto:
        causes.append(
            f"ribbons cannot be narrower there: below {limits.width_mm:g} mm they cannot be handled"
        )
    return "; ".join(causes) or None


def _worst(quantity: Measured, weave: Weave, labels: Sequence[str]) -> BrokenRule:
    """Describe the worst place of a rule that does not hold."""
    broken = quantity.broken
    refused = quantity.rule == "bend" and is_too_stiff(quantity)
    # Where a material is refused, the worst place is that material's.
    at = int(broken[np.isin(broken, stiffest(quantity))][0] if refused else broken[0])
    threads = weave.threads
    this_pass, other_pass = int(quantity.passes[at]), int(quantity.others[at])
    thread = int(threads.thread_of_pass[this_pass])
    x, y, z = (round(float(value), 3) for value in quantity.position[at])
    return BrokenRule(
        rule=quantity.rule,
        severity="refuse" if refused else "warn",
        value=float(quantity.value[at]),
        limit=quantity.limit_at(at),
        unit=quantity.unit,
        thread=labels[thread],
        station=this_pass - int(threads.offsets[thread]),
        crossing=int(threads.crossing[this_pass]),
        other=labels[int(threads.thread_of_pass[other_pass])] if other_pass >= 0 else None,
        position=(x, y, z),
        count=len(broken),
        of=threads.n_crossings if quantity.rule == "clearance" else len(quantity.value),
        far=int(np.count_nonzero(quantity.margins[broken] < _FAR.get(quantity.rule, FAR))),
    )


def require_pliable(
    check: RibbonCheck,
    material: str,
    thinner: str | None = None,
    formed: str | None = None,
) -> None:
    """Raise TooFineError if a material is too stiff, and say what would do.

    A larger size is told only where it is near, and most of what is wrong would be right there.

    Parameters
    ----------
    check : RibbonCheck
    material : str
        What it is called.
    thinner : str, optional
        How a thickness is asked for at which it would do.
    formed : str, optional
        How it can be softened.
    """
    for finding in check.refused:
        bend = check.measured["bend"].value[stiffest(check.measured["bend"])]
        hard = int(np.count_nonzero(bend * TOO_STIFF < finding.limit))
        ways = [COARSER]
        if (
            finding.may_be_mm is not None
            and finding.size_mm is not None
            and finding.may_be_mm <= NEAR_SIZE * check.size_mm
            and finding.size_mm <= _FAR_SIZE * check.size_mm
        ):
            # That is computed with laps everywhere, so it may come out as the size there is.
            larger = max(finding.may_be_mm, math.floor(check.size_mm + ROUNDING_MM) + 1)
            ways.append(f"--size {finding.size_mm}mm (from {larger}mm on, --force makes it)")
        if thinner is not None:
            ways.append(thinner)
        ways.append("another material")
        cure = f"use {', or '.join(ways)}"
        if formed is not None:
            cure += f". It may do as it is: {formed}; --library takes an entry of your own with "
            cure += "that radius"
        raise TooFineError(
            f"{material} is too stiff: it bends to a radius of {finding.limit:.0f} mm, but in "
            f"{hard} of {len(bend)} places between crossings a ribbon must bend to less than half "
            f"of that (the tightest is {finding.value:.1f} mm, on thread {finding.thread} after "
            f"crossing {finding.crossing})",
            cure,
        )
