"""Write down the steps of the assembly: what goes where, over and under what, in words."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from string import digits
from typing import NamedTuple

import numpy as np

from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.piece.piece import Piece, find_owners
from fabweave.piece.pieces import PieceSet
from fabweave.piece.rim_ring import RimRing
from fabweave.plan.bill_of_materials import INSTEAD, sold_at
from fabweave.plan.crossing_map import ClipPlace, StepRecord
from fabweave.plan.loose import strands_of
from fabweave.plan.order import Order
from fabweave.plan.reach import job_clips, set_outside

_SET_OUTSIDE = "You can no longer reach inside: from here on set fasteners from outside."
#: Of more strands that a piece meets, steps tell numbers only: names are on its card.
MOST_NAMED = 8
#: While so few pieces are in place, steps say where on these the new one comes to lie.
_EARLY = 15


@dataclass
class _Placing:
    """What happens when a piece is placed; lists are in the order of its stations."""

    piece: int
    effort: float
    crossings: list[int] = field(default_factory=list)
    over: list[int] = field(default_factory=list)
    under: list[int] = field(default_factory=list)
    joints: list[int] = field(default_factory=list)
    fasten: list[int] = field(default_factory=list)
    numbers: dict[int, int] = field(default_factory=dict)
    closes: bool = False
    text: str = ""


def build_steps(piece_set: PieceSet, order: Order, hardware: str | None = None) -> list[StepRecord]:
    """Build the steps of an order: one piece each, then rings.

    What a ring holds is fastened in its step, and not when its last layer comes.

    Parameters
    ----------
    piece_set : PieceSet
        All pieces and joints of the job.
    order : Order
        The order of its pieces.
    hardware : str, optional
        The sort of fastener that is to be used.
    """
    sold = sold_at(piece_set, hardware, order)
    held = {key for ring in piece_set.rings for key in ring.crossings.tolist()}
    placings = _place_all(piece_set, order)
    clips = _clips_of(piece_set, order, placings)
    blind = set_outside(piece_set, order)
    where = {joint.id: joint.crossing for joint in piece_set.joints}
    fixed = {
        key: number
        for number, placing in enumerate(placings, start=1)
        for key in placing.fasten
        if key in sold and key not in held
    }
    steps: list[StepRecord] = []
    for number, placing in enumerate(placings, start=1):
        fasten = tuple(key for key in placing.fasten if key not in held)
        outside = tuple(key for key in fasten if key in blind)
        shut = bool(outside) and not any(step.outside for step in steps)
        said = [placing.text, *([_SET_OUTSIDE] if shut else [])]
        said += _say_set(fasten, sold, placing.numbers)
        clipped = {key for key, _, _ in clips.on[number]}
        said += [
            f"Joint {key} is fixed in step {fixed[at]}."
            for key, at in ((key, where[key]) for key in placing.joints)
            if at not in clipped and fixed.get(at, number) > number
        ]
        steps.append(
            StepRecord(
                step=number,
                pieces=(piece_set.pieces[placing.piece].id,),
                crossings=tuple(placing.crossings),
                over=tuple(placing.over),
                under=tuple(placing.under),
                joints=tuple(placing.joints),
                fasten=fasten,
                closes=placing.closes,
                effort=round(placing.effort, 2),
                text=" ".join([*said, *clips.said(number)]),
                clips=tuple(clips.on[number]) or None,
                unclips=tuple(clips.off[number]) or None,
                outside=outside or None,
            )
        )
    return steps + _ring_steps(piece_set, sold, first=len(steps) + 1)


def _say_set(
    crossings: Sequence[int], sold: Mapping[int, Counter[str]], numbers: Mapping[int, int]
) -> list[str]:
    """Say what is set at crossings, as it is sold, and at which numbers; nothing for none."""
    count, at = Counter[str](), defaultdict[str, list[int]](list)
    for key in crossings:
        for name, often in sold.get(key, {}).items():
            count[name] += often
            at[name] += [numbers[key]] if key in numbers else []
    where = {
        name: listed([f"({one})" for one in sorted(at[name])]) if at[name] else "" for name in count
    }
    places = agree(count[INSTEAD], "{n} [place|places]")
    return [
        f"At {where[name] or places}, {INSTEAD}."
        if name == INSTEAD
        else f"Set {often} × {name}{where[name] and f' at {where[name]}'}."
        for name, often in count.items()
    ]


class _Clips(NamedTuple):
    """Which clips are put on after each step, and which come off; and where each of them is."""

    on: dict[int, list[ClipPlace]]
    off: dict[int, list[ClipPlace]]
    since: dict[ClipPlace, int]
    where: dict[ClipPlace, str]

    def _named(self, place: ClipPlace) -> str:
        _, one, other = place
        whom = f"{one} to {other}" if one != other else f"both ends of {one}"
        return whom + self.where[place]

    def said(self, step: int) -> list[str]:
        """Say which clips are put on, and which come off."""
        on = [self._named(place) for place in self.on[step]]
        off = [
            f"{'on ' * (place[1] == place[2])}{self._named(place)} of step {self.since[place]}"
            for place in self.off[step]
        ]
        said = [f"Clip {listed(on)}."] if on else []
        clips = "clips" if off[1:] else "clip"
        return said + ([f"Take off the {clips} {listed(off)}."] if off else [])


def _clips_of(piece_set: PieceSet, order: Order, placings: Sequence[_Placing]) -> _Clips:
    """Return the clips of all steps, from 1."""
    clips = _Clips(defaultdict(list), defaultdict(list), {}, {})
    laps = {(one.crossing, frozenset(one.pieces)): one.id for one in piece_set.joints}
    for clip in job_clips(piece_set, order):
        one, other = (piece_set.pieces[at] for at in clip.pieces)
        place: ClipPlace = clip.crossing, one.id, other.id
        clips.on[clip.since + 1].append(place)
        clips.since[place] = clip.since + 1
        if (lap := laps.get((clip.crossing, frozenset(clip.pieces)))) is not None:
            clips.where[place] = f" at joint {lap}"
        elif (number := placings[clip.since].numbers.get(clip.crossing)) is not None:
            clips.where[place] = f" at ({number})"
        else:
            clips.where[place] = _at(one, clip.crossing)
        if clip.until < len(order.order):
            clips.off[clip.until + 1].append(place)
    return clips


def _ring_steps(
    piece_set: PieceSet, sold: Mapping[int, Counter[str]], *, first: int
) -> list[StepRecord]:
    """Return a step for each ring: its pieces are laid, and fastened through all layers."""
    if not piece_set.rings:
        return []
    pieces = piece_set.pieces
    owners = find_owners(pieces, len(piece_set.fastened)).piece
    names = [f"{pieces[over].id} with {pieces[under].id}" for under, over in owners.tolist()]
    return [
        StepRecord(
            step=number,
            pieces=(),
            crossings=(),
            over=(),
            under=(),
            joints=(),
            fasten=fasten,
            closes=False,
            effort=0.0,
            text=" ".join([_say_ring(ring, names), *_say_set(fasten, sold, {})]),
            ring=tuple(piece.id for piece in ring.pieces),
        )
        for number, ring in enumerate(piece_set.rings, start=first)
        for fasten in [tuple(dict.fromkeys(ring.crossings.tolist()))]
    ]


def _say_ring(ring: RimRing, names: Sequence[str]) -> str:
    """Say how a ring is laid; ``names`` says which pieces meet at each crossing."""
    said = []
    for course in ring.courses:
        face = "inside" if course[0].inside else "outside"
        parts = [
            f"{piece.id} at "
            + ", ".join(
                f"{names[key]} ({at})" for at, key in enumerate(piece.crossings.tolist(), 1)
            )
            for piece in course
        ]
        said.append(
            f"Lay {listed([piece.id for piece in course])} along the rim at the {ring.side}, "
            f"{face}, letters towards you, to the right as seen with the rim above, the last hole "
            f"of each piece over the first of the next: {'; '.join(parts)}."
        )
    return " ".join([*said, "Fasten the ring through all layers. Then no clip is needed there."])


def _place_all(piece_set: PieceSet, order: Order) -> list[_Placing]:
    """Place the pieces one after another."""
    pieces = piece_set.pieces
    carriers = strands_of(pieces)
    layers: dict[int, int] = {}
    for (crossing, _), own in carriers.items():
        layers[crossing] = layers.get(crossing, 0) + len(own)
    joints = {joint.id: joint for joint in piece_set.joints}
    rings = _rings(pieces)
    there: set[int] = set()
    crossed: set[int] = set()
    result: list[_Placing] = []
    for number, effort in zip(order.order.tolist(), order.effort.tolist(), strict=True):
        piece = pieces[number]
        there.add(number)
        placing = _Placing(number, effort)
        met: list[_Meeting] = []
        half = len(piece.crossings) / 2
        for station, (crossing, over) in enumerate(
            zip(piece.crossings.tolist(), piece.over.tolist(), strict=True)
        ):
            layers[crossing] -= 1
            if layers[crossing] == 0:
                placing.fasten.append(crossing)
            others = sorted(there.intersection(carriers.get((crossing, not over), ())))
            if not others:
                continue
            if crossing not in crossed:
                crossed.add(crossing)
                placing.crossings.append(crossing)
            listed_at = placing.over if over else placing.under
            if crossing not in listed_at:
                listed_at.append(crossing)
            placing.numbers.setdefault(crossing, len(met) + 1)
            met.append(_Meeting(over, station < half, crossing, others))
        ties: list[str | None] = []
        for joint, mate in ((piece.start_joint, 0), (piece.end_joint, 1)):
            if joint is None or joints[joint].pieces[mate] not in there:
                ties.append(None)
                continue
            other = joints[joint].pieces[mate]
            tip = ("end", "start")[mate]
            whose = f"the {tip} of {pieces[other].id}" if other != number else f"its own {tip}"
            tie = joints[joint].kind.ties[1 - mate].format(whose)
            # A strip that is joined to itself is woven first, and closed at last.
            last = other == number and mate == 0
            ties.append(None if last else f"{tie} (joint {joint})")
            placing.joints.append(joint)
        placing.closes = len(placing.joints) == 2
        placing.joints = list(dict.fromkeys(placing.joints))
        ring = rings.get(piece.thread, set())
        closed = piece.id.rstrip(digits) if number in ring <= there else None
        often = Counter(other for one in met for other in one.others)
        early = len(result) < _EARLY
        names = [
            "itself"
            if number in one.others
            else _name([pieces[other] for other in one.others], one.crossing)
            if early or one.others[1:] or often[one.others[0]] > 1
            else pieces[one.others[0]].id
            for one in met
        ]
        placing.text = _say(met, names, (ties[0], ties[1]), placing.closes, closed)
        result.append(placing)
    return result


def _rings(pieces: Sequence[Piece]) -> dict[int, set[int]]:
    """Return the pieces of each thread that is a ring, by the thread."""
    rings: dict[int, set[int]] = {}
    for number, piece in enumerate(pieces):
        rings.setdefault(piece.thread, set()).add(number)
    return {
        thread: own
        for thread, own in rings.items()
        if all(None not in (pieces[at].start_joint, pieces[at].end_joint) for at in own)
    }


class _Meeting(NamedTuple):
    """What a piece meets at a station: whether it lies over it, and whether nearer to its start."""

    over: bool
    starts: bool
    crossing: int
    others: Sequence[int]


def _name(others: Sequence[Piece], crossing: int) -> str:
    """Name what is met at a crossing: a piece and where on it, or the lap of two."""
    if others[1:]:
        return f"the lap of {listed([piece.id for piece in others])}"
    return others[0].id + _at(others[0], crossing)


def _at(piece: Piece, crossing: int) -> str:
    """Say where on a piece in place a crossing is, from the first one of it."""
    steps = np.linalg.norm(np.diff(piece.points, axis=0), axis=1)
    station = int(np.flatnonzero(piece.crossings == crossing)[0])
    if station in (0, len(steps)):
        return f" at its {'end' if station else 'start'}"
    return f" at its {steps[:station].sum():.0f} mm"


def _say(
    met: Sequence[_Meeting],
    names: Sequence[str],
    ties: tuple[str | None, str | None],
    closes: bool,
    ring: str | None,
) -> str:
    """Say how a piece is placed, along its length; ``ring``: the thread whose ring it closes.

    What is nearer to an end is passed by pushing that end under it.
    """
    said = [] if ties[0] is None else [ties[0]]
    pushed = {starts for starts, tie in zip((True, False), ties, strict=True) if tie is not None}
    for (over, starts), run in groupby(
        enumerate(met), lambda one: (one[1].over, one[1].over or one[1].starts)
    ):
        own = [at for at, _ in run]
        where = (
            _counted([at + 1 for at in own])
            if len(met) > MOST_NAMED
            else listed([f"{names[at]} ({at + 1})" for at in own])
        )
        push = "" if over or starts in pushed else f"push the {'start' if starts else 'end'} "
        pushed |= set() if over else {starts}
        said.append(f"{push}{'over' if over else 'under'} {where}")
    said += [] if ties[1] is None else [ties[1]]
    if closes:
        said.append(f"ring {ring} is closed" if ring else "the gap is closed")
    tips = zip(ties, (met[:1], met[-1:]), strict=True)
    shut = all(tie is not None or any(not one.over for one in tip) for tie, tip in tips)
    two = len(met) + sum(tie is not None for tie in ties) > 1
    if shut and two and not all(one.over for one in met):
        said.insert(0, "bow the strip, so that both ends come in")
    text = "; ".join(said or ["begin: lay it on the table, its outer face up"])
    return f"{text[:1].upper()}{text[1:]}."


def _counted(numbers: Sequence[int]) -> str:
    """Return numbers that follow one another as people say them.

    Examples
    --------
    >>> _counted([3]), _counted([3, 4]), _counted([3, 4, 5])
    ('3', '3 and 4', '3 to 5')
    """
    first, last = numbers[0], numbers[-1]
    return str(first) if first == last else f"{first} {'and' if last == first + 1 else 'to'} {last}"


def listed(names: Sequence[str]) -> str:
    """Join names with commas and a last 'and'.

    Examples
    --------
    >>> listed(["A1"]), listed(["A1", "B2", "C3"])
    ('A1', 'A1, B2 and C3')
    """
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def last_tenth(steps: Sequence[StepRecord]) -> float:
    """Return how hard the last pieces are: their mean effort, as a multiple of that of all.

    The last pieces are those of the fewest last steps that have a tenth of all pieces.
    """
    pieces = sum(len(step.pieces) for step in steps)
    effort = sum(step.effort for step in steps)
    count, spent = 0, 0.0
    for step in reversed(steps):
        if 10 * count >= pieces:
            break
        count += len(step.pieces)
        spent += step.effort
    return float(spent / count / (effort / pieces)) if effort else 1.0


def order_note(order: Order, steps: Sequence[StepRecord], clips: int | None) -> Note:
    """Say what the order costs, what naive orders would, how hard the end is, what lies loose."""
    return Note(
        "assembly",
        f"assembly: effort {order.total:.0f}, where laying one strand over another counts 1: "
        f"{order.saved:.0%} less than the better of two naive orders ({order.by_thread:.0f} "
        f"thread by thread, {order.by_number:.0f} by piece number); a piece of the last tenth "
        f"takes {last_tenth(steps):.1f} times the average effort; "
        + agree(int(order.loose.max(initial=0)), "{n} [piece lies|pieces lie] loose at most")
        + (agree(clips, ", held by {n} small [clip|clips]") if clips else ""),
        detail=True,
    )
