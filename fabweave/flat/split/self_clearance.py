"""Find out how far a strip can go on before it comes too near to itself.

A stretch that contains one which overlaps itself overlaps itself, too. So it is enough to know
for each station the last station before it from which on the stretch closes a loop.
"""

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, offsets_of
from fabweave.flat.outline import strip_outlines
from fabweave.flat.split.candidates import Course, Sites
from fabweave.flat.split.runs import Runs
from fabweave.flat.unfold.development import Strips

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
