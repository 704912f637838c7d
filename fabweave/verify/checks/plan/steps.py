"""Replay the assembly: every piece once, every crossing and joint when its last half comes."""

import re
from collections import Counter
from dataclasses import dataclass, field

from fabweave.verify.crossing_map import CrossingMap, Piece, Step
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
    for step in plan.steps:
        events = [table.place(plan.piece[name]) for name in step.pieces if name not in table.placed]
        first += [event.piece for event in events if not event.touches]
        _check_step(step, events, tally.at(f"step {step.step}"))
    parts = _components(plan)
    assembly.expect(
        len(first) == parts,
        f"{len(first)} pieces hold on nothing when they come ({', '.join(first[:4])}), but the "
        f"object has {parts} separate parts to begin",
    )
    for crossing in plan.crossings:
        lies = table.lies.get(crossing.id, [])
        tally.at(f"crossing {crossing.id}").expect(
            (crossing.over.piece, True) in lies and (crossing.under.piece, False) in lies,
            f"after the last step {crossing.over.piece} does not lie over {crossing.under.piece}",
        )
    _check_effort(plan, assembly)


def _check_step(step: Step, events: list[_Event], place: Place) -> None:
    """Check the lists of a step, and that its text names what they do."""
    for names, stated, wanted in (
        ("crossings made", step.crossings, [key for event in events for key in event.made]),
        ("crossings over", step.over, [key for event in events for key in event.over]),
        ("crossings under", step.under, [key for event in events for key in event.under]),
        ("joints made", step.joints, [key for event in events for key in event.joints]),
        ("crossings to fasten", step.fasten, [key for event in events for key in event.fasten]),
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


def _components(plan: CrossingMap) -> int:
    """Count the sets of pieces that hang together by crossings and joints."""
    above = {piece.id: piece.id for piece in plan.pieces}

    def top(name: str) -> str:
        while above[name] != name:
            above[name] = above[above[name]]
            name = above[name]
        return name

    at: dict[int, str] = {}
    for piece in plan.pieces:
        for station in piece.stations:
            above[top(piece.id)] = top(at.setdefault(station.crossing, piece.id))
    for joint in plan.joints:
        above[top(joint.pieces[0])] = top(joint.pieces[1])
    return len({top(name) for name in above})


def _check_effort(plan: CrossingMap, place: Place) -> None:
    """Check that the efforts are numbers that add up; the model behind them is a judgement."""
    total = sum(step.effort for step in plan.steps)
    least = min([*(step.effort for step in plan.steps), *plan.efforts])
    place.expect(least >= 0.0, f"an effort is negative: {least}")
    within = _SAME_EFFORT * (1 + len(plan.steps))
    place.number("their effort in all", plan.efforts[0], total, within=within)
    # The last steps that have a tenth of the pieces.
    late, spent = 0, 0.0
    for step in reversed(plan.steps):
        if 10 * late < len(plan.pieces):
            late, spent = late + len(step.pieces), spent + step.effort
    if late and total > 0.0:
        end = spent / late / (total / len(plan.pieces))
        place.number("last_tenth", plan.last_tenth, end, within=_SAME_SHARE)
