"""Check how much of the engraving is seen when the object is woven.

Points along every stroke are carried from their sheet to their piece, from there to its panel in
the model, and on along the panel's normal: what meets the panel of the strand above is covered.
What is engraved between panels, where a ribbon is bent, counts as seen.
"""

from typing import NamedTuple

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import ENGRAVE_LAYERS, Drawing, Flags, Floats, Ints
from fabweave.verify.measure.development import Development, develop_pieces
from fabweave.verify.read.job_files import Job, required, sheet_drawings
from fabweave.verify.statement import Place, Tally

#: Points along strokes are no farther apart than this.
_STEP_MM = 0.1
#: How much may be seen that is not told, and of what is told which share, for want of points.
SEEN_MM, SEEN_SHARE = 0.5, 0.03
#: How far the end of a stroke may be past its label's box.
_BESIDE_MM = 0.02


class _Ink(NamedTuple):
    """Points along the strokes of a piece, in its coordinates, and what length each stands for."""

    points: Floats
    length_mm: Floats


def check_exposure(job: Job, tally: Tally) -> None:
    """Check that hidden labels are covered, and that what is seen is told."""
    plan = required(job.map)
    hidden = job.options.get("labels") in ("hidden", "kinds")
    outside = job.options.get("label_side", "outside") == "outside"
    stated = ((job.waste or {}).get("totals") or {}).get("engrave_seen_mm")
    for piece in plan.to_cut:
        place = tally.at(f"piece {piece.id}")
        for label in piece.labels:
            place.expect(
                (hidden and outside) or not label.hidden,
                f"the {label.kind} label {label.text!r} is said to be hidden, but none was to be",
            )
            place.expect(
                label.hidden or label.kind == "id" or not (hidden and outside),
                f"the {label.kind} label {label.text!r} is not hidden, and is no id",
            )
    report = tally.at("waste.json", "totals")
    told = report.expect(
        (stated is not None) == (hidden and outside),
        "engrave_seen_mm is told where labels are not hidden, or not told where they are",
    )
    if not (told and hidden and outside):
        return
    seen = 0.0
    developments = develop_pieces(plan, required(job.model))
    for sheet, drawing, place in sheet_drawings(job, "dxf", tally, needed=True):
        for piece in plan.on_sheet(sheet.number):
            here = place.at(f"piece {piece.id}")
            ink = _ink(piece, drawing)
            if not len(ink.points):
                continue
            name = plan.spare_of.get(piece.id, piece.id)
            if not here.expect(name in developments, "it is no part of the model"):
                continue
            bare = ~_covered(ink.points, plan.piece[name], plan, developments)
            # What is engraved on spares is seen only if they are put in.
            if piece.id in plan.piece:
                seen += float(ink.length_mm[bare].sum())
            _check_hidden(piece, ink, bare, here)
    report.number("engrave_seen_mm", stated, seen, within=SEEN_MM + SEEN_SHARE * seen)


def _ink(piece: Piece, drawing: Drawing) -> _Ink:
    """Return points all along what is engraved on a piece."""
    shapes = np.concatenate([drawing.of(layer, piece.id) for layer in ENGRAVE_LAYERS])
    if not len(shapes):
        return _Ink(np.zeros((0, 2)), np.zeros(0))
    points, line = drawing.traced(shapes)
    along = np.flatnonzero(line[1:] == line[:-1])
    start, step = points[along], points[along + 1] - points[along]
    length = np.hypot(*step.T)
    parts = np.maximum(np.ceil(length / _STEP_MM).astype(np.int64), 1)
    row = np.repeat(np.arange(len(along)), parts)
    within = np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = (within + 0.5) / parts[row]
    placed = start[row] + share[:, None] * step[row]
    return _Ink(_from_sheet(piece, placed), (length / parts)[row])


def _from_sheet(piece: Piece, points: Floats) -> Floats:
    """Return points of a sheet in the coordinates of a piece that lies there."""
    origin, east, north = piece.placed(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    axes = np.stack((east - origin, north - origin))
    return np.asarray((points - origin) @ np.linalg.inv(axes))


def _covered(
    points: Floats, piece: Piece, plan: CrossingMap, developments: dict[str, Development]
) -> Flags:
    """Say which points of a piece have the strand above over them."""
    own, result = developments[piece.id], np.zeros(len(points), dtype=np.bool_)
    for at, station in enumerate(piece.stations):
        crossing = plan.crossing.get(station.crossing)
        if station.over or crossing is None:
            continue
        upper = developments.get(crossing.over.piece)
        if upper is None or not 0 <= crossing.over.station < len(upper.space):
            continue
        # Corners go right, left where the ribbon enters, and right, left where it leaves.
        ring = own.panels[at][[0, 2, 3, 1]]
        inside = np.flatnonzero(shapely.contains_xy(shapely.Polygon(ring), *points.T))
        if not len(inside):
            continue
        space, normal = _raised(points[inside], own.panels[at], own.space[at])
        result[inside[_meets(space, normal, upper.space[crossing.over.station])]] = True
    return result


def _raised(points: Floats, flat: Floats, space: Floats) -> tuple[Floats, Floats]:
    """Carry points of a flat panel into space; return them and the panel's outward normal."""
    sides = np.stack((flat[2] - flat[0], flat[1] - flat[0]))
    forward, left = space[2] - space[0], space[1] - space[0]
    shares = (points - flat[0]) @ np.linalg.inv(sides)
    # By both diagonals: a panel with slanting ends may be a dart.
    normal = np.cross(space[3] - space[0], space[1] - space[2])
    return space[0] + shares @ np.stack((forward, left)), normal / np.linalg.norm(normal)


def _meets(points: Floats, way: Floats, panel: Floats) -> Flags:
    """Say from which points a ray in some direction, a unit vector, meets a panel."""
    corners = panel[[0, 2, 3, 1]] - points[0]
    if not np.all(corners @ way > 0.0):
        return np.zeros(len(points), dtype=np.bool_)
    # Seen along the rays.
    axes = np.linalg.svd(way[None])[2][1:].T
    return np.asarray(
        shapely.contains_xy(shapely.Polygon(corners @ axes), *((points - points[0]) @ axes).T)
    )


def _check_hidden(piece: Piece, ink: _Ink, bare: Flags, place: Place) -> None:
    """Check that nothing of a hidden label is seen."""
    for label in piece.labels:
        if not label.hidden:
            continue
        angle = np.deg2rad(label.rotation_deg)
        along = np.array([np.cos(angle), np.sin(angle)])
        away = ink.points - (label.x, label.y)
        local = np.stack((away @ along, away @ (-along[1], along[0])), axis=1)
        half = np.array(label.box_mm) / 2.0 + _BESIDE_MM
        own: Ints = np.flatnonzero(np.all(np.abs(local) <= half, axis=1))
        place.at_most(
            "seen_mm",
            float(ink.length_mm[own][bare[own]].sum()),
            0.0,
            f"{{}} of the hidden {label.kind} label {label.text!r} is seen",
        )
