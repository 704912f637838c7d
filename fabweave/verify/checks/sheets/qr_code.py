"""Check the QR code: it says what the map does, and on a sheet it stands clear of everything."""

import hashlib
import json
import shlex
from typing import Any

import numpy as np
import shapely

from fabweave.verify.checks.sheets.drawings import SAME_MM, compare_formats
from fabweave.verify.checks.sheets.looks import check_dxf_looks, check_svg_looks
from fabweave.verify.crossing_map import Code, CrossingMap, Sheet
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    NOTES,
    OUTLINES,
    Drawing,
    Flags,
    Floats,
    ReadError,
)
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.qr_code import CODE, QUIET, TAG, TAG_FOLDER, read_code
from fabweave.verify.statement import Place, Tally

_LETTERS, _MARKS = ENGRAVE_LAYERS
#: The dots of a tag, and within how much of an engraved line all of a dark one lies.
_TAG_DOT_MM, _BEAM_MM = 1.0, 0.125
#: So many points of a dot along each side are looked at, this far from its border at least.
_LOOKED, _INSET = 5, 0.15
_WIDTH_MM = 1e-3
#: Codes of more dots are not read.
_MOST_DOTS = 54.0
_DIGEST = "# sha256 "
#: What settings are that a command leaves out.
_UNSAID = {
    "bodies": "all", "fair": 0, "pattern": "plain", "boundary": "end",
    "smooth": 3, "crossing": 0.7, "clearance": "0.1mm", "prefer": "balanced", "kinds": "auto",
    "joint": "rivet", "symmetrise": False, "slots": False, "rotations": "auto", "seed": 0,
    "colours": "material", "profile": "maker", "strict": False, "force": False, "labels": "hidden",
    "label_side": "outside", "paper": "a4", "cut_order": "short", "template": "sheet",
    "rim": "none", "qr": "paper",
}  # fmt: skip


def check_code(job: Job, tally: Tally) -> None:
    """Check what the code says against the settings, and its dots wherever it is."""
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
    asked = job.options.get("qr", "none" if text is None else "paper")
    place.expect(bool(text) == (asked != "none"), f"it says {text!r}, and asked is {asked}")
    files = job.code
    if files is not None and files.dots is not None:
        _check_says(files.dots, text or "", tally.at(CODE))
    if files is not None and files.tag_dxf is not None:
        _check_tag(job, files.tag_dxf, files.tag_svg, text or "", tally)


def _check_says(dots: Flags, text: str, place: Place) -> None:
    """Check that dots are a code of a text."""
    try:
        place.equal("what the code says", read_code(dots), text)
    except ReadError as error:
        place.fail(f"the code cannot be read: {error}")


def _check_tag(job: Job, dxf: Drawing, svg: Drawing | None, text: str, tally: Tally) -> None:
    """Check that a tag bears the code on free ground, engraved, with one hole and one outline."""
    cut, place = required(job.map).cut, tally.at(TAG_FOLDER, f"{TAG}.dxf")
    place.expect(not dxf.problems, "; ".join(dxf.problems[:2]))
    check_dxf_looks(dxf, cut, cut.colours, place)
    if place.expect(svg is not None, "there is no SVG beside it") and svg is not None:
        other = tally.at(TAG_FOLDER, f"{TAG}.svg")
        compare_formats(svg, dxf, other)
        check_svg_looks(svg, cut, cut.colours, other)
    owners = {name for layer, name in dxf.groups if layer != NOTES}
    place.equal("what is drawn of it", owners, {"QR"})
    outlines, holes = (dxf.shapes_of(layer, "QR") for layer in (OUTLINES, HOLES))
    if not place.equal("its outlines and holes", (len(outlines), len(holes)), (1, 1)):
        return
    strokes = [_line(shape.points, closed=False) for shape in dxf.shapes_of(_MARKS, "QR")]
    if not place.expect(strokes, "nothing is engraved on it"):
        return
    lines = shapely.GeometryCollection(strokes)
    low = np.array(lines.bounds[:2])
    size = round((lines.bounds[2] - low[0]) / _TAG_DOT_MM)
    corner = low - (size * _TAG_DOT_MM - np.array(lines.bounds[2:]) + low) / 2.0
    within = np.linspace(_INSET, 1.0 - _INSET, _LOOKED)
    at = (np.arange(size)[:, None] + within).ravel() * _TAG_DOT_MM
    x, y = np.meshgrid(corner[0] + at, corner[1] + at[::-1])
    points = shapely.points(x.ravel(), y.ravel())
    shapely.prepare(lines)
    dark = shapely.dwithin(lines, points, _BEAM_MM).reshape(size, _LOOKED, size, _LOOKED)
    share = dark.mean(axis=(1, 3))
    place.expect(np.all((share == 0.0) | (share == 1.0)), "a dot is engraved in part")
    _check_says(share > 0.0, text, place)
    side = (size + 2 * QUIET) * _TAG_DOT_MM
    box = shapely.box(*(corner - QUIET * _TAG_DOT_MM), *(corner + side - QUIET * _TAG_DOT_MM))
    ring = shapely.Polygon(outlines[0].points)
    free = [_line(shape.points, closed=False) for shape in dxf.shapes_of(_LETTERS, "QR")]
    hole = shapely.Point(holes[0].points[0]).buffer(holes[0].radius or 0.0)
    place.expect(ring.covers(box), "the code leaves the tag")
    place.expect(
        not any(box.intersects(one) for one in [*free, hole]), "something stands on its border"
    )
    place.expect(
        all(ring.covers(one) for one in [*strokes, *free, hole]), "something leaves the tag"
    )


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
    _check_says(dots, text, place)
    low, side = np.array([x, y]) - dot * QUIET, dot * (size + 2 * QUIET)
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
