"""Check the QR code on each sheet: it says what the map does, and stands clear of everything."""

import hashlib
import json
import shlex
from typing import Any

import numpy as np
import shapely

from fabweave.verify.checks.sheets.drawings import SAME_MM
from fabweave.verify.crossing_map import Code, CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, Floats, ReadError
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.qr_code import read_code
from fabweave.verify.statement import Place, Tally

#: Readers want a border of so many dots to be free.
_QUIET = 4
_WIDTH_MM = 1e-3
#: Codes of more dots are not read.
_MOST_DOTS = 54.0
_DIGEST = "# sha256 "
#: What settings are that a command leaves out.
_UNSAID = {
    "bodies": "all", "fair": 0, "pattern": "plain", "boundary": "end", "width": "auto",
    "smooth": 3, "crossing": 0.7, "clearance": "0.1mm", "prefer": "balanced", "kinds": "auto",
    "joint": "rivet", "symmetrise": False, "slots": False, "rotations": "auto", "seed": 0,
    "colours": "safe", "profile": "maker", "strict": False, "force": False, "labels": "hidden",
    "label_side": "outside", "paper": "a4", "cut_order": "short", "template": "sheet",
    "rim": "none",
}  # fmt: skip


def check_code(job: Job, tally: Tally) -> None:
    """Check what the code says against the settings, and its dots on every sheet."""
    plan = required(job.map)
    coded = [sheet for sheet in plan.sheets if sheet.code is not None]
    text, place = plan.cut.code, tally.at("crossing_map.json", "code")
    if not place.expect(text or not coded, "sheets have a code, but what it says is not stated"):
        return
    if text:
        _check_text(text, job.options, place.against("job.toml"))
    for sheet in plan.sheets:
        dxf, svg = job.dxf.get(sheet.number), job.svg.get(sheet.number)
        if svg is not None:
            wide = {look.width_mm or 0.0 for look in svg.looks.get(NOTES, ())}
            beyond = [width for width in wide if abs(width - plan.cut.hairline_mm) > _WIDTH_MM]
            dot = [] if sheet.code is None else [sheet.code.dot_mm]
            tally.at(f"{sheet.name}.svg").expect(
                len(beyond) == len(dot) and np.allclose(beyond, dot, atol=_WIDTH_MM),
                f"lines of {NOTES} are {beyond} mm wide, and dots {dot} mm",
            )
        if sheet.code is not None and dxf is not None:
            here = tally.at(f"{sheet.name}.dxf").against("crossing_map.json")
            _check_dots(text or "", dxf, sheet, sheet.code, plan, here)


def _check_text(text: str, options: dict[str, Any], place: Place) -> None:
    """Check that a command and what it leaves out are what job.toml says."""
    command, _, digest = text.partition(_DIGEST)
    words = shlex.split(command)
    place.equal("its command", words[:2], ["fabweave", "make"])
    if digest:
        settings = json.dumps(options, sort_keys=True).encode()
        place.equal("its digest", digest, hashlib.sha256(settings).hexdigest()[:16])
        return
    place.equal("its mesh", words[2:3], [options.get("mesh")])
    stated: dict[str, list[str]] = {}
    option = ""
    for word in words[3:]:
        if word.startswith("-") and not _is_number(word):
            option = word.lstrip("-").replace("-", "_")
            stated.setdefault(option, [])
        else:
            stated.setdefault(option, []).append(word)
    stated.pop("o", None)
    for key, values in stated.items():
        value = options.get(key)
        wanted = value if isinstance(value, list) else [] if value is True else [value]
        place.expect(
            values == [str(word) for word in wanted] and key in options,
            f"it says {' '.join([key, *values])}, and job.toml {value!r}",
        )
    for key, value in options.items():
        if key in _UNSAID and key not in stated:
            place.at(key).equal("what is not said", value, _UNSAID[key])


def _is_number(word: str) -> bool:
    """Say whether an argument is a negative number rather than an option."""
    return word[1:2].isdigit() or word[1:2] == "."


def _check_dots(
    text: str, drawing: Drawing, sheet: Sheet, code: Code, plan: CrossingMap, place: Place
) -> None:
    """Check that the dots say the text, and nothing else is where the code and its border are."""
    x, y, dot = code.x_mm, code.y_mm, code.dot_mm
    notes = drawing.of(NOTES, None)
    two = notes[(drawing.sizes[notes] == 2) & ~drawing.closed[notes]]
    first = drawing.start[two]
    ends = np.sort(np.stack([drawing.points[first], drawing.points[first + 1]], axis=1), axis=1)
    # From the corner of the code, in dots; those that lie on its grid are its own.
    grid = (ends - [x, y]) / dot - [0.0, 0.5]
    near = np.abs(grid - np.rint(grid)).max(axis=(1, 2), initial=0.0) * dot <= SAME_MM
    level = np.ptp(grid[:, :, 1], axis=1) * dot <= SAME_MM
    inside = (grid > -0.5).all(axis=(1, 2)) & (grid < _MOST_DOTS).all(axis=(1, 2))
    dotted = near & level & inside
    runs = np.rint(grid[dotted]).astype(np.int64)
    size = int(runs.max(initial=0))
    dots = np.zeros((size, size), dtype=bool)
    for (left, row), (right, _) in runs.tolist():
        dots[size - 1 - min(row, size - 1), left:right] = True
    place.count(len(runs))
    try:
        place.equal("what the code says", read_code(dots), text)
    except ReadError as error:
        place.fail(f"the code cannot be read: {error}")
    low, side = np.array([x, y]) - dot * _QUIET, dot * (size + 2 * _QUIET)
    box = shapely.box(*low, *(low + side))
    material = shapely.make_valid(shapely.Polygon(sheet.outline))
    place.expect(material.covers(box), "the code leaves the sheet")
    others = [drawing.shape(at) for at in np.setdiff1d(notes, two[dotted]).tolist()]
    on = [note.name for note in others if box.intersects(_line(note.points, closed=note.closed))]
    on += [
        piece.id
        for piece in plan.on_sheet(sheet.number)
        if box.intersects(shapely.make_valid(shapely.Polygon(piece.placed(piece.outline))))
    ]
    place.expect(not on, f"the code overlaps {', '.join(on[:5])}")


def _line(points: Floats, *, closed: bool) -> Any:
    """Return a run as a line."""
    run = np.concatenate([points, points[:1]]) if closed else points
    return shapely.LineString(run) if len(run) > 1 else shapely.Point(run[0])
