"""Check the labels of every piece: what they tell, where they stand, and that they are legible."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.crossing_map import CrossingMap, Label, Piece
from fabweave.verify.drawing import HOLES, OUTLINES, Drawing, Floats, Ints, traced
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally

#: Nothing lower can be read on the bench; what is hidden is read in the hand, and an id at least
#: tells one piece from another.
LEAST_HEIGHT_MM, HIDDEN_HEIGHT_MM, ID_HEIGHT_MM = 2.0, 1.6, 1.2
#: Letters keep this far from edges, holes, marks and other labels.
CLEAR_MM = 0.2
#: How far strokes may be from the box that the map gives their label.
SAME_MM = 0.02

_LETTERS = "ENGRAVE_LABEL"
_ARROW, _OVER, _UNDER = "→", "●", "○"


def check_labels(job: Job, tally: Tally) -> None:
    """Check that labels say what is true, and are engraved legibly where the map says."""
    plan = required(job.map)
    asked, side = job.options.get("labels", "full"), job.options.get("label_side", "outside")
    if plan.cut.labels:
        tally.at("crossing_map.json").equal("what is engraved", plan.cut.labels, asked)
    tally.at("job.toml").expect(
        side in ("outside", "inside"), f"labels are {side!r}, which is no side of a piece"
    )
    for piece in plan.to_cut:
        place = tally.at(f"piece {piece.id}")
        _check_words(piece, plan, str(asked), place)
        _check_stations(piece, place)
    for sheet in plan.sheets:
        place = tally.at(sheet.name)
        place.equal(
            f"whether it is mirrored, with labels {side},", sheet.mirrored, side == "inside"
        )
        # That both formats draw the same is another check.
        drawing = job.dxf.get(sheet.number) or job.svg.get(sheet.number)
        if drawing is None:
            tally.fail(f"the labels on {sheet.name} are not checked: no drawing could be read")
            continue
        pieces = plan.on_sheet(sheet.number)
        for piece in pieces:
            _check_strokes(piece, drawing, place.at(f"piece {piece.id}"))
        _check_clearance(pieces, drawing, place)
        _check_apart(pieces, place)


def _check_words(piece: Piece, plan: CrossingMap, wanted: str, place: Place) -> None:
    """Check that labels tell what is true: the piece's name, its joints and its partners."""
    name = f"K{piece.kind}" if wanted == "kinds" else piece.id
    kinds = [label.kind for label in piece.labels] + [lost["kind"] for lost in piece.dropped]
    place.equal(
        "how often it is named, or said not to be,", kinds.count("id"), int(wanted != "none")
    )
    for label in piece.labels:
        true = {name, name + _ARROW, _ARROW}
        if label.station is not None:
            station = piece.stations[label.station]
            # Without its sign a partner could be the piece's own id.
            true = {(_OVER if station.over else _UNDER) + station.partner, f"#{station.joint}"}
            if station.joint is not None:
                mates = {*plan.joint[station.joint].pieces} - {piece.id}
                true |= {f"#{station.joint}>{mate}" for mate in mates or {piece.id}}
        place.expect(label.text in true, f"{_named(label)} is none of what it should tell")


def _check_stations(piece: Piece, place: Place) -> None:
    """Check that each label stands nearest to the station that it is about."""
    points = piece.points
    for label in piece.labels:
        if label.station is None or not 0 <= label.station < len(points):
            continue
        away = np.hypot(*(points - (label.x, label.y)).T)
        place.expect(
            away[label.station] <= away.min() + SAME_MM,
            f"{_named(label)} is about station {label.station}, but stands nearer to station "
            f"{int(np.argmin(away))}",
        )


def _check_strokes(piece: Piece, drawing: Drawing, place: Place) -> None:
    """Check that strokes fill their labels' boxes, with nothing beside."""
    shapes = drawing.of(_LETTERS, piece.id)
    if not len(shapes) and not piece.labels:
        return
    points, stroke = drawing.traced(shapes)
    local = np.stack([_in_box(piece, label, points) for label in piece.labels] or [points[:0]])
    half = np.array([label.box_mm for label in piece.labels]) / 2
    held = np.all(np.abs(local) <= half.reshape(-1, 1, 2) + SAME_MM, axis=2)
    starts = np.searchsorted(stroke, np.arange(len(shapes)))
    owned = np.logical_and.reduceat(held, starts, axis=1) if held.size else held
    strays = np.flatnonzero(owned.sum(axis=0) != 1) if owned.size else np.arange(len(shapes))
    place.count(len(shapes))
    for at in strays.tolist():
        place.fail(f"{drawing.name[int(shapes[at])]} is in no label")
    for number, label in enumerate(piece.labels):
        here = place.at(_named(label))
        least = HIDDEN_HEIGHT_MM if label.hidden else LEAST_HEIGHT_MM
        least = ID_HEIGHT_MM if label.kind == "id" else least
        here.at_least("height_mm", label.height_mm, least, "it is {} high")
        strokes = np.flatnonzero(owned[number]) if owned.size else np.zeros(0, dtype=np.int64)
        if not here.expect(len(strokes) > 0, "it is not engraved"):
            continue
        ink = local[number][np.isin(stroke, strokes)]
        beside = np.abs(np.concatenate((ink.min(axis=0), ink.max(axis=0)))) - np.tile(
            half[number], 2
        )
        here.at_most(
            "box_mm", float(np.abs(beside).max()), SAME_MM, "it does not fill its box: {} off"
        )


def _in_box(piece: Piece, label: Label, points: Floats) -> Floats:
    """Return points of a sheet from the middle of a label's box: along it, and up.

    Whichever face is engraved, whoever reads the sheet reads the text unmirrored.
    """
    angle = np.deg2rad(label.rotation_deg)
    middle = np.array([label.x, label.y])
    way = np.array([np.cos(angle), np.sin(angle)])
    ends = piece.placed(np.array([middle, middle + way]))
    along = ends[1] - ends[0]
    away = points - ends[0]
    return np.stack((away @ along, away @ (-along[1], along[0])), axis=1)


def _check_clearance(pieces: Sequence[Piece], drawing: Drawing, place: Place) -> None:
    """Check that letters are inside their outline, and off it, its holes and its marks."""
    names = [
        piece.id
        for piece in pieces
        if (_LETTERS, piece.id) in drawing.groups and (OUTLINES, piece.id) in drawing.groups
    ]
    if not names:
        return
    rings = [traced(drawing.shape(int(drawing.of(OUTLINES, name)[0]))) for name in names]
    letters, _ = _lines(drawing, _LETTERS, names)
    away = shapely.distance(letters, shapely.boundary(_polygons(rings)))
    marks, owner = _lines(drawing, "ENGRAVE_MARK", names)
    np.minimum.at(away, owner, shapely.distance(letters[owner], marks))
    holes = [drawing.of(HOLES, name) for name in names]
    owner = np.repeat(np.arange(len(names)), [len(own) for own in holes])
    shapes = np.concatenate(holes)
    round_ = ~np.isnan(drawing.radius[shapes])
    centres = shapely.points(drawing.points[drawing.start[shapes[round_]]])
    off = shapely.distance(letters[owner[round_]], centres) - drawing.radius[shapes[round_]]
    np.minimum.at(away, owner[round_], off)
    slots = _polygons([traced(drawing.shape(at)) for at in shapes[~round_].tolist()])
    np.minimum.at(away, owner[~round_], shapely.distance(letters[owner[~round_]], slots))
    inside = shapely.contains(shapely.make_valid(_polygons(rings)), letters)
    for name, off, held in zip(names, away.tolist(), inside.tolist(), strict=True):
        here = place.at(f"piece {name}")
        here.expect(held, "letters leave it")
        here.at_least("clear_mm", off, CLEAR_MM, "letters are {} from an edge, a hole or a mark")


def _lines(
    drawing: Drawing, layer: str, names: Sequence[str]
) -> tuple[npt.NDArray[np.object_], Ints]:
    """Return all lines of a layer for each piece that has any there, and which pieces have."""
    groups = [drawing.of(layer, name) for name in names]
    shapes = np.concatenate(groups)
    shapes_of = np.repeat(np.arange(len(names)), [len(own) for own in groups])
    points, line = drawing.traced(shapes)
    real = np.bincount(line, minlength=len(shapes)) > 1  # a point is no line
    lines = shapely.linestrings(points[real[line]], indices=(np.cumsum(real) - 1)[line[real[line]]])
    owners, number = np.unique(shapes_of[real], return_inverse=True)
    return np.asarray(shapely.multilinestrings(lines, indices=number)), owners


def _polygons(rings: Sequence[Floats]) -> npt.NDArray[np.object_]:
    """Return polygons; one with too few corners is empty."""
    return np.array(
        [shapely.Polygon(ring) if len(ring) > 3 else shapely.Polygon() for ring in rings],
        dtype=object,
    )


def _check_apart(pieces: Sequence[Piece], place: Place) -> None:
    """Check that the boxes of labels keep apart."""
    labels = [(piece, label) for piece in pieces for label in piece.labels]
    if not labels:
        return
    boxes = np.array([_box(piece, label) for piece, label in labels], dtype=object)
    pairs: npt.NDArray[np.int64] = shapely.STRtree(boxes).query(
        boxes, predicate="dwithin", distance=CLEAR_MM
    )
    place.count(len(boxes))
    for one, other in pairs.T[pairs[0] < pairs[1]].tolist():
        (first, label), (second, text) = labels[one], labels[other]
        place.fail(
            f"{_named(label)} of piece {first.id} and {_named(text)} of piece {second.id} are less "
            f"than {CLEAR_MM} mm apart"
        )


def _box(piece: Piece, label: Label) -> shapely.Polygon:
    """Return the box of a label on its sheet."""
    angle = np.deg2rad(label.rotation_deg)
    along = np.array([np.cos(angle), np.sin(angle)]) * label.box_mm[0] / 2
    up = np.array([-np.sin(angle), np.cos(angle)]) * label.box_mm[1] / 2
    middle = np.array([label.x, label.y])
    corners = [middle - along - up, middle + along - up, middle + along + up, middle - along + up]
    return shapely.Polygon(piece.placed(np.array(corners)))


def _named(label: Label) -> str:
    """Name a label in a finding."""
    return f"the {label.kind} label {label.text!r}"
