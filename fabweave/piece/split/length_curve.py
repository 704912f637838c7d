"""Predict what each greatest length of pieces comes to, and choose one of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.messages import agree
from fabweave.core.records import record
from fabweave.piece.development import Runs, unfold_runs
from fabweave.piece.outline import strip_outlines
from fabweave.piece.piece import Piece
from fabweave.piece.split.candidates import Bed, Sites, sheet_area
from fabweave.piece.split.preferences import (
    Workshop,
    all_sheets_for,
    cost_of,
    hand_hours,
    machine_hours,
)
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
#: Bent pieces are taken to fill no more of their sheets when laid there roughly; straight ones may.
_MOST_FILLED = 0.8


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
        Of sheets, joints and hours, by the rates of :mod:`fabweave.piece.split.preferences`.
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


def compared_threads(sites: Sites) -> tuple[IntArray, float]:
    """Return the threads that are cut for a comparison: all, but on very fine meshes every k-th.

    The second is how many times their sites stand for all.
    """
    count = np.diff(sites.offsets)
    threads = np.flatnonzero(count)
    stride = max(1, round(len(sites.position) / _MOST_SITES))
    some = np.asarray(threads[(len(threads) - 1) % stride // 2 :: stride])
    return some, float(count.sum() / max(count[some].sum(), 1))


def foretell(
    ribbons: Ribbons,
    threads: Threads,
    runs: Runs,
    length_mm: float,
    workshop: Workshop,
    bed: Bed,
    scale: float = 1.0,
    *,
    full: bool = False,
) -> Choice:
    """Return what some runs come to, as predicted before anything is nested.

    Parameters
    ----------
    ribbons : Ribbons
    threads : Threads
    runs : Runs
        As a job would have them with this greatest length.
    length_mm : float
    workshop : Workshop
        What pieces are cut from.
    bed : Bed
        What pieces must fit on.
    scale : float
        How many times the threads that are cut stand for all.
    full : bool
        Whether sheets count as if pieces filled as much of them as they can: no choice comes to
        fewer.
    """
    rings, (area, rim, hull, extent, length) = _measured(ribbons, runs)
    sheet, long = sheet_area(area, rim, hull, extent, bed), length > length_mm + 1e-6
    supply, count = workshop.supply[runs.thread], len(workshop.stock)
    least = area if bed.straight else area / _MOST_FILLED
    taken = np.bincount(supply, scale * (least if full else sheet), count).astype(np.float64)
    needed = all_sheets_for(taken, workshop)
    if not full and bed.packed is not None and scale == 1.0 and _few(len(rings), needed.count):
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


@lru_cache(maxsize=LENGTHS)  # a comparison asks for those of a length two or three times
def _measured(ribbons: Ribbons, runs: Runs) -> tuple[list[FloatArray], FloatArray]:
    """Return pieces' outlines, and their areas, rims, areas of hulls, extents and lengths."""
    strips = unfold_runs(ribbons, runs)
    rings = strip_outlines(strips)
    outlines = shapely.polygons([shapely.linearrings(ring) for ring in rings])
    area, rim = shapely.area(outlines), shapely.length(outlines)
    hull = shapely.area(shapely.convex_hull(outlines))
    extent = 2 * shapely.minimum_bounding_radius(outlines)
    middle = (strips.right + strips.left) / 2
    steps = np.append(np.hypot(*np.diff(middle, axis=0).T), 0.0)
    steps[strips.offsets[1:] - 1] = 0.0  # from the end of one piece to the next
    length = np.add.reduceat(steps, strips.offsets[:-1])
    return rings, np.stack((area, rim, hull, extent, length))


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
    return min(choices, key=lambda choice: rank(choice, prefer))


#: What a choice is judged by, for each preference.
_KEYS: dict[str, Callable[[Choice], tuple[float, ...]]] = {
    "waste": lambda choice: (choice.sheets_mm2, choice.joints, choice.sheet_mm2),
    "work": lambda choice: (choice.hours, choice.sheets_mm2),
    "balanced": lambda choice: (choice.cost, choice.sheets_mm2),
}


def rank(choice: Choice, prefer: str) -> tuple[float, ...]:
    """Return how good a choice is, for comparing: what the stock suffices for goes first."""
    return tuple(round(value, 6) for value in (choice.lacking_mm2, *_KEYS[prefer](choice)))


def compare(
    count: int,
    prefer: str,
    packed: Callable[[int], Choice],
    by_area: Callable[[int], Choice],
    full: Callable[[int], Choice] | None,
) -> tuple[Choice, tuple[Choice, ...]]:
    """Return the choice that serves the maker best, and all: those laid on sheets that may be it.

    Parameters
    ----------
    count : int
        How many choices there are.
    prefer : str
        See :func:`preferred`.
    packed, by_area : callable
        Return what a choice comes to, by its number, on sheets, which takes long, and by its area.
    full : callable, optional
        Returns what it comes to at least; if not given, all are laid on sheets.

    Examples
    --------
    >>> hours = [4.0, 2.0, 3.0]
    >>> def choice(share):
    ...     return lambda number: Choice(9.0, 9, 9, 1.0, 2.0, hours=share * hours[number])
    >>> best, every = compare(3, "work", choice(1.0), choice(0.9), choice(0.8))
    >>> best.hours, [one.hours for one in every]
    (2.0, [3.6, 2.0, 2.7])
    """
    if full is None:
        every = tuple(map(packed, range(count)))
        return preferred(every, prefer), every
    least = [rank(full(number), prefer) for number in range(count)]
    likely: dict[int, Choice] = {}
    for number in sorted(range(count), key=least.__getitem__):
        if likely and least[number] > min(rank(one, prefer) for one in likely.values()):
            break
        likely[number] = packed(number)
    best = preferred([likely[number] for number in sorted(likely)], prefer)
    return best, tuple(likely.get(number) or by_area(number) for number in range(count))


@frozen_value
class SplitPlan:
    """Where a job's threads are cut.

    Parameters
    ----------
    runs : Runs
        The passes of each piece.
    length_mm : float
        The greatest length that was chosen or asked for.
    choices : tuple of Choice
        What several greatest lengths come to, as predicted.
    chosen : Choice
        What the length that was taken comes to: as these runs are, before anything is nested.
    prefer : str or None
        By which preference one of the choices was taken; None if a length was asked for.
    likes : bool
        Whether threads are cut so that pieces repeat that no rotation carries onto one another.
    """

    runs: Runs
    length_mm: float
    choices: tuple[Choice, ...]
    chosen: Choice
    prefer: str | None
    likes: bool = False


#: What each preference has the least of.
_LEAST = {"balanced": "least cost", "work": "least work", "waste": "least sheet"}


@record
class ThreadSplitting:
    """How a thread is cut; ``fill`` is what its pieces fill of their smallest rectangles."""

    thread: str
    pieces: int
    longest_mm: float
    fill: float


@record
class SplittingRecord:
    """Where threads were cut: the greatest length of a piece, and each thread's pieces.

    ``chosen`` is what the length that was taken comes to, with pieces and joints as they are, and
    ``prefer`` the preference that took it, None if the length was asked for. ``choices`` are
    predictions for several greatest lengths. Sheets, hours and costs are predicted before anything
    is nested; costs are in euros, by the rates of fabweave.
    """

    max_length_mm: float
    prefer: str | None
    chosen: ChoiceRecord
    choices: tuple[ChoiceRecord, ...]
    threads: tuple[ThreadSplitting, ...]


def splitting_record(
    plan: SplitPlan, pieces: Sequence[Piece], labels: Sequence[str]
) -> SplittingRecord:
    """Return what ``waste.json`` holds under ``splitting``.

    Parameters
    ----------
    plan : SplitPlan
    pieces : sequence of Piece
    labels : sequence of str
        The name of each thread.
    """
    polygons = [shapely.Polygon(piece.outline) for piece in pieces]
    area, box = shapely.area(polygons), shapely.area(shapely.oriented_envelope(polygons))
    thread = np.array([piece.thread for piece in pieces], dtype=np.int64)
    count = np.bincount(thread, minlength=len(labels))
    filled, around = (np.bincount(thread, part, len(labels)) for part in (area, box))
    longest = np.zeros(len(labels))
    extent = np.array([float(np.ptp(piece.outline[:, 0])) for piece in pieces])
    np.maximum.at(longest, thread, extent)
    return SplittingRecord(
        max_length_mm=round(plan.length_mm, 1),
        prefer=plan.prefer,
        chosen=plan.chosen.record(),
        choices=tuple(choice.record() for choice in plan.choices),
        threads=tuple(
            ThreadSplitting(
                thread=labels[number],
                pieces=int(count[number]),
                longest_mm=round(float(longest[number]), 1),
                fill=round(float(filled[number] / around[number]), 4),
            )
            for number in np.flatnonzero(count).tolist()
        ),
    )


def splitting_reason(chosen: ChoiceRecord, prefer: str | None, lengths: int) -> str:
    """Say what a length comes to, and why it was taken.

    Parameters
    ----------
    chosen : ChoiceRecord
        What the length comes to.
    prefer : str or None
        The preference that took it; None if it was asked for.
    lengths : int
        How many were compared.

    Examples
    --------
    >>> from fabweave.piece.split.length_curve import Choice
    >>> few = Choice(900.0, 135, 135, 1.0, 2.0, sheets=4, hours=2.1, cost=60.2).record()
    >>> splitting_reason(few, "balanced", 8)
    'at most 900 mm: 135 pieces, 135 joints, about 4 sheets; the least cost of 8 lengths'
    >>> splitting_reason(few, None, 8)
    'at most 900 mm: 135 pieces, 135 joints, about 4 sheets; as asked for'
    """
    counts = (
        f"at most {chosen.max_length_mm:g} mm: {agree(chosen.pieces, '{n} piece[|s]')}, "
        f"{agree(chosen.joints, '{n} joint[|s]')}, about {agree(chosen.sheets, '{n} sheet[|s]')}"
    )
    if chosen.longer:
        counts += agree(chosen.longer, "; {n} piece[ is|s are] longer, as no cut helps")
    if prefer is None:
        return f"{counts}; as asked for"
    return f"{counts}; the {_LEAST[prefer]} of {agree(lengths, '{n} length[|s]')}"
