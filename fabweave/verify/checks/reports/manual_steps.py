"""Check the steps of the manual: every step once, in order, with all its words and names."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from fabweave.verify.checks.reports.hands import seconds_of_steps
from fabweave.verify.crossing_map import CrossingMap, Piece, Step
from fabweave.verify.running_text import RunningText

PICTURED = (
    "A picture of the whole object shows where the next pieces go; then each step has a picture "
    "of its own, seen from the same side. New pieces have their full colour and a heavy outline, "
    "and a black name; pieces in place are pale. A name with a disc is that of a piece that the "
    "new one lies over, with a ring that of one that it runs under, as it is engraved beside "
    "crossings; # is a joint. An arrow shows where an end slides beneath others, and a circle with "
    "a cross where all layers are now in place. A card shows the new piece flat, its outer face up "
    "and its start at the left: in order from there, all that crosses it and is in place, with a "
    "disc where the piece goes over it and a ring where it runs under. Grey lines are strands to "
    "come."
)
_UNPICTURED = (
    "There are too many steps to show each in a picture here: model.glb shows the woven object, "
    "and assembly.html each step on it, where that could be made."
)
RINGED = (
    " Crossings that the ring around an opening holds get their fasteners with it, at the end: "
    "until then, clips are enough there."
)
BOXES = " Tick the box of a piece when it is in its place."
OVER, UNDER, COMPLETE = "●", "○", "⊕"
_AROUND = ("front", "front right", "right", "back right", "back", "back left", "left", "front left")
#: From where an object may be seen.
_SIDES = (
    *(f"the {side}{high}" for side, high in product(_AROUND, ("", " and above", " and below"))),
    "straight above",
    "straight below",
)
#: What is new has so much room in its picture, the lower way; and the next scale that is used is
#: not farther off than this.
_LOW_MM, _NEXT = 37.0, 1.25
#: Times are rounded to a minute.
_SAME_MIN = 0.51


def check_steps(plan: CrossingMap, text: RunningText) -> None:
    """Check all texts of the steps against the map.

    Parameters
    ----------
    plan : CrossingMap
    text : RunningText
        That of the pages of steps.
    """
    ringed = RINGED if any(step.ring is not None for step in plan.steps) else ""
    pictured = text.skip(PICTURED + ringed + BOXES)
    if not pictured:
        text.block(_UNPICTURED + ringed + BOXES)
    check, at, side = _StepCheck(plan, text), 0, ""
    while at < len(plan.steps) and not text.lost:
        end = at + 1
        if pictured and plan.steps[at].ring is None:
            end, side = check.whole(at, side)
        for step in plan.steps[at:end]:
            check.step(step, pictured=pictured)
        at = end
    text.end()


class _StepCheck:
    """Reads one step after another, with what is in place."""

    def __init__(self, plan: CrossingMap, text: RunningText) -> None:
        self._plan, self._text = plan, text
        self._strands: dict[tuple[int, bool], list[str]] = {}
        for piece in plan.pieces:
            # A ring of one piece that laps itself is named once.
            for strand in {(station.crossing, station.over) for station in piece.stations}:
                self._strands.setdefault(strand, []).append(piece.id)
        self._idle = {crossing.id for crossing in plan.crossings if crossing.fastened is False}
        self._there: set[str] = set()
        self._seconds = seconds_of_steps(plan)
        self._so_far = 0.0

    def whole(self, at: int, side: str) -> tuple[int, str]:
        """Read the picture of the whole object before some steps.

        Returns
        -------
        end : int
            The first step that it does not show.
        side : str
            From where it is seen.
        """
        steps, text = self._plan.steps, self._text
        due = f"a run of steps from {steps[at].step}"
        said = text.match(r"Next: steps? (\d+)(?: to (\d+))?", due)
        last = 0 if said is None else int(said[2] or said[1])
        end = next((k + 1 for k in range(at, len(steps)) if steps[k].step == last), at)
        if said is None or int(said[1]) != steps[at].step or end == at:
            text.place.fail(f"a picture of the whole object does not show {due}")
            return len(steps), side
        sides = {f"Seen from {one}.": one for one in (_SIDES if at == 0 else [side])}
        if at:
            turned = (one for one in _SIDES if one != side)
            sides |= {f"Turn the object to see it from {one}.": one for one in turned}
        told = next((words for words in sides if text.skip(words)), "")
        if not told:
            text.block(*sides)
        side = sides.get(told, side)
        new = [key for step in steps[at:end] for key in step.pieces]
        count, pieces = len(self._there) + len(new), len(self._plan.pieces)
        are = "piece is" if pieces == 1 else "pieces are"
        text.block(f"With these, {count} of {pieces} {are} in place.")
        shown = text.some_of(set(new))
        text.place.equal(f"what is named before step {steps[at].step}", shown, new)
        return end, side

    def step(self, step: Step, *, pictured: bool) -> None:
        """Read a step."""
        plan, text = self._plan, self._text
        text.block(f"Step {step.step}")
        self._check_time(step)
        for key in step.pieces:
            text.block(_place(plan, plan.piece[key]))
        for name in step.ring or ():
            text.block(f"{name} (rim)")
        self._there.update(step.pieces)
        text.block(step.text)
        due = [key for key in step.fasten if key not in self._idle]
        if due and step.ring is None and not pictured:
            text.block(f"All layers are in place: {self._layers(step, due)}.")
        if carried := [self._hung(key) for key in sorted(step.fasten) if plan.crossing[key].hang]:
            text.block(f"A cord or a foot goes here: {_listed(carried)}.")
        if step.ring is not None and not text.lost:
            self._check_ring(step)
        elif pictured and not text.lost:
            for key in step.pieces:
                self._check_card(plan.piece[key], step, due)
            self._check_names(step, len(due))

    def _check_card(self, piece: Piece, step: Step, due: Sequence[int]) -> None:
        """Read the card of a piece, if it has one: all that it meets, from its start to its end."""
        words = list(self._on_card(piece, step, due))
        for word in (piece.id, *words) if words else ():
            if word in (OVER, UNDER, COMPLETE):
                self._text.match(word, word)
            else:
                self._text.block(word)

    def _on_card(self, piece: Piece, step: Step, due: Sequence[int]) -> Iterator[str]:
        """Yield what a card says behind the id of its piece."""
        first, last = (
            [] if key is None or key not in step.joints else [f"#{key}>{self._mate(piece, key)}"]
            for key in piece.joints
        )
        yield from first
        for station in piece.stations:
            others = self._strands.get((station.crossing, not station.over), [])
            there = [other for other in others if other in self._there]
            if there and station.crossing in (step.over if station.over else step.under):
                yield OVER if station.over else UNDER
                yield " ".join(there)
                if station.crossing in due:
                    yield COMPLETE
        yield from last

    def _mate(self, piece: Piece, joint: int) -> str:
        """Return whom a piece is joined to, which may be itself."""
        pieces = self._plan.joint[joint].pieces
        return next((name for name in pieces if name != piece.id), piece.id)

    def _hung(self, key: int) -> str:
        """Name a crossing that carries something, and its hole."""
        crossing = self._plan.crossing[key]
        station = self._plan.piece[crossing.over.piece].stations[crossing.over.station]
        hole = station.hole_mm
        if hole is None and station.joint is not None:
            hole = self._plan.joint[station.joint].hole_mm
        told = "" if hole is None else f" (hole of {hole:g} mm)"
        return f"{crossing.over.piece} with {crossing.under.piece}{told}"

    def _check_ring(self, step: Step) -> None:
        """Check the picture of a ring: its pieces, each with the numbers of its holes."""
        text = self._text
        parts = re.findall(r"[:;] (R+\d+) at ([^;]*)", step.text)
        for name, holes in parts:
            for number in range(1, 1 + len(re.findall(r"\(\d+\)", holes))):
                text.block(str(number))
            text.block(name)
        text.match(r"1 : \d+(\.\d)?", "its scale")

    def _check_time(self, step: Step) -> None:
        """Check how long a step is said to take, and all up to it."""
        seconds = self._seconds[self._plan.steps.index(step)]
        self._so_far += seconds
        said = self._text.match(r"(\d+) min, (\d+) h (\d\d)", "how long it takes")
        if said is None:
            return
        here = self._text.place.at(f"step {step.step}")
        own, hours, minutes = map(int, said.groups())
        for name, stated, wanted in (
            ("minutes", own, seconds / 60.0),
            ("minutes so far", 60 * hours + minutes, self._so_far / 60.0),
        ):
            here.number(name, float(stated), max(wanted, 1.0), within=_SAME_MIN)
        here.expect(minutes < 60, "an hour has 60 minutes or more")

    def _layers(self, step: Step, due: Sequence[int]) -> str:
        """Return which pieces meet others where the last layer has come."""
        met: dict[str, list[str]] = {}
        for crossing in due:
            for key in step.pieces:
                # Of a piece that crosses itself there, its first station.
                for station in reversed(self._plan.piece[key].stations):
                    if station.crossing == crossing:
                        last, over = key, station.over
            others = self._strands[crossing, not over]
            met.setdefault(last, []).extend(others)
        return "; ".join(f"{key} with {_listed(others)}" for key, others in met.items())

    def _check_names(self, step: Step, due: int) -> None:
        """Check the names in the picture of a step, with their signs, and its scale."""
        text, here = self._text, self._text.place.at(f"picture of step {step.step}")
        here.equal("how many crossings are complete", len(text.some_of({COMPLETE})), due)
        wanted = Counter(step.pieces)
        wanted.update(f"#{key}" for key in step.joints)
        for key in step.pieces:
            wanted.update(self._met(self._plan.piece[key], step))
        words = {word for name in wanted for word in name.split(" ")}
        shown: list[str] = []
        for word in text.some_of(words | {OVER, UNDER}):
            if shown and shown[-1] in (OVER, UNDER):
                shown[-1] += f" {word}"
            else:
                shown.append(word)
        here.same("names", shown, list(wanted.elements()))
        said = text.match(r"1 : (\d+(?:\.\d\d?)?)", "its scale")
        if said is not None:
            ratio, most = float(said[1]), self._smallest(step)
            here.expect(
                1.0 <= ratio <= most and f"{ratio:g}" == said[1],
                f"its scale is 1 : {said[1]}, which is none from 1 : 1 to 1 : {most:.1f}",
            )

    def _smallest(self, step: Step) -> float:
        """Return how many times smaller than they are new pieces need be drawn at the most.

        No two places of a piece are farther apart than half the way around it.
        """
        pieces = [self._plan.piece[key] for key in step.pieces]
        around = max(
            float(
                np.linalg.norm(np.diff(one.outline, axis=0, append=one.outline[:1]), axis=1).sum()
            )
            for one in pieces
        )
        wide = around / 2.0
        if len(pieces) > 1:
            met = {station.crossing for one in pieces for station in one.stations}
            places = [one.position for one in self._plan.crossings if one.id in met]
            wide += float(np.linalg.norm(np.ptp(np.array(places).reshape(-1, 3), axis=0)))
        return 1.0 + _NEXT * wide / _LOW_MM

    def _met(self, piece: Piece, step: Step) -> Iterator[str]:
        """Yield what a new piece lies over or runs under, once each."""
        named = set()
        for station in piece.stations:
            if station.crossing in (step.over if station.over else step.under):
                for other in self._strands.get((station.crossing, not station.over), []):
                    if other in self._there:
                        named.add(f"{OVER if station.over else UNDER} {other}")
        yield from named


def _place(plan: CrossingMap, piece: Piece) -> str:
    """Return a piece's id and where it is found."""
    which = f"sheet {piece.sheet}"
    if plan.cut.labels == "kinds":
        which = f"any K{piece.kind}" + (", arrow back" if piece.turned else "")
    return f"{piece.id} ({which})"


def _listed(names: Sequence[str]) -> str:
    """Join names, each once, with commas and a last 'and'."""
    once = list(dict.fromkeys(names))
    return " and ".join((", ".join(once[:-1]), once[-1])) if len(once) > 1 else once[0]
