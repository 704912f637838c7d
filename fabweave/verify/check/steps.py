"""Replay the assembly: each piece once, crossings when their last half comes, clips, reach."""

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fabweave.verify.crossing_map import Clip, CrossingMap, Piece, Step
from fabweave.verify.measure.walks import groups_of
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally


@dataclass
class _Event:
    """What placing one piece does."""

    piece: str
    made: list[int] = field(default_factory=list)
    over: dict[int, set[str]] = field(default_factory=dict)
    under: dict[int, set[str]] = field(default_factory=dict)
    joints: dict[int, str] = field(default_factory=dict)
    fasten: list[int] = field(default_factory=list)
    outside: list[int] = field(default_factory=list)
    closes: bool = False

    @property
    def touches(self) -> bool:
        """Whether it meets anything that was there."""
        others = {name for names in (*self.over.values(), *self.under.values()) for name in names}
        return bool((others | set(self.joints.values())) - {self.piece})


@dataclass
class _Table:
    """The work on the table: what lies at each crossing, and as which each piece came, from 1.

    A work that ``shuts`` lets no hand inside once three quarters of its pieces are in place.
    """

    plan: CrossingMap
    shuts: bool
    placed: dict[str, int] = field(default_factory=dict)
    lies: dict[int, list[tuple[str, bool]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Count how many layers each crossing will have."""
        self.missing = Counter(
            station.crossing for piece in self.plan.pieces for station in piece.stations
        )

    def place(self, piece: Piece) -> _Event:
        """Place a piece and return what happens."""
        event = _Event(piece.id)
        shut = self.shuts and 4 * len(self.placed) >= 3 * len(self.plan.pieces)
        self.placed[piece.id] = len(self.placed) + 1
        for station in piece.stations:
            self.lies.setdefault(station.crossing, []).append((piece.id, station.over))
        for station in piece.stations:
            key = station.crossing
            lies = self.lies[key]
            met = {name for name, over in lies if over != station.over}
            if met:
                (event.over if station.over else event.under).setdefault(key, set()).update(met)
                others = {over for name, over in lies if name != piece.id}
                if key not in event.made and len(others) < 2:
                    event.made.append(key)
            self.missing[key] -= 1
            if self.missing[key] == 0:
                event.fasten.append(key)
                if shut and self.plan.crossing[key].fastened:
                    event.outside.append(key)
        joined = 0
        for joint, mate in zip(piece.joints, (0, 1), strict=True):
            if joint is not None and self.plan.joint[joint].pieces[mate] in self.placed:
                event.joints[joint] = self.plan.joint[joint].pieces[mate]
                joined += 1
        event.closes = joined == 2
        return event

    def sets(self, ringed: set[int]) -> dict[int, int]:
        """Return after how many pieces each fastener is set that no ring waits for."""
        return {
            key: max(self.placed[name] for name, _ in lies)
            for key, lies in self.lies.items()
            if self.missing[key] == 0 and self.plan.crossing[key].fastened and key not in ringed
        }


@dataclass(frozen=True)
class _End:
    """An end of a piece, and after how many pieces it can be clipped, and is held."""

    piece: str
    crossings: set[int]
    since: float
    held: float


def _find_ends(table: _Table, sets: dict[int, int]) -> list[_End]:
    """Return the ends of all pieces on the table: each half of its stations, at least two.

    A fastener holds an end, and so does a lap without one; where there is neither, two strands do,
    if it lies over one and under the other.
    """
    ends = []
    for piece in (table.plan.piece[name] for name in table.placed):
        half = max(math.ceil(len(piece.stations) / 2), 2)
        both = (piece.stations[:half], piece.stations[-half:])
        for stations, joint, tip in zip(both, piece.joints, (0, -1), strict=True):
            others = {True: math.inf, False: math.inf}
            for station in stations:
                for name, above in table.lies[station.crossing]:
                    if above is not station.over and name != piece.id:
                        others[station.over] = min(others[station.over], table.placed[name])
            crossings = {station.crossing for station in stations}
            ties: list[float] = [sets[key] for key in crossings if key in sets]
            if joint is not None and stations[tip].crossing not in sets:
                mates = table.plan.joint[joint].pieces
                ties.append(max(table.placed.get(name, math.inf) for name in mates))
            ends.append(
                _End(
                    piece.id,
                    crossings,
                    since=max(table.placed[piece.id], min(others.values())),
                    held=min(ties, default=max(others.values())),
                )
            )
    return ends


def check_steps(job: Job, tally: Tally) -> None:
    """Check the steps of the assembly by doing them."""
    plan = required(job.map)
    assembly = tally.at("steps")
    numbers = [step.step for step in plan.steps]
    assembly.equal("their numbering", numbers, list(range(1, len(numbers) + 1)))
    times = Counter(name for step in plan.steps for name in step.pieces)
    for piece in plan.pieces:
        tally.at(f"piece {piece.id}").equal("how often it is placed", times[piece.id], 1)
    # Maps of earlier versions say nothing of clips and of what hands reach; nor have they ticks.
    says = any(step.clips or step.unclips or step.outside for step in plan.steps)
    says |= any(piece.ticks for piece in plan.pieces)
    table = _Table(plan, shuts=says and bool(np.all(required(job.mesh).twin >= 0)))
    first: list[str] = []
    held = {key for step in plan.steps if step.ring is not None for key in step.fasten}
    laid = [step for step in plan.steps if step.ring is not None]
    assembly.expect(
        laid == list(plan.steps[len(plan.steps) - len(laid) :]) and len(laid) == len(job.rings),
        "the last steps lay not each one of the rings",
    )
    for step, ring in zip(laid, job.rings, strict=False):
        _check_ring(step, ring, tally.at(f"step {step.step}"))
    for step in plan.steps[: len(plan.steps) - len(laid)]:
        events = [table.place(plan.piece[name]) for name in step.pieces if name not in table.placed]
        first += [event.piece for event in events if not event.touches]
        _check_step(step, events, held, tally.at(f"step {step.step}"))
    if says:
        _check_clips(table, held, tally)
    count = _count_parts(plan)
    assembly.expect(
        len(first) == count,
        f"{len(first)} pieces hold on nothing when they come ({', '.join(first[:4])}), but the "
        f"object has {count} separate parts to begin",
    )
    for crossing in plan.crossings:
        lies = table.lies.get(crossing.id, [])
        tally.at(f"crossing {crossing.id}").expect(
            (crossing.over.piece, True) in lies and (crossing.under.piece, False) in lies,
            f"after the last step {crossing.over.piece} does not lie over {crossing.under.piece}",
        )


def _count_parts(plan: CrossingMap) -> int:
    """Count the parts of the object, of which each hangs together by crossings and joints."""
    crossings = [(piece.id, one.crossing) for piece in plan.pieces for one in piece.stations]
    group = groups_of([*crossings, *(joint.pieces for joint in plan.joints)])
    return len({group.get(piece.id, piece.id) for piece in plan.pieces})


def _check_ring(step: Step, ring: dict[str, Any], place: Place) -> None:
    """Check the step that lays a ring: what it holds waits for it."""
    runs = [[int(hole["crossing"]) for hole in piece["holes"]] for piece in ring["pieces"]]
    names = [str(piece["id"]) for piece in ring["pieces"]]
    place.equal("its ring", list(step.ring or ()), names)
    place.same("crossings to fasten", step.fasten, {key for run in runs for key in run})
    nothing = (step.pieces, step.crossings, step.over, step.under, step.joints, step.outside)
    place.expect(not any(nothing) and not step.closes, "it does more than to lay a ring")


def _check_clips(table: _Table, ringed: set[int], tally: Tally) -> None:
    """Put clips on and take them off: each end has one until it is held.

    What nothing holds in the end needs no clip. Only rings let clips stay to the end.
    """
    sets, on, placed = table.sets(ringed), dict[Clip, set[str]](), 0
    ends, loose = sorted(_find_ends(table, sets), key=lambda end: -end.since), list[_End]()
    for step in table.plan.steps:
        place = tally.at(f"step {step.step}")
        placed = max([placed, *(table.placed.get(name, 0) for name in step.pieces)])
        for clip in step.unclips:
            place.expect(on.pop(clip, None) is not None, f"the clip {clip}, taken off, is not on")
        for clip in step.clips:
            key, one, other = clip
            lies = [lie for lie in table.lies.get(key, ()) if table.placed[lie[0]] <= placed]
            # A ring that laps itself lies there twice.
            there = Counter(name for name, _ in lies)
            place.expect(
                Counter((one, other)) <= there,
                f"the clip {clip} joins no two strands in place, one over the other",
            )
            place.expect(clip not in on, f"the clip {clip} is on already")
            on[clip] = {name for name, _ in lies}
        for clip in on:
            place.expect(
                sets.get(clip[0], math.inf) > placed, f"the clip {clip} is on where a fastener is"
            )
        while ends and ends[-1].since <= placed:
            loose.append(ends.pop())
        loose = [end for end in loose if placed < end.held < math.inf]
        for end in loose:
            place.expect(
                any(clip[0] in end.crossings and end.piece in names for clip, names in on.items()),
                f"an end of {end.piece} lies loose, and has no clip",
            )
    tally.at("steps").expect(ringed or not on, f"clips that nobody takes off: {sorted(on)[:4]}")


def _check_step(step: Step, events: list[_Event], held: set[int], place: Place) -> None:
    """Check the lists of a step.

    Crossings that are ``held`` by a ring are fastened with it.
    """
    fasten = [key for event in events for key in event.fasten if key not in held]
    for names, stated, wanted in (
        ("crossings made", step.crossings, [key for event in events for key in event.made]),
        ("crossings over", step.over, [key for event in events for key in event.over]),
        ("crossings under", step.under, [key for event in events for key in event.under]),
        ("joints made", step.joints, [key for event in events for key in event.joints]),
        ("crossings to fasten", step.fasten, fasten),
        ("crossings set outside", step.outside, [k for event in events for k in event.outside]),
    ):
        place.same(names, stated, wanted)
    place.equal("closes", step.closes, any(event.closes for event in events))
