"""Complete what is asked of pieces: how they lie to the grain, what is fastened, and with what."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.piece.joint.holes import HoleRule
from fabweave.piece.joint.kinds import parse_joint
from fabweave.piece.settings import PieceSettings
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.bends import measure_bends, measure_spans
from fabweave.ribbon.settings import RibbonSettings
from fabweave.stock.hardware import hardware_catalogue, parse_fastener
from fabweave.stock.material import (
    Material,
    along_radius_mm,
    hole_edge_mm,
    laid_across,
    min_bend_radius_mm,
    min_hole_mm,
)
from fabweave.stock.ribbon_limits import Limits, by_thread, thread_limits
from fabweave.stock.rotations import AUTO, Rotations
from fabweave.stock.supplies import Supplies

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


#: Hole diameters to choose from, in millimetres: a fastener of a common size and its clearance.
HOLES_MM = (4.1, 3.3, 2.5, 2.0, 1.6, 1.3, 1.0)
#: How pieces lie where bends ask for it; as pieces are wavy, some places are off by more.
ACROSS = "across:10deg"


@dataclass(frozen=True)
class Brief:
    """All that pieces are made by, beside the woven object.

    Parameters
    ----------
    ribbons : RibbonSettings
    pieces : PieceSettings
    supplies : Supplies
    effort : str
        How hard it is looked for a place on a sheet.
    rules : tuple of HoleRule
        The holes that may be used, the largest first; none if none are wanted.
    """

    ribbons: RibbonSettings
    pieces: PieceSettings
    supplies: Supplies
    effort: str
    rules: tuple[HoleRule, ...]

    @property
    def fasten(self) -> str:
        """Which crossings take a fastener: as asked, or else those that keep the form.

        Slots are for the fasteners of crossings without joints, so who asks for them wants all.
        """
        slots = parse_joint(self.pieces.joint).slots
        return self.pieces.fasten or ("all" if slots else "form")

    @property
    def holes(self) -> str:
        """Which crossings have holes; repeated pieces keep the same ones unless asked otherwise."""
        return self.pieces.holes or "alike"


def make_brief(
    ribbons: RibbonSettings, pieces: PieceSettings, supplies: Supplies, effort: str
) -> Brief:
    """Return what pieces are made by, with the holes that were asked for, or that suit the job.

    Parameters
    ----------
    ribbons, pieces, supplies, effort
        Complete.

    Raises
    ------
    InputError
        If the hole is too small to burn.
    """
    return Brief(ribbons, pieces, supplies, effort, _hole_rules(pieces, supplies))


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


def _hole_rules(pieces: PieceSettings, supplies: Supplies) -> tuple[HoleRule, ...]:
    """Return the holes that may be used, the largest first; none if none are wanted.

    A fastener goes through both strands of a crossing, so a hole suits all materials. Where no
    size is asked for, holes are left out for which nothing is sold that holds so thin a stack.
    """
    fastener = parse_fastener(pieces.fastener)
    if fastener.hole_mm == 0 or (pieces.fasten == "none" and pieces.holes != "all"):
        return ()
    material = max(supplies.materials, key=min_hole_mm)
    least = min_hole_mm(material)
    sort, hole = fastener.sort, fastener.hole_mm
    if hole is not None:
        if hole < least:
            raise InputError(
                f"a hole of {hole:g} mm is too small for a laser in "
                f"{material.description}: use {least:g} mm or more, "
                "or --fastener none"
            )
        sizes: Sequence[float] = (hole,)
    else:
        sizes = [size for size in HOLES_MM if size >= least] or [least]
        sizes = [size for size in sizes if _is_sold_for(size, supplies)] or sizes
    # A head that reached over the edge would show, and hold nothing there.
    head = 0.0 if sort is None else sort.head_mm / 2.0
    return tuple(
        HoleRule(size, max(head, *(hole_edge_mm(one, size) for one in supplies.materials)))
        for size in sizes
    )


def _is_sold_for(hole_mm: float, supplies: Supplies) -> bool:
    """Say whether there is hardware for a hole through two layers, and through three at a lap."""
    thickness = [material.thickness_mm for material in supplies.materials]
    return all(
        any(sort.fits(hole_mm, grip_mm) for sort in hardware_catalogue().values())
        for grip_mm in (2.0 * min(thickness), 3.0 * max(thickness))
    )
