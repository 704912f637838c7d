"""Look for the size or the width at which rules hold that are now broken."""

import bisect
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import IntEnum
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import IntArray
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.broken_rule import BrokenRule
from fabweave.ribbon.rules.clearance import Nearness
from fabweave.ribbon.rules.rules import Measured, measure_along, measure_clearance
from fabweave.stock.ribbon_limits import Limits
from fabweave.weave.pattern import Weave

#: A search goes no further than this many times the size that was asked for.
FARTHEST = 100
#: So many sizes are tried along a line through the last two; then intervals are halved.
_ALONG_A_LINE = 12


def smallest_size(margin: Callable[[int], float], start: int, *, most: int) -> int | None:
    """Return the smallest whole size at which the margin of a rule is at least 1.

    Parameters
    ----------
    margin : callable
        Tells what there is over what is wanted at a size. It is taken to rise with the size.
    start : int
        Where to begin, in millimetres.
    most : int
        No larger size is tried.

    Returns
    -------
    int or None
        None if the margin is below 1 up to ``most``.

    Examples
    --------
    >>> smallest_size(lambda size: size / 321.5, 100, most=1000)
    322
    >>> smallest_size(lambda size: 0.5, 100, most=1000) is None
    True
    """
    low, below, high, above = 0, -1.0, most + 1, math.inf
    size, stride = max(start, 1), 1
    held: bool | None = None
    tries = 0
    while high - low > 1:
        excess = margin(size) - 1
        tries += 1
        again, held = held == (excess >= 0), excess >= 0
        # An end that stays twice counts half (Illinois): it would stay to the last.
        if held:
            high, above, below = size, excess, below / 2 if again else below
        else:
            low, below, above = size, excess, above / 2 if again else above
        if high <= most and tries > _ALONG_A_LINE:
            # The margin jumps.
            size = (low + high) // 2
        elif high <= most:
            size = low + math.ceil((high - low) * below / (below - above))
        else:
            # Nothing holds yet. Margins grow about as sizes do; else strides become longer.
            stride *= 2
            size = max(low + stride, math.ceil(low / (1 + below)) if below > -1 else 0)
        size = min(max(size, low + 1), high - 1)
    return high if high <= most else None


#: Lays the same ribbons at another size (mm), with all widths multiplied by a factor; and, if the
#: width is left to fabweave, as narrow as may be where they were too near.
Lay: TypeAlias = Callable[[float, float, bool], Ribbons]
#: Lays ribbons at another size (mm) as they would be made there, and plans pieces for that or takes
#: them to have room for laps everywhere; tells what is too near, if that is known.
Settle: TypeAlias = Callable[[float, bool], tuple[Ribbons, Nearness | None]]


class Depth(IntEnum):
    """How far a check of ribbons goes; each takes several times as long as the one before.

    ``ALONG`` measures single ribbons, and looks for a size only where a material is refused;
    ``NEAR`` measures what is too near, too, and looks for the sizes at which each rule along
    single ribbons holds; ``SEARCHED`` looks for every size and width, and confirms them on what
    would be made there.
    """

    ALONG = 1
    NEAR = 2
    SEARCHED = 3


#: A material is too stiff if it takes less than half the bend ...
TOO_STIFF = 2.0
#: ... in more than this share of the spans between crossings: a few tight places may be trimmed.
STIFF_SHARE = 0.25
#: Narrower ribbons are tried in these steps, down to a third.
_NARROWER = tuple(step / 20 for step in range(19, 5, -1))
#: Where ribbons are too near after all, as they would be made, a size larger by this share is
#: tried, and then by twice as much each time, up to the last; and at the end sizes between the last
#: two, as close as the share next to it.
_STRIDE, _FARTHEST_STRIDE, _CLOSE = 0.01, 2.56, 0.03
#: Of objects of so many crossings at most, pieces are planned for every size that is told; of
#: larger ones, only for that at which all rules hold, if it is larger than the present one.
FEW = 600
#: By how much an object is larger than it is said to be through rounding alone.
ROUNDING_MM = 5e-4
#: Rules that a larger size fixes: lengths grow, and thickness stays.
SIZED = ("width", "bend", "crease", "clearance")


def is_too_stiff(bend: Measured) -> bool:
    """Tell whether a material is too stiff for these spans, as `TOO_STIFF` says."""
    return stiffness(bend) < 1


def stiffness(bend: Measured) -> float:
    """Return a margin that is below 1 where a material is too stiff for these spans.

    Of several materials the one counts that is the farthest from bending so: see `stiffest`.
    """
    if not len(bend.value):
        return math.inf
    tight = np.quantile(bend.margins[stiffest(bend)], STIFF_SHARE, method="higher")
    return float(tight) * TOO_STIFF + 1e-9


def stiffest(bend: Measured) -> IntArray:
    """Return the spans of the material that is worst off: all, if it is the only one.

    Materials that bend alike count as one.
    """
    limits = np.broadcast_to(bend.limit, len(bend.value))
    groups = [np.flatnonzero(limits == limit) for limit in np.unique(limits).tolist()]
    tight = [np.quantile(bend.margins[group], STIFF_SHARE, method="higher") for group in groups]
    return groups[int(np.argmin(tight))]


class RemedySearch:
    """Look for sizes and widths at which rules hold; each is laid and measured only once.

    Parameters
    ----------
    weave, limits
        Of the ribbons.
    size_mm : float
        As they are.
    lay : callable
        Lays them otherwise.
    near : Nearness or None
        What is too near now.
    settle : callable, optional
        Lays them as they would be made at another size; without it, they are taken to be what
        ``lay`` lays.
    auto : bool
        Whether their width is left to fabweave: then no width is proposed.
    depth : Depth
        How much is looked for.
    """

    def __init__(
        self,
        weave: Weave,
        limits: Limits,
        size_mm: float,
        lay: Lay,
        near: Nearness | None,
        *,
        settle: Settle | None = None,
        auto: bool = False,
        depth: Depth = Depth.SEARCHED,
    ) -> None:
        self._depth = depth
        self._weave, self._limits, self._lay = weave, limits, lay
        self._size = size_mm
        # An object of 300 mm may measure a rounding more.
        self._whole = math.ceil(size_mm - ROUNDING_MM)
        self._near = near
        self._narrowing = ("twist",) if auto else ("twist", "clearance")
        self._settle = settle
        self._few = weave.threads.n_crossings <= FEW
        #: Margins along single ribbons, by size.
        self._known: dict[int, dict[str, float]] = {}
        self._last_ribbons: tuple[float, float, bool, Ribbons] | None = None
        self._settled: dict[tuple[int, bool], tuple[dict[str, float], IntArray]] = {}

    def remedies(self, findings: Sequence[BrokenRule]) -> tuple[list[BrokenRule], int | None]:
        """Add to findings the size and the width at which each rule holds.

        Returns
        -------
        findings : list of BrokenRule
        size : int or None
            The smallest size at which all rules hold that a size can fix; None, too, where the
            search does not go so far.
        """
        if self._depth < Depth.SEARCHED:
            return [self._remedy(finding, self._size_along(finding)) for finding in findings], None
        sizes: dict[str, int | None] = {}
        for finding in findings:
            if finding.rule in SIZED and (finding.rule != "clearance" or self._few):
                sizes[finding.rule] = self._smallest_for((finding.rule,))
        known = [size for size in sizes.values() if size is not None]
        solvable = len(known) == len(sizes)
        overall: int | None = None
        if any(finding.rule == "clearance" for finding in findings) and not self._few:
            clear = self._clear_now(self._whole)
            if clear is not None and solvable and clear >= max(known, default=0):
                # Clearance decides: its size is that of all.
                overall = self._confirmed_size(clear, SIZED, planned=True)
                sizes["clearance"] = overall
            elif clear is not None:
                sizes["clearance"] = self._confirmed_size(clear, ("clearance",), planned=False)
            else:
                sizes["clearance"] = None
            solvable = solvable and sizes["clearance"] is not None
            known += [size for size in (sizes["clearance"],) if size is not None]
        if not sizes:
            # With room for laps everywhere more may be wanted than what is made here, and holds.
            overall = min(self._smallest_for(SIZED) or self._whole, self._whole)
        elif solvable and overall is None:
            # A rule that holds at one size holds at larger ones.
            overall = self._confirmed_size(max(known), SIZED, planned=True)
        return [self._remedy(finding, sizes.get(finding.rule)) for finding in findings], overall

    def _size_along(self, finding: BrokenRule) -> int | None:
        """Return the smallest size at which a rule along single ribbons holds, if it is wanted."""
        wanted = self._depth == Depth.NEAR or finding.severity == "refuse"
        if not wanted or finding.rule not in SIZED or finding.rule == "clearance":
            return None
        return self._smallest_along((finding.rule,))

    def _remedy(self, finding: BrokenRule, size: int | None) -> BrokenRule:
        """Add the size and the width at which a rule holds."""
        finding = replace(finding, size_mm=size)
        if finding.severity == "refuse":
            finding = replace(finding, may_be_mm=self._size_of_stiffness())
        if finding.rule in self._narrowing and self._depth == Depth.SEARCHED:
            finding = replace(finding, width_factor=self._narrower(finding.rule))
        return finding

    def broken_at(self, size: int, rules: Sequence[str]) -> tuple[str, ...]:
        """Return which of some rules do not hold at a size that was proposed."""
        at = self._settled.get((size, True)) or self._at(size, self._few)
        return tuple(rule for rule in rules if at[0][rule] < 1)

    def _smallest_for(self, rules: Sequence[str]) -> int | None:
        """Return the smallest size at which some rules hold."""
        along = [rule for rule in rules if rule != "clearance"]
        size = self._smallest_along(along) if along else self._whole
        if size is not None and "clearance" in rules:
            size = self._clear_now(size)
        if size is None or (len(along) == len(rules) and not self._few):
            return size
        return self._confirmed_size(size, rules, planned=self._few)

    def _smallest_along(self, rules: Sequence[str]) -> int | None:
        """Return the smallest size at which some rules along single ribbons hold."""
        return self._smallest(lambda at: self._margin(at, rules))

    def _clear_now(self, size: int) -> int | None:
        """Return the smallest size, from one up, at which all keep clear that are too near now."""
        near = self._near
        return self._clear(near.pairs, size) if near is not None and len(near.pairs) else size

    def _confirmed_size(self, size: int, rules: Sequence[str], *, planned: bool) -> int | None:
        """Return the smallest size, from one up, at which rules hold as ribbons are made there."""

        def holds(size: int) -> bool:
            margins, pairs = self._at(size, planned)
            return not ("clearance" in rules and len(pairs)) and all(
                margins[rule] >= 1 for rule in rules if rule in margins
            )

        stride, short = _STRIDE, 0
        while not holds(size):
            if stride > _FARTHEST_STRIDE or size >= self._size * FARTHEST:
                return None
            short, (_, pairs) = size, self._at(size, planned)
            size = math.ceil(size * (1 + stride))
            if len(pairs) and "clearance" in rules:
                size = self._clear(pairs, size) or size
            stride *= 2
        while short and size > short + max(1, _CLOSE * short):
            middle = (short + size) // 2
            short, size = (short, middle) if holds(middle) else (middle, size)
        return size

    def _at(self, size: int, planned: bool) -> tuple[dict[str, float], IntArray]:
        """Return margins along ribbons as they are made at a size, and the pairs too near."""
        if (size, planned) not in self._settled:
            if self._settle is not None:
                ribbons, near = self._settle(size, planned)
            else:
                ribbons = self._ribbons(size, narrowest=True)
                near = measure_clearance(ribbons, self._weave, self._limits)[1]
            along = measure_along(ribbons, self._limits)
            self._settled[size, planned] = (
                {rule: quantity.margin for rule, quantity in along.items()},
                near.pairs if near is not None else np.zeros((0, 2), dtype=np.int64),
            )
        return self._settled[size, planned]

    def _clear(self, pairs: IntArray, size: int) -> int | None:
        """Return the smallest size, from one up, at which these pairs of stretches are clear."""

        def margin(at: int) -> float:
            nonlocal pairs
            ribbons = self._lay(at, 1.0, True)
            measured, near = measure_clearance(ribbons, self._weave, self._limits, pairs)
            if 0 < 2 * len(near.pairs) < len(pairs):
                # Those that are clear here need not be asked at larger sizes.
                pairs = near.pairs
            return measured.margin

        return size if margin(size) >= 1 else self._smallest(margin, size)

    def _smallest(self, margin: Callable[[int], float], start: int | None = None) -> int | None:
        """Return the smallest size with a margin; from a start where there is none, one above."""
        size = self._whole
        return smallest_size(margin, size if start is None else start, most=size * FARTHEST)

    def _ribbons(self, size: float, width: float = 1.0, *, narrowest: bool = False) -> Ribbons:
        if self._last_ribbons is None or self._last_ribbons[:3] != (size, width, narrowest):
            self._last_ribbons = (size, width, narrowest, self._lay(size, width, narrowest))
        return self._last_ribbons[3]

    def _margin(self, size: int, rules: Sequence[str]) -> float:
        """Return the least margin of some rules along single ribbons at a size."""
        if size not in self._known:
            along = measure_along(self._ribbons(size), self._limits)
            self._known[size] = {rule: quantity.margin for rule, quantity in along.items()}
            self._known[size]["stiff"] = stiffness(along["bend"])
        return min(self._known[size][rule] for rule in rules)

    def _size_of_stiffness(self) -> int | None:
        """Return the smallest size at which a material is not too stiff."""
        return self._smallest(lambda at: self._margin(at, ("stiff",)))

    def _narrower(self, rule: str) -> float | None:
        """Return the largest factor on the width at which a rule holds."""

        def holds(factor: float, among: IntArray | None) -> bool:
            ribbons = self._ribbons(self._size, factor)
            if rule == "twist":
                return measure_along(ribbons, self._limits)[rule].margin >= 1
            return not len(measure_clearance(ribbons, self._weave, self._limits, among)[0].value)

        # What holds at one width holds at smaller ones; the pairs that are too near decide, and
        # then all are measured.
        pairs = self._near.pairs if self._near is not None else None
        first = bisect.bisect_left(_NARROWER, True, key=lambda factor: holds(factor, pairs))
        fitting = (factor for factor in _NARROWER[first:] if holds(factor, None))
        return next(fitting, None)
