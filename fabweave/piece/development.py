"""Unfold strips of planar facets to the plane, exactly."""

from collections.abc import Sequence
from typing import TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    flags,
    frozen_value,
    offsets_of,
    places_in_groups,
)
from fabweave.piece.piece import Piece
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.threads import Threads

_Complex: TypeAlias = npt.NDArray[np.complex128]
_Number = TypeVar("_Number", np.float64, np.complex128)


@frozen_value
class Strips:
    """Runs of ribbon rungs, in compressed rows, with their development in the plane.

    Parameters
    ----------
    offsets : (S + 1,) int array
        Strip ``s`` owns the rungs ``offsets[s]:offsets[s + 1]``.
    rung : (N,) int array
        The ribbon's rung behind each rung of the strips.
    right, left : (N, 2) float arrays
        The unfolded rails. The first rung of a strip runs from the origin along +y, and the strip
        sets off along +x, so its outer face is seen.
    """

    offsets: IntArray
    rung: IntArray
    right: FloatArray
    left: FloatArray


def run_rungs(
    ribbons: Ribbons, thread: IntArray, first: IntArray, last: IntArray
) -> tuple[IntArray, IntArray]:
    """List the rungs of runs along threads, each from rung ``first`` to ``last`` inclusive.

    Rung numbers count from the start of the thread; on a ring ``last`` may go past the end and
    wraps around.

    Returns
    -------
    offsets : (S + 1,) int array
    rung : (N,) int array
    """
    counts = last - first + 1
    offsets = offsets_of(counts)
    within = places_in_groups(counts)
    sizes = np.diff(ribbons.offsets)[thread]
    local = (np.repeat(first, counts) + within) % np.repeat(sizes, counts)
    return offsets, np.repeat(ribbons.offsets[:-1][thread], counts) + local


def unfold(ribbons: Ribbons, offsets: IntArray, rung: IntArray) -> Strips:
    """Unfold runs of rungs to the plane; every edge and diagonal of every facet keeps its length.

    Each quad between two rungs is two triangles, laid side by side in a frame at its first rung.
    The frames follow one another by rigid motions of the plane, whose product along a strip is a
    running sum of angles and then of displacements: the whole is array work.

    Parameters
    ----------
    ribbons : Ribbons
        The ribbons in space.
    offsets, rung
        The runs, as from :func:`run_rungs`.

    Returns
    -------
    Strips
        The development, by strips.
    """
    rails = unfold_rails(ribbons.right[rung], ribbons.left[rung], ribbons.from_right[rung], offsets)
    return Strips(offsets, rung, *rails)


def unfold_rails(
    right: FloatArray, left: FloatArray, from_right: BoolArray, offsets: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Unfold strips from their rails in space, as :func:`unfold` does; return both, (N, 2) each.

    A rung may share one of its ends with the next: the quad between them is a triangle.

    Parameters
    ----------
    right, left : (N, 3) float arrays
        Where each rung begins and ends.
    from_right : (N,) bool array
        Whether the diagonal of the quad after each rung starts at the right rail.
    offsets : (S + 1,) int array
    """
    breadth = np.linalg.norm(left - right, axis=1)
    count = len(right)
    if count == 0:
        return np.empty((0, 2)), np.empty((0, 2))
    after = np.minimum(np.arange(count) + 1, count - 1)
    near_right, near_left = _lay_quads(right, left, right[after], left[after], breadth, from_right)
    # A strip's last rung starts no quad: the next strip sets off afresh.
    last = offsets[1:][np.diff(offsets) > 0] - 1
    turn = np.angle((near_left - near_right) / 1j)
    turn[last] = 0.0
    near_right[last] = 0.0

    strip = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    heading = _running_sum(turn, offsets, strip)
    rotation = np.exp(1j * heading)
    origin = _running_sum(rotation * near_right, offsets, strip)
    end = origin + 1j * rotation * breadth
    return np.column_stack((origin.real, origin.imag)), np.column_stack((end.real, end.imag))


def _running_sum(
    values: npt.NDArray[_Number], offsets: IntArray, strip: IntArray
) -> npt.NDArray[_Number]:
    """Return the sum of the values before each place in its own strip."""
    before = np.concatenate((np.zeros(1, dtype=values.dtype), np.cumsum(values)[:-1]))
    return before - before[offsets[:-1][strip]]


def _lay_quads(
    right: FloatArray,
    left: FloatArray,
    next_right: FloatArray,
    next_left: FloatArray,
    breadth: FloatArray,
    from_right: BoolArray,
) -> tuple[_Complex, _Complex]:
    """Return where each quad's far rung lies when its near rung runs from 0 to ``1j * breadth``."""
    zero = np.zeros(len(right), dtype=np.complex128)
    tip = zero + 1j * breadth
    # Diagonal from the near right to the far left: the far left first, then the far right.
    left_a = _apex(right, left, next_left, zero, tip, -1.0)
    right_a = _apex(right, next_left, next_right, zero, left_a, -1.0)
    # Diagonal from the near left to the far right.
    right_b = _apex(right, left, next_right, zero, tip, -1.0)
    left_b = _apex(left, next_right, next_left, tip, right_b, 1.0)
    return np.where(from_right, right_a, right_b), np.where(from_right, left_a, left_b)


def _apex(
    start: FloatArray,
    end: FloatArray,
    apex: FloatArray,
    flat_start: _Complex,
    flat_end: _Complex,
    side: float,
) -> _Complex:
    """Lay the third corner of a triangle beside its flattened base; side +1 is to its left."""
    base = end - start
    length = np.linalg.norm(base, axis=1)
    safe = np.where(length > 0, length, 1.0)
    to_apex = apex - start
    along = np.einsum("ij,ij->i", to_apex, base) / safe
    across = np.linalg.norm(np.cross(base, to_apex), axis=1) / safe
    flat = flat_end - flat_start
    size = np.abs(flat)
    unit = flat / np.where(size > 0, size, 1.0)
    return flat_start + unit * (along + 1j * side * across)


def unfold_threads(ribbons: Ribbons) -> Strips:
    """Unfold every ribbon as one whole strip; a ring is opened at its first rung.

    Returns
    -------
    Strips
        One strip for each thread, without rungs where the thread has no crossing; the first rung
        of a ring is there again at its end.
    """
    sizes = np.diff(ribbons.offsets)
    threads = np.arange(len(sizes))
    last = np.where(sizes > 0, sizes - 1 + ribbons.closed, -1)
    offsets, rung = run_rungs(ribbons, threads, np.zeros_like(last), last)
    return unfold(ribbons, offsets, rung)


def wave_turns(ribbons: Ribbons) -> FloatArray:
    """Return by how many degrees each unfolded middle line turns at its rungs.

    A straight strip has none; the sum of their sizes over the length tells how wavy a ribbon is,
    and with it how much of the sheet its pieces waste.

    Returns
    -------
    (R,) float array
        Positive to the left as seen from outside; 0 at the ends of open ribbons.
    """
    strips = unfold_threads(ribbons)
    wave = np.zeros(ribbons.n_rungs)
    if len(strips.rung) < 3:
        return wave
    middle = (strips.right + strips.left) @ np.array([0.5, 0.5j])
    heading = np.diff(middle)
    strip = np.repeat(np.arange(len(strips.offsets) - 1), np.diff(strips.offsets))
    same = strip[:-2] == strip[2:]
    turn = np.degrees(np.angle(heading[1:] * heading[:-1].conj()))
    wave[strips.rung[1:-1][same]] = turn[same]
    # A ring ends with its first rung again: there the two ends of its strip come together.
    rings = np.flatnonzero(ribbons.closed & (np.diff(ribbons.offsets) > 0))
    starts, ends = strips.offsets[:-1][rings], strips.offsets[1:][rings] - 1
    rung = (strips.left - strips.right) @ np.array([1, 1j])
    out, back = heading[starts] / rung[starts], heading[ends - 1] / rung[ends]
    wave[strips.rung[starts]] = np.degrees(np.angle(out * back.conj()))
    return wave


def trim_strips(strips: Strips, begin: FloatArray, end: FloatArray) -> Strips:
    """Return strips that begin and end at given places.

    A place is a rung's number in its strip, counted from 0; between two rungs it shares both
    rails alike, which are straight there.

    Parameters
    ----------
    strips : Strips
    begin, end : (S,) float arrays
        ``0 <= begin < end <= count - 1``.

    Returns
    -------
    Strips
        With the rungs strictly between, and one at either end.

    Examples
    --------
    >>> rungs = np.arange(4)
    >>> rails = np.column_stack((rungs * 2.0, np.zeros(4)))
    >>> strip = Strips(np.array([0, 4]), rungs, rails, rails + (0.0, 1.0))
    >>> trim_strips(strip, np.array([0.5]), np.array([3.0])).left[:, 0].tolist()
    [1.0, 2.0, 4.0, 6.0]
    """
    counts = np.diff(strips.offsets)
    place = np.arange(len(strips.rung)) - np.repeat(strips.offsets[:-1], counts)
    inside = (place > np.repeat(begin, counts)) & (place < np.repeat(end, counts))
    strip = np.repeat(np.arange(len(counts)), counts)
    kept = np.flatnonzero(inside)
    offsets = offsets_of(np.bincount(strip[kept], minlength=len(counts)) + 2)
    order = np.empty(offsets[-1], dtype=np.int64)
    ends = np.zeros(offsets[-1], dtype=bool)
    ends[offsets[:-1]] = ends[offsets[1:] - 1] = True
    order[~ends] = kept
    rails = []
    for rail in (strips.right, strips.left):
        trimmed = np.empty((offsets[-1], 2))
        trimmed[~ends] = rail[kept]
        trimmed[offsets[:-1]] = rail_at(rail, strips.offsets[:-1], begin)
        trimmed[offsets[1:] - 1] = rail_at(rail, strips.offsets[:-1], end)
        rails.append(trimmed)
    order[offsets[:-1]] = strips.offsets[:-1] + np.floor(begin).astype(np.int64)
    order[offsets[1:] - 1] = strips.offsets[:-1] + np.ceil(end).astype(np.int64)
    return Strips(offsets, strips.rung[order], *rails)


def rail_at(rail: FloatArray, first: IntArray, place: FloatArray) -> FloatArray:
    """Return points of a rail at places counted from the rungs ``first``, (N, 2)."""
    low = np.floor(place).astype(np.int64)
    share = (place - low)[:, None]
    near, far = rail[first + low], rail[first + np.ceil(place).astype(np.int64)]
    return np.asarray(near + share * (far - near))


@frozen_value
class PieceRungs:
    """The rungs of every piece, from the panel of its first crossing to that of its last.

    Where no joint ends a piece, it reaches to the end of its open thread. Two pieces that lap both
    have the panel of their joint.

    Parameters
    ----------
    rung : (N,) int array
        The rungs of all pieces one after another, as numbers of rungs of the ribbons.
    offsets : (P + 1,) int array
        Where the rungs of each piece begin.
    panel : (S,) int array
        For all stations of all pieces, one after another: the rung, from the piece's own first, at
        which the panel of the station begins.
    panel_offsets : (P + 1,) int array
        Where the stations of each piece begin.
    """

    rung: IntArray
    offsets: IntArray
    panel: IntArray
    panel_offsets: IntArray

    def quads(self) -> tuple[IntArray, IntArray]:
        """Return the rungs at which quads of ribbon begin, and the piece that each belongs to.

        A piece's last rung ends its last quad, and begins none.
        """
        begins = ~flags(len(self.rung), self.offsets[1:] - 1)
        counts = np.diff(self.offsets) - 1
        return self.rung[begins], np.repeat(np.arange(len(counts)), counts)


def piece_stretches(ribbons: Ribbons, weave: Weave, pieces: Sequence[Piece]) -> PieceRungs:
    """Find the stretch of ribbon of every piece.

    Parameters
    ----------
    ribbons, weave
        The ribbons in space, and who is on top.
    pieces : sequence of Piece
        All pieces of a job.

    Returns
    -------
    PieceRungs
        Rungs rise along each piece, and count on from the first one around a ring.
    """
    threads = weave.threads
    passes = strand_passes(weave)
    first = np.array(
        [passes[piece.crossings[0], int(piece.over[0])] for piece in pieces], dtype=np.int64
    )
    thread = threads.thread_of_pass[first]
    panel_offsets = offsets_of(np.array([len(piece.crossings) for piece in pieces], dtype=np.int64))
    stations = np.diff(panel_offsets)
    place = np.repeat(first - threads.offsets[thread], stations) + places_in_groups(stations)
    entry = local_entry(ribbons, np.repeat(thread, stations), place)
    size = np.diff(ribbons.offsets)[thread]
    start, last = entry[panel_offsets[:-1]], entry[panel_offsets[1:] - 1] + 1
    start = np.where([piece.start_joint is None for piece in pieces], 0, start)
    last = np.where([piece.end_joint is None for piece in pieces], size - 1, last)
    offsets, rung = run_rungs(ribbons, thread, start, last)
    return PieceRungs(rung, offsets, entry - np.repeat(start, stations), panel_offsets)


@frozen_value
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

    @classmethod
    def of(cls, rows: Sequence[tuple[int, int, int]]) -> "Runs":
        """Return the runs of some rows: thread, first and last pass."""
        return cls(*np.array(rows, dtype=np.int64).reshape(-1, 3).T)

    @property
    def rows(self) -> list[tuple[int, int, int]]:
        """Thread, first and last pass of each run."""
        return list(zip(self.thread.tolist(), self.first.tolist(), self.last.tolist(), strict=True))

    def joint_passes(self, threads: Threads) -> IntArray:
        """Return the pass at which each joint lies, (J,), in the order of runs that end there."""
        count = threads.lengths[self.thread]
        goes_on = threads.closed[self.thread] | (self.last < count - 1)
        at = threads.offsets[self.thread] + self.last % np.maximum(count, 1)
        return np.asarray(at[goes_on])

    def laps(self, threads: Threads) -> IntArray:
        """Return the crossings at which one run ends and the next one begins."""
        return threads.crossing[self.joint_passes(threads)]


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
