"""Check the QR code on each sheet: it says what the map does, and stands clear of everything."""

import hashlib
import json
import shlex
from typing import Any

import numpy as np
import shapely

from fabweave.verify.checks.sheets.drawings import SAME_MM
from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, Floats, ReadError
from fabweave.verify.read.job_files import Job
from fabweave.verify.read.qr_code import read_code
from fabweave.verify.report import Tally

#: Readers want a border of so many dots to be free.
_QUIET = 4
_WIDTH_MM = 1e-3
#: Codes of more dots are not read.
_MOST_DOTS = 54.0
_DIGEST = "# sha256 "


def check_code(job: Job, tally: Tally) -> None:
    """Check what the code says against the settings, and its dots on every sheet."""
    plan = job.map
    if plan is None:
        return
    coded = [sheet for sheet in plan.sheets if sheet.code is not None]
    text = plan.cut.code
    if not tally.expect(text or not coded, "sheets have a code, and the map does not say which"):
        return
    if text:
        _check_text(text, job.options, tally)
    for sheet in plan.sheets:
        dxf, svg = job.dxf.get(sheet.number), job.svg.get(sheet.number)
        if svg is not None:
            wide = {look.width_mm or 0.0 for look in svg.looks.get(NOTES, ())}
            beyond = [width for width in wide if abs(width - plan.cut.hairline_mm) > _WIDTH_MM]
            dot = [] if sheet.code is None else [sheet.code[2]]
            tally.expect(
                len(beyond) == len(dot) and np.allclose(beyond, dot, atol=_WIDTH_MM),
                f"{sheet.name}.svg: lines of NOTES are {beyond} mm wide, and dots {dot} mm",
            )
        if sheet.code is not None and dxf is not None:
            _check_dots(f"{sheet.name}.dxf", text or "", dxf, sheet, plan, tally)


def _check_text(text: str, told: dict[str, Any], tally: Tally) -> None:
    """Check that a command states no setting that job.toml does not."""
    command, _, digest = text.partition(_DIGEST)
    words = shlex.split(command)
    tally.expect(words[:2] == ["fabweave", "make"], f"the code makes nothing: {text!r}")
    if digest:
        true = hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
        tally.expect(
            len(digest) == 16 and true.startswith(digest),
            f"the code's digest is {digest}, and that of job.toml {true[:16]}",
        )
        return
    tally.expect(
        words[2:3] == [told.get("mesh")], f"the code makes {words[2:3]}, not {told.get('mesh')!r}"
    )
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
        value = told.get(key)
        true_values = value if isinstance(value, list) else [] if value is True else [value]
        tally.expect(
            values == [str(one) for one in true_values] and key in told,
            f"the code says {key} {' '.join(values)}, and job.toml {value!r}",
        )


def _is_number(word: str) -> bool:
    """Say whether an argument is a negative number rather than an option."""
    return word[1:2].isdigit() or word[1:2] == "."


def _check_dots(
    where: str, text: str, drawing: Drawing, sheet: Sheet, plan: CrossingMap, tally: Tally
) -> None:
    """Check that the dots say the text, and nothing else is where the code and its border are."""
    x, y, dot = sheet.code or (0.0, 0.0, 1.0)
    notes = drawing.groups.get((NOTES, None), np.zeros(0, dtype=np.int64))
    two = notes[(drawing.sizes[notes] == 2) & ~drawing.closed[notes]]
    first = drawing.start[two]
    ends = np.sort(np.stack([drawing.points[first], drawing.points[first + 1]], axis=1), axis=1)
    # From the corner of the code, in dots; those that lie on its grid are its own.
    grid = (ends - [x, y]) / dot - [0.0, 0.5]
    near = np.abs(grid - np.rint(grid)).max(axis=(1, 2), initial=0.0) * dot <= SAME_MM
    level = np.ptp(grid[:, :, 1], axis=1) * dot <= SAME_MM
    inside = (grid > -0.5).all(axis=(1, 2)) & (grid < _MOST_DOTS).all(axis=(1, 2))
    own = near & level & inside
    runs = np.rint(grid[own]).astype(np.int64)
    size = int(runs.max(initial=0))
    dots = np.zeros((size, size), dtype=bool)
    for (left, row), (right, _) in runs.tolist():
        dots[size - 1 - min(row, size - 1), left:right] = True
    tally.count(len(runs))
    try:
        said = read_code(dots)
        tally.expect(said == text, f"{where}: the code says {said!r}, and the map {text!r}")
    except ReadError as error:
        tally.fail(f"{where}: the code cannot be read: {error}")
    low, side = np.array([x, y]) - dot * _QUIET, dot * (size + 2 * _QUIET)
    box = shapely.box(*low, *(low + side))
    material = shapely.make_valid(shapely.Polygon(sheet.outline))
    tally.expect(material.covers(box), f"{where}: the code leaves the sheet")
    others = [drawing.shape(at) for at in np.setdiff1d(notes, two[own]).tolist()]
    on = [one.name for one in others if box.intersects(_line(one.points, closed=one.closed))]
    on += [
        piece.id
        for piece in plan.pieces
        if piece.sheet == sheet.number
        and box.intersects(shapely.make_valid(shapely.Polygon(piece.placed(piece.outline))))
    ]
    tally.expect(not on, f"{where}: the code overlaps {', '.join(on[:5])}")


def _line(points: Floats, *, closed: bool) -> Any:
    """Return a run as a line."""
    run = np.concatenate([points, points[:1]]) if closed else points
    return shapely.LineString(run) if len(run) > 1 else shapely.Point(run[0])
