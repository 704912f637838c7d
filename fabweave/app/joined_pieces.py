"""Build the pieces of an object whose strips are known, and tell what they would cost."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.app.joined_object import JoinedObject
from fabweave.app.nest_job import rings_fit
from fabweave.app.request import chosen_holes
from fabweave.app.settings import Settings
from fabweave.app.woven_object import WovenObject
from fabweave.core.arrays import BoolArray
from fabweave.cut.labels.marks import mark_pieces
from fabweave.flat.file_records import DECIMALS
from fabweave.flat.joint.fastening import (
    beside_edges,
    fastened_crossings,
    hanging_crossings,
    loose_shares,
    parse_fastening,
    parse_hanging,
)
from fabweave.flat.joint.holes import HoleRule
from fabweave.flat.piece import Piece
from fabweave.flat.pieces import PieceSet, build_pieces
from fabweave.flat.rim_ring import RimRing, plan_ring, ring_prefix
from fabweave.flat.split.preferences import KIND_PRICES
from fabweave.mesh.openings.leave_out import Opening
from fabweave.report.costs.costs import Costs, planned_costs
from fabweave.report.grain import grain_findings, tight_along
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.material import min_bend_radius_mm
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.supplies import Supplies

#: A ring is not cut into more pieces to make them fit on a sheet.
MOST_RING_PIECES = 12
#: Vertices of a rim are on its circle to this, but for those that are told to be off it.
_ON_RIM_MM = 1e-3


def chosen_fastening(settings: Settings) -> str:
    """Return which crossings take a fastener: as asked, or else those where the weave is loose.

    Slots are for the fasteners of crossings without joints, so who asks for them wants all.
    """
    return settings.fasten or ("all" if settings.slots else "loose")


def joined_pieces(
    joined: JoinedObject, settings: Settings, supplies: Supplies, rules: Sequence[HoleRule]
) -> PieceSet:
    """Build the pieces of an object, with their holes and joints."""
    woven = joined.woven
    fastening = parse_fastening(chosen_fastening(settings))
    fastened = fastened_crossings(
        fastening,
        woven.weave,
        woven.halfedges,
        joined.joints.crossing,
    )
    openings = ringed(woven, settings)
    beside = [beside_opening(woven, opening) for opening in openings]
    for crossings in beside:
        fastened |= crossings
    hanging = hung(woven, settings)
    fastened |= hanging
    holes = chosen_holes(settings)
    bend_t = min(
        min_bend_radius_mm(material) / material.thickness_mm for material in supplies.materials
    )
    piece_set = build_pieces(
        woven.ribbons,
        woven.weave,
        joined.plan.runs,
        woven.labels,
        rules,
        joined.joints,
        slots=settings.slots,
        cut=joined.cut,
        fastened=fastened,
        loose=loose_shares(woven.ribbons, woven.weave.threads, bend_t)
        if fastening.kind == "loose"
        else None,
        holed=np.ones_like(fastened) if holes == "all" else None,
        alike=holes == "alike",
        supply=supplies.of(woven.bunches),
        fit=KIND_PRICES[settings.kinds] is not None,
    )
    rings = _rings(openings, beside, piece_set, woven, settings, supplies)
    return replace(piece_set, rings=rings, hanging=hanging)


def hung(woven: WovenObject, settings: Settings) -> BoolArray:
    """Return the crossings that carry something, (X,)."""
    if settings.hang is None:
        return np.zeros(woven.weave.threads.n_crossings, dtype=np.bool_)
    # As the map tells where they are: of two that are as high, both choose the same.
    places = woven.ribbons.centre.round(DECIMALS)
    return hanging_crossings(parse_hanging(settings.hang), places)


def ringed(woven: WovenObject, settings: Settings) -> tuple[Opening, ...]:
    """Return the openings that get a ring."""
    if settings.rim == "none":
        return ()
    return tuple(one for one in woven.source.openings if one.diameter_mm is not None)


def beside_opening(woven: WovenObject, opening: Opening) -> BoolArray:
    """Return which crossings lie beside the rim of a round opening, (X,)."""
    halfedges, vertices = woven.halfedges, woven.mesh.vertices
    away = np.hypot(vertices[:, 0] - (opening.x_mm or 0.0), vertices[:, 1] - (opening.y_mm or 0.0))
    near = np.abs(away - (opening.diameter_mm or 0.0) / 2.0) <= opening.off_mm + _ON_RIM_MM
    rim = (halfedges.twin < 0) & near[halfedges.tail] & near[halfedges.tail[halfedges.next]]
    return beside_edges(woven.weave.threads, halfedges, rim)


def _rings(
    openings: Sequence[Opening],
    beside: Sequence[BoolArray],
    piece_set: PieceSet,
    woven: WovenObject,
    settings: Settings,
    supplies: Supplies,
) -> tuple[RimRing, ...]:
    """Plan a ring for each opening, of as few pieces as fit on a sheet of the first material."""
    rings: list[RimRing] = []
    # Around the widest hole there is the most room to keep.
    edge_mm = piece_set.rules[0].edge_mm if piece_set.rules else 0.0
    thickness = supplies.materials[0].thickness_mm
    for opening, crossings in zip(openings, beside, strict=True):
        held = np.flatnonzero(crossings & piece_set.fastened)
        first = 1 + sum(len(ring.pieces) for ring in rings)
        for count in range(2, MOST_RING_PIECES + 1):
            ring = plan_ring(
                opening.side,
                held,
                woven.ribbons.centre[held],
                (opening.x_mm or 0.0, opening.y_mm or 0.0),
                opening.diameter_mm or 0.0,
                count=count,
                first=first,
                hole_mm=piece_set.size_mm[held],
                edge_mm=edge_mm,
                thickness_mm=thickness,
                clearance_mm=settings.clearance_mm,
                prefix=ring_prefix(woven.labels),
            )
            if count == MOST_RING_PIECES or rings_fit(ring, settings, supplies):
                break
        rings.append(ring)
    return tuple(rings)


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
