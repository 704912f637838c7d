"""Check the order of cutting, and that everything of a piece lies inside its outline."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.checks.sheets.drawings import SAME_MM
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    LAYERS,
    NOTES,
    OUTLINES,
    Drawing,
    Flags,
    Ints,
)
from fabweave.verify.read.job_files import Job, sheet_drawings
from fabweave.verify.statement import Place, Tally

_RANK = {"ENGRAVE_LABEL": 0, "ENGRAVE_MARK": 0, HOLES: 1, OUTLINES: 2}


def check_order(job: Job, tally: Tally) -> None:
    """Check the order of cutting, and that a piece's holes and engraving are inside its outline."""
    for _, drawing, place in sheet_drawings(job, "dxf", tally, needed=True):
        _check_sequence(drawing, place)
        _check_inside(drawing, place)
    for _, drawing, place in sheet_drawings(job, "svg", tally, needed=True):
        layers = [layer for layer in drawing.layers if layer in LAYERS]
        wanted = [layer for layer in LAYERS if layer in layers]
        place.equal("the order of its layers", layers, wanted)
        _check_inside(drawing, place)


def _check_sequence(drawing: Drawing, place: Place) -> None:
    """Check that pieces follow one another whole: engraving, holes, outline."""
    done: set[str | None] = set()
    current: str | None = None
    rank = 0
    noted = False
    # Only the first of a run of shapes of one piece on one layer can be out of order by itself.
    shapes = list(zip(drawing.layer, drawing.piece, strict=True))
    starts = [at for at, shape in enumerate(shapes) if at == 0 or shape != shapes[at - 1]]
    for start, end in pairwise([*starts, len(shapes)]):
        layer, piece = shapes[start]
        if layer == NOTES:
            noted = current is not None
        if layer == NOTES or piece is None:
            continue
        if piece != current:
            place.expect(piece not in done, f"piece {piece} is taken up again after another piece")
            done.add(current)
            current, rank = piece, 0
        elif noted:
            place.fail(f"a note stands between the shapes of piece {current}")
        noted = False
        layer_rank = _RANK.get(layer, rank)
        place.count(end - start)
        if layer_rank < rank:
            for name in drawing.name[start:end]:
                place.fail(f"{name} of piece {piece} on {layer} comes after a later operation")
        rank = max(rank, layer_rank)


def _check_inside(drawing: Drawing, place: Place) -> None:
    """Check that holes lie strictly inside their outlines and engraving does not leave them."""
    names = [
        name
        for (layer, name), shapes in drawing.groups.items()
        if layer == OUTLINES and drawing.sizes[shapes[0]] > 2
    ]
    firsts = np.array([drawing.groups[OUTLINES, name][0] for name in names], dtype=np.int64)
    points, ring = drawing.traced(firsts)
    outlines = shapely.make_valid(shapely.polygons(shapely.linearrings(points, indices=ring)))
    shapely.prepare(outlines)
    number = {name: at for at, name in enumerate(names)}
    for layers, inside in (((HOLES,), _holes_inside), (ENGRAVE_LAYERS, _lines_inside)):
        groups = [
            (shapes, number[name])
            for (layer, name), shapes in drawing.groups.items()
            if layer in layers and name in number
        ]
        if not groups:
            continue
        shapes = np.concatenate([group for group, _ in groups])
        owner = np.repeat([at for _, at in groups], [len(group) for group, _ in groups])
        place.count(len(shapes))
        for at in shapes[~inside(drawing, shapes, outlines, owner)].tolist():
            place.fail(f"{drawing.shape(at).where} on {drawing.layer[at]} leaves the outline")


def _lines_inside(
    drawing: Drawing, shapes: Ints, outlines: npt.NDArray[np.object_], owner: Ints
) -> Flags:
    """Return whether what is engraved stays inside the outline of its piece."""
    points, line = drawing.traced(shapes)
    result = np.bincount(line, minlength=len(shapes)) > 1  # a point is no line
    kept = result[line]
    lines = np.full(len(shapes), None, dtype=object)
    lines[result] = shapely.linestrings(points[kept], indices=np.cumsum(result)[line[kept]] - 1)
    # All lines of a piece in one question; one by one only if some are not inside.
    order = np.flatnonzero(result)[np.argsort(owner[result], kind="stable")]
    pieces, number = np.unique(owner[order], return_inverse=True)
    together = shapely.multilinestrings(lines[order], indices=number)
    outside = ~shapely.covers(outlines[pieces], together)
    # Edge ticks may begin on the outline, whose points are rounded.
    wide = shapely.buffer(outlines[pieces[outside]], SAME_MM)
    shapely.prepare(wide)
    outside[outside] = ~shapely.covers(wide, together[outside])
    for piece in pieces[outside].tolist():
        rows = np.flatnonzero(result & (owner == piece))
        result[rows] = shapely.covers(shapely.buffer(outlines[piece], SAME_MM), lines[rows])
    return result


def _holes_inside(
    drawing: Drawing, shapes: Ints, outlines: npt.NDArray[np.object_], owner: Ints
) -> Flags:
    """Return whether holes and slots lie strictly inside an outline."""
    starts = drawing.start[shapes]
    radius = drawing.radius[shapes]
    cutouts = np.asarray(shapely.points(drawing.points[starts]))
    slots = np.flatnonzero(np.isnan(radius))
    if len(slots):
        points, ring = drawing.traced(shapes[slots])
        cutouts[slots] = shapely.polygons(shapely.linearrings(points, indices=ring))
    borders = shapely.boundary(outlines)[owner]
    # Written so that NaN objects; a slot that crosses the border is not clear of it.
    clear = shapely.distance(borders, cutouts) > np.where(np.isnan(radius), 0.0, radius)
    return np.asarray(clear & shapely.contains(outlines[owner], cutouts))
