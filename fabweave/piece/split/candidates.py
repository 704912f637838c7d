"""Gather the pieces that a thread could be cut into, measured by array code, with their prices.

A candidate is a stretch of a thread between two of its sites. Every thread is unfolded once, rings
for two laps. Unfolding is rigid, so the stretch between two sites of a whole strip is congruent to
the piece that would be cut there. Lengths and areas are differences of running sums, convex hulls
come from running extremes in a fan of directions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    frozen_value,
    offsets_of,
    places_in_groups,
)
from fabweave.piece.development import Runs, Strips, run_rungs, unfold
from fabweave.piece.outline import strip_outlines
from fabweave.piece.split.preferences import AVOIDED_MM2, SheetsNeeded
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave


@frozen_value
class Sites:
    """Where each thread may be cut, in compressed rows, in walking order.

    A ring may be cut at any of its sites. An open thread has its first and its last pass as its
    outer sites: there it ends, whether it is cut or not.

    Parameters
    ----------
    offsets : (T + 1,) int array
        Thread ``t`` owns the sites ``offsets[t]:offsets[t + 1]``; none if it has no crossing.
    position : (N,) int array
        The pass of each site, counted from the start of its thread.
    crossing : (N,) int array
        The crossing of each site.
    closed : (T,) bool array
        Whether the thread is a ring.
    lengths : (T,) int array
        Number of passes of each thread.
    """

    offsets: IntArray
    position: IntArray
    crossing: IntArray
    closed: BoolArray
    lengths: IntArray

    @property
    def thread(self) -> IntArray:
        """The thread of each site, (N,)."""
        return np.repeat(np.arange(len(self.closed)), np.diff(self.offsets))

    @property
    def outer(self) -> BoolArray:
        """Whether each site is the end of an open thread and so carries no joint, (N,)."""
        thread = self.thread
        end = (self.position == 0) | (self.position == self.lengths[thread] - 1)
        return np.asarray(end & ~self.closed[thread])

    @property
    def steps(self) -> IntArray:
        """How many passes on the next site of the thread is, (N,); 0 at the end of an open one."""
        filled = np.flatnonzero(np.diff(self.offsets))
        final = self.offsets[filled + 1] - 1
        steps = np.diff(self.position, append=0)
        back = self.position[self.offsets[filled]] + self.lengths[filled] - self.position[final]
        steps[final] = np.where(self.closed[filled], back, 0)
        return steps

    def of(self, threads: IntArray) -> "Sites":
        """Return the sites of some threads only; the others keep none."""
        chosen = np.zeros(len(self.closed), dtype=bool)
        chosen[threads] = True
        keep = chosen[self.thread]
        return Sites(
            offsets=offsets_of(np.where(chosen, np.diff(self.offsets), 0)),
            position=self.position[keep],
            crossing=self.crossing[keep],
            closed=self.closed,
            lengths=self.lengths,
        )


def list_sites(weave: Weave) -> Sites:
    """List where threads go under, and the ends of open threads.

    A ring that never goes under may be cut anywhere.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import tetrahedron
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(tetrahedron())))
    >>> sites = list_sites(weave)
    >>> np.diff(sites.offsets).tolist(), sites.position.tolist()
    ([2, 2, 2], [1, 3, 1, 3, 1, 3])
    """
    threads = weave.threads
    thread, lengths = threads.thread_of_pass, threads.lengths
    position = np.arange(len(thread)) - threads.offsets[thread]
    under = np.bincount(thread[~weave.over], minlength=threads.n_threads)
    chosen = ~weave.over | (threads.closed & (under == 0))[thread]
    ends = (position == 0) | (position == lengths[thread] - 1)
    chosen = np.flatnonzero(chosen | (ends & ~threads.closed[thread]))
    return Sites(
        offsets=offsets_of(np.bincount(thread[chosen], minlength=threads.n_threads)),
        position=position[chosen],
        crossing=threads.crossing[chosen],
        closed=threads.closed,
        lengths=lengths,
    )


#: Directions in which hulls are sampled; every vertex of a hull that is extreme in one is found.
_DIRECTIONS = 48
#: Hulls of so many windows are worked on at a time.
_BATCH = 20_000


@frozen_value
class WholeStrips:
    """Whole strips, unfolded once, with the passes along them; a ring for up to two laps.

    Parameters
    ----------
    strips : Strips
        One for each thread.
    offsets : (T + 1,) int array
        Thread ``t`` has the stations ``offsets[t]:offsets[t + 1]``, one for each of its passes and
        again for those of the second lap.
    begin, end : (M,) int arrays
        The rungs of the strips where a piece begins that has its first station here, and where one
        ends that has its last station here.
    """

    strips: Strips
    offsets: IntArray
    begin: IntArray
    end: IntArray

    def carried(self, behind: IntArray) -> IntArray:
        """Return for each station the greatest of some numbers up to it on its thread, or -1."""
        most = np.maximum.accumulate(behind)
        start = np.repeat(self.offsets[:-1], np.diff(self.offsets))
        # What lies before the thread's own first station comes from the thread before.
        return np.where(most < start, -1, most)

    def stretches(self, first: IntArray, last: IntArray) -> Strips:
        """Return the pieces from station to station, cut out of the whole strips."""
        begin, end = self.begin[first], self.end[last]
        offsets = offsets_of(end - begin + 1)
        rung = np.arange(offsets[-1]) - np.repeat(offsets[:-1] - begin, np.diff(offsets))
        strips = self.strips
        return Strips(offsets, strips.rung[rung], strips.right[rung], strips.left[rung])


@frozen_value
class Windows:
    """All stretches between two sites that could become a piece: row by first, column by last.

    Column ``d`` of row ``i`` is the stretch from site ``i`` to site ``i + 1 + d`` of its thread,
    counted around a ring. Where there is none, lengths are infinite.

    Parameters
    ----------
    passes : (N, D) int array
        Number of stations; 0 where there is no stretch.
    length_mm : (N, D) float array
        Length along the middle.
    area_mm2 : (N, D) float array
        Area of the outline.
    rim_mm : (N, D) float array
        Length of the outline.
    hull_mm2 : (N, D) float array
        Area of the convex hull.
    extent_mm : (N, D) float array
        How far apart two of its points are at most.
    room_mm : (N, D) float array
        Least distance that is left in the best sheet at the best of all whole degrees, infinite
        where there is plenty, negative if it does not fit.
    """

    passes: IntArray
    length_mm: FloatArray
    area_mm2: FloatArray
    rim_mm: FloatArray
    hull_mm2: FloatArray
    extent_mm: FloatArray
    room_mm: FloatArray


def lay_course(ribbons: Ribbons, most_passes: int) -> WholeStrips:
    """Unfold every thread once, and rings so far into a second lap that no window is cut short.

    Parameters
    ----------
    ribbons : Ribbons
    most_passes : int
        No window has more stations than this.
    """
    count = np.diff(ribbons.pass_offsets)
    more = np.where(ribbons.closed, np.minimum(count, most_passes), 0)
    stations = offsets_of(count + more)
    thread = np.repeat(np.arange(len(count)), np.diff(stations))
    position = np.arange(stations[-1]) - stations[thread]
    size = np.diff(ribbons.offsets)
    final = local_entry(ribbons, thread, position)
    last = np.full(len(count), -1)
    last[thread] = final + 1  # the last assignment of each thread stays
    last = np.where(ribbons.closed | (count == 0), last, size - 1)
    offsets, rung = run_rungs(ribbons, np.arange(len(count)), np.zeros_like(last), last)
    strips = unfold(ribbons, offsets, rung)
    begin = offsets[thread] + final
    end = begin + 1
    filled = np.flatnonzero((count > 0) & ~ribbons.closed)
    begin[stations[filled]] = offsets[filled]
    end[stations[filled + 1] - 1] = offsets[filled + 1] - 1
    return WholeStrips(strips, stations, begin, end)


def station_of_site(course: WholeStrips, sites: Sites) -> IntArray:
    """Return the station of each site on the first lap, (N,)."""
    return np.asarray(course.offsets[:-1][sites.thread] + sites.position)


def measure_windows(
    course: WholeStrips,
    sites: Sites,
    *,
    most_passes: int,
    longest_mm: float,
    usable: Sequence[tuple[float, float]] = (),
    whole: bool = False,
) -> Windows:
    """Measure every stretch between two sites of one thread.

    Parameters
    ----------
    course : WholeStrips
        The unfolded threads, laid for at least as many passes.
    sites : Sites
        Where pieces may begin and end.
    most_passes : int
        Windows have at most so many stations.
    longest_mm : float
        Windows are at most so long along their middle.
    usable : sequence of (float, float)
        What the margin leaves of each sheet; none for sheets without bounds.
    whole : bool
        Whether a ring may be one piece though it can be cut in two.
    """
    thread = sites.thread
    at = station_of_site(course, sites)
    first, last, ahead = _pairs(sites, at, most_passes, whole)
    strips = course.strips
    middle = (strips.right + strips.left) / 2
    along = _running_length(middle)
    length = along[course.end[last]] - along[course.begin[first]]
    keep = length <= longest_mm + 1e-9
    first, last, ahead, length = first[keep], last[keep], ahead[keep], length[keep]
    begin, end = course.begin[first], course.end[last]
    right, left = _running_length(strips.right), _running_length(strips.left)
    breadth = np.hypot(*(strips.left - strips.right).T)
    area = _running_area(strips)
    hull, extent, room = _hulls(course, first, last, usable)

    row = np.full(len(course.begin), -1)
    row[at] = np.arange(len(at))
    row = row[first]
    shape = (len(thread), int(ahead.max(initial=0)))

    def table(values: FloatArray | IntArray, empty: float) -> FloatArray:
        result = np.full(shape, empty)
        result[row, ahead - 1] = values
        return result

    rim = right[end] - right[begin] + left[end] - left[begin] + breadth[begin] + breadth[end]
    return Windows(
        passes=table(last - first + 1, 0).astype(np.int64),
        length_mm=table(length, np.inf),
        area_mm2=table(area[end] - area[begin], np.inf),
        rim_mm=table(rim, np.inf),
        hull_mm2=table(hull, np.inf),
        extent_mm=table(extent, np.inf),
        room_mm=table(room, -np.inf),
    )


def _pairs(
    sites: Sites, at: IntArray, most_passes: int, whole: bool
) -> tuple[IntArray, IntArray, IntArray]:
    """Return first and last station of every window, and how many sites it goes ahead."""
    count = np.diff(sites.offsets)
    thread = sites.thread
    place = np.arange(len(thread)) - sites.offsets[thread]
    ring = count if whole else np.maximum(count - 1, np.minimum(count, 1))
    most = np.where(sites.closed, ring, count - 1)
    windows = []
    for ahead in range(1, int(most.max(initial=0)) + 1):
        site = np.flatnonzero(
            (ahead <= most[thread]) & (sites.closed[thread] | (place + ahead < count[thread]))
        )
        around, target = np.divmod(place[site] + ahead, count[thread[site]])
        target = sites.offsets[thread[site]] + target
        step = at[target] + around * sites.lengths[thread[site]] - at[site]
        short = step < most_passes
        if not short.any():
            break
        site, step = site[short], step[short]
        windows.append((at[site], at[site] + step, np.full(len(site), ahead)))
    if not windows:
        none = np.zeros(0, dtype=np.int64)
        return none, none, none
    first, last, far = (np.concatenate(parts) for parts in zip(*windows, strict=True))
    return first, last, far


def _running_length(points: FloatArray) -> FloatArray:
    """Return the length of a polyline up to each of its points."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.concatenate((np.zeros(min(len(points), 1)), np.cumsum(steps)))


def _running_area(strips: Strips) -> FloatArray:
    """Return the area of the quads before each rung; quads between two strips do not count."""
    a, b = strips.right[:-1], strips.right[1:]
    c, d = strips.left[1:], strips.left[:-1]
    diagonal, other = c - a, d - b
    quads = (diagonal[:, 0] * other[:, 1] - diagonal[:, 1] * other[:, 0]) / 2
    return np.concatenate((np.zeros(min(len(strips.rung), 1)), np.cumsum(quads)))


def _hulls(
    course: WholeStrips, first: IntArray, last: IntArray, usable: Sequence[tuple[float, float]]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the hull's area, the extent, and the room on the best sheet of each window."""
    hull, extent, room = np.zeros(len(first)), np.zeros(len(first)), np.full(len(first), np.inf)
    if not len(first):
        return hull, extent, room
    points = np.concatenate((course.strips.right, course.strips.left)) @ np.array([1.0, 1.0j])
    chunk, tip = _extremes(course, points)
    starts, row = np.unique(first, return_inverse=True)
    step = last - first
    by_step = np.argsort(step, kind="stable")
    for low in range(0, len(starts), _BATCH):
        mine = by_step[(row[by_step] >= low) & (row[by_step] < low + _BATCH)]
        bounds = np.searchsorted(step[mine], np.arange(1, int(step[mine[-1]]) + 2))
        at = starts[low : low + _BATCH]
        held = chunk.rows(at)
        for own in np.split(mine, bounds)[1:-1]:
            if len(own):
                outermost = held.rows(row[own] - low)
                outermost.widen(tip.rows(last[own]))
                hull[own], extent[own], room[own] = _hull_facts(
                    points[outermost.point], outermost.reach, usable
                )
            at = np.minimum(at + 1, len(chunk.reach) - 1)
            held.widen(chunk.rows(at))
    return hull, extent, room


@dataclass(eq=False)
class _Extremes:
    """The outermost point of some things in each direction of a fan, and how far out it lies."""

    reach: FloatArray
    point: IntArray

    def rows(self, index: IntArray) -> "_Extremes":
        """Return a copy of some rows."""
        return _Extremes(self.reach[index], self.point[index])

    def widen(self, other: "_Extremes") -> None:
        """Take the outer one of two points everywhere."""
        np.copyto(self.point, other.point, where=other.reach > self.reach)
        np.maximum(self.reach, other.reach, out=self.reach)


def _extremes(course: WholeStrips, points: ComplexArray) -> tuple[_Extremes, _Extremes]:
    """Return the outermost points of short stretches.

    Returns
    -------
    chunk : _Extremes
        From where a piece would begin at a station to where one would begin at the next.
    tip : _Extremes
        From where a piece would begin at a station to where one would end there.
    """
    rungs = len(points) // 2
    shape = (len(course.begin), _DIRECTIONS)
    chunk = _Extremes(np.empty(shape), np.empty(shape, dtype=np.int64))
    tip = _Extremes(np.empty(shape), np.empty(shape, dtype=np.int64))
    skipped = int(course.begin[0])
    chunks = course.begin - skipped
    number = np.repeat(np.arange(len(chunks)), np.diff(np.append(course.begin, rungs)))
    for k, way in enumerate(_fan()):
        reach = (points * way.conj()).real
        outer = np.where(reach[:rungs] >= reach[rungs:], 0, rungs) + np.arange(rungs)
        reach = reach[outer]
        chunk.reach[:, k] = np.maximum.reduceat(reach[skipped:], chunks)
        outermost = reach[skipped:] == chunk.reach[number, k]
        there = np.where(outermost, np.arange(skipped, rungs), rungs)
        chunk.point[:, k] = outer[np.minimum.reduceat(there, chunks)]
        rung = course.begin
        for other in (course.begin + 1, course.end):
            rung = np.where(reach[other] > reach[rung], other, rung)
        tip.reach[:, k], tip.point[:, k] = reach[rung], outer[rung]
    return chunk, tip


def _fan() -> ComplexArray:
    """Return the directions in which hulls are sampled."""
    return np.exp(2j * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS)


def _hull_facts(
    hull: ComplexArray, reach: FloatArray, usable: Sequence[tuple[float, float]]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the area, the extent, and the room on the best sheet of hulls (N, K)."""
    hull = hull - hull[:, :1]  # areas of hulls far away would be rounded
    area = np.einsum("nk,nk->n", hull[:, :-1].conj(), hull[:, 1:]).imag / 2
    room = np.full(len(hull), np.inf)
    half = _DIRECTIONS // 2
    across = reach[:, :half] + reach[:, half:]
    if usable:
        wide, high = across[:, 0], across[:, half // 2]
        tight = np.flatnonzero(np.hypot(wide, high) > max(min(sheet) for sheet in usable))
        for low in range(0, len(tight), 300):
            block = tight[low : low + 300]
            room[block] = _best_room(hull[block], usable)
    return area, across.max(axis=1), room


def _best_room(hull: ComplexArray, usable: Sequence[tuple[float, float]]) -> FloatArray:
    """Return the room at the best of all whole degrees."""
    angle = np.deg2rad(np.arange(180.0))
    turned = np.stack((hull.real, hull.imag), axis=2) @ [np.cos(angle), np.sin(angle)]
    across = np.ptp(turned, axis=1)
    high = np.roll(across, -90, axis=1)
    rooms = [np.minimum(w - across, h - high).max(axis=1) for w, h in usable]
    return np.asarray(np.max(rooms, axis=0))


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


def last_clear(course: WholeStrips, most_passes: int) -> IntArray:
    """Return for each station the one behind which a piece must begin that ends here, or later.

    Parameters
    ----------
    course : WholeStrips
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
    while len(late):
        fresh = np.ones(len(late), dtype=bool)
        fresh[1:] = late[1:] != late[:-1]
        a, b = early[fresh], late[fresh]
        looped = ~keeps_clear(course.stretches(a, b))
        behind[b[looped]] = a[looped]
        behind = course.carried(behind)
        left = ~fresh & (early > behind[late])
        early, late = early[left], late[left]
    return behind


def also_barred(course: WholeStrips, sites: Sites, behind: IntArray, barred: Runs) -> IntArray:
    """Return what :func:`last_clear` does where no piece may carry some other stretches, either.

    Parameters
    ----------
    course : WholeStrips
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
    for thread, first, last in barred.rows:
        # A ring's stations come again on its second lap.
        lap, start = int(sites.lengths[thread]), int(course.offsets[thread])
        for again in range(2 if sites.closed[thread] else 1):
            low = first % lap + again * lap
            high = low + last - first
            if high < count[thread]:
                behind[start + high] = max(behind[start + high], start + low)
    return course.carried(behind)


def _near_pairs(course: WholeStrips, most_passes: int) -> tuple[IntArray, IntArray]:
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
    box, other = shapely.STRtree(boxes).query(boxes)
    # Neighbours touch always; only what is further apart along the strand is looked at closely.
    apart = member[other] - member[box]
    far = (apart > 1) & (apart < most_passes)
    box, other = box[far], other[far]
    involved, place = np.unique(np.concatenate((box, other)), return_inverse=True)
    rings = _rings(right, left, first[involved], last[involved], moved[involved])
    close = shapely.dwithin(rings[place[: len(box)]], rings[place[len(box) :]], SELF_CLEARANCE_MM)
    pairs = np.unique(np.column_stack((member[box[close]], member[other[close]])), axis=0)
    return pairs[:, 0], pairs[:, 1]


def _bounds(extreme: np.ufunc, course: WholeStrips, first: IntArray, last: IntArray) -> FloatArray:
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
    start = places_in_groups(blocks) * most_passes
    size = np.minimum(2 * most_passes, count[thread] - start)
    block = np.repeat(np.arange(len(size)), size)
    return block, (offsets[:-1][thread] + start)[block] + places_in_groups(size)


def _rings(
    right: FloatArray, left: FloatArray, first: IntArray, last: IntArray, shift: FloatArray
) -> npt.NDArray[np.object_]:
    """Return the borders of stretches between two rungs, shifted."""
    count = last - first + 1
    number = np.repeat(np.arange(len(first)), 2 * count)
    within = places_in_groups(2 * count)
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
#: So full rows of straight strips are, but for the height of sheets that is left.
_FULL_ROWS = 0.95
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
    straight : bool
        Whether pieces are straight strips of one width, which lie in rows.
    """

    fits: Callable[[FloatArray], bool]
    usable: tuple[tuple[float, float], ...] = ()
    gap_mm: float = 0.0
    free_mm: tuple[float, float] | None = None
    packed: Callable[[Sequence[FloatArray], IntArray], SheetsNeeded | None] | None = None
    straight: bool = False

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
    course : WholeStrips
        The unfolded threads.
    windows : Windows
        The pieces from site to site.
    clear : (N, D) bool array
        Which of them keep clear of themselves.
    barred : Runs or None
        Stretches that no piece may carry all of, whatever these ribbons show.
    whole : bool
        Whether a ring may be one piece though it can be cut in two.
    """

    ribbons: Ribbons
    sites: Sites
    course: WholeStrips
    windows: Windows
    clear: BoolArray
    barred: Runs | None = None
    whole: bool = False

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
    whole: bool = False,
) -> Candidates:
    """Measure all pieces that some threads could be cut into.

    No piece may carry all of a stretch that is barred. A ring is one piece only if that is asked
    for, or it can be cut at one place only.
    """
    sites = list_sites(weave).of(threads)
    course = lay_course(ribbons, most_passes)
    windows = measure_windows(
        course,
        sites,
        most_passes=most_passes,
        longest_mm=longest_mm,
        usable=bed.usable,
        whole=whole,
    )
    behind = last_clear(course, int(windows.passes.max(initial=1)))
    if barred is not None:
        behind = also_barred(course, sites, behind, barred)
    at = station_of_site(course, sites)[:, None]
    there = windows.passes > 0
    last = np.where(there, at + windows.passes - 1, at)
    return Candidates(ribbons, sites, course, windows, there & (at > behind[last]), barred, whole)


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
    if bed.straight:
        taken = (area_mm2 + inflated) / _FULL_ROWS
    return np.where(extent_mm > bed.side_mm, np.maximum(taken, bed.askew_mm2), taken)
