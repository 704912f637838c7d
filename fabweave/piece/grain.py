"""Say what the grain of a material does to bends: which ask for it, and which lie off it."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray
from fabweave.core.messages import agree
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.bends import measure_bends, measure_spans
from fabweave.stock.material import Material, along_radius_mm, laid_across, min_bend_radius_mm
from fabweave.stock.ribbon_limits import Limits, by_thread
from fabweave.stock.rotations import Rotations

#: A strip that is no more than this off the line across the grain bends as across it (the same
#: table that has the radii: "at 0 or 45 degrees").
ACROSS_DEG = 45.0


def tight_along(ribbons: Ribbons, limits: Limits) -> BoolArray:
    """Return whether from each pass to the next a ribbon bends more tightly than along the grain.

    Parameters
    ----------
    ribbons : Ribbons
    limits : Limits

    Returns
    -------
    (P,) bool array
        False where the material has no grain that counts.
    """
    if not np.any(limits.along_mm):
        return np.zeros(len(ribbons.entry), dtype=np.bool_)
    of_pass = np.repeat(np.arange(len(ribbons.closed)), np.diff(ribbons.pass_offsets))
    radius = measure_spans(ribbons, measure_bends(ribbons)).radius_mm
    return np.asarray(np.nan_to_num(radius, nan=np.inf) < by_thread(limits.along_mm, of_pass))


def grain_notes(
    ribbons: Ribbons, limits: Limits, materials: Sequence[Material], rotations: Rotations
) -> list[str]:
    """Say how pieces lie to the grain, and why, where a material has one that counts.

    Parameters
    ----------
    ribbons : Ribbons
    limits : Limits
    materials : sequence of Material
    rotations : Rotations
        How pieces may lie.
    """
    grained = [material for material in materials if material.across_table_mm]
    if not grained:
        return []
    takes = "; ".join(
        f"{material.description} bends to a radius of "
        f"{min_bend_radius_mm(laid_across(material)):.1f} mm across the grain of its "
        f"face, and of {along_radius_mm(material):.1f} mm along it"
        for material in grained
    )
    count = int(np.count_nonzero(tight_along(ribbons, limits)))
    if rotations.across:
        asks = agree(count, "{n} bend[ asks|s ask] for it")
        return [
            f"grain: pieces lie across the grain, up to {rotations.tolerance_deg:g}° off: "
            f"{asks if count else 'no bend asks for it'}. {takes}"
        ]
    if count:
        asks = agree(count, "{n} bend[ is|s are] tighter than that")
        return [f"grain: {takes}; {asks}, and --rotations auto would lay pieces across the grain"]
    need_not = "grain: pieces need not lie across the grain"
    return [f"{need_not}. {takes}, and no bend here is tighter than that"]
