"""Replay the assembly: every piece once, every crossing and joint when its last half comes."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from fabweave.verify.crossing_map import CrossingMap, Piece, Step
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
        _check_ring(step, ring, tally.at(f"step {step.step}"))
    for step in plan.steps[: len(plan.steps) - len(laid)]:
        events = [table.place(plan.piece[name]) for name in step.pieces if name not in table.placed]
        first += [event.piece for event in events if not event.touches]
        _check_step(step, events, held, tally.at(f"step {step.step}"))
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
    nothing = (step.pieces, step.crossings, step.over, step.under, step.joints)
    place.expect(not any(nothing) and not step.closes, "it does more than to lay a ring")


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
    ):
        place.same(names, stated, wanted)
    place.equal("closes", step.closes, any(event.closes for event in events))
