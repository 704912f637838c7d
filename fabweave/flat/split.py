"""Choose where to cut long strips into pieces."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.arrays import BoolArray, FloatArray, IntArray, frozen
from fabweave.errors import CannotMakeError
from fabweave.flat.outline import strip_outlines
from fabweave.flat.unfold import Strips, run_rungs, unfold
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads
from fabweave.words import agree

#: Two stretches of one outline must not come nearer than this.
SELF_CLEARANCE_MM = 0.5

#: Share of the piece length by which each thread's joints are set off against the one before:
#: the golden section, whose multiples are spread most evenly.
_STAGGER = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class Runs:
    """Which passes of its thread each piece carries, in order of threads.

    Parameters
    ----------
    thread : (N,) int array
    first, last : (N,) int arrays
        Positions in the thread, both included. On a ring ``last`` may go past the end; the pass
        at ``last`` is then the one at ``last - n``.
    """

    thread: IntArray
    first: IntArray
    last: IntArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("thread", "first", "last"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def laps(self, threads: Threads) -> IntArray:
        """Return the crossings at which one run ends and the next one begins."""
        count = threads.lengths[self.thread]
        goes_on = threads.closed[self.thread] | (self.last < count - 1)
        at = threads.offsets[self.thread] + self.last % np.maximum(count, 1)
        return np.asarray(threads.crossing[at[goes_on]])


@dataclass(frozen=True, eq=False)
class _Line:
    """A thread as the splitter sees it: stations along a line, some of which may carry a joint."""

    at: FloatArray  # (n,) distance of each station along the unfolded middle line
    total: float  # length of the whole thread
    allowed: IntArray  # stations that may carry a joint
    closed: bool


def split_threads(
    ribbons: Ribbons,
    weave: Weave,
    *,
    length_mm: float,
    max_length_mm: float = np.inf,
    fits: Callable[[FloatArray], bool],
    labels: tuple[str, ...],
) -> Runs:
    """Cut every thread at crossings where it goes under, into pieces of even length.

    A closed thread is always opened, into two pieces at least where it goes under twice. Joints
    of successive threads are staggered. Where a piece does not fit the stock, comes too near to
    itself or is too long, it is halved until it does.

    Parameters
    ----------
    ribbons, weave
        The ribbons and who goes under where.
    length_mm : float
        Pieces are about as long as this, or as short as the crossings allow.
    max_length_mm : float
        No piece is longer, measured along its unfolded middle line, laps included.
    fits : callable
        Whether an outline (K, 2) fits the usable stock.
    labels : tuple of str
        Names of the threads, for messages.

    Returns
    -------
    Runs
        The pieces.

    Raises
    ------
    CannotMakeError
        If a stretch without any crossing to join at is still too long, too large or too curled.
    """
    threads = weave.threads
    lines = _thread_lines(ribbons, weave)
    cuts = [
        _even_cuts(line, min(length_mm, max_length_mm), thread) for thread, line in enumerate(lines)
    ]
    while True:
        runs = _runs_of_cuts(cuts, threads.closed, threads.lengths)
        wrong = ~_acceptable(ribbons, runs, max_length_mm, fits)
        if not np.any(wrong):
            return runs
        cuts = _halve(cuts, lines, runs, np.flatnonzero(wrong), labels, max_length_mm)


def unfold_runs(ribbons: Ribbons, runs: Runs) -> Strips:
    """Unfold every piece: from where it enters its first panel to where it leaves its last."""
    first, last = first_and_last_rung(ribbons, runs)
    offsets, rung = run_rungs(ribbons, runs.thread, first, last)
    return unfold(ribbons, offsets, rung)


def first_and_last_rung(ribbons: Ribbons, runs: Runs) -> tuple[IntArray, IntArray]:
    """Return first and last local rung of each run; ends of open threads keep their tails."""
    first = local_entry(ribbons, runs.thread, runs.first)
    last = local_entry(ribbons, runs.thread, runs.last) + 1
    open_run = ~ribbons.closed[runs.thread]
    final = np.diff(ribbons.pass_offsets)[runs.thread] - 1
    size = np.diff(ribbons.offsets)[runs.thread]
    return (
        np.where(open_run & (runs.first == 0), 0, first),
        np.where(open_run & (runs.last == final), size - 1, last),
    )


def _thread_lines(ribbons: Ribbons, weave: Weave) -> list[_Line]:
    """Measure every thread along the middle of its ribbon."""
    middle = (ribbons.right + ribbons.left) / 2
    threads = weave.threads
    lines = []
    for thread in range(threads.n_threads):
        a, b = ribbons.offsets[thread : thread + 2]
        passes = slice(threads.offsets[thread], threads.offsets[thread + 1])
        closed = bool(threads.closed[thread])
        under = np.flatnonzero(~weave.over[passes])
        count = int(threads.lengths[thread])
        if closed and len(under) == 0:
            under = np.arange(count)
        elif not closed:
            under = under[(under > 0) & (under < count - 1)]
        if count == 0:
            lines.append(_Line(np.zeros(0), 0.0, under, closed))
            continue
        steps = np.linalg.norm(np.diff(middle[a:b], axis=0, append=middle[a : a + 1]), axis=1)
        run = np.concatenate(([0.0], np.cumsum(steps)))
        entry = ribbons.entry[passes] - a
        total = float(run[-1] if closed else run[-2])
        at = (run[entry] + run[entry + 1]) / 2
        lines.append(_Line(at, total, under, closed))
    return lines


def _even_cuts(line: _Line, length: float, thread: int) -> IntArray:
    """Choose joints near evenly spaced places, few enough that pieces stay under the length."""
    if len(line.allowed) == 0:
        return line.allowed
    places = line.at[line.allowed]
    ring = line.total if line.closed else 0.0
    # Every lap is cut twice, so a piece advances by less than its length.
    lap = line.total / len(line.at)
    pieces = int(np.ceil(line.total / max(length - lap, length / 2)))
    if line.closed:
        pieces = min(max(pieces, 2), len(places))
        targets = line.total * ((np.arange(pieces) + (thread * _STAGGER) % 1.0) / pieces)
        # Distances around the ring: the nearest station may lie across the start.
        around = np.concatenate((places - ring, places, places + ring))
        numbers = np.tile(line.allowed, 3)
    else:
        if line.total <= length:
            return line.allowed[:0]
        targets = line.total * np.arange(1, pieces) / pieces
        around, numbers = places, line.allowed
    right = np.clip(np.searchsorted(around, targets), 1, len(around) - 1)
    if len(around) == 1:
        return numbers
    nearest = np.where(targets - around[right - 1] <= around[right] - targets, right - 1, right)
    return np.unique(numbers[nearest])


def _runs_of_cuts(cuts: list[IntArray], closed: BoolArray, lengths: IntArray) -> Runs:
    """Turn the joints of each thread into runs of passes."""
    thread, first, last = [], [], []
    for number, joints in enumerate(cuts):
        count = int(lengths[number])
        if count == 0:
            continue
        if closed[number]:
            starts = joints
            ends = np.append(joints[1:], joints[0] + count)
        else:
            starts = np.concatenate(([0], joints))
            ends = np.concatenate((joints, [count - 1]))
        thread.append(np.full(len(starts), number))
        first.append(starts)
        last.append(ends)
    if not thread:
        none = np.zeros(0, dtype=np.int64)
        return Runs(none, none.copy(), none.copy())
    return Runs(np.concatenate(thread), np.concatenate(first), np.concatenate(last))


def _acceptable(
    ribbons: Ribbons, runs: Runs, max_length: float, fits: Callable[[FloatArray], bool]
) -> BoolArray:
    """Say which pieces are short enough, keep clear of themselves, and fit the stock."""
    strips = unfold_runs(ribbons, runs)
    middle = (strips.right + strips.left) / 2
    steps = np.append(np.hypot(*np.diff(middle, axis=0).T), 0.0)
    steps[strips.offsets[1:] - 1] = 0.0
    length = np.add.reduceat(steps, strips.offsets[:-1])
    outlines = strip_outlines(strips)
    polygons = np.array([shapely.Polygon(outline) for outline in outlines], dtype=object)
    good = (length <= max_length + 1e-9) & shapely.is_valid(polygons)
    swollen = shapely.buffer(polygons[good], SELF_CLEARANCE_MM / 2, quad_segs=2)
    good[good] = shapely.get_num_interior_rings(swollen) == 0
    for index in np.flatnonzero(good):
        good[index] = fits(outlines[index])
    return np.asarray(good)


def _halve(
    cuts: list[IntArray],
    lines: list[_Line],
    runs: Runs,
    wrong: IntArray,
    labels: tuple[str, ...],
    max_length: float,
) -> list[IntArray]:
    """Add a joint near the middle of each piece that cannot be cut as it is."""
    result = list(cuts)
    stuck = []
    for index in wrong:
        thread, first, last = (int(x[index]) for x in (runs.thread, runs.first, runs.last))
        line = lines[thread]
        count = len(line.at)
        ring = np.concatenate((line.allowed, line.allowed + count)) if line.closed else line.allowed
        inside = ring[(ring > first) & (ring < last)]
        if len(inside) == 0:
            stuck.append(f"{labels[thread]} between its crossings {first} and {last % count}")
            continue
        places = line.at[inside % count] + line.total * (inside // count)
        ends = line.at[[first % count, last % count]] + line.total * np.array(
            [first // count, last // count]
        )
        middle = inside[np.argmin(np.abs(places - ends.mean()))] % count
        result[thread] = np.union1d(result[thread], [middle])
    if stuck:
        some = "; ".join(stuck[:4]) + (" …" if len(stuck) > 4 else "")
        limit = f"longer than {max_length:g} mm, " if np.isfinite(max_length) else ""
        raise CannotMakeError(
            agree(len(stuck), "{n} stretch[|es] of thread [is|are] ")
            + f"{limit}too large for the sheet, or "
            + agree(len(stuck), "[curls onto itself, and has|curl onto themselves, and have] ")
            + f"no crossing to be joined at: {some}. A larger --sheet"
            + (", a longer --max-length" if limit else "")
            + ", a smaller --size or a finer mesh would help."
        )
    return result
