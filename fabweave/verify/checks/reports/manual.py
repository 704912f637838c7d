"""Check that the manual says what the crossing map says: its pieces, sheets, steps and stations."""

import math
import re
from collections import Counter

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

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
    texts, plan = job.manual, job.map
    if texts is None or plan is None:
        return
    written, said = set(texts), _plain(" ".join(texts))
    for piece in plan.pieces:
        tally.expect(piece.id in written, f"assembly.pdf does not name piece {piece.id}")
    several = len({(sheet.material, sheet.thickness_mm) for sheet in plan.sheets}) > 1
    for sheet in plan.sheets:
        own = [text for text in texts if text.startswith((f"{sheet.name}:", f"{sheet.name},"))]
        tally.expect(bool(own), f"assembly.pdf has no page for sheet {sheet.name}")
        told = f" mm, {sheet.material} {sheet.thickness_mm:g} mm" if several else ""
        tally.expect(
            all(told in text for text in own),
            f"assembly.pdf: the page of {sheet.name} does not say that it is of {sheet.material}",
        )
        for name in (sheet.stock, sheet.rest[0] if sheet.rest is not None else ""):
            tally.expect(
                _plain(name) in said, f"assembly.pdf does not name {name!r}, of {sheet.name}"
            )
    _check_map(plan, texts, tally)
    _check_parts(plan, texts, tally)
    _check_steps(plan, texts, tally)
    _check_tables(plan, texts, tally)


def _plain(text: str) -> str:
    """Return a text as the manual's fonts have it, wherever its lines are broken."""
    return " ".join(text.encode("cp1252", "replace").decode("cp1252").split())


def _check_map(plan: CrossingMap, texts: tuple[str, ...], tally: Tally) -> None:
    """Require that the map shows each thread's pieces, joints and crossings in order."""
    heads = [at for at, text in enumerate(texts) if text.startswith("Thread ")]
    end = next((at for at, text in enumerate(texts) if text == _PARTS), len(texts))
    shown = {
        texts[at][7:]: texts[at + 1 : after]
        for at, after in zip(heads, [*heads[1:], max(end, *heads, 0)], strict=True)
    }
    for thread in plan.threads:
        where = f"assembly.pdf, map of thread {thread.label}"
        said = shown.get(thread.label, ())
        pieces = list(dict.fromkeys(text for text in said if text in plan.piece))
        tally.expect(
            pieces == list(thread.pieces),
            f"{where}: pieces {' '.join(pieces[:5])} …, not {' '.join(thread.pieces[:5])} …",
        )
        wanted, joints = [], []
        for number, key in enumerate(thread.pieces):
            piece = plan.piece[key]
            own = [f"{one.crossing} {'o' if one.over else 'u'}" for one in piece.stations]
            shared = number > 0 and piece.joints[0] is not None
            wanted += own[1:] if shared else own
            joints += [f"#{key}" for key in piece.joints[shared:] if key is not None]
        tally.expect(
            [text for text in said if re.fullmatch(r"\d+ [ou]", text)] == wanted,
            f"{where}: it does not show the thread's {len(wanted)} crossings in order, each over "
            "or under as it is",
        )
        tally.expect(
            [text for text in said if re.fullmatch(r"#\d+", text)] == joints,
            f"{where}: it does not show the thread's {len(joints)} joints in order",
        )


def _check_parts(plan: CrossingMap, texts: tuple[str, ...], tally: Tally) -> None:
    """Require that the parts list has each piece with its stations, its place and its kind."""
    start = next((at for at, text in enumerate(texts) if text == _PARTS), len(texts))
    listed: dict[str, tuple[str, ...]] = {}
    for at in range(start, len(texts) - 2):
        if texts[at] in plan.piece and " at " in texts[at + 2]:
            listed.setdefault(texts[at], texts[at + 1 : at + 3])
    names = {sheet.number: sheet.name for sheet in plan.sheets}
    alike = Counter(piece.kind for piece in plan.pieces)
    for piece in plan.pieces:
        size, place = listed.get(piece.id, ("", ""))
        many = alike[piece.kind] > 1
        kind = rf", kind {piece.kind} \(x {alike[piece.kind]}\)" if many else ""
        name = re.escape(names.get(piece.sheet, "?"))
        found = re.fullmatch(rf"{name} at (-?\d+), (-?\d+){kind}", place)
        outline = piece.placed(piece.outline)
        middle = (outline.min(axis=0) + outline.max(axis=0)) / 2.0
        tally.expect(
            found is not None
            and all(
                abs(float(text) - at) <= _SAME_PLACE_MM
                for text, at in zip(found.groups(), middle.tolist(), strict=True)
            )
            and re.search(rf" {len(piece.stations)} stations?$", size) is not None,
            f"assembly.pdf, parts list, piece {piece.id}: {size!r}, {place!r}, but it has "
            f"{len(piece.stations)} stations, its middle is at {middle[0]:.1f}, {middle[1]:.1f} "
            f"mm on {names.get(piece.sheet, '?')}, and {alike[piece.kind]} are of its kind",
        )


def _check_steps(plan: CrossingMap, texts: tuple[str, ...], tally: Tally) -> None:
    """Require every step once, in order, each with its words."""
    heads = [at for at, text in enumerate(texts) if _is_step(text)]
    numbers = [int(texts[at][5:]) for at in heads]
    wanted = [step.step for step in plan.steps]
    if not tally.expect(
        numbers == wanted, f"assembly.pdf has {len(numbers)} steps, the map has {len(wanted)}"
    ):
        return
    for step, start, end in zip(plan.steps, heads, [*heads[1:], len(texts)], strict=True):
        said = " ".join(texts[start + 1 : end])
        tally.expect(
            step.text in said, f"assembly.pdf, step {step.step}: it does not say {step.text!r}"
        )


def _is_step(text: str) -> bool:
    """Return whether a line is the head of a step."""
    return text.startswith("Step ") and text[5:].isascii() and text[5:].isdigit()


def _check_tables(plan: CrossingMap, texts: tuple[str, ...], tally: Tally) -> None:
    """Require that the table of each piece lists its stations."""
    tables: dict[str, list[tuple[str, ...]]] = {}
    for at, text in enumerate(texts):
        if not text.startswith("Piece ") or text[6:] not in plan.piece:
            continue
        start = at + 1 + _CELLS  # after the names of the columns
        while start + _CELLS <= len(texts) and texts[start].isdigit():
            tables.setdefault(text[6:], []).append(texts[start : start + _CELLS])
            start += _CELLS
    made = {key: step.step for step in plan.steps for key in step.crossings}
    for piece in plan.pieces:
        rows = tables.get(piece.id, [])
        where = f"assembly.pdf, table of piece {piece.id}"
        if not tally.expect(
            len(rows) == len(piece.stations),
            f"{where}: {len(rows)} stations, the map has {len(piece.stations)}",
        ):
            continue
        along = 0.0
        for number, row in enumerate(rows):
            here, last = piece.stations[number], piece.stations[max(number - 1, 0)]
            along += math.hypot(here.x - last.x, here.y - last.y)
            names = (*row[:2], *row[3:])
            wanted = _names(plan, piece, number, made)
            tally.expect(
                names == wanted and _near(row[2], along),
                f"{where}, station {number}: {' '.join(row)}, not {' '.join(wanted)} "
                f"at {along:.1f} mm",
            )


def _names(plan: CrossingMap, piece: Piece, number: int, made: dict[int, int]) -> tuple[str, ...]:
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
        str(made.get(station.crossing)),
    )


def _near(text: str, value: float) -> bool:
    """Say whether a cell has a number."""
    try:
        return abs(float(text) - value) <= _SAME_MM
    except ValueError:
        return False
