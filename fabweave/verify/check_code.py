"""Check the QR code on each sheet: it says what the map does, and stands clear of everything."""

import hashlib
import json
import shlex
from typing import Any

import numpy as np
import segno
import shapely
from scipy.spatial import KDTree

from fabweave.verify.check_drawings import SAME_MM
from fabweave.verify.crossing_map import CrossingMap, Sheet
from fabweave.verify.drawing import NOTES, Drawing, Floats, Ints
from fabweave.verify.loading import Job
from fabweave.verify.report import Tally

#: Readers want a border of so many dots to be free.
_QUIET = 4
_WIDTH_MM = 1e-3
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
        _check_text(text, (job.settings or {}).get("job"), tally)
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


def _check_text(text: str, options: Any, tally: Tally) -> None:
    """Check that a command states no setting that job.toml does not."""
    told = options if isinstance(options, dict) else {}
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
    """Check that all dots are drawn, and nothing else is where the code and its border are."""
    x, y, dot = sheet.code or (0.0, 0.0, 0.0)
    utf8 = not text.isascii()
    symbol = segno.make(
        text, error="l", encoding="utf-8" if utf8 else None, eci=utf8, micro=False,
        boost_error=False,
    )  # fmt: skip
    rows = [list(row) for row in symbol.matrix]
    wanted = []
    for number, row in enumerate(rows):
        height = y + dot * (len(rows) - number - 0.5)
        edges = [k for k in range(len(row) + 1) if [*row, 0][k] != [0, *row][k]]
        wanted += [
            (x + dot * left, height, x + dot * right, height)
            for left, right in zip(edges[::2], edges[1::2], strict=True)
        ]
    notes = drawing.groups.get((NOTES, None), np.zeros(0, dtype=np.int64))
    two = notes[(drawing.sizes[notes] == 2) & ~drawing.closed[notes]]
    lines = np.concatenate(
        [drawing.points[drawing.start[two]], drawing.points[drawing.start[two] + 1]], axis=1
    )
    matched = _matched(np.array(wanted), lines)
    lost = int(np.sum(matched < 0))
    tally.count(len(wanted))
    tally.expect(
        lost == 0, f"{where}: {lost} of {len(wanted)} lines of the code are missing or out of place"
    )
    side = dot * (len(rows) + 2 * _QUIET)
    box = shapely.box(*(np.array([x, y, x, y]) - dot * _QUIET + [0.0, 0.0, side, side]))
    outline = sheet.outline * [-1.0, 1.0] + [sheet.width_mm, 0.0]
    material = shapely.Polygon(outline if sheet.mirrored else sheet.outline)
    tally.expect(shapely.make_valid(material).covers(box), f"{where}: the code leaves the sheet")
    others = np.setdiff1d(notes, two[matched[matched >= 0]])
    runs = [drawing.shape(at) for at in others.tolist()]
    on = [run.name for run in runs if box.intersects(_line(run.points, closed=run.closed))]
    on += [
        piece.id
        for piece in plan.pieces
        if piece.sheet == sheet.number
        and box.intersects(shapely.make_valid(shapely.Polygon(piece.placed(piece.outline))))
    ]
    tally.expect(not on, f"{where}: the code overlaps {', '.join(on[:5])}")


def _matched(wanted: Floats, lines: Floats) -> Ints:
    """Return for each wanted line the place of the one that is it; -1 for none."""
    if not len(lines):
        return np.full(len(wanted), -1)
    distance, place = KDTree(lines).query(wanted)
    return np.where(distance <= SAME_MM, place, -1)


def _line(points: Floats, *, closed: bool) -> Any:
    """Return a run as a line."""
    run = np.concatenate([points, points[:1]]) if closed else points
    return shapely.LineString(run) if len(run) > 1 else shapely.Point(run[0])
