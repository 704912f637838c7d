"""Say how long hands take to put an object together, and how difficult it is, from what they do."""

import math
from collections import defaultdict
from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

from fabweave.core.records import record
from fabweave.piece.joint.kinds import KINDS
from fabweave.plan.bill_of_materials import BillOfMaterials, FastenerRow, sort_for
from fabweave.plan.crossing_map import CrossingMap
from fabweave.stock.hardware import Hardware, hardware_catalogue, hardware_named
from fabweave.stock.machine import HOLDING_S, MIDDLE_PACE, PACE, PRACTISED, Span

#: Before the order is known: the share of crossings at which a strand is slid under; 0.33 to 0.55
#: in jobs of 8 to 140 pieces.
_UNDER = 0.38
#: And how many clips are put on for each piece; 0.95 to 1.02 in jobs of 64 to 96 pieces.
_CLIPS = 0.98
#: What a dab of glue at a crossing takes, until it holds by itself or by a clip: an estimate.
_DAB_S = 12.0
_HOUR_S = 3600.0


@record
class Action:
    """Something that hands do: how often, and how long it takes each time, in practised hands."""

    action: str
    count: int
    each_s: float
    words: str


@record
class AssemblyTime:
    """What hands do, how many hours it takes practised ones, and makers: from quick to slow."""

    actions: tuple[Action, ...]
    practised_h: float
    hours: Span

    def often(self, action: str) -> int:
        """Return how often something is done."""
        return sum(one.count for one in self.actions if one.action == action)


class Difficulty(NamedTuple):
    """How difficult an assembly is, from 0 to 10, and in a word or two."""

    score: float
    word: str


def hardware_for(hole_mm: float, bill: BillOfMaterials) -> list[Hardware]:
    """Return the sorts of fasteners that holes of a size may take.

    Those that hold a stack of the bill; where none does, those whose own holes are nearest.

    Parameters
    ----------
    hole_mm : float
    bill : BillOfMaterials

    Examples
    --------
    >>> from fabweave.plan.bill_of_materials import GlueRow, TapeRow
    >>> glue, tape = GlueRow(joints=0, area_mm2=0.0), TapeRow(joints=0, length_mm=0.0)
    >>> bare = BillOfMaterials(fasteners=(), glue=glue, tape=tape)
    >>> [sort.name for sort in hardware_for(4.7, bare)]
    ['book-screw']
    """
    names = [
        name for row in bill.fasteners if row.diameter_mm == hole_mm for name in row.fits or ()
    ]
    if names:
        return [hardware_named(name) for name in dict.fromkeys(names)]
    sorts = list(hardware_catalogue().values())
    off = [max(sort.hole_mm[0] - hole_mm, hole_mm - sort.hole_mm[1], 0.0) for sort in sorts]
    return [sort for sort, far in zip(sorts, off, strict=True) if far == min(off)]


def planned_hands(
    pieces: int,
    crossings: int,
    joints: Sequence[str],
    bill: BillOfMaterials,
    *,
    rolls: bool = False,
    ties: int = 0,
) -> AssemblyTime:
    """Predict how long hands take, before the order of pieces is known.

    At each crossing one strand is laid over or slid under the other; of two pieces that are joined
    there, one or both.
    """
    placed = crossings + len(joints) // 2
    under = round(_UNDER * placed)
    clips, marks = round(_CLIPS * pieces), 2 * crossings + len(joints)
    return assembly_time(
        pieces, placed - under, under, joints, bill,
        clips=clips, marks=marks if rolls else None, ties=ties,
    )  # fmt: skip


def assembly_time(
    pieces: int,
    over: int,
    under: int,
    joints: Sequence[str],
    bill: BillOfMaterials,
    *,
    clips: int = 0,
    marks: int | None = None,
    ties: int = 0,
) -> AssemblyTime:
    """Return what actions take together.

    Parameters
    ----------
    pieces, over, under : int
        How many pieces are taken up, and strands laid over others and slid under them.
    joints : sequence of str
        The kind of each joint.
    bill : BillOfMaterials
        Whose fasteners are set: each takes what the first sort takes that is listed for it.
    clips : int
        How many are put on, and taken off again.
    marks : int, optional
        How many are copied to strips that are cut from rolls by hand, and not taken out of sheets.
    ties : int
        How many feet are tied to a base.
    """
    held = [kind for kind in joints if not KINDS[kind].most_fasteners]
    set_: dict[float, int] = defaultdict(int)
    setting_s: dict[float, float] = defaultdict(float)
    for row in bill.fasteners:
        set_[row.diameter_mm] += row.needed
        setting_s[row.diameter_mm] += _setting_s(row, bill)
    often = _often(pieces, over, under, sum(set_.values()) + len(held), clips, marks)
    often["tie"] = ties
    actions = [
        Action(action=name, count=often[name], each_s=seconds, words=words)
        for name, (seconds, words) in PRACTISED.items()
    ]
    if bill.glue.crossings:
        words = "to glue a crossing"
        actions.append(Action(action="dab", count=over + under, each_s=_DAB_S, words=words))
    actions += [
        Action(
            action=kind,
            count=held.count(kind),
            each_s=HOLDING_S[kind],
            words=f"to make a {kind} joint",
        )
        for kind in sorted(set(held))
    ]
    actions += [
        Action(
            action=_fastening(size),
            count=set_[size],
            each_s=round(setting_s[size] / set_[size], 3) if set_[size] else 0.0,
            words=f"to set a fastener in a hole of {size:g} mm",
        )
        for size in sorted(set_)
    ]
    practised = sum(action.count * action.each_s for action in actions) / _HOUR_S
    quick, slow = PACE
    return AssemblyTime(
        actions=tuple(action for action in actions if action.count),
        practised_h=round(practised, 4),
        hours=(round(quick * practised, 4), round(slow * practised, 4)),
    )


def _often(
    pieces: int, over: int, under: int, aligned: int, clips: int, marks: int | None
) -> dict[str, int]:
    """Return how often each of the ``PRACTISED`` actions is done."""
    rolls = marks is not None
    apart = {"sort": 0 if rolls else pieces, "cut": pieces if rolls else 0, "mark": marks or 0}
    laid = {"find": pieces, "take": pieces, "over": over, "under": under, "align": aligned}
    return apart | laid | {"clip": clips}


def _setting_s(row: FastenerRow, bill: BillOfMaterials) -> float:
    """Return what setting all fasteners of a row takes.

    Where nothing fits from outside, it is glued; where nothing is known at all, it takes the middle
    of what is near.
    """
    outside = row.outside or 0
    first, there = sort_for(row, outside=False), sort_for(row, outside=True)
    near = median(sort.seconds for sort in hardware_for(row.diameter_mm, bill))
    usual = near if first is None else first.seconds
    return (row.needed - outside) * usual + outside * (
        HOLDING_S["glue"] if there is None else there.seconds
    )


def _fastening(hole_mm: float) -> str:
    """Name what sets a fastener in a hole."""
    return f"fasten {hole_mm:g} mm"


def step_seconds(crossing_map: CrossingMap, hands: AssemblyTime) -> list[float]:
    """Return about how many seconds each step takes a maker: half way from quick to slow.

    A piece is sorted out of its sheet in the step that places it. Fasteners are set when the last
    layer of their crossing is in place, or with the ring that they hold.

    Parameters
    ----------
    crossing_map : CrossingMap
    hands : AssemblyTime
        Of the same job: all steps together take as long as it says.
    """
    holes: dict[int, list[str]] = defaultdict(list)
    for piece in crossing_map.pieces:
        for cut in piece.cutouts:
            station = piece.stations[cut.station]
            if cut.hole is not None and station.over:
                holes[station.crossing].append(_fastening(cut.hole[2]))
    each_s = {action.action: action.each_s for action in hands.actions}
    for crossing in crossing_map.crossings:
        if crossing.fastened is False or (crossing.hang and "tie" in each_s):
            holes.pop(crossing.id, None)
    kind = {joint.id: joint.kind for joint in crossing_map.joints}
    stations = {piece.id: len(piece.stations) for piece in crossing_map.pieces}
    feet = {crossing.id for crossing in crossing_map.crossings if crossing.hang}
    seconds = []
    for step in crossing_map.steps:
        made = [name for key in step.fasten for name in holes.get(key, ())]
        made += [kind[key] for key in step.joints if not KINDS[kind[key]].most_fasteners]
        over, under = len(step.over), len(step.under)
        marks = sum(stations[key] for key in step.pieces) if "cut" in each_s else None
        often = _often(step.handled, over, under, len(made), len(step.clips or ()), marks)
        often |= {"dab": over + under} if "dab" in each_s else {}
        often |= {"tie": len(feet & set(step.fasten))} if "tie" in each_s else {}
        total = sum(count * each_s[name] for name, count in often.items() if count)
        seconds.append(MIDDLE_PACE * (total + sum(each_s[name] for name in made)))
    return seconds


#: Words for a score, each up to this; nearer to it than ``_BETWEEN``, two words are said.
_WORDS = ((3.0, "easy"), (5.5, "moderate"), (7.5, "demanding"), (math.inf, "very demanding"))
_BETWEEN = 0.25
#: Each of these weighs as much as the others, and all three together make a score of 7.5: hours of
#: practised hands, strands that are slid under, a piece; and the width of a ribbon. A scale to
#: compare objects by, and no measurement.
_HARD_H, _HARD_UNDERS, _HARD_WIDTH_MM = 8.0, 6.0, 4.0


def difficulty(practised_h: float, unders: float, width_mm: float) -> Difficulty:
    """Return how difficult an assembly is.

    The score grows with the hours, with the strands that have to be slid under others, and with
    narrowness, without steps; where it is near the border of two words, both are said.

    Parameters
    ----------
    practised_h : float
        Hours that it takes practised hands.
    unders : float
        How many strands a piece is slid under, in the mean.
    width_mm : float
        How wide a piece is at a crossing, in the median.

    Examples
    --------
    >>> difficulty(0.1, 1.2, 30.0).word, difficulty(4.2, 1.6, 15.0).word
    ('easy', 'moderate')
    >>> difficulty(8.0, 6.0, 4.0).score
    7.5
    """
    load = practised_h / _HARD_H + unders / _HARD_UNDERS + _HARD_WIDTH_MM / max(width_mm, 0.1)
    score = 10.0 * load / (1.0 + load)
    at = next(number for number, (most, _) in enumerate(_WORDS) if score <= most)
    word = _WORDS[at][1]
    if at and score - _WORDS[at - 1][0] < _BETWEEN:
        word = f"{_WORDS[at - 1][1]} to {word}"
    elif _WORDS[at][0] - score < _BETWEEN:
        word = f"{word} to {_WORDS[at + 1][1]}"
    return Difficulty(round(score, 2), word)
