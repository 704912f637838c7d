"""Check that the manual says what the crossing map says: its pieces, sheets, steps and stations."""

import math
import re
from collections import Counter

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally, as_number, cell_number

#: Cells of a station in the manual: number, crossing, distance, over or under whom, joint, step.
_CELLS = 6
#: The heading of what follows the map of the threads.
_PARTS = "Parts list"
#: Places in it are rounded to a millimetre.
_SAME_PLACE_MM = 0.55
#: Distances in it are rounded to a tenth.
_SAME_MM = 0.0501


def check_manual(job: Job, tally: Tally) -> None:
    """Check the texts of assembly.pdf against the crossing map."""
    texts, plan = required(job.manual), required(job.map)
    place = tally.at("assembly.pdf").against("crossing_map.json")
    words, text = set(texts), _plain(" ".join(texts))
    for piece in plan.pieces:
        place.expect(piece.id in words, f"it does not name piece {piece.id}")
    several = len({(sheet.material, sheet.thickness_mm) for sheet in plan.sheets}) > 1
    for sheet in plan.sheets:
        here = place.at(sheet.name)
        heads = [line for line in texts if line.startswith((f"{sheet.name}:", f"{sheet.name},"))]
        here.expect(bool(heads), "it has no page for the sheet")
        material = f"{sheet.material} {sheet.thickness_mm:g} mm" if several else ""
        here.expect(all(material in line for line in heads), f"its page does not name {material}")
        for name in (sheet.stock, sheet.rest.name if sheet.rest is not None else ""):
            here.expect(_plain(name) in text, f"it does not name {name!r}")
    _check_map(plan, texts, place)
    _check_parts(plan, texts, place.at("parts list"))
    _check_steps(plan, texts, place)
    _check_tables(plan, texts, place)


def _plain(text: str) -> str:
    """Return a text as the manual's fonts have it, wherever its lines are broken."""
    return " ".join(text.encode("cp1252", "replace").decode("cp1252").split())


def _check_map(plan: CrossingMap, texts: tuple[str, ...], place: Place) -> None:
    """Require that the map shows each thread's pieces, joints and crossings in order."""
    heads = [at for at, text in enumerate(texts) if text.startswith("Thread ")]
    end = next((at for at, text in enumerate(texts) if text == _PARTS), len(texts))
    shown = {
        texts[at][7:]: texts[at + 1 : after]
        for at, after in zip(heads, [*heads[1:], max(end, *heads, 0)], strict=True)
    }
    for thread in plan.threads:
        here = place.at(f"map of thread {thread.label}")
        cells = shown.get(thread.label, ())
        pieces = list(dict.fromkeys(text for text in cells if text in plan.piece))
        here.equal("the row of pieces", pieces, list(thread.pieces))
        crossings, joints = [], []
        for number, key in enumerate(thread.pieces):
            piece = plan.piece[key]
            ways = [
                f"{station.crossing} {'o' if station.over else 'u'}" for station in piece.stations
            ]
            shared = number > 0 and piece.joints[0] is not None
            crossings += ways[1:] if shared else ways
            joints += [f"#{key}" for key in piece.joints[shared:] if key is not None]
        for names, pattern, wanted in (
            ("crossings, over or under,", r"\d+ [ou]", crossings),
            ("joints", r"#\d+", joints),
        ):
            row = [text for text in cells if re.fullmatch(pattern, text)]
            here.equal(f"the row of {names}", row, wanted)


def _check_parts(plan: CrossingMap, texts: tuple[str, ...], place: Place) -> None:
    """Require that the parts list has each piece with its stations, its place and its kind."""
    start = next((at for at, text in enumerate(texts) if text == _PARTS), len(texts))
    listed: dict[str, tuple[str, ...]] = {}
    for at in range(start, len(texts) - 2):
        if texts[at] in plan.piece and " at " in texts[at + 2]:
            listed.setdefault(texts[at], texts[at + 1 : at + 3])
    alike = Counter(piece.kind for piece in plan.pieces)
    for piece in plan.pieces:
        size, spot = listed.get(piece.id, ("", ""))
        many = alike[piece.kind] > 1
        kind = rf", kind {piece.kind} \(x {alike[piece.kind]}\)" if many else ""
        name = plan.sheet[piece.sheet].name if piece.sheet in plan.sheet else "?"
        match = re.fullmatch(rf"{re.escape(name)} at (-?\d+), (-?\d+){kind}", spot)
        outline = piece.placed(piece.outline)
        middle = (outline.min(axis=0) + outline.max(axis=0)) / 2.0
        place.at(f"piece {piece.id}").expect(
            match is not None
            and all(
                abs(float(text) - at) <= _SAME_PLACE_MM
                for text, at in zip(match.groups(), middle.tolist(), strict=True)
            )
            and re.search(rf" {len(piece.stations)} stations?$", size) is not None,
            f"it says {size!r}, {spot!r}, but the piece has {len(piece.stations)} stations, its "
            f"middle is at {middle[0]:.1f}, {middle[1]:.1f} mm on {name}, and "
            f"{alike[piece.kind]} are of its kind",
        )


def _check_steps(plan: CrossingMap, texts: tuple[str, ...], place: Place) -> None:
    """Require every step once, in order, each with its words."""
    heads = [at for at, text in enumerate(texts) if _is_step(text)]
    numbers = [int(texts[at][5:]) for at in heads]
    if not place.equal("the row of steps", numbers, [step.step for step in plan.steps]):
        return
    for step, start, end in zip(plan.steps, heads, [*heads[1:], len(texts)], strict=True):
        text = " ".join(texts[start + 1 : end])
        place.at(f"step {step.step}").expect(step.text in text, f"it does not say {step.text!r}")


def _is_step(text: str) -> bool:
    """Return whether a line is the head of a step."""
    return text.startswith("Step ") and text[5:].isascii() and text[5:].isdigit()


def _check_tables(plan: CrossingMap, texts: tuple[str, ...], place: Place) -> None:
    """Require that the table of each piece lists its stations."""
    tables: dict[str, list[tuple[str, ...]]] = {}
    for at, text in enumerate(texts):
        if not text.startswith("Piece ") or text[6:] not in plan.piece:
            continue
        start = at + 1 + _CELLS  # after the names of the columns
        while start + _CELLS <= len(texts) and texts[start].isdigit():
            tables.setdefault(text[6:], []).append(texts[start : start + _CELLS])
            start += _CELLS
    steps = {key: step.step for step in plan.steps for key in step.crossings}
    for piece in plan.pieces:
        rows = tables.get(piece.id, [])
        here = place.at(f"table of piece {piece.id}")
        if not here.equal("the number of stations", len(rows), len(piece.stations)):
            continue
        along = 0.0
        for number, row in enumerate(rows):
            station, last = piece.stations[number], piece.stations[max(number - 1, 0)]
            along += math.hypot(station.x - last.x, station.y - last.y)
            wanted = _names(plan, piece, number, steps)
            near = abs(as_number(cell_number(row[2])) - along) <= _SAME_MM
            here.at(f"station {number}").expect(
                (*row[:2], *row[3:]) == wanted and near,
                f"it says {' '.join(row)}, but should say {' '.join(wanted)}, at {along:.1f} mm",
            )


def _names(plan: CrossingMap, piece: Piece, number: int, steps: dict[int, int]) -> tuple[str, ...]:
    """Return the cells of a station but for its distance."""
    station = piece.stations[number]
    joint = "-"
    if station.joint is not None:
        pieces = plan.joint[station.joint].pieces
        mate = next((name for name in pieces if name != piece.id), piece.id)
        joint = f"#{station.joint} {mate}"
    return (
        str(number),
        str(station.crossing),
        f"{'over' if station.over else 'under'} {station.partner}",
        joint,
        str(steps.get(station.crossing)),
    )
