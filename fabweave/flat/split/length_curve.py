"""Predict what each greatest length of pieces comes to, and choose one of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.core.arrays import IntArray
from fabweave.core.records import record
from fabweave.flat.outline import strip_outlines
from fabweave.flat.split.candidate_costs import Bed
from fabweave.flat.split.candidates import Sites
from fabweave.flat.split.preferences import (
    Workshop,
    all_sheets_for,
    cost_of,
    hand_hours,
    machine_hours,
    sheet_area,
)
from fabweave.flat.split.runs import Runs, unfold_runs
from fabweave.ribbon.project import Ribbons
from fabweave.weave.threads import Threads

#: How many lengths are compared.
LENGTHS = 8
#: On meshes with more places to cut, threads are left out of the comparison, evenly, so that
#: about so many are looked at: cutting all eight times would take longer than the rest of the job.
_MOST_SITES = 10_000
#: Pieces of which no more are on a sheet, or on all of so few sheets, are laid on sheets to count
#: these: by their area, 3 sheets were told of 5 that 16 pieces of up to 600 mm took, 9 of 14 for
#: 40, and 12 of 15 for 77; with 24 on a sheet, as many as came. More would take too long.
_FEW_ON_SHEET, _FEW_SHEETS, _MOST_PACKED = 12, 5, 200


@dataclass(frozen=True)
class Choice:
    """What comes of cutting to one greatest length, as predicted before anything is nested.

    Parameters
    ----------
    length_mm : float
        The greatest length, laps included.
    pieces, joints : int
        How many there are.
    piece_mm2 : float
        Area of all pieces.
    sheet_mm2 : float
        Area of sheet that they are predicted to take.
    longer : int
        How many pieces are longer all the same, as their threads cannot be cut so short.
    sheets : int
        How many whole sheets that is.
    sheets_mm2 : float
        Area of these.
    hours : float
        Of handling pieces and joints, and of the machine.
    cost : float
        Of sheets, joints and hours, by the rates of :mod:`fabweave.flat.split.preferences`.
    lacking_mm2 : float
        Area of sheet that the stock is short of.
    exact : bool
        Whether all threads were cut; else counts are those of some, scaled up.
    """

    length_mm: float
    pieces: int
    joints: int
    piece_mm2: float
    sheet_mm2: float
    longer: int = 0
    sheets: int = 0
    sheets_mm2: float = 0.0
    hours: float = 0.0
    cost: float = 0.0
    lacking_mm2: float = 0.0
    exact: bool = True

    @property
    def utilisation(self) -> float:
        """Predicted share of the used sheet area that becomes pieces."""
        return self.piece_mm2 / self.sheet_mm2

    def record(self) -> "ChoiceRecord":
        """Return the choice as files have it, rounded."""
        return ChoiceRecord(
            max_length_mm=round(self.length_mm, 1),
            pieces=self.pieces,
            joints=self.joints,
            longer=self.longer,
            exact=self.exact,
            piece_mm2=round(self.piece_mm2, 1),
            sheet_mm2=round(self.sheet_mm2, 1),
            utilisation=round(self.utilisation, 4),
            sheets=self.sheets,
            hours=round(self.hours, 2),
            cost=round(self.cost, 2),
        )


@record
class ChoiceRecord:
    """A choice as files have it; ``cost`` is in euros, by the rates of fabweave."""

    max_length_mm: float
    pieces: int
    joints: int
    longer: int
    exact: bool
    piece_mm2: float
    sheet_mm2: float
    utilisation: float
    sheets: int
    hours: float
    cost: float


def compared_threads(sites: Sites) -> IntArray:
    """Return the threads that are cut for a comparison: all, but on very fine meshes every k-th."""
    threads = np.flatnonzero(np.diff(sites.offsets))
    stride = max(1, round(len(sites.position) / _MOST_SITES))
    return np.asarray(threads[(len(threads) - 1) % stride // 2 :: stride])


def compare_lengths(
    ribbons: Ribbons,
    threads: Threads,
    lengths_mm: Sequence[float],
    cut: Callable[[float], Runs],
    workshop: Workshop,
    bed: Bed,
    scale: float = 1.0,
) -> tuple[Choice, ...]:
    """Cut the threads to each of some lengths, as a job would, and tell what that comes to.

    Parameters
    ----------
    ribbons : Ribbons
    threads : Threads
    lengths_mm : sequence of float
        The lengths, ascending.
    cut : callable
        Returns the runs that a job would have with a greatest length.
    workshop : Workshop
        What pieces are cut from.
    bed : Bed
        What pieces must fit on.
    scale : float
        How many times the threads that are cut stand for all.
    """
    return tuple(
        foretell(ribbons, threads, cut(length), length, workshop, bed, scale)
        for length in lengths_mm
    )


def foretell(
    ribbons: Ribbons,
    threads: Threads,
    runs: Runs,
    length_mm: float,
    workshop: Workshop,
    bed: Bed,
    scale: float = 1.0,
) -> Choice:
    """Return what some runs come to; parameters as of :func:`compare_lengths`."""
    strips = unfold_runs(ribbons, runs)
    rings = strip_outlines(strips)
    outlines = shapely.polygons([shapely.linearrings(ring) for ring in rings])
    area, rim = shapely.area(outlines), shapely.length(outlines)
    sheet = sheet_area(
        area,
        rim,
        shapely.area(shapely.convex_hull(outlines)),
        2 * shapely.minimum_bounding_radius(outlines) > bed.side_mm,
        gap_mm=bed.gap_mm,
        askew_mm2=bed.askew_mm2,
    )
    middle = (strips.right + strips.left) / 2
    steps = np.append(np.hypot(*np.diff(middle, axis=0).T), 0.0)
    steps[strips.offsets[1:] - 1] = 0.0  # from the end of one piece to the next
    long = np.add.reduceat(steps, strips.offsets[:-1]) > length_mm + 1e-6

    supply, count = workshop.supply[runs.thread], len(workshop.stock)
    needed = all_sheets_for(np.bincount(supply, scale * sheet, count).astype(np.float64), workshop)
    if bed.packed is not None and scale == 1.0 and _few(len(rings), needed.count):
        needed = bed.packed(rings, supply) or needed
    pieces, joints = len(runs.thread), len(runs.joint_passes(threads))
    by_hand = scale * hand_hours(pieces, joints)
    cut_mm = np.bincount(supply, rim, count).astype(np.float64)
    by_machine = scale * machine_hours(pieces, cut_mm, workshop.speed_mm_s)
    return Choice(
        length_mm=length_mm,
        pieces=round(scale * pieces),
        joints=round(scale * joints),
        piece_mm2=float(scale * area.sum()),
        sheet_mm2=float(scale * sheet.sum()),
        longer=round(scale * np.count_nonzero(long)),
        sheets=needed.count,
        sheets_mm2=needed.area_mm2,
        hours=by_hand + by_machine,
        cost=cost_of(needed.price, scale * joints, by_hand, by_machine),
        lacking_mm2=needed.lacking_mm2,
        exact=scale == 1.0,
    )


def _few(pieces: int, sheets: int) -> bool:
    """Return whether pieces are so few, or so large, that their area alone says too little."""
    return pieces <= min(_FEW_ON_SHEET * max(sheets, _FEW_SHEETS), _MOST_PACKED)


def preferred(choices: Sequence[Choice], prefer: str) -> Choice:
    """Return the choice that serves the maker best; what the stock suffices for goes first.

    Parameters
    ----------
    choices : sequence of Choice
    prefer : str
        ``waste`` for the least area of whole sheets, then the fewest joints; ``work`` for the
        fewest hours; ``balanced`` for the least cost. Of equal ones the shortest is taken: what
        may be longer but is not, says nothing.

    Examples
    --------
    >>> few = Choice(900.0, 135, 135, 1.0, 2.0, sheets=5, sheets_mm2=5.0, hours=2.0, cost=60.0)
    >>> many = Choice(200.0, 240, 240, 1.0, 2.0, sheets=4, sheets_mm2=4.0, hours=4.0, cost=90.0)
    >>> [preferred([many, few], name).pieces for name in ("waste", "work", "balanced")]
    [240, 135, 135]
    """
    keys: dict[str, Callable[[Choice], tuple[float, ...]]] = {
        "waste": lambda choice: (choice.sheets_mm2, choice.joints, choice.sheet_mm2),
        "work": lambda choice: (choice.hours, choice.sheets_mm2),
        "balanced": lambda choice: (choice.cost, choice.sheets_mm2),
    }

    def rank(choice: Choice) -> tuple[float, ...]:
        return tuple(round(value, 6) for value in (choice.lacking_mm2, *keys[prefer](choice)))

    return min(choices, key=rank)
