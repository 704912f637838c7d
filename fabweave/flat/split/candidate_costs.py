"""Gather the pieces that threads could be cut into, and what each would cost."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.flat.split.candidates import (
    Course,
    Sites,
    Windows,
    lay_course,
    list_sites,
    measure_windows,
    station_of_site,
)
from fabweave.flat.split.preferences import SheetsNeeded, window_costs
from fabweave.flat.split.runs import Runs
from fabweave.flat.split.self_clearance import also_barred, last_clear
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

#: Pieces pass no more crossings than this unless there is no other way: they would be hard to
#: thread, and there would be no end of pieces to choose from on fine meshes.
MOST_PASSES = 64

#: Rooms are measured at whole degrees only; between them a piece may have this share of its
#: length more.
_ROOM_SHARE = 0.01

#: A joint is worth as much sheet as so many crossings of its ribbon take.
JOINT_WORTH = 4.0
#: An uneven division may cost more by up to this share of a joint.
_EVEN_SHARE = 0.1


@dataclass(frozen=True)
class Bed:
    """What a piece must fit on.

    Parameters
    ----------
    fits : callable
        Whether an outline (K, 2) fits the usable stock at some angle.
    usable : tuple of (float, float)
        What the margin leaves of each sheet, so that most answers are known without asking; may
        be empty.
    gap_mm : float
        Least distance between two pieces on a sheet.
    free_mm : (float, float), optional
        The largest rectangle that is free.
    packed : callable, optional
        What sheets some outlines take, each with the number of its supply, by laying them on
        sheets; None where there is no room for them.
    """

    fits: Callable[[FloatArray], bool]
    usable: tuple[tuple[float, float], ...] = ()
    gap_mm: float = 0.0
    free_mm: tuple[float, float] | None = None
    packed: Callable[[Sequence[FloatArray], IntArray], SheetsNeeded | None] | None = None

    @property
    def side_mm(self) -> float:
        """How long a piece may be from end to end without lying askew."""
        return np.inf if self.free_mm is None else max(self.free_mm)

    @property
    def askew_mm2(self) -> float:
        """What a piece that lies askew takes: there is room for one more at most."""
        return 0.0 if self.free_mm is None else self.free_mm[0] * self.free_mm[1] / 2


@frozen_value
class Candidates:
    """All pieces that threads could be cut into.

    Parameters
    ----------
    ribbons : Ribbons
    sites : Sites
        Where threads may be cut.
    course : Course
        The unfolded threads.
    windows : Windows
        The pieces from site to site.
    clear : (N, D) bool array
        Which of them keep clear of themselves.
    barred : Runs or None
        Stretches that no piece may carry all of, whatever these ribbons show.
    """

    ribbons: Ribbons
    sites: Sites
    course: Course
    windows: Windows
    clear: BoolArray
    barred: Runs | None = None

    @property
    def slack(self) -> FloatArray:
        """How exactly the room of each is known, (N, D)."""
        length = self.windows.length_mm
        return np.where(np.isfinite(length), length, 0.0) * _ROOM_SHARE

    def fresh(self) -> BoolArray:
        """Return which pieces may be cut as far as is known, (N, D)."""
        return np.asarray(self.clear & (self.windows.room_mm >= -self.slack))


def list_candidates(
    ribbons: Ribbons,
    weave: Weave,
    bed: Bed,
    longest_mm: float,
    threads: IntArray,
    most_passes: int = MOST_PASSES,
    barred: Runs | None = None,
) -> Candidates:
    """Measure all pieces that some threads could be cut into.

    No piece may carry all of a stretch that is barred.
    """
    sites = list_sites(weave).of(threads)
    course = lay_course(ribbons, most_passes)
    windows = measure_windows(
        course, sites, most_passes=most_passes, longest_mm=longest_mm, usable=bed.usable
    )
    behind = last_clear(course, int(windows.passes.max(initial=1)))
    if barred is not None:
        behind = also_barred(course, sites, behind, barred)
    at = station_of_site(course, sites)[:, None]
    there = windows.passes > 0
    last = np.where(there, at + windows.passes - 1, at)
    return Candidates(ribbons, sites, course, windows, there & (at > behind[last]), barred)


def joint_price(candidates: Candidates) -> float:
    """Return what a joint is worth in square millimetres: the mean ribbon of some crossings."""
    windows = candidates.windows
    there = windows.passes > 1
    if not there.any():
        return 0.0
    area = windows.area_mm2[there].sum() / (windows.passes[there] - 0.5).sum()
    return float(JOINT_WORTH * area)


def price_candidates(candidates: Candidates, bed: Bed, longest_mm: float) -> FloatArray:
    """Return the cost of every piece, (N, D), without its joints; infinite where it is none."""
    cost = window_costs(
        candidates.windows,
        gap_mm=bed.gap_mm,
        even_mm2=_EVEN_SHARE * joint_price(candidates),
        longest_mm=longest_mm,
        side_mm=bed.side_mm,
        askew_mm2=bed.askew_mm2,
    )
    cost[~candidates.fresh()] = np.inf
    return cost
