"""Price a way of cutting threads by what it takes to make: sheets, fasteners and hours.

The rates that decide which greatest length ``--max-length auto`` takes stand here; hands take as
long as in the costs of a job. They are estimates, and prices of stock count as they stand. What
counts is what differs between two ways to cut the same weave; whatever they share, such as the
holes of crossings and the weaving itself, is left out.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.stock.machine import HOLDING_S, LABOUR_EUR_H, MIDDLE_PACE, PRACTISED

#: What is done only if there is no other way costs this much more, in square millimetres.
AVOIDED_MM2 = 1e8

#: What ``--prefer`` may say, the default first.
PREFERENCES = ("balanced", "work", "waste")

#: What ``--kinds`` may say, and what a kind of piece costs more, in joints; none does where each
#: thread is cut by itself. A kind is one more shape to sort and to tell apart: four joints' work.
KIND_PRICES = {"auto": 4.0, "fewest": 50.0, "any": None}
#: The same where pieces repeat though no rotation carries them onto one another. There each piece
#: has its price, not each of many: at four joints, a block of squares took a third more pieces.
LIKE_PRICES = {"auto": 0.5, "fewest": 4.0}

#: A piece is taken out of its sheet, found and taken up in so many seconds, and a joint is brought
#: into line and held: as costs count it, at a middling pace.
PIECE_S = MIDDLE_PACE * sum(PRACTISED[action][0] for action in ("sort", "find", "take"))
JOINT_S = MIDDLE_PACE * (PRACTISED["align"][0] + HOLDING_S["none"])
#: Id, arrow, joint numbers and mates of a piece are engraved in so many seconds. Labels of
#: crossings are as many however threads are cut.
ENGRAVE_S = 12.0
#: A joint's fastener is longer than that of a crossing, or comes besides.
JOINT_EUR = 0.05
#: A minute at a laser in an open workshop.
MACHINE_EUR_MIN = 0.5
#: Cutting speed of a material of which none is known.
CUT_MM_S = 20.0
#: Price of a square metre of a material of which none is known: about that of good card or thin
#: plywood.
SHEET_EUR_M2 = 10.0


@dataclass(frozen=True)
class StockSheet:
    """A kind of sheet in stock: area of one, price of one, and how many; None for enough."""

    area_mm2: float
    price: float
    quantity: int | None = None


@frozen_value
class Workshop:
    """What pieces are cut from, as far as it decides what they cost.

    Parameters
    ----------
    stock : tuple of tuples of StockSheet
        The sheets of each supply, in the order in which they are used.
    speed_mm_s : (S,) float array
        Cutting speed in the material of each supply.
    supply : (T,) int array
        Which supply each thread is cut from.
    """

    stock: tuple[tuple[StockSheet, ...], ...]
    speed_mm_s: FloatArray
    supply: IntArray


@dataclass(frozen=True)
class SheetsNeeded:
    """How many sheets are needed, their area and price, and what area the stock is short of."""

    count: int
    area_mm2: float
    price: float
    lacking_mm2: float


def sheets_for(area_mm2: float, stock: Sequence[StockSheet]) -> SheetsNeeded:
    """Return what whole sheets an area takes, used in the order of the stock.

    A last sheet that is nearly empty costs as much as a full one.

    Examples
    --------
    >>> sheets_for(2.5e6, [StockSheet(1e6, 4.0)])
    SheetsNeeded(count=3, area_mm2=3000000.0, price=12.0, lacking_mm2=0.0)
    >>> sheets_for(2.5e6, [StockSheet(1e6, 4.0, 2)]).lacking_mm2
    500000.0
    """
    left, count, area, price = area_mm2, 0, 0.0, 0.0
    for sheet in stock:
        wanted = max(math.ceil(left / sheet.area_mm2 - 1e-9), 0)
        taken = wanted if sheet.quantity is None else min(wanted, sheet.quantity)
        left -= taken * sheet.area_mm2
        count, area, price = (
            count + taken,
            area + taken * sheet.area_mm2,
            price + taken * sheet.price,
        )
    return SheetsNeeded(count, area, price, max(left, 0.0))


def all_sheets_for(areas_mm2: FloatArray, workshop: Workshop) -> SheetsNeeded:
    """Return what whole sheets the areas of all supplies, (S,), take together."""
    return sum_sheets(
        [
            sheets_for(area, stock)
            for area, stock in zip(areas_mm2.tolist(), workshop.stock, strict=True)
        ]
    )


def sum_sheets(parts: Sequence[SheetsNeeded]) -> SheetsNeeded:
    """Return what several needs come to together."""
    return SheetsNeeded(
        sum(part.count for part in parts),
        sum(part.area_mm2 for part in parts),
        sum(part.price for part in parts),
        sum(part.lacking_mm2 for part in parts),
    )


def hand_hours(pieces: float, joints: float) -> float:
    """Return the hours of handling pieces and joints.

    Examples
    --------
    >>> round(hand_hours(100, 100), 1)
    1.6
    """
    return (PIECE_S * pieces + JOINT_S * joints) / 3600.0


def machine_hours(pieces: float, cut_mm: FloatArray, speed_mm_s: FloatArray) -> float:
    """Return the hours that the machine cuts outlines and engraves what pieces are called.

    Parameters
    ----------
    pieces : float
    cut_mm, speed_mm_s : (S,) float arrays
        Length of all outlines, and the speed, in each material.

    Examples
    --------
    >>> import numpy as np
    >>> machine_hours(100, np.array([24_000.0]), np.array([10.0]))
    1.0
    """
    return float(ENGRAVE_S * pieces + (cut_mm / speed_mm_s).sum()) / 3600.0


def cost_of(sheets: float, joints: float, by_hand: float, by_machine: float) -> float:
    """Return what sheets of a price, joints, and hours by hand and by machine cost together.

    Examples
    --------
    >>> cost_of(8.0, 40, 2.0, 0.5)
    55.0
    """
    return sheets + JOINT_EUR * joints + LABOUR_EUR_H * by_hand + 60 * MACHINE_EUR_MIN * by_machine
