"""Build the pieces of an object whose strips are known, and the rings of its openings."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray
from fabweave.mesh.leave_out import Opening
from fabweave.piece.brief import ACROSS_DEG, Brief, tight_along
from fabweave.piece.joined_strands import JoinedObject
from fabweave.piece.joint.fastening import (
    beside_edges,
    fastened_crossings,
    hanging_crossings,
    parse_fastening,
    parse_hanging,
)
from fabweave.piece.joint.kinds import parse_joint
from fabweave.piece.on_stock import rings_fit
from fabweave.piece.piece import Piece
from fabweave.piece.pieces import Hold, PieceSet, build_pieces
from fabweave.piece.rim_ring import RimRing, free_prefix, plan_ring
from fabweave.piece.split.preferences import KIND_PRICES
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.broken_rule import FAR, BrokenRule
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.rotations import parse_rotations

#: A ring is not cut into more pieces to make them fit on a sheet.
MOST_RING_PIECES = 12
#: Vertices of a rim are on its circle to this, but for those that are told to be off it.
_ON_RIM_MM = 1e-3


def joined_pieces(joined: JoinedObject, brief: Brief, hold: Hold | None = None) -> PieceSet:
    """Build the pieces of an object, with their holes and joints; ``hold`` may add fasteners."""
    woven, asked, supplies = joined.woven, brief.pieces, brief.supplies
    fastened = fastened_crossings(
        parse_fastening(brief.fasten), woven.weave, woven.halfedges, joined.joints.crossing
    )
    openings = woven.source.rims
    beside = [beside_opening(woven, opening) for opening in openings]
    for crossings in beside:
        fastened |= crossings
    hanging = np.zeros_like(fastened)
    if asked.hang is not None:
        hanging = hanging_crossings(parse_hanging(asked.hang), woven.ribbons.centre)
    fastened |= hanging
    piece_set = build_pieces(
        woven.ribbons,
        woven.weave,
        joined.plan.runs,
        woven.labels,
        brief.rules,
        joined.joints,
        slots=parse_joint(asked.joint).slots,
        cut=joined.cut,
        fastened=fastened,
        hold=hold,
        holed=np.ones_like(fastened) if brief.holes == "all" else None,
        alike=brief.holes == "alike",
        supply=supplies.of(woven.bunches),
        fit=KIND_PRICES[asked.kinds] is not None,
    )
    rings = _rings(openings, beside, piece_set, woven, brief)
    return replace(piece_set, rings=rings, hanging=hanging)


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
    brief: Brief,
) -> tuple[RimRing, ...]:
    """Plan a ring for each opening, of as few pieces as fit on a sheet of the first material."""
    rings: list[RimRing] = []
    # Around the widest hole there is the most room to keep.
    edge_mm = piece_set.rules[0].edge_mm if piece_set.rules else 0.0
    thickness = brief.supplies.materials[0].thickness_mm
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
                clearance_mm=brief.ribbons.clearance_mm,
                prefix=free_prefix("R", woven.labels),
            )
            if count == MOST_RING_PIECES or rings_fit(ring, brief.supplies, brief.effort):
                break
        rings.append(ring)
    return tuple(rings)


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
