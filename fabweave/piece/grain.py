"""Say how pieces lie to the grain, and where bends ask for it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.piece.joined_object import JoinedObject
from fabweave.piece.piece import Piece
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.bends import measure_bends, measure_spans
from fabweave.ribbon.rules.broken_rule import FAR, BrokenRule
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.material import Material, along_radius_mm, laid_across, min_bend_radius_mm
from fabweave.stock.ribbon_limits import Limits, by_thread, thread_limits
from fabweave.stock.rotations import AUTO, Rotations, parse_rotations
from fabweave.stock.supplies import Supplies

#: A strip that is no more than this off the line across the grain bends as across it (the same
#: table that has the radii: "at 0 or 45 degrees").
ACROSS_DEG = 45.0
#: How pieces lie where bends ask for it; as pieces are wavy, some places are off by more.
ACROSS = "across:10deg"


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
) -> list[Note]:
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
        told = (
            f"pieces lie across the grain, up to {rotations.tolerance_deg:g}° off: "
            f"{asks if count else 'no bend asks for it'}. {takes}"
        )
    elif count:
        asks = agree(count, "{n} bend[ is|s are] tighter than that")
        told = f"{takes}; {asks}, and --rotations auto would lay pieces across the grain"
    else:
        no_need = "pieces need not lie across the grain"
        told = f"{no_need}. {takes}, and no bend here is tighter than that"
    return [Note("grain", f"grain: {told}", detail=True)]


def chosen_grain(ribbons: Ribbons, bunches: IntArray, supplies: Supplies) -> Supplies:
    """Lay pieces across the grain if that is left to fabweave, and bends ask for it.

    They do where a ribbon must bend, from crossing to crossing, more tightly than a strip along the
    grain can, if its material bends better across.

    Parameters
    ----------
    ribbons : Ribbons
        As wide as asked.
    bunches : (T,) int array
        The bunch of each thread.
    supplies : Supplies

    Returns
    -------
    Supplies
        The same, or with rotations ``across:10deg`` and the radius of strips that lie so.
    """
    limits = thread_limits(supplies, bunches)
    if supplies.rotations != AUTO or not tight_along(ribbons, limits).any():
        return supplies
    return replace(supplies.across(), rotations=ACROSS)


def with_grain(
    check: RibbonCheck, joined: JoinedObject, pieces: Sequence[Piece], rotations: str
) -> RibbonCheck:
    """Return a check that also says which tight bends may lie off the line across the grain.

    Where a piece turns, its strip does not run as its length does: from station to station the
    line between them counts. What the rotations allow is added.
    """
    woven, threads, turns = joined.woven, joined.woven.weave.threads, parse_rotations(rotations)
    tight = tight_along(woven.ribbons, check.limits)
    if not turns.across or not tight.any():
        return check
    passes, off = [], []
    for piece, first in zip(pieces, joined.plan.runs.first.tolist(), strict=True):
        step = np.abs(np.diff(piece.points, axis=0))
        around = (first + np.arange(len(step))) % threads.lengths[piece.thread]
        passes.append(threads.offsets[piece.thread] + around)
        off.append(np.degrees(np.arctan2(step[:, 1], step[:, 0])) + turns.tolerance_deg)
    at, degrees = np.concatenate(passes), np.concatenate(off)
    at, degrees = at[tight[at]], degrees[tight[at]]
    if degrees.max(initial=0.0) <= ACROSS_DEG:
        return check
    worst = int(np.argmax(degrees))
    thread, crossing = int(threads.thread_of_pass[at[worst]]), int(threads.crossing[at[worst]])
    x, y, z = (round(float(value), 3) for value in woven.ribbons.centre[crossing])
    found = BrokenRule(
        rule="grain",
        severity="warn",
        value=float(degrees[worst]),
        limit=ACROSS_DEG,
        unit="degrees",
        thread=woven.labels[thread],
        station=int(at[worst] - threads.offsets[thread]),
        crossing=crossing,
        other=None,
        position=(x, y, z),
        count=int(np.count_nonzero(degrees > ACROSS_DEG)),
        of=len(at),
        far=int(np.count_nonzero(degrees > ACROSS_DEG / FAR)),
    )
    return replace(check, findings=(*check.findings, found))
