"""Count what is bought besides sheets: fasteners by diameter and grip, glue, tape."""

from collections import Counter

import numpy as np

from fabweave.core.messages import agree
from fabweave.core.records import optional, record
from fabweave.piece.pieces import PieceSet, count_layers, grips_mm
from fabweave.stock.hardware import Hardware, hardware_catalogue, hardware_named

#: Spare fasteners, as a share of those needed; but no fewer than ``LEAST_SPARES``.
SPARE_SHARE = 0.08
LEAST_SPARES = 2


@record
class FastenerRow:
    """Fasteners of one diameter, number of layers and grip: needed, spare, and to buy in all.

    ``fits`` names the sorts of hardware that do, in the order of the catalogue.
    """

    diameter_mm: float
    layers: int
    grip_mm: float
    needed: int
    spare: int
    buy: int
    fits: tuple[str, ...] | None = optional()


@record
class GlueRow:
    """Glued joints, and the area of their laps, each counted once."""

    joints: int
    area_mm2: float


@record
class TapeRow:
    """Taped joints, and the length of tape across their seams."""

    joints: int
    length_mm: float


@record
class BillOfMaterials:
    """What is bought besides sheets; ``hardware`` tells of the sorts that fit some fastener."""

    fasteners: tuple[FastenerRow, ...]
    glue: GlueRow
    tape: TapeRow
    hardware: tuple[Hardware, ...] | None = optional()


def bill_of_materials(piece_set: PieceSet, hardware: str | None = None) -> BillOfMaterials:
    """Count fasteners, glue and tape, and say which hardware fits.

    A fastener's grip is the thickness of all layers that it goes through, each with that of its
    own material: two at a crossing, three at a lap. Glue covers the laps of all glued joints, once
    each. Tape runs across the seams of pieces that meet end to end: each is as long as the ribbon
    is wide, square to it.

    Parameters
    ----------
    piece_set : PieceSet
    hardware : str, optional
        The sort that is to be used; by default any of the catalogue.
    """
    sorts = (
        tuple(hardware_catalogue().values()) if hardware is None else (hardware_named(hardware),)
    )
    needed: Counter[tuple[float, int, float]] = Counter()
    layers, grip = count_layers(piece_set), grips_mm(piece_set)
    for piece in piece_set.pieces:
        # Each fastener is counted once, by the strand above; slots are holes in a strand below.
        for station, _, _, diameter in piece.holes.tolist():
            crossing = piece.crossings[int(station)]
            if piece.over[int(station)] and piece_set.fastened[crossing]:
                needed[diameter, int(layers[crossing]), float(grip[crossing])] += 1
    rows = []
    for (diameter, count, grip_mm), number in sorted(needed.items()):
        spare = max(LEAST_SPARES, int(np.ceil(SPARE_SHARE * number)))
        rows.append(
            FastenerRow(
                diameter_mm=diameter,
                layers=count,
                grip_mm=grip_mm,
                needed=number,
                spare=spare,
                buy=number + spare,
                fits=tuple(sort.name for sort in sorts if sort.fits(diameter, grip_mm)),
            )
        )
    glued = [joint for joint in piece_set.joints if joint.kind.bought == "glue"]
    taped = [joint for joint in piece_set.joints if joint.kind.bought == "tape"]
    lap_mm2 = sum(piece_set.plan.lap_mm2[joint.id - 1] for joint in glued)
    tape_mm = sum(_breadth(piece_set, joint.pieces[0]) for joint in taped)
    return BillOfMaterials(
        fasteners=tuple(rows),
        glue=GlueRow(joints=len(glued), area_mm2=round(float(lap_mm2), 3)),
        tape=TapeRow(joints=len(taped), length_mm=round(float(tape_mm), 3)),
        hardware=tuple(
            sort for sort in sorts if any(sort.name in (row.fits or ()) for row in rows)
        ),
    )


def _breadth(piece_set: PieceSet, index: int) -> float:
    """Return how wide a piece is at its last station, square to its thread."""
    piece = piece_set.pieces[index]
    across, along = piece.rails[-1, 1] - piece.rails[-1, 0], piece.directions[-1]
    return float(abs(along[0] * across[1] - along[1] * across[0]))


def bom_notes(bill: BillOfMaterials) -> list[str]:
    """Return the shopping list in words."""
    notes = [
        f"buy: {row.buy} fasteners for holes of {row.diameter_mm:g} mm, grip "
        f"{row.grip_mm:g} mm ({row.layers} layers): {row.needed} needed, {row.spare} spare"
        + _fitting(row)
        for row in bill.fasteners
    ]
    glue, tape = bill.glue, bill.tape
    if glue.joints:
        laps = agree(glue.joints, "{n} [lap|laps]")
        notes.append(f"buy: glue for {laps}, {glue.area_mm2 / 100:.0f} cm² in all")
    if tape.joints:
        seams = agree(tape.joints, "{n} [seam|seams]")
        notes.append(f"buy: {tape.length_mm / 1000:.2f} m of tape for {seams}")
    return notes


def _fitting(row: FastenerRow) -> str:
    """Say what fits the holes and the grip of a row, as it is sold."""
    sold = sold_for(row)
    if not sold:
        return "; nothing that is known fits: try another --fastener, or washers"
    return f"; take {sold}"


def sold_for(row: FastenerRow, *, outside: bool = False) -> str:
    """Name what is sold for the holes and the grip of a row; empty if nothing that is known fits.

    Parameters
    ----------
    row : FastenerRow
    outside : bool
        Only what is set from one side.
    """
    sorts = [hardware_named(name) for name in row.fits or ()]
    sold = [str(sort.length_for(row.grip_mm)) for sort in sorts if sort.outside or not outside]
    return f"{', '.join(sold[:-1])} or {sold[-1]}" if len(sold) > 1 else "".join(sold)


#: What the columns of the shopping list are called.
SHOPPING = ("Any one of these", "Size", "Set with", "Each, EUR", "Needed", "Spare", "Buy")


def shopping_rows(bill: BillOfMaterials) -> list[tuple[object, ...]]:
    """Return the shopping list, with the columns of ``SHOPPING`` and a box to tick."""
    rows: list[tuple[object, ...]] = []
    for row in bill.fasteners:
        sorts = [hardware_named(name) for name in row.fits or ()]
        sold = sold_for(row) or "fasteners"
        each = [price for sort in sorts for price in sort.each]
        rows.append(
            (
                f"☐ {sold}",
                f"hole {row.diameter_mm:g} mm, grip {row.grip_mm:g} mm ({row.layers} layers)",
                ", ".join(dict.fromkeys(sort.tool for sort in sorts)),
                f"{min(each):.2f} to {max(each):.2f}" if each else "",
                row.needed,
                row.spare,
                row.buy,
            )
        )
    glue, tape = bill.glue, bill.tape
    if glue.joints:
        laps = f"{glue.area_mm2 / 100:.1f} cm² of laps"
        rows.append(("☐ glue", laps, "", "", glue.joints, "", ""))
    if tape.joints:
        seams = f"{tape.length_mm / 1000:.2f} m"
        rows.append(("☐ tape", seams, "", "", tape.joints, "", ""))
    return rows
