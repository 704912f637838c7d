"""Look for the size or the width at which the rules hold that do not hold now."""

import bisect
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from fabweave.arrays import IntArray
from fabweave.ribbon.clearance import Nearness
from fabweave.ribbon.finding import Finding
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules import (
    Limits,
    Measured,
    measure_along,
    measure_between,
    measure_clearance,
)
from fabweave.ribbon.sizing import FARTHEST, smallest_size
from fabweave.weave.pattern import Weave

#: Lays the same ribbons at another size (mm), with all widths multiplied by a factor; and, if the
#: width is left to fabweave, as narrow as may be where they were too near.
Lay: TypeAlias = Callable[[float, float, bool], Ribbons]
#: Lays ribbons at another size (mm) whose width is left to fabweave, and tells what is too near.
Settle: TypeAlias = Callable[[float], tuple[Ribbons, Nearness | None]]

#: A material is too stiff if it takes less than half the bend ...
TOO_STIFF = 2.0
#: ... in more than this share of the spans between crossings: a few tight places may be trimmed.
STIFF_SHARE = 0.25
#: Narrower ribbons are tried in these steps, down to a third.
_NARROWER = tuple(step / 20 for step in range(19, 5, -1))
#: While a size is looked for, this many of the tightest places are measured; at its end, all.
_WATCHED = 2000
#: So often may new places be too near at the size at which the old ones are clear.
_ROUNDS = 20
#: Where widths left to fabweave turn out too near after all, a size larger by this share is tried,
#: and then by twice as much each time, up to the last; and at the end sizes between the last two,
#: as close as the share next to it.
_STRIDE, _FARTHEST_STRIDE, _CLOSE = 0.01, 2.56, 0.03
#: Rules that a larger size mends: lengths grow, and thickness stays.
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
    tight = [np.quantile(bend.margins[own], STIFF_SHARE, method="higher") for own in groups]
    return groups[int(np.argmin(tight))]


def _tightest(measured: dict[str, Measured], n_passes: int) -> IntArray | None:
    """Return the passes with the least margins, which decide on a size; None for all."""
    count = max(_WATCHED, n_passes // 20)
    if n_passes <= count:
        return None
    passes = [
        measured[rule].passes[np.argsort(measured[rule].margins)[:count]]
        for rule in ("width", "bend", "crease")
    ]
    return np.unique(np.concatenate(passes))


class Search:
    """Look for sizes and widths at which rules hold; each is laid and measured only once."""

    def __init__(
        self,
        weave: Weave,
        limits: Limits,
        size_mm: float,
        lay: Lay,
        measured: dict[str, Measured],
        near: Nearness | None,
        settle: Settle | None = None,
    ) -> None:
        self._weave, self._limits, self._lay = weave, limits, lay
        self._size = size_mm
        self._near = near
        self._narrowing = ("twist", "clearance") if settle is None else ("twist",)
        self._settle = settle
        self._watched = _tightest(measured, len(weave.threads.crossing))
        self._laid: tuple[float, float, bool, Ribbons] | None = None
        self._known: dict[tuple[int, bool], dict[str, float]] = {}

    def remedy(self, found: Finding) -> Finding:
        """Add the size and the width at which a rule holds."""
        if found.rule in SIZED:
            found = replace(found, size_mm=self.smallest((found.rule,)))
        if found.severity == "refuse":
            found = replace(found, may_be_mm=self._smallest(self._stiffness))
        if found.rule in self._narrowing:
            found = replace(found, width_factor=self._narrower(found.rule))
        return found

    def overall(self, findings: Sequence[Finding]) -> int | None:
        """Return the smallest size at which all rules hold that a size can mend."""
        sizes = [found.size_mm for found in findings if found.rule in SIZED]
        if not sizes:
            return self.smallest(SIZED)
        # A rule that holds at one size holds at larger ones.
        known = [size for size in sizes if size is not None]
        return self._cleared(max(known), SIZED) if len(known) == len(sizes) else None

    def smallest(self, rules: Sequence[str]) -> int | None:
        """Return the smallest size at which some rules hold."""
        along = [rule for rule in rules if rule != "clearance"]
        size: int | None = math.ceil(self._size)
        if along:
            size = self._smallest(lambda at: self._margin(at, along, watched=True))
            # The tightest places decide; then all are measured.
            while size is not None and self._margin(size, along, watched=False) < 1:
                size = self._smallest(lambda at: self._margin(at, along, watched=False), size)
        return self._cleared(size, rules) if "clearance" in rules else size

    def _cleared(self, size: int | None, rules: Sequence[str]) -> int | None:
        """Return the smallest size, from one up, at which ribbons keep clear of one another."""
        stride, short = _STRIDE, 0
        for _ in range(_ROUNDS):
            if size is None or stride > _FARTHEST_STRIDE:
                return None
            near = self._near
            if near is None or size != self._size:
                near = self._clearance(size, None)[1]
            if len(near.pairs):
                # A pair that is clear at one size is so at larger ones, or the next round finds it.
                size = self._clear(near.pairs, size)
            elif self._settled(size, rules):
                while short and size > short * (1 + _CLOSE):
                    middle = (short + size) // 2
                    short, size = (
                        (short, middle) if self._settled(middle, rules) else (middle, size)
                    )
                return size
            else:
                short = size
                size = math.ceil(size * (1 + stride))
                stride *= 2
        return None

    def _settled(self, size: int, rules: Sequence[str]) -> bool:
        """Tell whether rules hold at a size when the width is left to fabweave there."""
        if self._settle is None or size == self._size:
            return True
        ribbons, near = self._settle(size)
        along = measure_along(ribbons, self._limits)
        return (near is None or not len(near.pairs)) and all(
            along[rule].margin >= 1 for rule in rules if rule in along
        )

    def _clear(self, pairs: IntArray, size: int) -> int | None:
        """Return the smallest size above one at which these pairs of stretches are clear."""

        def margin(at: int) -> float:
            nonlocal pairs
            measured, near = self._clearance(at, pairs)
            pairs = near.pairs if len(near.pairs) else pairs
            return measured.margin

        return self._smallest(margin, size)

    def _smallest(self, margin: Callable[[int], float], start: int | None = None) -> int | None:
        """Return the smallest size with a margin; from a start where there is none, one above."""
        size = math.ceil(self._size)
        return smallest_size(margin, size if start is None else start, most=size * FARTHEST)

    def _ribbons(self, size: float, width: float = 1.0, *, narrowest: bool = False) -> Ribbons:
        if self._laid is None or self._laid[:3] != (size, width, narrowest):
            self._laid = (size, width, narrowest, self._lay(size, width, narrowest))
        return self._laid[3]

    def _clearance(self, size: float, among: IntArray | None) -> tuple[Measured, Nearness]:
        ribbons = self._ribbons(size, narrowest=True)
        return measure_clearance(ribbons, self._weave, self._limits, among)

    def _margin(self, size: int, rules: Sequence[str], *, watched: bool) -> float:
        """Return the least margin of some rules at a size: of all places, or the watched ones."""
        key = (size, watched)
        if key not in self._known:
            ribbons = self._ribbons(size)
            along = (
                measure_between(ribbons, self._watched, self._limits)
                if watched and self._watched is not None
                else measure_along(ribbons, self._limits)
            )
            self._known[key] = {rule: one.margin for rule, one in along.items()}
            self._known[key]["stiff"] = stiffness(along["bend"])
        return min(self._known[key][rule] for rule in rules)

    def _stiffness(self, size: int) -> float:
        return self._margin(size, ("stiff",), watched=False)

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
