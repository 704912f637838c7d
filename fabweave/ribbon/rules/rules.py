"""Measure ribbons against the rules of a material: what there is, what is wanted, and where."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.ribbon.project import Ribbons, crossing_threads, following_rung, preceding_rung
from fabweave.ribbon.rules.bends import Bends, Spans, measure_bends, measure_spans
from fabweave.ribbon.rules.clearance import Nearness, near_pairs
from fabweave.ribbon.stretches import ends_of_stretches
from fabweave.stock.ribbon_limits import Limits, by_thread
from fabweave.weave.pattern import Weave, strand_passes

#: What is computed from rounded coordinates holds to this, relative.
_ROUNDING = 1e-9
#: Two ribbons may be nearer than is wanted by this share: facets meet at many odd angles.
_TOUCHING = 1e-6


@frozen_value
class Measured:
    """One quantity along the ribbons, and the limit it is held to.

    Parameters
    ----------
    rule, unit : str
    value : (N,) float array
        What there is.
    limit : float or (N,) float array
        What is wanted, everywhere or at each place.
    at_least : bool
        Whether the value must be at least the limit; else at most.
    passes : (N,) int array
        The pass at or before each place.
    others : (N,) int array
        The pass of another ribbon that is concerned; -1 for none.
    position : (N, 3) float array
    """

    rule: str
    unit: str
    value: FloatArray
    limit: float | FloatArray
    at_least: bool
    passes: IntArray
    others: IntArray
    position: FloatArray

    def limit_at(self, place: int) -> float:
        """Return what is wanted at a place."""
        return float(np.broadcast_to(self.limit, len(self.value))[place])

    @property
    def margins(self) -> FloatArray:
        """What there is over what is wanted, (N,): below 1 the rule does not hold."""
        if self.at_least:
            return self.value / self.limit
        zero = self.value == 0
        return np.where(zero, np.inf, self.limit / np.where(zero, 1.0, self.value))

    @property
    def broken(self) -> IntArray:
        """The places where the rule does not hold, the worst first."""
        margins = self.margins
        places = np.flatnonzero(margins < 1 - _ROUNDING)
        return places[np.argsort(margins[places], kind="stable")]

    @property
    def margin(self) -> float:
        """The least margin; infinite if there is no place to measure."""
        return float(self.margins.min()) + _ROUNDING if len(self.value) else np.inf


def pass_of_rungs(ribbons: Ribbons) -> IntArray:
    """Return for each rung the pass whose panel it begins or follows, (R,).

    Before an open thread's first panel that is its first pass; on a ring, its last.
    """
    thread = np.repeat(np.arange(len(ribbons.closed)), np.diff(ribbons.offsets))
    owner = np.searchsorted(ribbons.entry, np.arange(ribbons.n_rungs), side="right") - 1
    first, last = ribbons.pass_offsets[:-1][thread], ribbons.pass_offsets[1:][thread] - 1
    ahead = np.where(ribbons.closed[thread], last, first)
    return np.where(owner < first, ahead, owner)


def measure_along(
    ribbons: Ribbons, limits: Limits, bends: Bends | None = None
) -> dict[str, Measured]:
    """Measure what depends on single ribbons: ``width``, ``bend``, ``twist`` and ``crease``.

    A crease is the angle by which a ribbon turns at one cross-line, as its mean planes on either
    side do. It may be softened over the ribbon from crossing to crossing, of length s, and no
    farther: crossings keep their planes. A material that bends to a radius r turns by s / r there,
    so no crease may be sharper.
    """
    bends = measure_bends(ribbons) if bends is None else bends
    spans = measure_spans(ribbons, bends)
    middle = (ribbons.right + ribbons.left) / 2
    passes = np.arange(len(ribbons.entry))
    ends = ribbons.entry + 1
    pass_limits = limits.of(
        np.repeat(np.arange(len(ribbons.closed)), np.diff(ribbons.pass_offsets))
    )
    rung_pass = pass_of_rungs(ribbons)
    crease, softened = _creases(ribbons, bends, spans)
    quantities = {}
    for rule, unit, value, limit, at_least, owners, place in (
        ("width", "mm", bends.width_mm, pass_limits.width_mm, True, rung_pass, middle),
        ("bend", "mm", spans.radius_mm, pass_limits.bend_mm, True, passes, middle[ends]),
        ("twist", "degrees", spans.twist_deg, pass_limits.twist_deg, False, passes, middle[ends]),
    ):
        there = np.flatnonzero(~np.isnan(value))
        quantities[rule] = Measured(
            rule, unit, value[there], by_thread(limit, owners[there]), at_least, owners[there],
            np.full(len(there), -1, dtype=np.int64), place[there],
        )  # fmt: skip
    there = np.flatnonzero(~np.isnan(crease))
    passes = rung_pass[there]
    takes = np.degrees(softened[there] / by_thread(pass_limits.bend_mm, passes))
    quantities["crease"] = Measured(
        "crease", "degrees", crease[there], takes, False, passes,
        np.full(len(there), -1, dtype=np.int64), middle[there],
    )  # fmt: skip
    return quantities


def _creases(ribbons: Ribbons, bends: Bends, spans: Spans) -> tuple[FloatArray, FloatArray]:
    """Return the turn at each rung in degrees, and the length over which it may be softened, (R,).

    A rung where a panel begins belongs to the span before it. NaN where there is no span.
    """
    owner = pass_of_rungs(ribbons)
    before = preceding_rung(following_rung(ribbons.pass_offsets, ribbons.closed))
    owner[ribbons.entry] = np.where(before >= 0, before, np.arange(len(before)))
    length = spans.length_mm[owner]
    return np.where(np.isnan(length), np.nan, np.abs(bends.turn_deg)), length


def measure_layers(ribbons: Ribbons, weave: Weave, limits: Limits) -> Measured:
    """Measure at each crossing how far the strand above stands off the one below.

    The least height of the upper panel's corners, less the greatest of the lower panel's: panels
    that are not parallel are as near as their nearest corners.
    """
    crossing = weave.threads.crossing
    normal, centre = ribbons.normal[crossing], ribbons.centre[crossing]
    heights = np.stack(
        [
            np.einsum("pd,pd->p", rail[ribbons.entry + shift] - centre, normal)
            for rail in (ribbons.right, ribbons.left)
            for shift in (0, 1)
        ]
    )
    low = np.full(weave.threads.n_crossings, np.inf)
    high = np.full(weave.threads.n_crossings, -np.inf)
    over = weave.over
    np.minimum.at(low, crossing[over], heights.min(axis=0)[over])
    np.maximum.at(high, crossing[~over], heights.max(axis=0)[~over])
    apart, wanted = low - high, limits.between(*crossing_threads(weave))
    lower, upper = strand_passes(weave).T
    return Measured("layers", "mm", apart, wanted, True, upper, lower, ribbons.centre)


def measure_clearance(
    ribbons: Ribbons,
    weave: Weave,
    limits: Limits,
    among: IntArray | None = None,
) -> tuple[Measured, Nearness]:
    """Measure how near ribbons come that do not cross there; only what is too near is listed.

    Their middle surfaces are to be one thickness (half of either's) and the clearance apart. Two
    stretches that part from the same crossing begin just so far apart, and need not be farther
    apart than one thickness. Pairs may be chosen as in
    :func:`~fabweave.ribbon.rules.clearance.near_pairs`.
    """
    rows = weave.threads.offsets, weave.threads.closed
    thickest = float(np.max(limits.thickness_mm, initial=0.0))
    reach = thickest + limits.clearance_mm

    def wanted(pairs: IntArray) -> FloatArray:
        return _wanted(weave, limits, ends_of_stretches(*rows, pairs))

    found = near_pairs(ribbons, weave.threads.crossing, reach, wanted, among)
    passes = ends_of_stretches(*rows, found.pairs)
    apart = _wanted(weave, limits, passes)
    kept = found.distance_mm < apart * (1 - _TOUCHING)
    found = Nearness(found.pairs[kept], found.distance_mm[kept], found.place[kept])
    first, second = passes[kept, :, 0].T
    measured = Measured(
        "clearance", "mm", found.distance_mm, apart[kept], True, first, second, found.place
    )
    return measured, found


def _wanted(weave: Weave, limits: Limits, passes: IntArray) -> FloatArray:
    """Return how far apart pairs of stretches are to be, from the passes at their ends."""
    met = weave.threads.crossing[passes]
    parting = np.any(met[:, 0, :, None] == met[:, 1, None, :], axis=(1, 2))
    threads = weave.threads.thread_of_pass[passes[:, :, 0]]
    return limits.between(*threads.T) + np.where(parting, 0.0, limits.clearance_mm)
