"""Check the steps of the manual: every step once, in order, each with all its words."""

from collections.abc import Iterator
from itertools import product

from fabweave.verify.crossing_map import CrossingMap, Piece, Step
from fabweave.verify.running_text import RunningText

PICTURED = (
    "New pieces are dark, pieces in place are light, and pieces still to come are faint. Black "
    "tags name new pieces, white tags joints."
)
_UNPICTURED = (
    "There are too many steps to show each in a picture here: model.glb shows the woven object, "
    "and assembly.html each step on it, where that could be made."
)
BOXES = (
    " Tick the box when a step is done. Crossings and joints are numbered as in the crossing "
    "tables."
)
_SIDES = ("front", "front right", "right", "back right", "back", "back left", "left", "front left")
#: From where an object may be seen.
_FROM = (
    *(f"the {side} and {high}" for side, high in product(_SIDES, ("above", "below"))),
    "straight above",
    "straight below",
)
_TURNS = tuple(f"Turn the object to see it from {side}." for side in _FROM)


def check_steps(plan: CrossingMap, text: RunningText) -> None:
    """Check all texts of the steps against the map.

    Parameters
    ----------
    plan : CrossingMap
    text : RunningText
        That of the pages of steps.
    """
    pictured = text.skip(PICTURED + BOXES)
    if not pictured:
        text.block(_UNPICTURED + BOXES)
    strands: dict[tuple[int, bool], list[str]] = {}
    for piece in plan.pieces:
        for station in piece.stations:
            strands.setdefault((station.crossing, station.over), []).append(piece.id)
    idle = {crossing.id for crossing in plan.crossings if crossing.fastened is False}
    there: set[str] = set()
    for step in plan.steps:
        there.update(step.pieces)
        tags = [*step.pieces, *(f"#{key}" for key in step.joints)] if pictured else []
        shown = text.some_of(tags)
        if len(set(shown)) < len(shown):
            text.place.fail(f"the picture of step {step.step} names something twice")
        text.block(f"Step {step.step}")
        if pictured:
            text.skip(*_TURNS)
        text.block(step.text)
        for key in step.pieces:
            text.block(_placing(plan, plan.piece[key], step, strands, there))
        due = [key for key in step.fasten if key not in idle]
        if due:
            word = "crossing" if len(due) == 1 else "crossings"
            listed = ", ".join(map(str, due))
            text.block(f"All layers are now in place at {word} {listed}.")
        if text.lost:
            return
    text.end()


def _placing(
    plan: CrossingMap,
    piece: Piece,
    step: Step,
    strands: dict[tuple[int, bool], list[str]],
    there: set[str],
) -> str:
    """Return where a new piece goes over and under which pieces, and its joints."""
    said = [*_passing(piece, step, strands, there)]
    for key in dict.fromkeys(piece.joints):
        if key in step.joints:
            mates = [name for name in plan.joint[key].pieces if name != piece.id]
            said.append(f"joint #{key} with {mates[0] if mates else 'itself'}")
    which = f"sheet {piece.sheet}"
    if plan.cut.labels == "kinds":
        which = f"any K{piece.kind}" + (", arrow back" if piece.turned else "")
    return f"{piece.id} ({which}): {'; '.join(said) or 'lay it down'}"


def _passing(
    piece: Piece, step: Step, strands: dict[tuple[int, bool], list[str]], there: set[str]
) -> Iterator[str]:
    """Yield over whom a piece goes, and under whom, of those that are in place."""
    for word, over, crossings in (("over", True, step.over), ("under", False, step.under)):
        met = []
        for station in piece.stations:
            if station.over == over and station.crossing in crossings:
                others = strands.get((station.crossing, not over), [])
                names = dict.fromkeys(name for name in others if name in there)
                met.append(f"{' and '.join(names)} at {station.crossing}")
        if met:
            yield f"{word} {', '.join(met)}"
