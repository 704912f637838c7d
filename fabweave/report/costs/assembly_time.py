"""Say how long hands take to put an object together, and how difficult it is, from what they do."""

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

from fabweave.core.records import record
from fabweave.flat.bill_of_materials import BillOfMaterials
from fabweave.flat.crossing_map import CrossingMap, HoleRecord, StepRecord
from fabweave.flat.joint.kinds import KINDS
from fabweave.report.costs.fasteners import fastener_class
from fabweave.stock.machine import HOLDING_S, MIDDLE_PACE, PACE, PRACTISED, Span

#: Before the order is known: the share of crossings at which a strand is slid under; 0.33 to 0.55
#: in jobs of 8 to 140 pieces.
_UNDER = 0.38
_HOUR_S = 3600.0


@record
class Counts:
    """What is done how often: ``joints`` without fasteners by kind, ``fasteners`` by diameter."""

    pieces: int
    over: int
    under: int
    joints: tuple[tuple[str, int], ...]
    fasteners: tuple[tuple[float, int], ...]


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


class Difficulty(NamedTuple):
    """How difficult an assembly is, from 0 to 10, and in a word or two."""

    score: float
    word: str


def step_counts(
    steps: Sequence[StepRecord], joints: Sequence[str], bill: BillOfMaterials
) -> Counts:
    """Count what is done in steps that are known.

    Parameters
    ----------
    steps : sequence of StepRecord
    joints : sequence of str
        The kind of each joint.
    bill : BillOfMaterials
        Whose fasteners are set.
    """
    return _counts(
        sum(step.handled for step in steps),
        sum(len(step.over) for step in steps),
        sum(len(step.under) for step in steps),
        joints,
        bill,
    )


def planned_counts(
    pieces: int, crossings: int, joints: Sequence[str], bill: BillOfMaterials
) -> Counts:
    """Predict what is done before the order of pieces is known.

    At each crossing one strand is laid over or slid under the other; of two pieces that are joined
    there, one or both.
    """
    placed = crossings + len(joints) // 2
    under = round(_UNDER * placed)
    return _counts(pieces, placed - under, under, joints, bill)


def _counts(
    pieces: int, over: int, under: int, joints: Sequence[str], bill: BillOfMaterials
) -> Counts:
    held = sorted({kind for kind in joints if not KINDS[kind].most_fasteners})
    diameters = sorted({row.diameter_mm for row in bill.fasteners})
    return Counts(
        pieces=pieces,
        over=over,
        under=under,
        joints=tuple((kind, joints.count(kind)) for kind in held),
        fasteners=tuple(
            (size, sum(row.needed for row in bill.fasteners if row.diameter_mm == size))
            for size in diameters
        ),
    )


def assembly_time(counts: Counts) -> AssemblyTime:
    """Return what actions take together.

    Examples
    --------
    300 pieces, 500 strands over, 500 under and 600 fasteners of 10 s are 5.4 hours in practised
    hands, and 8 to 16 in a maker's.

    >>> counts = Counts(pieces=300, over=500, under=500, joints=(), fasteners=((3.2, 600),))
    >>> found = assembly_time(counts)
    >>> round(found.practised_h, 1), [round(hours) for hours in found.hours]
    (5.4, [8, 16])
    """
    fasteners = sum(number for _, number in counts.fasteners)
    often = {
        "sort": counts.pieces,
        "find": counts.pieces,
        "take": counts.pieces,
        "over": counts.over,
        "under": counts.under,
        "align": fasteners + sum(number for _, number in counts.joints),
    }
    actions = [
        Action(action=name, count=often[name], each_s=seconds, words=words)
        for name, (seconds, words) in PRACTISED.items()
    ]
    actions += [
        Action(action=kind, count=number, each_s=HOLDING_S[kind], words=f"to make a {kind} joint")
        for kind, number in counts.joints
    ]
    actions += [
        Action(
            action=f"fasten {size:g} mm",
            count=number,
            each_s=fastener_class(size).seconds,
            words=f"to set a fastener in a hole of {size:g} mm",
        )
        for size, number in counts.fasteners
    ]
    practised = sum(action.count * action.each_s for action in actions) / _HOUR_S
    return AssemblyTime(
        actions=tuple(action for action in actions if action.count),
        practised_h=round(practised, 4),
        hours=(round(PACE[0] * practised, 4), round(PACE[1] * practised, 4)),
    )


def step_seconds(crossing_map: CrossingMap) -> list[float]:
    """Return about how many seconds each step takes a maker: half way from quick to slow.

    Its fasteners are set when the last layer of their crossing is in place, or with the ring that
    they hold. All steps together take as long as ``assembly_time`` says, but for sorting, which
    comes before them.
    """
    holes: dict[int, list[float]] = defaultdict(list)
    for piece in crossing_map.pieces:
        for cut in piece.cutouts:
            station = piece.stations[cut.station]
            if isinstance(cut, HoleRecord) and station.over:
                holes[station.crossing].append(cut.diameter_mm)
    for crossing in crossing_map.crossings:
        if crossing.fastened is False:
            holes.pop(crossing.id, None)
    kind = {joint.id: joint.kind for joint in crossing_map.joints}
    seconds = []
    for step in crossing_map.steps:
        set_here = [size for key in step.fasten for size in holes.get(key, ())]
        held = [kind[key] for key in step.joints if not KINDS[kind[key]].most_fasteners]
        often = {
            "find": step.handled,
            "take": step.handled,
            "over": len(step.over),
            "under": len(step.under),
            "align": len(set_here) + len(held),
        }
        total = sum(count * PRACTISED[name][0] for name, count in often.items())
        total += sum(HOLDING_S[name] for name in held)
        total += sum(fastener_class(size).seconds for size in set_here)
        seconds.append(MIDDLE_PACE * total)
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
