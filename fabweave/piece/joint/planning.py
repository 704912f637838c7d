"""Plan every joint: its kind, where its two pieces end, and how their ends are shaped."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
import shapely

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    flags,
    frozen_value,
    places_in_groups,
)
from fabweave.core.errors import CannotMakeError
from fabweave.piece.development import Runs, Strips, run_rungs, trim_strips, unfold
from fabweave.piece.joint.kinds import GLUE, Interlock, JointKind, JointRule
from fabweave.ribbon.project import Ribbons, local_entry
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads

#: A lap goes on over so many crossings more at most, until its thread goes under again.
_MOST_MORE = 3
#: A lap ends at least this far from the crossing panels before and after its own.
_SHORT_OF_NEXT_MM = 0.5
#: Rungs apart in one long line of all windows; no window is longer.
_APART_MM = 1e7


@frozen_value
class JointPlan:
    """All joints of a job, numbered from 1 in the order of threads; arrays have one row a joint.

    Places are counted in rungs from where the ribbon enters the crossing panel: the panel goes
    from 0 to 1. Where ends interlock, shapes are cut from pieces that end at these places.

    Parameters
    ----------
    rule : JointRule
        What was asked.
    crossing, passes : (J,) int arrays
        The crossing, and the pass that goes under there.
    kind : tuple of JointKind
        As each is made: what was asked, or a glued lap where there is no room for that.
    begin, end : (J,) float arrays
        Where the second piece begins, and where the first one ends.
    lap_mm : (J,) float array
        Length of the lap along the middle line; 0 where none.
    ahead_mm : (J,) float array
        How much of that lies ahead of the middle of the crossing.
    beside : (K,) int array
        The crossings after their own over which laps go on.
    lap_mm2 : (J,) float array
        Area of the lap.
    room_mm : (J,) float array
        From the middle of the crossing panel to its nearest edge.
    needed_mm : (J,) float array
        What ``room_mm`` must be for the kind that was asked; 0 where any will do.
    ends : tuple of Interlock or None
        How the ends are shaped, in the frame of the station; None where they are cut straight.
    thickness_mm : (T,) float array
        Of each thread's material.
    """

    rule: JointRule
    crossing: IntArray
    passes: IntArray
    kind: tuple[JointKind, ...]
    begin: FloatArray
    end: FloatArray
    lap_mm: FloatArray
    ahead_mm: FloatArray
    beside: IntArray
    lap_mm2: FloatArray
    room_mm: FloatArray
    needed_mm: FloatArray
    ends: tuple[Interlock | None, ...]
    thickness_mm: FloatArray

    def where(self, holds: Callable[[JointKind], object]) -> BoolArray:
        """Return which joints are of a kind of which something holds, (J,)."""
        return np.array([bool(holds(kind)) for kind in self.kind], dtype=np.bool_)

    @property
    def laps(self) -> IntArray:
        """The crossings at which two pieces lie on one another."""
        return np.concatenate([self.crossing[self.where(lambda kind: kind.laps)], self.beside])


def plan_joints(
    ribbons: Ribbons,
    weave: Weave,
    runs: Runs,
    rule: JointRule,
    thickness_mm: float | FloatArray = 0.5,
    lapped: IntArray | None = None,
) -> JointPlan:
    """Decide how each joint is made and where its pieces end.

    A lap is as long as its crossing panel unless another length is asked for; it then reaches as
    far to either side, and stops short of the crossing panels before and after. Pieces that do
    not lap meet in the middle of the panel. Where the panel is too narrow or too slanting for the
    kind, the joint is a glued lap; and where a lap over several crossings has not enough of them
    for itself. The strands' heights do not matter: panels keep their shape.

    Parameters
    ----------
    ribbons, weave, runs
        The ribbons, who is on top, and which passes each piece carries.
    rule : JointRule
    thickness_mm : float or (T,) float array
        Of the material, or of each thread's: tongues and slots are cut to their own thread's.
    lapped : (K,) int array, optional
        Crossings at which pieces have to lap, whatever is asked.

    Raises
    ------
    CannotMakeError
        If laps over several crossings are asked of strips of several thicknesses: which of them
        lies below is not the same at all crossings.
    """
    passes = runs.joint_passes(weave.threads)
    thickness = np.array(np.broadcast_to(thickness_mm, weave.threads.n_threads))
    if rule.kind.crossings > 1 and np.ptp(thickness) > 0.0:
        raise CannotMakeError(
            f"a joint of kind {rule.kind.name} asks for strips of one thickness; use another "
            "--joint, or one --thickness"
        )
    beyond = _apart(weave.threads, passes, _passes_beyond(weave, passes, rule.kind.crossings))
    strips, entry, last = _windows(ribbons, weave.threads, passes, beyond)
    middle = (strips.right + strips.left) / 2
    panel_mm = np.hypot(*(middle[entry + 1] - middle[entry]).T)
    room = _room(strips, entry)
    begin, end, lap = np.zeros(len(passes)), (last + 1 - entry).astype(float), panel_mm.copy()
    more = beyond > 0
    lap[more] = _middle_mm(strips, entry, last + 1)[more]
    if rule.lap_mm is not None:
        begin, end, lap = _reach(strips, entry, rule.lap_mm)
        # On a slanting panel a cross-line may meet the rails again: then the panel is the lap.
        bent = ~_simple(strips, entry, begin, end)
        begin[bent], end[bent], lap[bent] = 0.0, 1.0, panel_mm[bent]
    long = rule.kind.crossings > 1
    kinds = [GLUE if long and not goes_on else rule.kind for goes_on in more.tolist()]
    needed = np.zeros(len(passes))
    ends: list[Interlock | None] = [None] * len(passes)
    if rule.kind.shape is not None and rule.kind.room_mm is not None:
        thicknesses = thickness[weave.threads.thread_of_pass[passes]].tolist()
        needed = np.array([rule.kind.room_mm(thick) for thick in thicknesses])
        # However long the lap, tongues stay in the flat panel; and in the lap, if that is shorter.
        inside = np.clip(begin, 0.0, 1.0), np.clip(end, 0.0, 1.0)
        reach = np.minimum.reduce([room, *_to_lines_across(strips, entry, inside)])
        free = np.isin(
            weave.threads.crossing[passes], [] if lapped is None else lapped, invert=True
        )
        for index in np.flatnonzero((reach >= needed) & free).tolist():
            ends[index] = shape = rule.kind.shape(float(reach[index]), thicknesses[index])
            end[index] = 1.0
            if shape.begin_mm is not None:
                begin[index] = 0.0
        kinds = [rule.kind if shape is not None else GLUE for shape in ends]
    laps = np.array([kind.laps for kind in kinds], dtype=np.bool_)
    return JointPlan(
        rule=rule,
        crossing=weave.threads.crossing[passes],
        passes=passes,
        kind=tuple(kinds),
        begin=begin,
        end=end,
        lap_mm=np.where(laps, lap, 0.0),
        ahead_mm=np.where(laps, np.where(more, lap - panel_mm / 2, lap / 2), 0.0),
        beside=np.concatenate(_crossings_after(weave.threads, passes, beyond)),
        lap_mm2=np.where(laps, _areas(strips, entry, begin, end), 0.0),
        room_mm=room,
        needed_mm=needed,
        ends=tuple(ends),
        thickness_mm=thickness,
    )


def lap_beyond(ribbons: Ribbons, weave: Weave, rule: JointRule) -> float:
    """Return how far laps go beyond either end of a crossing panel, at most.

    Of laps that go on to one side only, it is half of what they do there.
    """
    long = rule.kind.crossings > 1
    passes = np.flatnonzero(~(weave.over & long))
    if not len(passes) or (rule.lap_mm is None and not long):
        return 0.0
    beyond = _passes_beyond(weave, passes, rule.kind.crossings, joined=False)
    strips, entry, last = _windows(ribbons, weave.threads, passes, beyond)
    lap = _middle_mm(strips, entry, last + 1)
    if rule.lap_mm is not None:
        lap = _reach(strips, entry, rule.lap_mm)[2]
    return max(float((lap - _middle_mm(strips, entry, entry + 1)).max()) / 2, 0.0)


def _passes_beyond(
    weave: Weave, passes: IntArray, crossings: int, *, joined: bool = True
) -> IntArray:
    """Return how many passes after each a lap over several crossings ends, where it goes under.

    It is 0 where the thread ends before that, or, if the passes are those of joints, where another
    one comes first; and where laps lie at one crossing only.
    """
    threads = weave.threads
    thread = threads.thread_of_pass[passes]
    place, count = passes - threads.offsets[thread], threads.lengths[thread]
    taken = flags(len(threads.crossing), passes) & joined
    beyond = np.zeros(len(passes), dtype=np.int64)
    if crossings == 1:
        return beyond
    free = np.ones(len(passes), dtype=np.bool_)
    for step in range(1, crossings + _MOST_MORE):
        after = threads.offsets[thread] + (place + step) % count
        free &= (threads.closed[thread] | (place + step < count)) & (step < count) & ~taken[after]
        beyond[free & (beyond == 0) & (step >= crossings - 1) & ~weave.over[after]] = step
    return beyond


def _apart(threads: Threads, passes: IntArray, beyond: IntArray) -> IntArray:
    """Return how far laps go on where those do not that would meet others at a crossing."""
    taken = set(threads.crossing[passes].tolist())
    beyond = beyond.copy()
    for joint, crossings in enumerate(_crossings_after(threads, passes, beyond)[:-1]):
        if taken.isdisjoint(crossings.tolist()):
            taken.update(crossings.tolist())
        else:
            beyond[joint] = 0
    return beyond


def laps_meeting(weave: Weave, crossings: int) -> IntArray | None:
    """Return at which crossings joints would meet a lap over several from each, (X, N).

    A lap begins where its thread goes under. Where there are fewer, the crossing itself fills the
    row; None if no lap goes on.
    """
    if crossings == 1:
        return None
    threads, count = weave.threads, weave.threads.n_crossings
    passes = np.flatnonzero(~weave.over)
    beyond = _passes_beyond(weave, passes, crossings, joined=False)
    own = threads.crossing[passes]
    after = np.concatenate(_crossings_after(threads, passes, beyond))
    rows = np.concatenate([own, np.repeat(own, beyond)])
    covers = sp.csr_array(
        (np.ones(len(rows)), (rows, np.concatenate([own, after]))), shape=(count, count)
    )
    meeting = sp.csr_array(covers @ covers.T)
    size = np.diff(meeting.indptr)
    around = np.tile(np.arange(count)[:, None], int(size.max()))
    around[np.repeat(np.arange(count), size), places_in_groups(size)] = meeting.indices
    return around


def _crossings_after(threads: Threads, passes: IntArray, count: IntArray) -> list[IntArray]:
    """Return the crossings of so many passes after each, and no more at last."""
    thread = np.repeat(threads.thread_of_pass[passes], count)
    start = threads.offsets[thread]
    place = np.repeat(passes, count) - start + 1 + places_in_groups(count)
    return np.split(
        threads.crossing[start + place % threads.lengths[thread]], np.cumsum(count, dtype=np.int64)
    )


def _middle_mm(strips: Strips, first: IntArray, last: IntArray) -> FloatArray:
    """Return the length of the middle line between two rungs of each strip."""
    middle = (strips.right + strips.left) / 2
    run = np.append(0.0, np.cumsum(np.hypot(*np.diff(middle, axis=0).T)))
    return np.asarray(run[last] - run[first])


def _windows(
    ribbons: Ribbons, threads: Threads, passes: IntArray, beyond: IntArray
) -> tuple[Strips, IntArray, IntArray]:
    """Unfold the ribbon about each joint, from the panel before to the panel after.

    Returns the strips, and the rungs where each enters its joint's panel, and the one as many
    passes beyond it as are asked for; the window goes on to the panel after that.
    """
    thread = threads.thread_of_pass[passes]
    count = threads.lengths[thread]
    # Once around a ring, so that there always is a panel before.
    place = passes - threads.offsets[thread] + np.where(ribbons.closed[thread], count, 0)
    entry = local_entry(ribbons, thread, place)
    ring = ribbons.closed[thread]
    final = np.diff(ribbons.offsets)[thread] - 1
    before = local_entry(ribbons, thread, np.maximum(place - 1, 0)) + 1
    far = place + beyond
    after = local_entry(ribbons, thread, np.where(ring, far + 1, np.minimum(far + 1, count - 1)))
    first = np.where(~ring & (place == 0), 0, before)
    last = np.where(~ring & (far == count - 1), final, after)
    offsets, rung = run_rungs(ribbons, thread, first, last)
    shift = offsets[:-1] - first
    return (
        unfold(ribbons, offsets, rung),
        shift + entry,
        shift + local_entry(ribbons, thread, far),
    )


def _reach(
    strips: Strips, entry: IntArray, lap_mm: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the places at half a lap from the middle of each panel, and the laps' lengths."""
    middle = (strips.right + strips.left) / 2
    steps = np.append(0.0, np.hypot(*np.diff(middle, axis=0).T))
    steps[strips.offsets[1:-1]] = _APART_MM
    run = np.cumsum(steps)
    centre = (run[entry] + run[entry + 1]) / 2
    panel = run[entry + 1] - run[entry]
    room = np.minimum(centre - run[strips.offsets[:-1]], run[strips.offsets[1:] - 1] - centre)
    most = np.maximum(room - _SHORT_OF_NEXT_MM, panel / 2)
    reach = np.minimum(lap_mm / 2, most)
    rungs = np.arange(len(run), dtype=np.float64)
    places = [np.interp(centre + side * reach, run, rungs) - entry for side in (-1, 1)]
    # The ends of the panel are rungs themselves.
    near = [np.where(np.abs(place - np.round(place)) < 1e-9, np.round(place), place)
            for place in places]  # fmt: skip
    return near[0], near[1], 2 * reach


def _simple(strips: Strips, entry: IntArray, begin: FloatArray, end: FloatArray) -> BoolArray:
    """Say which windows are still simple figures when they end, or begin, at the given places."""
    first, last = strips.offsets[:-1], strips.offsets[1:] - 1
    good = np.ones(len(entry), dtype=bool)
    for low, high in ((first - first, entry + end - first), (entry + begin - first, last - first)):
        kept = trim_strips(strips, low.astype(np.float64), high.astype(np.float64))
        rings = [
            np.concatenate((kept.right[a:b], kept.left[a:b][::-1]))
            for a, b in pairwise(kept.offsets.tolist())
        ]
        good &= shapely.is_valid([shapely.Polygon(ring) for ring in rings])
    return good


def _areas(strips: Strips, entry: IntArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Return the area of each ribbon between two places, (J,)."""
    place = (entry - strips.offsets[:-1]).astype(np.float64)
    laps = trim_strips(strips, place + begin, place + end)
    right, left = (rail[:, 0] + 1j * rail[:, 1] for rail in (laps.right, laps.left))
    # Each quad between two rungs by its diagonals; the step to the next strip does not count.
    quads = ((left[1:] - right[:-1]).conj() * (left[:-1] - right[1:])).imag / 2
    strip = np.repeat(np.arange(len(entry)), np.diff(laps.offsets))
    same = strip[1:] == strip[:-1]
    return np.bincount(strip[1:][same], quads[same], len(entry)).astype(np.float64)


def _room(strips: Strips, entry: IntArray) -> FloatArray:
    """Return how far the middle of each panel is from its edges, (J,).

    Also, from the line square across the middle to the corners: it must not meet the ends.
    """
    middle = (strips.right + strips.left) / 2
    centre = (middle[entry] + middle[entry + 1]) / 2
    sides = [
        _distance(centre, rail[entry], rail[entry + 1]) for rail in (strips.right, strips.left)
    ]
    ends = _to_lines_across(strips, entry, (np.zeros(len(entry)), np.ones(len(entry))))
    way = middle[entry + 1] - middle[entry]
    way /= np.hypot(*way.T)[:, None]
    corners = [
        side * np.einsum("jk,jk->j", rail[at] - centre, way)
        for rail in (strips.right, strips.left)
        for side, at in ((-1.0, entry), (1.0, entry + 1))
    ]
    return np.asarray(np.minimum.reduce([*sides, *ends, *corners]))


def _to_lines_across(
    strips: Strips, entry: IntArray, places: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return how far the middle of each panel is from lines across it, at places from 0 to 1."""
    rails = [(rail[entry], rail[entry + 1]) for rail in (strips.right, strips.left)]
    centre = np.mean(rails, axis=(0, 1))
    lines = [[start + place[:, None] * (end - start) for start, end in rails] for place in places]
    return [_distance(centre, right, left) for right, left in lines]


def _distance(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the distance of points from lines."""
    way = end - start
    length = np.hypot(*way.T)
    away = point - start
    twice = np.abs(way[:, 0] * away[:, 1] - way[:, 1] * away[:, 0])
    return np.asarray(twice / np.where(length > 0, length, 1.0))
