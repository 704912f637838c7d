"""Replay the assembly: every piece once, every crossing and joint when its last half comes."""

import itertools
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from fabweave.verify.crossing_map import CrossingMap, Piece, Step
from fabweave.verify.measure.effort import (
    efforts_of_order,
    number_by_number,
    parts_of,
    thread_by_thread,
)
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: Efforts are rounded to a hundredth.
_SAME_EFFORT = 0.006
#: The effort of the last pieces is rounded to a thousandth of the mean.
_SAME_SHARE = 0.0006


@dataclass
class _Event:
    """What placing one piece does."""

    piece: str
    made: list[int] = field(default_factory=list)
    over: dict[int, set[str]] = field(default_factory=dict)
    under: dict[int, set[str]] = field(default_factory=dict)
    joints: dict[int, str] = field(default_factory=dict)
    fasten: list[int] = field(default_factory=list)
    closes: bool = False

    @property
    def touches(self) -> bool:
        """Whether it meets anything that was there."""
        others = {name for names in (*self.over.values(), *self.under.values()) for name in names}
        return bool((others | set(self.joints.values())) - {self.piece})


@dataclass
class _Table:
    """The work on the table: what lies at each crossing, and which pieces are there."""

    plan: CrossingMap
    placed: set[str] = field(default_factory=set)
    lies: dict[int, list[tuple[str, bool]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Count how many layers each crossing will have."""
        self.missing = Counter(
            station.crossing for piece in self.plan.pieces for station in piece.stations
        )

    def place(self, piece: Piece) -> _Event:
        """Place a piece and return what happens."""
        event = _Event(piece.id)
        self.placed.add(piece.id)
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
        joined = 0
        for joint, mate in zip(piece.joints, (0, 1), strict=True):
            if joint is not None and self.plan.joint[joint].pieces[mate] in self.placed:
                event.joints[joint] = self.plan.joint[joint].pieces[mate]
                joined += 1
        event.closes = joined == 2
        return event


def check_steps(job: Job, tally: Tally) -> None:
    """Check the steps of the assembly by doing them."""
    plan = required(job.map)
    assembly = tally.at("steps")
    numbers = [step.step for step in plan.steps]
    assembly.equal("their numbering", numbers, list(range(1, len(numbers) + 1)))
    times = Counter(name for step in plan.steps for name in step.pieces)
    for piece in plan.pieces:
        tally.at(f"piece {piece.id}").equal("how often it is placed", times[piece.id], 1)
    table = _Table(plan)
    first: list[str] = []
    rings = job.rim.rings if job.rim is not None else []
    held = {key for step in plan.steps if step.ring is not None for key in step.fasten}
    laid = [step for step in plan.steps if step.ring is not None]
    assembly.expect(
        laid == list(plan.steps[len(plan.steps) - len(laid) :]) and len(laid) == len(rings),
        "the last steps lay not each one of the rings",
    )
    for step, ring in zip(laid, rings, strict=False):
        _check_ring(plan, step, ring, tally.at(f"step {step.step}"))
    for step in plan.steps[: len(plan.steps) - len(laid)]:
        events = [table.place(plan.piece[name]) for name in step.pieces if name not in table.placed]
        first += [event.piece for event in events if not event.touches]
        _check_step(step, events, held, tally.at(f"step {step.step}"))
    parts = parts_of(plan)
    count = len(set(parts.values()))
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
    _check_end(plan, assembly)
    if job.mesh is not None and sorted(times.elements()) == sorted(plan.piece):
        _check_efforts(plan, parts, tally, enclosed=bool((job.mesh.twin >= 0).all()))


def _check_ring(plan: CrossingMap, step: Step, ring: dict[str, Any], place: Place) -> None:
    """Check the step that lays a ring: what it holds waits for it, and its text names all that."""
    runs = [[int(hole["crossing"]) for hole in piece["holes"]] for piece in ring["pieces"]]
    names = [str(piece["id"]) for piece in ring["pieces"]]
    place.equal("its ring", list(step.ring or ()), names)
    place.same("crossings to fasten", step.fasten, {key for run in runs for key in run})
    nothing = (step.pieces, step.crossings, step.over, step.under, step.joints)
    place.expect(not any(nothing) and not step.closes, "it does more than to lay a ring")
    said = []
    for name, run in zip(names, runs, strict=True):
        ways = [plan.crossing[key] for key in run if key in plan.crossing]
        holes = [
            f"{way.over.piece} with {way.under.piece} ({at})" for at, way in enumerate(ways, 1)
        ]
        said.append(f"{name} at {', '.join(holes)}")
    head, _, rest = step.text.partition(": ")
    place.equal("what its text says of holes", rest, f"{'; '.join(said)}.")
    place.expect(
        re.findall(r"R+[0-9]+", head) == names and f" at the {ring['side']}, " in head,
        "its text names another ring",
    )


def _check_step(step: Step, events: list[_Event], held: set[int], place: Place) -> None:
    """Check the lists of a step, and that its text names what they do.

    Crossings that are ``held`` by a ring are fastened with it.
    """
    fasten = [key for event in events for key in event.fasten if key not in held]
    for names, stated, wanted in (
        ("crossings made", step.crossings, [key for event in events for key in event.made]),
        ("crossings over", step.over, [key for event in events for key in event.over]),
        ("crossings under", step.under, [key for event in events for key in event.under]),
        ("joints made", step.joints, [key for event in events for key in event.joints]),
        ("crossings to fasten", step.fasten, fasten),
    ):
        place.same(names, stated, wanted)
    place.equal("closes", step.closes, any(event.closes for event in events))
    sentences = [text for text in re.split(r"(?<=\.)\s+", step.text) if text]
    if place.equal("the number of sentences", len(sentences), len(events)):
        for sentence, event in zip(sentences, events, strict=True):
            _check_text(sentence, event, place.at(f"text of piece {event.piece}"))


def _check_text(sentence: str, event: _Event, place: Place) -> None:
    """Check that a text names what a piece goes over and under and is joined to."""
    names: dict[str, set[str]] = {"over": set(), "under": set(), "joint": set()}
    for clause in sentence.rstrip(".").split(";"):
        if "#" in clause:
            names["joint"].update(re.findall(r"[A-Z]+[0-9]+|#[0-9]+", clause))
            continue
        for word in ("over", "under"):
            _, _, rest = f" {clause} ".partition(f" {word} ")
            names[word].update(re.findall(r"[A-Z]+[0-9]+", rest))
    wanted = {
        "over": {name for names in event.over.values() for name in names},
        "under": {name for names in event.under.values() for name in names},
        "joint": {f"#{joint}" for joint in event.joints}
        | {mate for mate in event.joints.values() if mate != event.piece},
    }
    place.expect(
        re.findall(r"[A-Z]+[0-9]+", sentence)[:1] == [event.piece] and names == wanted,
        f"it names {_named(names)}, but should name {_named(wanted)}",
    )


def _named(names: dict[str, set[str]]) -> str:
    """Write the names in a text for a finding."""
    return ", ".join(f"{word} {' '.join(sorted(ids))}" for word, ids in names.items() if ids)


def _check_efforts(
    plan: CrossingMap, parts: dict[str, str], tally: Tally, *, enclosed: bool
) -> None:
    """Check what each step takes, and what is claimed to be saved against naive orders."""
    order = [name for step in plan.steps for name in step.pieces]
    efforts = efforts_of_order(plan, order, parts, enclosed=enclosed)
    each = iter(efforts)
    for step in plan.steps:
        effort = sum(itertools.islice(each, len(step.pieces)))
        tally.at(f"step {step.step}").number("effort", step.effort, effort, within=_SAME_EFFORT)
    naive = [
        efforts_of_order(plan, names, parts, enclosed=enclosed)
        for names in (thread_by_thread(plan), number_by_number(plan))
    ]
    place = tally.at("crossing_map.json", "assembly")
    names = ("effort", "by_thread", "by_number")
    for name, stated, wanted in zip(names, plan.efforts, (efforts, *naive), strict=True):
        place.number(name, stated, sum(wanted), within=_SAME_EFFORT)


def _check_end(plan: CrossingMap, place: Place) -> None:
    """Check how hard the last steps are said to be: those that have a tenth of the pieces."""
    total = sum(step.effort for step in plan.steps)
    late, spent = 0, 0.0
    for step in reversed(plan.steps):
        if 10 * late < len(plan.pieces):
            late, spent = late + len(step.pieces), spent + step.effort
    if late and total > 0.0:
        end = spent / late / (total / len(plan.pieces))
        place.number("last_tenth", plan.last_tenth, end, within=_SAME_SHARE)
