"""Measure again how near ribbons come to one another, and only where that may have changed."""

import numpy as np

from fabweave.core.arrays import IntArray
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.rules.clearance import Nearness, in_order
from fabweave.ribbon.rules.rules import Measured, hold_apart, measure_clearance
from fabweave.ribbon.subweave import Part
from fabweave.stock.ribbon_limits import Limits
from fabweave.weave.pattern import Weave


def measure_pairs(
    ribbons: Ribbons, part: Part, limits: Limits, pairs: IntArray
) -> tuple[float, Nearness]:
    """Measure pairs of stretches in a part of the ribbons.

    Parameters
    ----------
    ribbons : Ribbons
        Of the part.
    part : Part
        With the passes at both ends of every stretch.
    limits : Limits
        Of the whole.
    pairs : (N, 2) int array
        Stretches as the whole numbers them.

    Returns
    -------
    margin : float
        The least share of what is wanted; infinite if no pair is too near.
    near : Nearness
        Those that are, as the whole numbers them.
    """
    part_pairs = np.sort(part.stretch_numbers(pairs), axis=1)
    measured, near = measure_clearance(ribbons, part.weave, limits.of(part.thread), part_pairs)
    whole_pairs = np.sort(part.whole_stretches(near.pairs), axis=1)
    return measured.margin, in_order(whole_pairs, near.distance_mm, near.place)


def measure_changed(
    ribbons: Ribbons, weave: Weave, limits: Limits, before: Nearness, passes: IntArray
) -> tuple[Measured, Nearness]:
    """Measure what is too near where ribbons are what they were, but beside some passes.

    Parameters
    ----------
    ribbons : Ribbons
        As they are now.
    weave, limits
        As they were.
    before : Nearness
        All that was too near.
    passes : (N,) int array
        The passes whose panels changed, and with them what leads to and from them.

    Returns
    -------
    Measured, Nearness
        What :func:`~fabweave.ribbon.rules.rules.measure_clearance` finds now.
    """
    changed = _stretches_beside(ribbons, passes)
    _, near = measure_clearance(ribbons, weave, limits, beside=changed)
    kept = ~np.isin(before.pairs, changed).any(axis=1)
    near = in_order(
        np.concatenate((before.pairs[kept], near.pairs)),
        np.concatenate((before.distance_mm[kept], near.distance_mm)),
        np.concatenate((before.place[kept], near.place)),
    )
    return hold_apart(weave, limits, near)


def _stretches_beside(ribbons: Ribbons, passes: IntArray) -> IntArray:
    """Return the panels of some passes, and the stretches before and after them."""
    count = len(ribbons.entry)
    following = following_rung(ribbons.pass_offsets, ribbons.closed)
    changed = np.zeros(count, dtype=bool)
    changed[passes] = True
    before = np.flatnonzero((following >= 0) & changed[following])
    firsts = ribbons.pass_offsets[:-1]
    open_threads = np.flatnonzero(~ribbons.closed & (np.diff(ribbons.pass_offsets) > 0))
    ahead = open_threads[changed[firsts[open_threads]]]
    return np.concatenate((passes, count + passes, count + before, 2 * count + ahead))
