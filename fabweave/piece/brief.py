"""Complete what is asked of pieces: what is fastened, and with what holes."""

from collections.abc import Sequence
from dataclasses import dataclass

from fabweave.core.errors import InputError
from fabweave.piece.joint.holes import HoleRule
from fabweave.piece.joint.kinds import parse_joint
from fabweave.piece.settings import PieceSettings
from fabweave.ribbon.settings import RibbonSettings
from fabweave.stock.hardware import hardware_catalogue, parse_fastener
from fabweave.stock.material import hole_edge_mm, min_hole_mm
from fabweave.stock.supplies import Supplies

#: Hole diameters to choose from, in millimetres: a fastener of a common size and its clearance.
HOLES_MM = (4.1, 3.3, 2.5, 2.0, 1.6, 1.3, 1.0)


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


def hole_rules(pieces: PieceSettings, supplies: Supplies) -> tuple[HoleRule, ...]:
    """Return the holes that may be used, the largest first; none if none are wanted.

    A fastener goes through both strands of a crossing, so a hole suits all materials. Where no
    size is asked for, holes are left out for which nothing is sold that holds so thin a stack.

    Raises
    ------
    InputError
        If the hole is too small to burn.
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
