"""Build the pieces of an object whose strips are known, and tell what they would cost."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.app.joined_object import JoinedObject
from fabweave.app.request import chosen_holes
from fabweave.app.settings import Settings
from fabweave.app.woven_object import WovenObject
from fabweave.cut.labels.marks import mark_pieces
from fabweave.flat.joint.fastening import fastened_crossings, holds_itself, parse_fastening
from fabweave.flat.joint.holes import HoleRule
from fabweave.flat.piece import Piece
from fabweave.flat.pieces import PieceSet, build_pieces
from fabweave.flat.split.preferences import KIND_PRICES
from fabweave.report.costs.costs import Costs, planned_costs
from fabweave.report.grain import grain_findings, tight_along
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.bending import min_bend_radius_mm
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.supplies import Supplies


def chosen_fastening(woven: WovenObject, settings: Settings, supplies: Supplies) -> str:
    """Return which crossings take a fastener: as asked, or else what the weave wants.

    Slots are for the fasteners of crossings without joints, so who asks for them wants all.
    """
    if settings.fasten is not None or settings.slots:
        return settings.fasten or "all"
    bend_t = min(
        min_bend_radius_mm(material) / material.thickness_mm for material in supplies.materials
    )
    return "joints" if holds_itself(woven.ribbons, woven.weave.threads, bend_t) else "all"


def joined_pieces(
    joined: JoinedObject, settings: Settings, supplies: Supplies, rules: Sequence[HoleRule]
) -> PieceSet:
    """Build the pieces of an object, with their holes and joints."""
    woven = joined.woven
    fastened = fastened_crossings(
        parse_fastening(chosen_fastening(woven, settings, supplies)),
        woven.weave,
        woven.halfedges,
        joined.joints.crossing,
    )
    holes, holed = chosen_holes(settings), fastened
    if holes == "all":
        holed = np.ones_like(fastened)
    elif holes == "alike" and joined.repeats is not None:
        holed = joined.repeats.alike(joined.plan.runs, woven.weave.threads, fastened)
    return build_pieces(
        woven.ribbons,
        woven.weave,
        joined.plan.runs,
        woven.labels,
        rules,
        joined.joints,
        slots=settings.slots,
        cut=joined.cut,
        fastened=fastened,
        holed=holed,
        supply=supplies.of(woven.bunches),
        fit=KIND_PRICES[settings.kinds] is not None,
    )


def with_grain(
    check: RibbonCheck, joined: JoinedObject, pieces: Sequence[Piece], settings: Settings
) -> RibbonCheck:
    """Return a check that also says which tight bends may lie off the line across the grain."""
    woven = joined.woven
    found = grain_findings(
        pieces,
        joined.plan.runs,
        woven.weave.threads,
        tight_along(woven.ribbons, check.limits),
        parse_rotations(settings.rotations),
        woven.labels,
        woven.ribbons.centre,
    )
    return replace(check, findings=(*check.findings, *found))


def pieces_costs(
    piece_set: PieceSet, woven: WovenObject, settings: Settings, supplies: Supplies
) -> Costs:
    """Return what pieces would cost that are not nested yet; they are engraved as the job would."""
    pieces, crossings = piece_set.pieces, woven.weave.threads.n_crossings
    of_thread = supplies.of(woven.bunches)
    marks = mark_pieces(pieces, crossings, settings.labels, settings.label_side, piece_set.kinds)
    materials = [supplies.materials[int(of_thread[piece.thread])] for piece in pieces]
    return planned_costs(piece_set, marks, materials, calibration=settings.calibrate)
