"""Choose where to cut long strips into pieces: at the least cost, exactly for each thread.

Every thread is unfolded once, and everything that it could be cut into is measured
(``candidates``), priced (``cost``) and chosen from (``shortest_path``). Joints of different threads
should not lie side by side, which couples the threads: they are cut one after another, each knowing
where those before it have their joints, and then each once more, knowing all others. So each thread
is cut at the least cost for the joints of the others, which is the optimum of that thread and not
of all.
"""

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree, few_of
from fabweave.piece.development import Runs, Strips, unfold_runs
from fabweave.piece.outline import resting_frame, simple, strip_outlines
from fabweave.piece.split.candidates import (
    MOST_PASSES,
    SELF_CLEARANCE_MM,
    Bed,
    Candidates,
    Sites,
    joint_price,
    keeps_clear,
    last_clear,
    lay_course,
    list_candidates,
    price_candidates,
    station_of_site,
)
from fabweave.piece.split.repeats import KindPrices, Repeats
from fabweave.piece.split.row_filling import Rests, Worth, climb
from fabweave.piece.split.shortest_path import Joints, Orbit, Solve, list_orbits
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave


@frozen_value
class SelfCrossing:
    """Stretches of threads that cross themselves when they are unfolded.

    Parameters
    ----------
    loops : Runs
        Those that are apart when the thread is cut at one of the crossings within: no piece may
        carry such a stretch.
    kinks : Runs
        Those that no cut mends, as the thread nowhere goes under within. Only a narrower ribbon
        may.
    """

    loops: Runs
    kinks: Runs

    def __bool__(self) -> bool:
        return bool(len(self.loops.thread) or len(self.kinks.thread))


def find_self_crossing(
    ribbons: Ribbons, weave: Weave, runs: Runs, outlines: Sequence[FloatArray]
) -> SelfCrossing:
    """Find what makes pieces cross themselves.

    Where any piece of a thread does, whatever else in that thread would not keep clear of itself
    in one piece is found, too: so that other cuts do not lead to the next such piece.

    Parameters
    ----------
    ribbons, weave
        The ribbons as they are cut, and who goes under where.
    runs : Runs
        Which passes each piece carries.
    outlines : sequence of (K, 2) float arrays
        The pieces as they are cut.
    """
    crossed = np.flatnonzero(~simple(outlines))
    if not len(crossed):
        return SelfCrossing(some_runs(runs, crossed), some_runs(runs, crossed))
    shortest = Runs.of([_shortest(ribbons, *run) for run in some_runs(runs, crossed).rows])
    inside = np.array([_goes_under(weave, *stretch) for stretch in shortest.rows])
    loops = joined_runs(some_runs(shortest, inside), _loops(ribbons, np.unique(shortest.thread)))
    return SelfCrossing(loops, some_runs(shortest, ~inside))


def joined_runs(*parts: Runs) -> Runs:
    """Return runs one after another, each once."""
    return Runs.of(sorted({row for part in parts for row in part.rows}))


def some_runs(runs: Runs, chosen: IntArray | BoolArray) -> Runs:
    """Return some of the runs."""
    return Runs(runs.thread[chosen], runs.first[chosen], runs.last[chosen])


def _shortest(ribbons: Ribbons, thread: int, first: int, last: int) -> tuple[int, int, int]:
    """Return of a run the shortest stretch that crosses itself, the first to be closed."""

    def crosses(low: int, high: int) -> bool:
        run = Runs.of([(thread, low, high)])
        return not simple(strip_outlines(unfold_runs(ribbons, run)))[0]

    if not crosses(first, last):
        return thread, first, last
    # What contains a stretch that crosses itself does so, too.
    ends = range(first, last)
    high = first + bisect_left(ends, True, key=lambda end: crosses(first, end))
    starts = range(high, first, -1)
    return thread, high - bisect_left(starts, True, key=lambda low: crosses(low, high)), high


def _goes_under(weave: Weave, thread: int, first: int, last: int) -> bool:
    """Say whether a thread goes under strictly between two of its passes."""
    count = int(weave.threads.lengths[thread])
    within = weave.threads.offsets[thread] + np.arange(first + 1, last) % count
    return not weave.over[within].all()


def _loops(ribbons: Ribbons, threads: IntArray) -> Runs:
    """Return the stretches of some threads that come too near to themselves."""
    course = lay_course(ribbons, MOST_PASSES)
    behind = last_clear(course, MOST_PASSES)
    before = np.append(-1, behind[:-1])
    before[course.offsets[:-1][np.diff(course.offsets) > 0]] = -1
    rows = []
    for thread in threads.tolist():
        start = int(course.offsets[thread])
        own = start + np.flatnonzero((behind > before)[start : int(course.offsets[thread + 1])])
        rows += [(thread, int(behind[at]) - start, at - start) for at in own.tolist()]
    return Runs.of(rows)


#: So many stretches are named.
_NAMED = 4
#: What makes strips that come back to themselves keep clear.
_APART = "a smaller --width, a smoother mesh (--fair)"


def splitting_refusal(
    candidates: Candidates,
    bed: Bed,
    threads: Sequence[int],
    labels: Sequence[str],
    longest_mm: float,
) -> str:
    """Return a message that says why some threads cannot be cut into pieces.

    Parameters
    ----------
    candidates : Candidates
        The pieces to choose from, no longer than ``longest_mm``.
    bed : Bed
        What pieces must fit on.
    threads : sequence of int
        Threads that cannot be cut.
    labels : sequence of str
        Names of all threads.
    longest_mm : float
        No piece may be longer along its middle.
    """
    said: list[str] = []
    remedies: dict[str, None] = {}
    for thread in threads:
        for first, last, strip, clear in _stretches(candidates, thread):
            causes = dict(_causes(strip, bed, longest_mm, clear=clear))
            if causes:
                what = ", ".join(causes)
                said.append(f"{labels[thread]} between its crossings {first} and {last} ({what})")
            remedies.update(dict.fromkeys(causes.values()))
    return (
        agree(len(said), "{n} stretch[|es] of thread [has|have] ")
        + f"no crossing for a joint, and can be no piece: {few_of(said, _NAMED)}. "
        + f"What would help: {', '.join(remedies)} or a finer mesh (--refine)"
    )


def _stretches(candidates: Candidates, thread: int) -> list[tuple[int, int, Strips, bool]]:
    """Return the stretches of a thread between neighbouring sites, the shortest pieces there are.

    Returns
    -------
    list of (int, int, Strips, bool)
        Its first and last pass, its strip, and whether a piece may carry it so far as it keeps
        clear of itself.
    """
    sites, course = candidates.sites, candidates.course
    rows = slice(sites.offsets[thread], sites.offsets[thread + 1])
    begin, start = sites.position[rows], station_of_site(course, sites)[rows]
    steps = sites.steps[rows]
    if not sites.closed[thread] and len(steps) > 1:
        begin, start, steps = begin[:-1], start[:-1], steps[:-1]
    measured = candidates.windows.passes.shape[1] > 0
    clear = candidates.clear[rows, 0] if measured else np.ones(len(start), dtype=bool)
    lap = int(sites.lengths[thread])
    return [
        (first, (first + step) % lap, course.stretches(*np.array([[at], [at + step]])), free)
        for first, step, at, free in zip(
            begin.tolist(), steps.tolist(), start.tolist(), clear.tolist(), strict=False
        )
    ]


def _causes(
    strip: Strips, bed: Bed, longest_mm: float, *, clear: bool
) -> Iterator[tuple[str, str]]:
    """Yield why a strip can be no piece, and what would help; nothing if it can."""
    middle = (strip.right + strip.left) / 2
    length = float(np.hypot(*np.diff(middle, axis=0).T).sum())
    if length > longest_mm:
        yield f"{length:.1f} mm long, and {longest_mm:g} mm is the most", "a longer --max-length"
    outline = strip_outlines(strip)[0]
    if not keeps_clear(strip)[0]:
        yield f"nearer than {SELF_CLEARANCE_MM:g} mm to itself when unfolded", _APART
    elif not bed.fits(outline):
        size = np.ptp(resting_frame(outline, middle[0], middle[-1]).apply(outline), axis=0)
        free = np.sort(bed.free_mm or (0.0, 0.0))
        turned = "--rotations free, " if np.all(np.sort(size) <= free) else ""
        larger = f"a --sheet with more than {free[1]:.1f} × {free[0]:.1f} mm free"
        yield f"{size.max():.1f} × {size.min():.1f} mm", f"{turned}{larger}, a smaller --size"
    elif length <= longest_mm and not clear:
        yield "crossing itself as it is cut, laps and all", _APART


#: A joint beside another strand's joint costs more by this share of a joint.
_NEAR_SHARE = 0.25
#: Where another kind of joint would come of that, by so much.
_LOST_SHARE = 4.0
#: Rows of straight strips are filled in so many rounds through all threads.
_SWEEPS = 3
#: So many pieces are dealt to rows for that at most, again and again: what takes some ten seconds.
_MOST_DEALT = 400_000


def choose_runs(
    candidates: Candidates,
    weave: Weave,
    bed: Bed,
    labels: tuple[str, ...],
    length_mm: float,
    max_length_mm: float,
    room: BoolArray | None,
    threads: IntArray | None = None,
    *,
    repeats: Repeats | None = None,
    kind_price: float = 0.0,
    likes: IntArray | None = None,
    around: IntArray | None = None,
    rests: Rests | None = None,
) -> Runs:
    """Cut every thread at crossings where it goes under, at the least cost.

    The cost is the predicted area of sheet, a price for every joint, and a little for unevenness
    and for joints beside one another. A closed thread is always opened; where it goes under twice,
    into two pieces at least, if candidates are not whole rings, too. Pieces of fewer than three
    crossings, joints without room and two joints at one crossing are avoided where that is possible
    at all.

    Parameters
    ----------
    candidates : Candidates
        The pieces to choose from. Those that are longer than ``length_mm`` serve the threads that
        cannot be cut so short.
    weave : Weave
    bed : Bed
        What pieces must fit on.
    labels : tuple of str
        Names of the threads, for messages.
    length_mm : float
        Pieces are no longer than this, measured along their unfolded middle, laps included, but
        for threads that cannot be cut so short.
    max_length_mm : float
        No piece is longer than this in any case.
    room : (X,) bool array, optional
        Which crossings have room for a joint's fasteners; by default all.
    threads : (K,) int array, optional
        The threads that are cut; by default all.
    repeats : Repeats, optional
        Which stretches repeat others: threads that do are cut alike. By default each is cut by
        itself.
    kind_price : float
        What a kind of piece costs more, in joints.
    likes : (N, D) int array, optional
        The kind of each candidate, as of :func:`window_kinds`, where threads are cut so that pieces
        repeat although no rotation carries them onto one another.
    rests : callable, optional
        What area of rows straight strips waste: cuts are then changed while they waste less for
        what that costs.

    around : (X, N) int array, optional
        Beside a joint at each crossing, one at these is made otherwise than asked; by default,
        joints are only kept some crossings apart.

    Raises
    ------
    CannotMakeError
        If a stretch without any crossing to join at is still too long, too large or too curled.
    """
    near = _NEAR_SHARE if around is None else _LOST_SHARE
    joints = Joints(weave.threads, near * joint_price(candidates), room, around)
    if threads is None:
        threads = np.flatnonzero(np.diff(candidates.sites.offsets))
    price_mm2 = kind_price * joint_price(candidates)
    priced = None if likes is None else KindPrices(likes, price_mm2)
    shorter = min(length_mm, max_length_mm)
    # Cut by itself, a thread has no kinds.
    kind_mm2 = 0.0 if repeats is None else price_mm2
    cutter = _Cutter(candidates, bed, joints, kind_mm2, priced, shorter)
    cuts = cutter.cut(threads, repeats)
    if rests is not None:
        cutter.fill_rows(cuts, threads, repeats, rests)
    lost = _lost(cuts)
    if len(lost) and length_mm < max_length_mm:
        longer = _Cutter(candidates, bed, joints, price_mm2, priced, max_length_mm)
        cuts |= longer.cut(lost, repeats)
        lost = _lost(cuts)
    if len(lost):
        # What contains a stretch that can be no piece cannot be one, either: where there is any
        # way to cut a thread, cutting it at all its sites is one.
        most = max(MOST_PASSES, int(candidates.sites.steps.max()) + 1)
        wider = list_candidates(
            candidates.ribbons,
            weave,
            bed,
            max_length_mm,
            lost,
            most,
            candidates.barred,
            candidates.whole,
        )
        cuts |= _Cutter(wider, bed, joints, price_mm2, None, max_length_mm).cut(lost, repeats)
        stuck = _lost(cuts).tolist()
        if stuck:
            raise CannotMakeError(splitting_refusal(wider, bed, stuck, labels, max_length_mm))
    return _runs_of_cuts(
        {thread: cut for thread, cut in cuts.items() if cut is not None}, candidates.sites
    )


def _lost(cuts: Mapping[int, IntArray | None]) -> IntArray:
    """Return the threads that could not be cut."""
    return np.array([thread for thread, cut in cuts.items() if cut is None], dtype=np.int64)


class _Cutter:
    """Cuts threads one after another, each at the least cost beside the joints that there are."""

    def __init__(
        self,
        candidates: Candidates,
        bed: Bed,
        joints: Joints,
        kind_mm2: float,
        likes: KindPrices | None,
        longest_mm: float,
    ) -> None:
        self._all, self._bed, self._joints = candidates, bed, joints
        self._kind_mm2, self._likes = kind_mm2, likes
        self._outer, self._dealt = candidates.sites.outer, 0
        self._cost = price_candidates(candidates, bed, longest_mm)
        self._fitting = (candidates.windows.room_mm > candidates.slack) & bool(bed.usable)

    def cut(self, threads: IntArray, repeats: Repeats | None) -> dict[int, IntArray | None]:
        """Cut some threads; None for those that cannot be cut so short.

        Returns
        -------
        dict
            For each thread the sites, counted in it, at which its pieces begin.
        """
        cuts: dict[int, IntArray | None] = {}
        # In a second sweep, each is cut beside the joints of all others.
        for orbit in [*list_orbits(self._all.sites, threads, repeats)] * 2:
            self._take_away(orbit, cuts)
            self._put(orbit, self._cut_orbit(orbit, self._more(orbit)), cuts)
        return cuts

    def _rows(self, orbit: Orbit) -> IntArray:
        """Return the sites of all threads of an orbit, in the order of the first one's, (K, n)."""
        return np.asarray(self._all.sites.offsets[orbit.threads][:, None] + orbit.there)

    def _more(self, orbit: Orbit) -> FloatArray:
        """Return what candidates of an orbit's first thread cost more than their sheet, (n, D)."""
        rows, price = self._rows(orbit), joint_price(self._all)
        beside = orbit.beside(self._all.sites.crossing[rows], self._joints)
        joint = np.where(self._outer[rows[0]], 0.0, price + beside)
        # The site at which each candidate ends.
        count, width = rows.shape[1], self._cost.shape[1]
        target = np.arange(count)[:, None] + np.arange(1, width + 1)
        more = joint[target % count if orbit.closed else np.minimum(target, count - 1)]
        return more if self._likes is None else more + self._likes.costs(rows[0])

    def _take_away(self, orbit: Orbit, cuts: Mapping[int, IntArray | None]) -> None:
        """Take away the joints and pieces of an orbit, if there are any."""
        for thread in orbit.threads.tolist():
            earlier = cuts.get(thread)
            if earlier is not None:
                self._count(thread, earlier, -1)

    def _put(self, orbit: Orbit, cut: IntArray | None, cuts: dict[int, IntArray | None]) -> None:
        """Cut all threads of an orbit as the first one, where joints cost least."""
        sites = self._all.sites
        for number, thread in enumerate(orbit.threads.tolist()):
            cuts[thread] = None
            if cut is not None:
                ways = sites.offsets[thread] + orbit.ways(cut, number)
                costs = np.where(self._outer[ways], 0.0, self._joints.costs(sites.crossing[ways]))
                best = int(np.argmin(np.round(costs.sum(axis=1), 3)))
                cuts[thread] = chosen = ways[best] - sites.offsets[thread]
                self._count(thread, chosen, 1)

    def fill_rows(
        self,
        cuts: dict[int, IntArray | None],
        threads: IntArray,
        repeats: Repeats | None,
        rests: Rests,
    ) -> None:
        """Change cuts, orbit after orbit, while straight strips waste less of rows for the cost."""
        for orbit in [*list_orbits(self._all.sites, threads, repeats)] * _SWEEPS:
            cut, sites = cuts[int(orbit.threads[0])], orbit.there.shape[1]
            if cut is not None and sites > 1:
                self._take_away(orbit, cuts)
                worth = self._worth(orbit, cuts, rests)
                self._put(orbit, climb(cut, sites, worth, closed=orbit.closed), cuts)

    def _worth(self, orbit: Orbit, cuts: Mapping[int, IntArray | None], rests: Rests) -> Worth:
        """Return what tells the cost of cutting the threads of an orbit beside all others."""
        mates = orbit.threads.tolist()
        cost = self._cost[self._rows(orbit)[0]] + self._more(orbit)
        others = {
            thread: self._lengths(thread, cut)
            for thread, cut in cuts.items()
            if cut is not None and thread not in mates
        }

        def worth(cut: IntArray, limit: float) -> float:
            ahead = self._ahead(mates[0], cut)
            if ahead.max() >= cost.shape[1]:
                return np.inf
            own = len(mates) * float(cost[cut, ahead].sum()) + self._kind_mm2 * orbit.kinds(cut)
            if own >= limit or self._dealt > _MOST_DEALT or not self._all_fit(mates[0], cut):
                return np.inf
            lengths = others | dict.fromkeys(mates, self._lengths(mates[0], cut))
            self._dealt += sum(map(len, lengths.values()))
            return own + rests(lengths)

        return worth

    def _lengths(self, thread: int, cut: IntArray) -> FloatArray:
        """Return how long the pieces of a thread are."""
        row = self._all.sites.offsets[thread] + cut
        return np.asarray(self._all.windows.length_mm[row, self._ahead(thread, cut)])

    def _all_fit(self, thread: int, cut: IntArray) -> bool:
        """Say whether all pieces of a thread fit the stock; the cost of others becomes infinite."""
        row, ahead = self._all.sites.offsets[thread] + cut, self._ahead(thread, cut)
        doubtful = ~self._fitting[row, ahead]
        row, ahead = row[doubtful], ahead[doubtful]
        if not len(row):
            return True
        first = station_of_site(self._all.course, self._all.sites)[row]
        fit = self._fit(first, first + self._all.windows.passes[row, ahead] - 1)
        self._fitting[row[fit], ahead[fit]] = True
        self._cost[row[~fit], ahead[~fit]] = np.inf
        return bool(fit.all())

    def _count(self, thread: int, cut: IntArray, times: int) -> None:
        """Add the joints and the pieces of a thread to those that there are, or take them away."""
        sites = self._all.sites
        at = sites.offsets[thread] + cut
        self._joints.add(sites.crossing[at[~self._outer[at]]], times)
        if self._likes is not None:
            self._likes.add(at, self._ahead(thread, cut), times)

    def _ahead(self, thread: int, cut: IntArray) -> IntArray:
        """Return how many sites beyond the next one each piece of a thread ends."""
        sites = self._all.sites
        count = int(sites.offsets[thread + 1] - sites.offsets[thread])
        after = np.append(cut[1:], cut[0] + count if sites.closed[thread] else count - 1)
        return np.asarray(after - cut - 1)

    def _cut_orbit(self, orbit: Orbit, more: FloatArray) -> IntArray | None:
        """Cut the first thread of an orbit, so that few kinds come of it if a kind has a price.

        What candidates cost ``more`` than their sheet is known of the first thread only, (n, D).
        """
        best, chosen = np.inf, None
        for times, solve in orbit.plans():
            total, cut = self._cut_thread(int(orbit.threads[0]), more, solve, times)
            if cut is None:
                continue
            # Pieces of one kind cost the same, so a kind more or less is all that they differ by.
            total = len(orbit.threads) * times * total + self._kind_mm2 * orbit.kinds(cut)
            if total < best:
                best, chosen = total, cut
        return chosen

    def _cut_thread(
        self, thread: int, more: FloatArray, solve: Solve, times: int
    ) -> tuple[float, IntArray | None]:
        """Cut one thread; the costs of pieces that turn out not to fit become infinite.

        A ring is cut to so many equal repeats, ``times``.
        """
        sites, course = self._all.sites, self._all.course
        rows = slice(sites.offsets[thread], sites.offsets[thread + 1])
        count = len(self._cost[rows])
        if count == 1 and not sites.closed[thread]:
            station = np.array([course.offsets[thread]])
            fits = self._fit(station, station).all()
            return 0.0, np.zeros(1, dtype=np.int64) if fits else None
        block = count // times
        while True:
            cost = (self._cost[rows] + more).reshape(times, block, -1)
            # What fits not in one repeat is cut in none.
            total, cut = solve(np.where(np.isinf(cost).any(axis=0), np.inf, cost[0]))
            if not np.isfinite(total):
                return np.inf, None
            cut = (np.arange(times)[:, None] * block + cut).ravel()
            if self._all_fit(thread, cut):
                return total, cut

    def _fit(self, first: IntArray, last: IntArray) -> BoolArray:
        """Say which pieces from station to station fit the stock."""
        outlines = strip_outlines(self._all.course.stretches(first, last))
        return np.array([self._bed.fits(outline) for outline in outlines], dtype=bool)


def _runs_of_cuts(cuts: dict[int, IntArray], sites: Sites) -> Runs:
    """Turn the sites where pieces begin into runs of passes."""
    rows: list[tuple[int, int, int]] = []
    for number in sorted(cuts):
        count = int(sites.lengths[number])
        begins = sites.position[sites.offsets[number] + cuts[number]].tolist()
        end = begins[0] + count if sites.closed[number] else count - 1
        rows += [(number, first, last) for first, last in pairwise([*begins, end])]
    return Runs.of(rows)
