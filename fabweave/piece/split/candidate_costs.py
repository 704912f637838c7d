"""Gather the pieces that threads could be cut into, and what each would cost."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.piece.development import Runs, Strips
from fabweave.piece.outline import strip_outlines
from fabweave.piece.split.candidates import (
    Course,
    Sites,
    Windows,
    lay_course,
    list_sites,
    measure_windows,
    station_of_site,
)
from fabweave.piece.split.preferences import AVOIDED_MM2, SheetsNeeded
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

#: Two stretches of one outline must not come nearer than this.
SELF_CLEARANCE_MM = 0.5


def keeps_clear(strips: Strips) -> BoolArray:
    """Say which strips neither cross themselves nor close a loop with less than the clearance.

    Parameters
    ----------
    strips : Strips
        Unfolded pieces.

    Returns
    -------
    (S,) bool array
    """
    polygons = np.array(
        [shapely.Polygon(outline) for outline in strip_outlines(strips)], dtype=object
    )
    good = np.asarray(shapely.is_valid(polygons))
    swollen = shapely.buffer(polygons[good], SELF_CLEARANCE_MM / 2, quad_segs=2)
    good[good] = shapely.get_num_interior_rings(swollen) == 0
    return good


def last_clear(course: Course, most_passes: int) -> IntArray:
    """Return for each station the one behind which a piece must begin that ends here, or later.

    Parameters
    ----------
    course : Course
        Whole strips.
    most_passes : int
        Pieces of more stations than this are ignored.

    Returns
    -------
    (M,) int array
        A station, or -1: all pieces with up to ``most_passes`` stations that end here keep clear
        of themselves if, and only if, they begin behind it.
    """
    behind = np.full(len(course.begin), -1)
    early, late = _near_pairs(course, most_passes)
    # For each late station its early ones, the nearest first: the shortest loop that is closed.
    order = np.lexsort((-early, late))
    early, late = early[order], late[order]
    thread = np.repeat(np.arange(len(course.offsets) - 1), np.diff(course.offsets))
    while len(late):
        fresh = np.ones(len(late), dtype=bool)
        fresh[1:] = late[1:] != late[:-1]
        a, b = early[fresh], late[fresh]
        looped = ~keeps_clear(course.stretches(a, b))
        behind[b[looped]] = a[looped]
        np.maximum.accumulate(behind, out=behind)
        # What lies before the thread's own first station comes from the thread before.
        behind[behind < course.offsets[:-1][thread]] = -1
        left = ~fresh & (early > behind[late])
        early, late = early[left], late[left]
    return behind


def also_barred(course: Course, sites: Sites, behind: IntArray, barred: Runs) -> IntArray:
    """Return what :func:`last_clear` does where no piece may carry some other stretches, either.

    Parameters
    ----------
    course : Course
        Whole strips.
    sites : Sites
        Of the same threads.
    behind : (M,) int array
        What it returned.
    barred : Runs
        No piece carries all of one of these.

    Returns
    -------
    (M,) int array
    """
    behind = behind.copy()
    count = np.diff(course.offsets)
    for thread, first, last in zip(
        barred.thread.tolist(), barred.first.tolist(), barred.last.tolist(), strict=True
    ):
        # A ring's stations come again on its second lap.
        lap, start = int(sites.lengths[thread]), int(course.offsets[thread])
        for again in range(2 if sites.closed[thread] else 1):
            low = first % lap + again * lap
            high = low + last - first
            if high < count[thread]:
                behind[start + high] = max(behind[start + high], start + low)
    np.maximum.accumulate(behind, out=behind)
    thread_of = np.repeat(np.arange(len(count)), count)
    behind[behind < course.offsets[:-1][thread_of]] = -1
    return behind


def _near_pairs(course: Course, most_passes: int) -> tuple[IntArray, IntArray]:
    """Return stations whose stretches to the next station come near each other, not neighbours."""
    block, member = _blocks(course.offsets, most_passes)
    if not len(member):
        none = np.zeros(0, dtype=np.int64)
        return none, none
    last = np.append(course.begin[1:], len(course.strips.rung) - 1)
    filled = np.diff(course.offsets) > 0
    last[course.offsets[1:][filled] - 1] = course.strips.offsets[1:][filled] - 1
    first, last = course.begin[member], last[member]
    right, left = course.strips.right, course.strips.left
    # Blocks are laid far from one another, so that one tree serves them all.
    middle = (right[first] + left[first]) / 2
    count = np.bincount(block).astype(np.float64)
    centre = np.column_stack([np.bincount(block, middle[:, k]) / count for k in (0, 1)])
    away = np.zeros(len(count))
    np.maximum.at(away, block, np.abs(middle - centre[block]).max(axis=1))
    longest = np.hypot(*np.diff(right, axis=0).T).max(initial=0.0) + SELF_CLEARANCE_MM
    spread = 4 * (away + longest * (last - first + 1).max())
    shift = np.column_stack((np.cumsum(spread), np.zeros(len(spread)))) - centre
    moved = shift[block]
    low, high = _bounds(np.minimum, course, first, last), _bounds(np.maximum, course, first, last)
    low, high = low + moved - SELF_CLEARANCE_MM / 2, high + moved + SELF_CLEARANCE_MM / 2
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    one, other = shapely.STRtree(boxes).query(boxes)
    # Neighbours touch always; only what is further apart along the strand is looked at closely.
    apart = member[other] - member[one]
    far = (apart > 1) & (apart < most_passes)
    one, other = one[far], other[far]
    involved, place = np.unique(np.concatenate((one, other)), return_inverse=True)
    rings = _rings(right, left, first[involved], last[involved], moved[involved])
    near = shapely.dwithin(rings[place[: len(one)]], rings[place[len(one) :]], SELF_CLEARANCE_MM)
    pairs = np.unique(np.column_stack((member[one[near]], member[other[near]])), axis=0)
    return pairs[:, 0], pairs[:, 1]


def _bounds(extreme: np.ufunc, course: Course, first: IntArray, last: IntArray) -> FloatArray:
    """Return the least or greatest coordinates between two rungs, (K, 2)."""
    right, left = course.strips.right, course.strips.left
    outer = np.append(extreme(right, left), right[-1:], axis=0)
    # Every other stretch is between one's end and the next one's beginning.
    bounds = np.column_stack((first, last + 1)).ravel()
    return np.asarray(extreme.reduceat(outer, bounds, axis=0)[::2])


def _blocks(offsets: IntArray, most_passes: int) -> tuple[IntArray, IntArray]:
    """Cut threads into blocks that overlap by half, so that each window lies within one.

    Returns
    -------
    block, member : (K,) int arrays
        The number of each block, and one station of it.
    """
    count = np.diff(offsets)
    blocks = np.maximum(-(-count // most_passes) - 1, np.minimum(count, 1))
    thread = np.repeat(np.arange(len(count)), blocks)
    start = (np.arange(len(thread)) - offsets_of(blocks)[thread]) * most_passes
    size = np.minimum(2 * most_passes, count[thread] - start)
    block = np.repeat(np.arange(len(size)), size)
    within = np.arange(len(block)) - offsets_of(size)[block]
    return block, (offsets[:-1][thread] + start)[block] + within


def _rings(
    right: FloatArray, left: FloatArray, first: IntArray, last: IntArray, shift: FloatArray
) -> npt.NDArray[np.object_]:
    """Return the borders of stretches between two rungs, shifted."""
    count = last - first + 1
    number = np.repeat(np.arange(len(first)), 2 * count)
    within = np.arange(len(number)) - offsets_of(2 * count)[number]
    back = within >= count[number]
    rung = first[number] + np.where(back, 2 * count[number] - 1 - within, within)
    points = np.where(back[:, None], left[rung], right[rung]) + shift[number]
    return np.asarray(shapely.linearrings(points, indices=number))


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
#: How much sheet a nested piece takes: so much of its area and of its convex hull's.
_AREA_SHARE, _HULL_SHARE = 1.07, 0.31
#: A piece that passes fewer crossings is hardly held by the weave; avoided where possible.
FEWEST_PASSES = 3


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
    """Return the cost of every piece, (N, D), without its joints; infinite where it is none.

    It is the sheet that a piece takes, and something for its length, by the square of that: of ways
    to cut that waste as much, the even one is the cheapest.
    """
    windows = candidates.windows
    there = (windows.passes > 0) & (windows.length_mm <= longest_mm + 1e-9)
    cost = np.full(there.shape, np.inf)
    length = windows.length_mm[there]
    area, rim, hull, extent = (
        values[there]
        for values in (windows.area_mm2, windows.rim_mm, windows.hull_mm2, windows.extent_mm)
    )
    cost[there] = sheet_area(area, rim, hull, extent, bed)
    if len(length):
        cost[there] += _EVEN_SHARE * joint_price(candidates) * (length / length.max()) ** 2
    cost[there & (windows.passes < FEWEST_PASSES)] += AVOIDED_MM2
    # Congruent pieces cost the same in spite of rounding, so ties fall the same way everywhere.
    cost = np.round(cost, 3)
    cost[~candidates.fresh()] = np.inf
    return cost


def sheet_area(
    area_mm2: FloatArray, rim_mm: FloatArray, hull_mm2: FloatArray, extent_mm: FloatArray, bed: Bed
) -> FloatArray:
    """Return the predicted area of sheet that nested pieces take, in square millimetres.

    Parameters
    ----------
    area_mm2, rim_mm, hull_mm2, extent_mm : float arrays
        Area and length of the outlines, area of their convex hulls, and how far apart two of their
        points are at most.
    bed : Bed

    Examples
    --------
    >>> bar = np.array([1000.0]), np.array([220.0]), np.array([1000.0]), np.array([100.5])
    >>> sheet_area(*bar, Bed(lambda outline: True, gap_mm=2.0)).round(3).tolist()
    [1683.6]
    """
    inflated = rim_mm * (bed.gap_mm / 2)
    taken = _AREA_SHARE * (area_mm2 + inflated) + _HULL_SHARE * (hull_mm2 + inflated)
    return np.where(extent_mm > bed.side_mm, np.maximum(taken, bed.askew_mm2), taken)
