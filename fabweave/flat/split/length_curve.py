"""Predict how the greatest length of pieces affects waste and joints, and choose it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.records import record
from fabweave.flat.split.candidate_costs import Bed, Candidates, joint_price, price_candidates
from fabweave.flat.split.cost import sheet_area
from fabweave.flat.split.shortest_path import cheapest_ring, cheapest_row

#: How many lengths are compared.
LENGTHS = 8
#: Threads are left out of the comparison, evenly, so that about so many sites are looked at.
_MOST_SITES = 20_000


@dataclass(frozen=True)
class Choice:
    """What comes of cutting to one greatest length, as predicted before anything is nested.

    Parameters
    ----------
    length_mm : float
        No piece is longer.
    pieces, joints : int
        How many there are.
    piece_mm2 : float
        Area of all pieces.
    sheet_mm2 : float
        Area of sheet that they are predicted to take.
    """

    length_mm: float
    pieces: int
    joints: int
    piece_mm2: float
    sheet_mm2: float

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
            piece_mm2=round(self.piece_mm2, 1),
            sheet_mm2=round(self.sheet_mm2, 1),
            utilisation=round(self.utilisation, 4),
        )


@record
class ChoiceRecord:
    """A choice as files have it."""

    max_length_mm: float
    pieces: int
    joints: int
    piece_mm2: float
    sheet_mm2: float
    utilisation: float


def compare_lengths(
    candidates: Candidates, bed: Bed, lengths_mm: Sequence[float]
) -> tuple[Choice, ...]:
    """Cut all threads at the least cost for each of some lengths, joints not staggered.

    Lengths to which some thread cannot be cut are left out. On very fine meshes only every
    k-th thread is cut, and counts and areas are scaled up.

    Parameters
    ----------
    candidates : Candidates
        Measured up to the longest of the lengths.
    bed : Bed
        What pieces must fit on.
    lengths_mm : sequence of float
        The lengths, ascending.
    """
    sites, windows = candidates.sites, candidates.windows
    count = np.diff(sites.offsets)
    threads = np.flatnonzero((count > 1) | ((count > 0) & sites.closed))
    stride = max(1, round(len(sites.position) / _MOST_SITES))
    some = threads[(len(threads) - 1) % stride // 2 :: stride]
    scale = count[threads].sum() / max(count[some].sum(), 1)
    choices = []
    for length in lengths_mm:
        cut = _cut_each(candidates, bed, length, some)
        if cut is None:
            continue
        area = windows.area_mm2[cut]
        used = sheet_area(area, windows.rim_mm[cut], windows.hull_mm2[cut], bed.gap_mm)
        joints = len(area) - np.count_nonzero(~sites.closed[some])
        choices.append(
            Choice(
                length_mm=length,
                pieces=round(scale * len(area)),
                joints=round(scale * joints),
                piece_mm2=float(scale * area.sum()),
                sheet_mm2=float(scale * used.sum()),
            )
        )
    return tuple(choices)


def _cut_each(
    candidates: Candidates, bed: Bed, longest_mm: float, threads: IntArray
) -> tuple[IntArray, IntArray] | None:
    """Cut threads without a look at one another; None if some thread cannot be cut.

    Returns
    -------
    row, column : (N,) int arrays
        The pieces among the candidates.
    """
    sites = candidates.sites
    cost = price_candidates(candidates, bed, longest_mm) + joint_price(candidates)
    rows, columns = [], []
    for thread in threads.tolist():
        costs = cost[sites.offsets[thread] : sites.offsets[thread + 1]]
        ring = bool(sites.closed[thread])
        total, cut = (cheapest_ring if ring else cheapest_row)(costs)
        if not np.isfinite(total):
            return None
        size = len(costs)
        rows.append(sites.offsets[thread] + cut)
        columns.append(np.diff(np.append(cut, cut[0] + size if ring else size - 1)) - 1)
    if not rows:
        return None
    return np.concatenate(rows), np.concatenate(columns)


def knee(choices: Sequence[Choice]) -> Choice:
    """Return the choice at the knee of the curve of sheet area over joints.

    Both are scaled to run from 0 to 1 over the choices; the knee is where they sum to the least,
    which is where the curve lies furthest below the line from end to end. Of equal ones the
    longest is taken.

    Examples
    --------
    >>> points = [(100.0, 90, 1.0), (200.0, 40, 1.1), (400.0, 20, 2.0)]
    >>> knee([Choice(length, n, n, 1.0, area) for length, n, area in points]).length_mm
    200.0
    """
    joints = np.array([choice.joints for choice in choices], dtype=np.float64)
    sheet = np.array([choice.sheet_mm2 for choice in choices])
    total = np.round(_scaled(joints) + _scaled(sheet), 9)
    return choices[len(total) - 1 - int(np.argmin(total[::-1]))]


def _scaled(values: FloatArray) -> FloatArray:
    """Return values scaled to run from 0 to 1."""
    spread = np.ptp(values)
    return np.asarray((values - values.min()) / (spread if spread > 0 else 1.0))
