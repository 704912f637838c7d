"""Find one width for all ribbons: that which suits the object, or the widest that is clear."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.measures import ribbon_widths
from fabweave.ribbon.project import Ribbons, following_rung, project_ribbons
from fabweave.ribbon.rules.bends import Bends, measure_bends
from fabweave.ribbon.rules.clearance import Nearness
from fabweave.ribbon.rules.remedy import is_too_stiff
from fabweave.ribbon.rules.rules import (
    Measured,
    measure_along,
    measure_clearance,
    pass_of_rungs,
)
from fabweave.ribbon.stretches import ends_of_stretches
from fabweave.ribbon.width import WidthRule, tapered
from fabweave.stock.ribbon_limits import Limits, by_thread
from fabweave.weave.pattern import Weave

#: Lays ribbons with a factor on the width at each pass, (P,).
LayNarrowed: TypeAlias = Callable[[FloatArray], Ribbons]

#: So much narrower is the next width tried where ribbons are too near.
_STEP = 0.9
#: Ribbons stay this many times as wide as the least to handle: facets between panels are slanted.
_HANDLED = 1.05


@frozen_value
class Narrowing:
    """Ribbons that are narrower where they would be too near to others.

    Parameters
    ----------
    ribbons : Ribbons
    factor : (P,) float array
        Factor on the width at each pass, in (0, 1].
    least : (P,) float array
        The factors that would leave ribbons just wide enough to be handled; more than 1 where
        they are too narrow as they are.
    clearance : (Measured, Nearness) or None
        What is too near though it may be no narrower; None where that was not measured, as the
        material is far too stiff.
    """

    ribbons: Ribbons
    factor: FloatArray
    least: FloatArray
    clearance: tuple[Measured, Nearness] | None

    @property
    def stuck(self) -> IntArray:
        """The passes beside which ribbons are too near, and may be no narrower."""
        if self.clearance is None:
            return np.zeros(0, dtype=np.int64)
        return np.unique(
            ends_of_stretches(
                self.ribbons.pass_offsets, self.ribbons.closed, self.clearance[1].pairs
            )
        )


def narrow_ribbons(
    lay: LayNarrowed, weave: Weave, limits: Limits, most: FloatArray | None = None
) -> Narrowing:
    """Narrow ribbons, step by step, about the places where they are too near to one another.

    Where two stretches are too near, the ribbon gets narrower at the crossings at their ends, and
    tapers to them from its neighbours. None gets narrower than the least to handle. What a
    material is far too stiff for is left as wide as it is.

    Parameters
    ----------
    lay : callable
        Lays ribbons with a factor on the width at each pass.
    weave : Weave
    limits : Limits
    most : (P,) float array, optional
        Factors that are not exceeded, whatever is left to be handled.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import tetrahedron
    >>> from fabweave.ribbon.project import project_ribbons
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = tetrahedron()
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> def lay(factor):
    ...     return project_ribbons(mesh, halfedges, weave, height_mm=0.005, narrowing=factor)
    >>> limits = Limits(thickness_mm=0.01, bend_mm=0.1, width_mm=0.01, twist_deg=30.0)
    >>> narrowing = narrow_ribbons(lay, weave, limits)
    >>> sorted(set(narrowing.factor.round(2).tolist())), len(narrowing.stuck)
    ([0.9], 0)
    """
    factor = top = np.ones(len(weave.threads.crossing))
    ribbons = lay(factor)
    bends = measure_bends(ribbons)
    least = _least_factors(ribbons, limits, bends)
    if most is not None:
        following = following_rung(weave.threads.offsets, weave.threads.closed)
        factor = top = tapered(most, following)
        ribbons = lay(factor)
        bends = measure_bends(ribbons)
    if is_too_stiff(measure_along(ribbons, limits, bends)["bend"]):
        return Narrowing(ribbons, factor, least, None)
    floor = np.minimum(least, top)
    clearance, near = measure_clearance(ribbons, weave, limits)
    while True:
        narrower = _cleared(lay, weave, limits, near.pairs, factor, floor)
        if narrower is factor:
            # In tight bends ribbons may have got narrower than their crossing panels: too narrow.
            thin = _least_factors(ribbons, limits, measure_bends(ribbons)) > _HANDLED
            weak = np.flatnonzero(thin & (factor < top) & (floor < top))
            if not len(weak):
                return Narrowing(ribbons, factor, least, (clearance, near))
            floor[weak] = np.minimum(factor[weak] / _STEP, top[weak])
            narrower = np.maximum(factor, floor)
        factor, ribbons = narrower, lay(narrower)
        clearance, near = measure_clearance(ribbons, weave, limits)


def _cleared(
    lay: LayNarrowed,
    weave: Weave,
    limits: Limits,
    pairs: IntArray,
    factor: FloatArray,
    floor: FloatArray,
) -> FloatArray:
    """Return factors at which pairs of stretches are apart, or may be no narrower.

    The same array if none may be narrower now.
    """
    rows = weave.threads.offsets, weave.threads.closed
    following = following_rung(*rows)
    while True:
        passes = ends_of_stretches(*rows, pairs)
        free = (factor[passes] > floor[passes]).any(axis=(1, 2))
        if not free.any():
            return factor
        pairs, passes = pairs[free], passes[free]
        narrower = factor.copy()
        narrower[np.unique(passes)] *= _STEP
        factor = np.maximum(tapered(narrower, following), floor)
        pairs = measure_clearance(lay(factor), weave, limits, pairs)[1].pairs


def _least_factors(ribbons: Ribbons, limits: Limits, bends: Bends) -> FloatArray:
    """Return the factors, (P,), that leave ribbons as wide as can be handled.

    What lies between two panels depends on both, so either has what leaves all of it wide enough.
    """
    width = bends.width_mm
    measured = ~np.isnan(width)
    passes = pass_of_rungs(ribbons)[measured]
    thread = np.repeat(np.arange(len(ribbons.closed)), np.diff(ribbons.pass_offsets))
    following = following_rung(ribbons.pass_offsets, ribbons.closed)[passes]
    least = np.full(len(ribbons.entry), np.inf)
    np.minimum.at(least, passes, width[measured])
    np.minimum.at(least, following[following >= 0], width[measured][following >= 0])
    return _HANDLED * by_thread(limits.width_mm, thread) / np.maximum(least, 1e-9)


#: The widest width is found to this share of itself.
_CLOSE = 0.02


def widest_width(
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    *,
    length: float,
    portals: FloatArray | None = None,
) -> float:
    """Return the greatest width, in millimetres, that ribbons have room for everywhere.

    No ribbon may be wider than the crossing panel of its partner is long, relative to the room
    that each has, or its connectors run into the partner's panel.

    Parameters
    ----------
    mesh, halfedges, weave
        A mesh and the weave on it.
    length : float
        Relative length of crossing panels.
    portals : (H,) float array, optional
        As in :func:`~fabweave.ribbon.project.project_ribbons`.
    """
    widest = project_ribbons(
        mesh, halfedges, weave, height_mm=0.0, length=length, width=length, portals=portals
    )
    return float(ribbon_widths(widest).min(initial=np.inf))


def even_widths(
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    rule: WidthRule,
    *,
    length: float,
    portals: FloatArray | None = None,
) -> FloatArray:
    """Return the width at each pass, (P,), of ribbons that have one width wherever they can.

    Panels at crossings have one width: the room of the narrower of their two cross-lines counts.

    Parameters
    ----------
    mesh, halfedges, weave
        A mesh and the weave on it.
    rule : WidthRule
        An even one.
    length, portals
        As for :func:`widest_width`.
    """
    share = min(rule.relative, length)
    laid = project_ribbons(
        mesh, halfedges, weave, height_mm=0.0, length=length, width=share, portals=portals
    )
    width = ribbon_widths(laid)
    room = np.minimum(width[laid.entry], width[laid.entry + 1])
    return rule.even_widths(room, following_rung(laid.pass_offsets, laid.closed))


def widest_clear(
    lay: Callable[[float], Ribbons], weave: Weave, limits: Limits, room_mm: float
) -> float | None:
    """Return the greatest width of all ribbons at which they keep clear of one another.

    Parameters
    ----------
    lay : callable
        Lays ribbons of one width, in millimetres.
    weave : Weave
    limits : Limits
    room_mm : float
        No greater width is tried, as from :func:`widest_width`.

    Returns
    -------
    float or None
        At this width all have been measured; at one that is 2 % greater some are too near, or
        have no room. None if some are too near even at the least width to handle.
    """
    least = float(np.max(limits.width_mm, initial=0.0))
    if not least <= room_mm < np.inf:
        return None

    def near(width_mm: float, among: IntArray | None = None) -> IntArray:
        return measure_clearance(lay(width_mm), weave, limits, among)[1].pairs

    high, too_near = room_mm, near(room_mm)
    among = too_near
    while len(too_near):
        # The pairs that are too near decide on a width; then all are measured there.
        low = least
        if len(near(low, among)):
            return None
        while high > low * (1 + _CLOSE):
            middle = float(np.sqrt(low * high))
            low, high = (low, middle) if len(near(middle, among)) else (middle, high)
        high, too_near = low, near(low)
        among = np.concatenate((among, too_near))
    return high
