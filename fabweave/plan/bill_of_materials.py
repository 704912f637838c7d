"""Count what is bought besides sheets: fasteners by diameter and grip, glue, tape."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fabweave.core.messages import agree
from fabweave.core.records import optional, record
from fabweave.piece.pieces import PieceSet, count_layers, grips_mm
from fabweave.plan.order import Order
from fabweave.plan.reach import job_clips, most_clips, set_outside
from fabweave.stock.hardware import Hardware, hardware_catalogue, hardware_named

#: Spare fasteners, as a share of those needed; but no fewer than ``LEAST_SPARES``.
SPARE_SHARE = 0.08
LEAST_SPARES = 2


@record
class FastenerRow:
    """Fasteners of one diameter, number of layers and grip: needed, spare, and to buy in all.

    ``fits`` names the sorts of hardware that do, in the order of the catalogue, and ``outside``
    says how many are set when no hand comes to the inside; absent where the order is not known.
    """

    diameter_mm: float
    layers: int
    grip_mm: float
    needed: int
    spare: int
    buy: int
    fits: tuple[str, ...] | None = optional()
    outside: int | None = optional()


@record
class GlueRow:
    """Glued joints, and the area of their laps, each counted once; and glued crossings, if any."""

    joints: int
    area_mm2: float
    crossings: int | None = optional()


@record
class TapeRow:
    """Taped joints, and the length of tape across their seams."""

    joints: int
    length_mm: float


@record
class BillOfMaterials:
    """What is bought besides sheets; ``hardware`` tells of the sorts that fit some fastener.

    ``clips`` is how many hold loose ends at once, absent where the order is not known.
    """

    fasteners: tuple[FastenerRow, ...]
    glue: GlueRow
    tape: TapeRow
    hardware: tuple[Hardware, ...] | None = optional()
    clips: int | None = optional()


def _rows(
    piece_set: PieceSet, hardware: str | None, order: Order | None
) -> dict[FastenerRow, Counter[int]]:
    """Return the rows of fasteners, and how many of each go through which crossing."""
    sorts = _sorts(hardware)
    outside = None if order is None else set_outside(piece_set, order)
    where: dict[tuple[float, int, float], Counter[int]] = {}
    layers, grip = count_layers(piece_set), grips_mm(piece_set)
    tied = piece_set.hanging if piece_set.tied else None
    set_ = piece_set.fastened if tied is None else piece_set.fastened & ~tied
    for piece in piece_set.pieces:
        # Each fastener is counted once, by the strand above; slots are holes in a strand below. A
        # wire takes the place of one where a foot is tied to a base.
        for station, _, _, diameter in piece.holes.tolist():
            crossing = int(piece.crossings[int(station)])
            if piece.over[int(station)] and set_[crossing]:
                key = diameter, int(layers[crossing]), float(grip[crossing])
                where.setdefault(key, Counter())[crossing] += 1
    rows = {}
    for (diameter, count, grip_mm), at in sorted(where.items()):
        number = at.total()
        spare = max(LEAST_SPARES, int(np.ceil(SPARE_SHARE * number)))
        row = FastenerRow(
            diameter_mm=diameter,
            layers=count,
            grip_mm=grip_mm,
            needed=number,
            spare=spare,
            buy=number + spare,
            fits=tuple(sort.name for sort in sorts if sort.fits(diameter, grip_mm)),
            outside=None if outside is None else sum(at[key] for key in outside),
        )
        rows[row] = at
    return rows


def _sorts(hardware: str | None) -> tuple[Hardware, ...]:
    """Return the sorts that may be used."""
    every = hardware_catalogue()
    return tuple(every.values()) if hardware is None else (hardware_named(hardware),)


def sold_at(piece_set: PieceSet, hardware: str | None, order: Order) -> dict[int, Counter[str]]:
    """Return what is set at each crossing that takes a fastener: as it is sold, and how many.

    Parameters are those of ``bill_of_materials``.
    """
    outside, sold = set_outside(piece_set, order), dict[int, Counter[str]]()
    for row, at in _rows(piece_set, hardware, order).items():
        names = {way: _first_sold(row, outside=way) for way in (False, True)}
        for crossing, count in at.items():
            sold.setdefault(crossing, Counter())[names[crossing in outside]] += count
    return sold


def _first_sold(row: FastenerRow, *, outside: bool) -> str:
    """Name what is set: the first sort of the list; what to do where none can be set."""
    sort = sort_for(row, outside=outside)
    if sort is None:
        return INSTEAD if outside else "fastener"
    return str(sort.length_for(row.grip_mm))


def bill_of_materials(
    piece_set: PieceSet, hardware: str | None = None, order: Order | None = None
) -> BillOfMaterials:
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
    order : Order, optional
        Of assembly, if it is known: it says which fasteners are set from outside, and what clips
        hold.
    """
    rows = _rows(piece_set, hardware, order)
    glued = [joint for joint in piece_set.joints if joint.kind.bought == "glue"]
    taped = [joint for joint in piece_set.joints if joint.kind.bought == "tape"]
    lap_mm2 = sum(piece_set.plan.lap_mm2[joint.id - 1] for joint in glued)
    tape_mm = sum(_breadth(piece_set, joint.pieces[0]) for joint in taped)
    return BillOfMaterials(
        fasteners=tuple(rows),
        glue=GlueRow(
            joints=len(glued),
            area_mm2=round(float(lap_mm2), 3),
            crossings=len(piece_set.fastened) if piece_set.glued else None,
        ),
        tape=TapeRow(joints=len(taped), length_mm=round(float(tape_mm), 3)),
        hardware=tuple(
            sort for sort in _sorts(hardware) if any(sort.name in (row.fits or ()) for row in rows)
        ),
        clips=None if order is None else most_clips(job_clips(piece_set, order)),
    )


def _breadth(piece_set: PieceSet, index: int) -> float:
    """Return how wide a piece is at its last station, square to its thread."""
    piece = piece_set.pieces[index]
    across, along = piece.rails[-1, 1] - piece.rails[-1, 0], piece.directions[-1]
    return float(abs(along[0] * across[1] - along[1] * across[0]))


def sorts_for(row: FastenerRow) -> list[Hardware]:
    """Return the sorts that fit a row; what is set from outside comes first where some have to be.

    The first one is that which steps name and hours count.
    """
    sorts = [hardware_named(name) for name in row.fits or ()]
    return sorted(sorts, key=lambda sort: not sort.outside) if row.outside else sorts


def sort_for(row: FastenerRow, *, outside: bool) -> Hardware | None:
    """Return the first sort of a row, if any, that can be set where it goes."""
    return next((sort for sort in sorts_for(row) if sort.outside or not outside), None)


def set_with(bill: BillOfMaterials) -> dict[str, str]:
    """Return the sorts that steps name, and the tool of each; what is done instead has its own."""
    tools = {}
    for row in bill.fasteners:
        outside = row.outside or 0
        for way, count in ((False, row.needed - outside), (True, outside)):
            sort = sort_for(row, outside=way)
            if sort is not None and count:
                tools[sort.name] = sort.tool
            elif way and count:
                tools[INSTEAD] = "glue, or a needle, thread and scissors"
    return tools


def _sold(row: FastenerRow, sorts: Sequence[Hardware]) -> str:
    """Name what is sold for the grip of a row, of some sorts."""
    sold = [str(sort.length_for(row.grip_mm)) for sort in sorts]
    return f"{', '.join(sold[:-1])} or {sold[-1]}" if len(sold) > 1 else "".join(sold)


#: What is done where no fastener can be set.
INSTEAD = "glue, or sew through two holes"
#: What holds loose ends, and what to search for.
_CLIPS, _CLIPS_SEARCH = "small binder clip, 19 mm, or clothes peg", "foldback clips 19 mm"


def buy_lines(bill: BillOfMaterials) -> list[tuple[str, str]]:
    """Return the shopping list in words, each line with what it is about."""
    lines = [
        (
            "Fasteners",
            f"{row.buy} × {_sold(row, sorts_for(row)[:1]) or 'what fits, not known here'}, "
            f"{_size(row)}; {row.needed} needed, {row.spare} spare{_from_outside(row)}",
        )
        for row in bill.fasteners
    ]
    lines += [("Washers", f"{count} × {what}") for what, count in _washers(bill).items()]
    if bill.clips:
        lines.append(("Clips", f"{bill.clips} × {_CLIPS}, for ends that are still loose"))
    glue, tape = bill.glue, bill.tape
    if glue.joints:
        laps = agree(glue.joints, "{n} [lap|laps]")
        lines.append(("Glue", f"glue for {laps}, {glue.area_mm2 / 100:.0f} cm² in all"))
    if glue.crossings:
        dabs = f"a dab for each of {glue.crossings} crossings, as soon as it is covered"
        lines.append(("Glue", dabs))
    if tape.joints:
        seams = agree(tape.joints, "{n} [seam|seams]")
        lines.append(("Tape", f"{tape.length_mm / 1000:.2f} m of tape for {seams}"))
    return lines


def _washers(bill: BillOfMaterials) -> Counter[str]:
    """Count what goes under the backs of fasteners that soft strips do not hold, by what it is."""
    count = Counter[str]()
    for row in bill.fasteners:
        if sorts_for(row) and sorts_for(row)[0].washer:
            what = f"washer with a hole of {row.diameter_mm:.1f} mm, one under each back, inside"
            count[f"{what}; none on metal"] += row.buy
    return count


def _size(row: FastenerRow) -> str:
    """Say what a row goes through."""
    return f"hole {row.diameter_mm:g} mm, grip {row.grip_mm:g} mm ({row.layers} layers)"


def _from_outside(row: FastenerRow) -> str:
    """Say how many are set when no hand comes to the inside, and what serves there, if not all."""
    sorts = sorts_for(row)
    if not row.outside or (sorts and all(sort.outside for sort in sorts)):
        return ""
    which = agree(row.outside, "; {n} of them [is|are] set from outside")
    return which + ("" if sorts and sorts[0].outside else f": {INSTEAD}, or try another --fastener")


#: What the columns of the shopping list are called.
SHOPPING = (
    "Any one of these", "Search for", "Size", "Set with", "Each, EUR", "Needed", "From outside",
    "Spare", "Buy",
)  # fmt: skip


def shopping_rows(bill: BillOfMaterials) -> list[tuple[object, ...]]:
    """Return the shopping list, with the columns of ``SHOPPING``."""
    rows: list[tuple[object, ...]] = []
    for row in bill.fasteners:
        sorts = sorts_for(row)
        each = [price for sort in sorts for price in sort.each]
        rows.append(
            (
                _sold(row, sorts) or "fasteners that fit",
                "; ".join(sort.search for sort in sorts),
                _size(row),
                ", ".join(dict.fromkeys(sort.tool for sort in sorts)),
                f"{min(each):.2f} to {max(each):.2f}" if each else "",
                row.needed,
                _from_outside(row).removeprefix("; ") or row.outside or "",
                row.spare,
                row.buy,
            )
        )
    for what, count in _washers(bill).items():
        rows.append((what, "flat washers", "", "fingers", "", count, "", "", count))
    if bill.clips:
        own = _CLIPS, _CLIPS_SEARCH, "for loose ends", "fingers"
        rows.append((*own, "", bill.clips, "", "", bill.clips))
    glue, tape = bill.glue, bill.tape
    if glue.joints:
        laps = f"{glue.area_mm2 / 100:.1f} cm² of laps"
        rows.append(("glue", "", laps, "", "", glue.joints, "", "", ""))
    if glue.crossings:
        rows.append(("glue", "", "a dab each", "", "", glue.crossings, "", "", ""))
    if tape.joints:
        seams = f"{tape.length_mm / 1000:.2f} m"
        rows.append(("tape", "", seams, "", "", tape.joints, "", "", ""))
    return rows
