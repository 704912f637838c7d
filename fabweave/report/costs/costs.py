"""Say what a job costs, in one place for all who show it: machine, hands, sheets, hardware, money.

Everything is a range. ``job_costs`` is for sheets that are drawn and steps that are known, and
``planned_costs`` for pieces before they are nested; they agree on engraving and cutting.
"""

from collections.abc import Sequence

import numpy as np

from fabweave.core.records import inline, record
from fabweave.cut.drawing import SheetDrawing
from fabweave.cut.labels.marks import Marks
from fabweave.flat.bill_of_materials import BillOfMaterials
from fabweave.flat.crossing_map import StepRecord
from fabweave.flat.piece import Piece
from fabweave.flat.pieces import PieceSet
from fabweave.report.bom import bill_of_materials
from fabweave.report.costs.assembly_time import (
    AssemblyTime,
    difficulty,
    job_hands,
    planned_hands,
)
from fabweave.report.costs.assumptions import assumptions_of
from fabweave.report.costs.machine_time import (
    MachineTime,
    add_times,
    piece_time,
    scaled_time,
    sheet_time,
)
from fabweave.report.costs.money import (
    Price,
    hardware_price,
    machine_price,
    sheet_price,
    sum_prices,
)
from fabweave.report.costs.rates import MaterialRates, material_rates
from fabweave.stock.machine import Span
from fabweave.stock.material import Material
from fabweave.stock.sheet_size import SheetSize

#: Before pieces are nested: the share of sheets that pieces fill, from the worst to the best, an
#: estimate; a torus of 218 pieces on two sheets fills 0.34 of them, with most of the second free.
_FILLED: Span = (0.35, 0.75)


@record
class SheetCosts:
    """What a sheet takes, and its price; ``number`` counts from 1."""

    sheet: int
    machine: MachineTime = inline()
    price: Price | None


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
        None while they are planned.
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
    machine: MachineTime = inline()
    machine_s: Span | None
    assembly: AssemblyTime
    difficulty: DifficultyFigures
    sheet_price: Price | None
    hardware_price: Price
    machine_price: Price | None
    price: Price | None
    assumptions: tuple[str, ...]


def job_costs(
    piece_set: PieceSet,
    drawings: Sequence[SheetDrawing],
    sheets: Sequence[SheetSize],
    materials: Sequence[Material],
    steps: Sequence[StepRecord],
    bill: BillOfMaterials,
    *,
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
    calibration : float
        What the machine took, divided by what was estimated.
    """
    times = [
        scaled_time(sheet_time(drawing, material), calibration)
        for drawing, material in zip(drawings, materials, strict=True)
    ]
    stated = [0.0 if sheet.offcut and sheet.price is None else sheet.price for sheet in sheets]
    each = tuple(
        SheetCosts(
            sheet=number,
            machine=time,
            price=sheet_price(sheet.area_mm2, material, price),
        )
        for number, (sheet, time, material, price) in enumerate(
            zip(sheets, times, materials, stated, strict=True), start=1
        )
    )
    return _costs(
        piece_set.pieces,
        times,
        materials,
        sum_prices(sheet.price for sheet in each),
        job_hands(steps, [joint.kind.name for joint in piece_set.joints], bill),
        bill,
        sheets=each,
        calibration=calibration,
        stock=any(price for price in stated),
    )


def planned_costs(
    piece_set: PieceSet,
    marks: Sequence[Marks],
    piece_materials: Sequence[Material],
    *,
    calibration: float = 1.0,
) -> Costs:
    """Return what a job will cost whose pieces are known, but not where they lie.

    Engraving and cutting are those of the finished job. Ways between pieces, the area of sheets and
    the share of strands that are slid under others are predicted.

    Parameters
    ----------
    piece_set : PieceSet
    marks : sequence of Marks
        What is engraved on each piece.
    piece_materials : sequence of Material
        That of each piece.
    calibration : float
        What the machine took, divided by what was estimated.
    """
    pieces, bill = piece_set.pieces, bill_of_materials(piece_set)
    of_material: dict[Material, list[int]] = {}
    for at, material in enumerate(piece_materials):
        of_material.setdefault(material, []).append(at)
    times, prices = [], []
    for material, members in of_material.items():
        own = [pieces[at] for at in members]
        time = piece_time(own, [marks[at] for at in members], material)
        times.append(scaled_time(time, calibration))
        area = sum(piece.path.area for piece in own)
        prices.append(sheet_price((area / _FILLED[1], area / _FILLED[0]), material))
    crossings = len({int(key) for piece in pieces for key in piece.crossings})
    joints = [joint.kind.name for joint in piece_set.joints]
    return _costs(
        pieces,
        times,
        list(of_material),
        sum_prices(prices),
        planned_hands(len(pieces), crossings, joints, bill),
        bill,
        planned=True,
        calibration=calibration,
    )


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
