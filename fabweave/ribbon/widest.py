"""Find one width for all ribbons: that which suits the object, or the widest that is clear."""

from collections.abc import Callable

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.measures import ribbon_widths
from fabweave.ribbon.project import Ribbons, following_rung, project_ribbons
from fabweave.ribbon.rules.rules import measure_clearance
from fabweave.ribbon.width import WidthRule
from fabweave.stock.ribbon_limits import Limits
from fabweave.weave.pattern import Weave

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
    laid = project_ribbons(
        mesh,
        halfedges,
        weave,
        height_mm=0.0,
        length=length,
        width=min(rule.relative, length),
        portals=portals,
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
