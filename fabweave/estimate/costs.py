"""Say what a job costs, in one place for all who show it: machine, hands, sheets, hardware, money.

Everything is a range. ``job_costs`` is for sheets that are drawn and steps that are known, and
``pieces_costs`` for pieces before they are nested; they agree on engraving and cutting.
"""

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace

import numpy as np

from fabweave.core.arrays import IntArray
from fabweave.core.records import inline, optional, record
from fabweave.estimate.assembly_time import (
    AssemblyTime,
    assembly_time,
    difficulty,
    hardware_for,
    planned_hands,
)
from fabweave.estimate.machine_time import (
    MachineTime,
    add_times,
    piece_time,
    scaled_time,
    sheet_time,
)
from fabweave.estimate.money import (
    Price,
    fastener_price,
    hardware_price,
    machine_price,
    sheet_price,
    sum_prices,
)
from fabweave.piece.piece import Piece
from fabweave.piece.pieces import PieceSet
from fabweave.piece.settings import PieceSettings
from fabweave.plan.bill_of_materials import BillOfMaterials, bill_of_materials
from fabweave.plan.crossing_map import StepRecord
from fabweave.ribbon.lay import WovenObject
from fabweave.sheet.drawing import SheetDrawing
from fabweave.sheet.labels.marks import mark_pieces
from fabweave.sheet.side_sheets import SideSheets
from fabweave.stock.machine import CURRENCY, PACE, OneOrSpan, Span, as_span, machines
from fabweave.stock.material import Material, machine_of
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.supplies import Supplies


@record
class MaterialRates:
    """Speeds and prices of a material: millimetres and seconds, prices in its currency.

    Pairs are a least and a greatest value. What is None, or an empty source, is not known.
    """

    material: str
    thickness_mm: float
    machine: str
    speed_mm_s: Span | None
    engrave_mm_s: Span
    rapid_mm_s: Span
    acceleration_mm_s2: Span
    deviation_mm: float
    pierce_s: Span
    laser_on_s: Span
    speed_source: str
    price_per_m2: OneOrSpan | None
    machine_per_h: OneOrSpan | None
    currency: str
    price_source: str


def material_rates(material: Material) -> MaterialRates:
    """Return the speeds and prices of a material, with those of its machine."""
    machine = machine_of(material)
    # What a material says of its machine, machine_of has taken in already.
    known = {each.name: getattr(material, each.name) for each in fields(material)}
    known |= {each.name: getattr(machine, each.name) for each in fields(machine)}
    known |= {"material": material.name, "machine": machine.name}
    return MaterialRates(**{each.name: known[each.name] for each in fields(MaterialRates)})


def assumptions_of(
    rates: Sequence[MaterialRates],
    hands: AssemblyTime,
    bill: BillOfMaterials,
    *,
    calibration: float,
    planned: bool,
    stock: bool,
) -> tuple[str, ...]:
    """Return what costs rest on.

    Parameters
    ----------
    rates : sequence of MaterialRates
    hands : AssemblyTime
    bill : BillOfMaterials
    calibration : float
    planned : bool
        Whether pieces are not nested yet.
    stock : bool
        Whether a list of stock has prices.
    """
    if hands.often("cut"):
        told = ["Strips are cut from the roll by hand: no machine is counted."]
    else:
        told = [*(text for one in rates for text in _speeds(one)), *_machine_words(calibration)]
    told += [
        f"Hands: {', '.join(f'{each.each_s:g} s {each.words}' for each in hands.actions)}, "
        f"practised, times {_span(PACE)} for a maker; waiting for glue is not counted.",
        *(text for one in rates for text in _prices(one)),
    ]
    if stock:
        told.append("Prices in the list of stock are taken to be in the currency of the material.")
    told += _hardware(bill)
    if planned:
        told.append(
            "Pieces are not nested yet: ways between them, the area of sheets and the strands that "
            "are slid under others are predicted, and sheets are not counted whole."
        )
    return tuple(told)


def _machine_words(calibration: float) -> Iterator[str]:
    """Say what times of the machine rest on, beside its speeds."""
    if calibration != 1.0:
        yield (
            f"Times of the machine are multiplied by {calibration:g}, as one job was measured "
            "(--calibrate)."
        )
    else:
        yield (
            "Nothing is measured on your machine: after a first job, --calibrate makes these times "
            "yours."
        )
    yield (
        "Lines are followed one colour after another, with one acceleration, slowly round corners, "
        "and from rest to rest; loading sheets and focusing are not counted."
    )


def _span(value: OneOrSpan) -> str:
    """Return a range in words."""
    low, high = as_span(value)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _speeds(rates: MaterialRates) -> Iterator[str]:
    """Say how fast a material is cut."""
    name = f"{rates.material} {rates.thickness_mm:g} mm"
    machine = machines()[rates.machine].title
    if rates.speed_mm_s is None:
        yield (
            f"No cutting speed of {name} is known: write speed_mm_s in a materials file of your "
            "own."
        )
        cut = ""
    else:
        source = f" ({rates.speed_source})" if rates.speed_source else ""
        cut = f" is cut at {_span(rates.speed_mm_s)} mm/s{source},"
    yield (
        f"{name}{cut} is engraved at {_span(rates.engrave_mm_s)} mm/s; a {machine} moves at "
        f"{_span(rates.rapid_mm_s)} mm/s, gathers speed at {_span(rates.acceleration_mm_s2)} "
        f"mm/s², and rests {_span(rates.pierce_s)} s where a cut begins."
    )


def _prices(rates: MaterialRates) -> Iterator[str]:
    """Say what a material and its machine cost."""
    name = f"{rates.material} {rates.thickness_mm:g} mm"
    if rates.price_per_m2 is None:
        yield (
            f"No price of {name} is known: write price_per_m2 and currency in a materials file of "
            "your own."
        )
    else:
        source = f" ({rates.price_source})" if rates.price_source else ""
        yield f"{name} costs {_span(rates.price_per_m2)} {rates.currency} a square metre{source}."
    if rates.machine_per_h is not None:
        yield f"An hour of the machine costs {_span(rates.machine_per_h)} {rates.currency}."


def _hardware(bill: BillOfMaterials) -> Iterator[str]:
    """Say what fasteners, glue and tape cost."""
    for size in sorted({row.diameter_mm for row in bill.fasteners}):
        sorts = ", ".join(sort.title for sort in hardware_for(size, bill))
        yield (
            f"A fastener for a hole of {size:g} mm ({sorts}) costs "
            f"{_span(fastener_price(size, bill))} {CURRENCY}, an estimate."
        )
    if bill.glue.joints or bill.tape.joints:
        yield "Glue and tape cost a cent or two a joint, an estimate."


#: Before pieces are nested: the share of sheets that pieces fill, from the worst to the best, an
#: estimate; a torus of 218 pieces on two sheets fills 0.34 of them, with most of the second free.
_FILLED: Span = (0.35, 0.75)
#: The same of straight strips in rows, and the share of their outlines that is cut where they share
#: cuts: measured on twelve objects.
_IN_ROWS: Span = (0.75, 0.97)
_SHARED = 0.52
#: Of more pieces, letters are laid on so many, and take the rest as long as those of like length.
_LETTERED = 40
#: Areas are told to so many digits.
_DECIMALS = 6


@record
class SheetCosts:
    """What a sheet takes, and its price; ``number`` counts from 1."""

    sheet: int
    machine: MachineTime = inline()
    price: Price | None


@record
class SideSheet:
    """A sheet beside those of the pieces: its name and size, area without holes, time, price."""

    sheet: str
    width_mm: float
    height_mm: float
    pieces: int
    piece_area_mm2: float
    material: str
    thickness_mm: float
    machine: MachineTime = inline()
    price: Price | None


def side_costs(sheets: SideSheets, calibration: float) -> tuple[SideSheet, ...]:
    """Return what each sheet beside those of the pieces takes."""
    layout, material = sheets.layout, sheets.material
    found = []
    for number, (sheet, drawing) in enumerate(zip(layout.sheets, sheets.drawings, strict=True)):
        own = [sheets.areas_mm2[one.piece] for one in layout.placements if one.sheet == number]
        found.append(
            SideSheet(
                sheet=drawing.name,
                width_mm=sheet.width_mm,
                height_mm=sheet.height_mm,
                pieces=len(own),
                piece_area_mm2=round(sum(own), _DECIMALS),
                material=material.name,
                thickness_mm=material.thickness_mm,
                machine=scaled_time(sheet_time(drawing, material), calibration),
                price=sheet_price(sheet.area_mm2, material, _stated(sheet)),
            )
        )
    return tuple(found)


def _stated(sheet: SheetSize) -> float | None:
    """Return the price of a sheet in a list of stock; an offcut without one is free."""
    return 0.0 if sheet.offcut and sheet.price is None else sheet.price


@record
class DifficultyFigures:
    """How difficult the assembly is, from 0 to 10 and in words; and what it is made of.

    ``unders`` is how many strands a piece is slid under, and ``width_mm`` how wide a piece is at a
    crossing, in the median.
    """

    score: float
    word: str
    unders: float
    width_mm: float


@record
class Costs:
    """What a job costs: pairs are from the least to the most; None is what is not known.

    Parameters
    ----------
    planned : bool
        Whether pieces are not nested yet, so that ways between them, sheets and steps are
        predicted.
    calibration : float
        By what times of the machine are multiplied, already.
    materials : tuple of MaterialRates
        The speeds and prices that were taken.
    sheets : tuple of SheetCosts
        Those of the pieces; none while they are planned.
    beside : int or None
        How many sheets more there are, of rings and of a former; all sums count them.
    without : tuple of str or None
        What no sum counts while sheets are planned: rings, and a former.
    machine : MachineTime
        ``cut_s``, ``engrave_s`` and ``travel_s``.
    machine_s : (float, float) or None
        All three.
    assembly : AssemblyTime
    difficulty : DifficultyFigures
    sheet_price, hardware_price, machine_price : Price or None
    price : Price or None
        What sheets and hardware cost together, and the machine where a rate is known.
    assumptions : tuple of str
        What all this rests on, in sentences.
    """

    planned: bool
    calibration: float
    materials: tuple[MaterialRates, ...]
    sheets: tuple[SheetCosts, ...]
    beside: int | None = optional()
    without: tuple[str, ...] | None = optional()
    machine: MachineTime = inline()
    machine_s: Span | None
    assembly: AssemblyTime
    difficulty: DifficultyFigures
    sheet_price: Price | None
    hardware_price: Price
    machine_price: Price | None
    price: Price | None
    assumptions: tuple[str, ...]

    @property
    def by_hand(self) -> bool:
        """Whether there is nothing for a machine to do."""
        return self.machine_s is not None and self.machine_s[1] == 0.0


def job_costs(
    piece_set: PieceSet,
    drawings: Sequence[SheetDrawing],
    sheets: Sequence[SheetSize],
    materials: Sequence[Material],
    steps: Sequence[StepRecord],
    bill: BillOfMaterials,
    *,
    beside: Sequence[SideSheets] = (),
    calibration: float = 1.0,
) -> Costs:
    """Return what a job costs whose sheets are drawn.

    Parameters
    ----------
    piece_set : PieceSet
    drawings : sequence of SheetDrawing
        Nominal sheets, pieces in the order of the cut.
    sheets : sequence of SheetSize
        That of each drawing, with its price in a list of stock; an offcut without one is free.
    materials : sequence of Material
        That of each sheet.
    steps : sequence of StepRecord
        The assembly.
    bill : BillOfMaterials
    beside : sequence of SideSheets
        What is cut besides: rings, and a former.
    calibration : float
        What the machine took for a job, divided by what was estimated.
    """
    each: list[SheetCosts] = []
    for sheet, drawing, material in zip(sheets, drawings, materials, strict=True):
        time = add_times(()) if sheet.is_roll else sheet_time(drawing, material)
        price = sheet_price(sheet.area_mm2, material, _stated(sheet))
        time = scaled_time(time, calibration)
        each.append(SheetCosts(sheet=len(each) + 1, machine=time, price=price))
    kinds, rolls = [joint.kind.name for joint in piece_set.joints], sheets[0].is_roll
    more = [(one, sheets.material) for sheets in beside for one in side_costs(sheets, calibration)]
    rows: list[SheetCosts | SideSheet] = [*each, *(one for one, _ in more)]
    return _costs(
        piece_set.pieces,
        [row.machine for row in rows],
        [*materials, *(material for _, material in more)],
        sum_prices(row.price for row in rows),
        assembly_time(
            sum(step.handled for step in steps),
            sum(len(step.over) for step in steps),
            sum(len(step.under) for step in steps),
            kinds,
            bill,
            clips=sum(len(step.clips or ()) for step in steps),
            marks=sum(len(piece.crossings) for piece in piece_set.pieces) if rolls else None,
            ties=piece_set.tied,
        ),
        bill,
        sheets=tuple(each),
        beside=len(more) or None,
        calibration=calibration,
        stock=any(_stated(sheet) for sheet in sheets),
    )


def pieces_costs(
    piece_set: PieceSet,
    woven: WovenObject,
    labelled: PieceSettings,
    supplies: Supplies,
    calibration: float,
    *,
    common: bool = False,
) -> Costs:
    """Return what a job will cost whose pieces are known, but not where they lie.

    ``common`` is whether straight strips share cuts.

    Cutting is that of the finished job, and so is engraving unless pieces are many: then letters
    are laid on some. Ways between pieces, the area of sheets and the share of strands that are slid
    under others are predicted.
    """
    pieces, bill = piece_set.pieces, bill_of_materials(piece_set)
    of_thread = supplies.of(woven.bunches)
    marks = mark_pieces(
        pieces,
        woven.weave.threads.n_crossings,
        labelled.labels,
        labelled.label_side,
        piece_set.kinds,
        # Before the order is known, numbers of other steps are as long.
        {piece.id: at for at, piece in enumerate(pieces, start=1)},
        leaders=_leaders(pieces),
    )
    of_material: dict[Material, list[int]] = {}
    for at, piece in enumerate(pieces):
        material = supplies.materials[int(of_thread[piece.thread])]
        of_material.setdefault(material, []).append(at)
    times, prices = [], []
    for material, members in of_material.items():
        own = [pieces[at] for at in members]
        time = piece_time(own, [marks[at] for at in members], material)
        if common and time.cut_s is not None:
            time = replace(time, cut_s=(_SHARED * time.cut_s[0], _SHARED * time.cut_s[1]))
        filled = _IN_ROWS if woven.straight else _FILLED
        times.append(add_times(()) if supplies.rolls else scaled_time(time, calibration))
        area = sum(piece.path.area for piece in own)
        prices.append(sheet_price((area / filled[1], area / filled[0]), material))
    crossings = len({int(key) for piece in pieces for key in piece.crossings})
    joints = [joint.kind.name for joint in piece_set.joints]
    without = ["rings"] * bool(piece_set.rings) + ["former"] * (supplies.former is not None)
    return _costs(
        pieces,
        times,
        list(of_material),
        sum_prices(prices),
        planned_hands(
            len(pieces), crossings, joints, bill, rolls=supplies.rolls, ties=piece_set.tied
        ),
        bill,
        planned=True,
        without=tuple(without) or None,
        calibration=calibration,
    )


def _leaders(pieces: Sequence[Piece]) -> IntArray:
    """Return for each piece one that is about as long, of few, (P,)."""
    order = np.argsort([len(piece.crossings) for piece in pieces], kind="stable")
    every = -(-len(order) // _LETTERED)
    leaders = np.empty(len(order), dtype=np.int64)
    leaders[order] = np.repeat(order[::every], every)[: len(order)]
    return leaders


def _costs(
    pieces: Sequence[Piece],
    times: Sequence[MachineTime],
    materials: Sequence[Material],
    sheets_cost: Price | None,
    hands: AssemblyTime,
    bill: BillOfMaterials,
    *,
    calibration: float,
    planned: bool = False,
    sheets: tuple[SheetCosts, ...] = (),
    beside: int | None = None,
    without: tuple[str, ...] | None = None,
    stock: bool = False,
) -> Costs:
    """Put together what is known of machine, hands and money."""
    # Sums are of what is stated, so that whoever adds up the sheets finds them.
    machine = scaled_time(add_times(times), 1.0)
    total = machine.total_s
    hardware = hardware_price(bill)
    rent = machine_price([time.total_s for time in times], materials)
    rates = tuple(material_rates(material) for material in dict.fromkeys(materials))
    return Costs(
        planned=planned,
        calibration=calibration,
        materials=rates,
        sheets=sheets,
        beside=beside,
        without=without,
        machine=machine,
        machine_s=None if total is None else (round(total[0], 3), round(total[1], 3)),
        assembly=hands,
        difficulty=_difficulty(pieces, hands),
        sheet_price=sheets_cost,
        hardware_price=hardware,
        machine_price=rent,
        price=sum_prices([sheets_cost, hardware] + ([rent] if rent is not None else [])),
        assumptions=assumptions_of(
            rates, hands, bill, calibration=calibration, planned=planned, stock=stock
        ),
    )


def _difficulty(pieces: Sequence[Piece], hands: AssemblyTime) -> DifficultyFigures:
    """Return how difficult an assembly is."""
    rails = np.concatenate([np.zeros((0, 2, 2)), *(piece.rails for piece in pieces)])
    widths = np.hypot(*(rails[:, 1] - rails[:, 0]).T)
    width = round(float(np.median(widths)), 3) if len(widths) else 0.0
    unders = round(hands.often("under") / max(hands.often("take"), 1), 4)
    found = difficulty(hands.practised_h, unders, width)
    return DifficultyFigures(score=found.score, word=found.word, unders=unders, width_mm=width)
