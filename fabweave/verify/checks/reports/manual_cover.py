"""Check the first pages of the manual: the cover, and how to read a piece."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from fabweave.verify.checks.reports.manual_drawings import and_spares
from fabweave.verify.checks.reports.page import material_of, title_of
from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.measure.joint_kinds import KINDS, kind_of
from fabweave.verify.measure.words import (
    counted,
    difficulty_words,
    machine_words,
    money_words,
    time_words,
    verdict_words,
)
from fabweave.verify.read.job_files import MOST_VIEWED, Job
from fabweave.verify.running_text import RunningText

#: Sizes are rounded to a millimetre; the mesh has more digits.
_SAME_MM = 0.501
TABLE, PROCEED = "On the table", "How to proceed"
TAKE = (
    "Take the pieces out of their sheets, one sheet after another, and tick each in the list of "
    "its sheet."
)
LOOSE = (
    "Leave a fastener loose as long as a layer is still to come, and tighten it when the step "
    "shows that all layers are in place."
)
VIEWER = " assembly.html shows the same steps on an object that you can turn and zoom."
#: The number by which a picture points out each kind of label, holes, and ticks.
_NUMBERS = {"id": "1", "joint": "2", "partner": "3", "sign": "3"}
_TICKS, _HOLE = "4", "5"


def check_cover(job: Job, plan: CrossingMap, text: RunningText) -> None:
    """Check the cover against the map, the verdict, the mesh and waste.json.

    Parameters
    ----------
    job : Job
    plan : CrossingMap
    text : RunningText
        That of the cover.
    """
    waste = job.waste or {}
    text.block(title_of(job))
    if job.verdict is not None:
        _line(text, "Buildable?", verdict_words(job.verdict))
    _check_size(job, text)
    material = material_of(job)
    if material is not None:
        _line(text, "Material", material)
    _line(
        text,
        "Made of",
        f"{counted(len(plan.pieces), 'piece')}{and_spares(len(plan.spare_of))} on "
        f"{counted(len(plan.sheets), 'sheet')}, "
        f"{counted(len(plan.threads), 'thread')}, {counted(len(plan.crossings), 'crossing')}, "
        f"{counted(len(plan.joints), 'joint')}",
    )
    if waste.get("estimate") is not None:
        for name, words in _costs(waste["estimate"]):
            _line(text, name, words)
    text.block(TABLE)
    rim = f" and the {counted(len(job.rim.dxf), 'sheet')} in rim/" if job.rim is not None else ""
    _line(text, "Sheets", f"the {counted(len(plan.sheets), 'sheet')}{rim}, cut")
    for name, words in _to_buy(waste):
        _line(text, name, words)
    _line(text, "Tools", _tools(plan, fastened=bool(waste.get("fasteners"))))
    text.block(PROCEED)
    viewer = VIEWER if len(plan.crossings) <= MOST_VIEWED else ""
    steps = (TAKE, f"Sort them: {piles(plan)}.", f"Follow the steps.{viewer}", LOOSE)
    for number, words in enumerate(steps, start=1):
        _line(text, str(number), words)
    text.end()


def piles(plan: CrossingMap) -> str:
    """Return how pieces are to be sorted: by kinds where these are engraved, else by threads."""
    if plan.cut.labels == "kinds":
        counts = list(Counter(piece.kind for piece in plan.pieces).values())
        one, end = "kind", "any piece of a pile fits any of its places"
    else:
        counts = [len(thread.pieces) for thread in plan.threads]
        one, end = "thread", "the letters of an id name its thread"
    low, high = min(counts), max(counts)
    many = counted(high, "piece") if low == high else f"{low} to {high} pieces"
    return f"{counted(len(counts), 'pile')}, one for each {one}, of {many}; {end}"


def _line(text: RunningText, name: str, words: str) -> None:
    """Read what stands beside a name, and then that."""
    text.block(words)
    text.block(name)


def _check_size(job: Job, text: RunningText) -> None:
    """Check the extents of the mesh."""
    said = text.match(r"(\d+) x (\d+) x (\d+) mm", "the size, such as '90 x 90 x 90 mm'")
    text.block("Size")
    if said is None or job.mesh is None:
        return
    size = np.ptp(job.mesh.vertices, axis=0).tolist()
    stated = " x ".join(f"{length:.1f}" for length in size)
    text.place.expect(
        all(
            abs(float(one) - length) <= _SAME_MM
            for one, length in zip(said.groups(), size, strict=True)
        ),
        f"the size is said to be {said[0]}, but the mesh has {stated} mm",
    )


def _to_buy(waste: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield what is to be bought."""
    for row in waste.get("fasteners", ()):
        yield (
            "Fasteners",
            f"buy {row['buy']} for holes of {row['diameter_mm']:g} mm with a grip of "
            f"{row['grip_mm']:g} mm ({row['layers']} layers): {row['needed']} needed, "
            f"{row['spare']} spare",
        )
    glue, tape = waste.get("glue"), waste.get("tape")
    if glue and glue["joints"]:
        yield "Glue", f"{glue['area_mm2'] / 100:.0f} cm² of laps in all"
    if tape and tape["joints"]:
        yield "Tape", f"{tape['length_mm'] / 1000:.2f} m in all"


def _tools(plan: CrossingMap, *, fastened: bool) -> str:
    """Return the tools that the joints, and maybe fasteners at other crossings, take."""
    kinds = sorted({joint.kind for joint in plan.joints})
    if fastened and "rivet" not in kinds:
        kinds.append("rivet")
    tools = [KINDS[kind].tools for kind in kinds if kind in KINDS]
    return "; ".join([*tools, "clips or soft clamps", "a pencil to tick the boxes"])


def _costs(estimate: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield what is said of difficulty, times and money."""
    yield "Difficulty", difficulty_words(estimate)
    hands = estimate["assembly"]
    hours, practised = (
        time_words([3600.0 * end for end in span])
        for span in (hands["hours"], [hands["practised_h"]] * 2)
    )
    pace = ", ".join(
        f"{action['each_s']:g} s {action['words']} ({action['count']})"
        for action in hands["actions"]
    )
    practised = practised.partition(" to ")[2]
    yield "Time", f"{hours}; practised hands take {practised}, at {pace}"
    yield "Machine", machine_words(estimate)
    yield "Cost", money_words(estimate)


def check_legend(plan: CrossingMap, text: RunningText) -> None:
    """Check what is said of the marks on one piece, the one with the most kinds of labels.

    Parameters
    ----------
    plan : CrossingMap
    text : RunningText
        That of the page.
    """
    piece = max(
        plan.pieces, key=lambda one: (len({label.kind for label in one.labels}), len(one.labels))
    )
    signs = list(_signs(plan, piece))
    counted = {
        name[0]: str(number)
        for number, (name, _) in enumerate((one for one in signs if one[0][0].isdigit()), start=1)
    }
    holes = [station for station in piece.stations if station.hole_mm]
    numbers = [_NUMBERS[kind] for kind in ("id", "joint") if kind in _kinds(piece)]
    # Of crossings one is shown that is passed over, and one under.
    numbers += ["3"] * len(
        {
            label.station is not None and piece.stations[label.station].over
            for label in piece.labels
            if _NUMBERS.get(label.kind) == "3"
        }
    )
    numbers += [_HOLE] if holes else []
    numbers, ticks = [counted[kind] for kind in numbers], counted.get(_TICKS, "")
    shown = text.some_of({*numbers, ticks} - {""})
    text.place.equal(
        "the list of numbers, ticks left out,",
        sorted(number for number in shown if number != ticks),
        sorted(numbers),
    )
    text.place.expect(shown.count(ticks) <= 1, "it points out ticks twice")
    text.block(f"Piece {piece.id} of this object")
    for name, words in signs:
        text.block(counted.get(name[0], name[0]) + name[1:])
        text.block(words)
    text.end()


def _kinds(piece: Piece) -> set[str]:
    """Return the kinds of labels on a piece."""
    return {label.kind for label in piece.labels}


def _signs(plan: CrossingMap, piece: Piece) -> Iterator[tuple[str, str]]:
    """Yield what the marks on a piece mean, each with an example from the piece itself."""
    kinds = _kinds(piece)
    face = "inside" if any(sheet.mirrored for sheet in plan.sheets) else "outside"
    if kinds:
        covered = any(label.hidden for label in piece.labels)
        cover = " Other strands cover the letters when it is woven." if covered else ""
        yield "Engraved face", f"This is the {face} of the object.{cover}"
    else:
        yield (
            "No lettering",
            f"The pieces are not engraved. The face that is up on the sheet is the {face}.",
        )
    if "id" in kinds and plan.cut.labels == "kinds":
        yield (
            "1 Kind",
            f"K{piece.kind}: all pieces with these letters are alike, and any of them fits any of "
            f"their places. {piece.id} is a name of the place alone: its letters name the thread, "
            "and the number counts its pieces. The arrow points from the start of a piece to its "
            "end; or back, where a step says so.",
        )
    elif "id" in kinds:
        yield (
            "1 Id",
            f"{piece.id}: the letters name the thread, and the number counts its pieces. The arrow "
            "points from the start of the piece to its end.",
        )
    if "joint" in kinds:
        joint = next(plan.joint[key] for key in piece.joints if key is not None)
        mate = next((name for name in joint.pieces if name != piece.id), piece.id)
        yield (
            "2 Joint",
            f"#{joint.id}>{mate}: joint {joint.id} joins this end to piece {mate}.",
        )
    if kinds & {"partner", "sign"}:
        first = piece.stations[0]
        yield (
            "3 Crossing",
            "Beside a crossing stands the piece that is met there: with a disc before its id where "
            "this piece passes over, with a ring where it passes under. At its first station, "
            f"{piece.id} passes {'over' if first.over else 'under'} {first.partner}.",
        )
    if any(kind_of(joint).marked for joint in plan.joints):
        yield (
            f"{_TICKS} Cross",
            "A cross in place of a hole marks a glued lap: lay cross on cross. Where there are "
            "ticks, the end of the other piece lies at them.",
        )
    if any(station.hole_mm for station in piece.stations):
        yield (
            f"{_HOLE} Hole",
            "A fastener goes through all layers of the crossing: line up their holes.",
        )
