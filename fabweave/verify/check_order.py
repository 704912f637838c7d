"""Check the order of cutting, and that everything of a piece lies inside its outline."""

from collections.abc import Sequence

import numpy as np
import shapely

from fabweave.verify.check_drawings import SAME_MM, by_piece
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    LAYERS,
    NOTES,
    OUTLINES,
    Drawing,
    Shape,
    traced,
)
from fabweave.verify.loading import Job
from fabweave.verify.report import Tally

_RANK = {"ENGRAVE_LABEL": 0, "ENGRAVE_MARK": 0, HOLES: 1, OUTLINES: 2}


def check_order(job: Job, tally: Tally) -> None:
    """Check the order of cutting, and that a piece's holes and engraving are inside its outline."""
    plan = job.map
    if plan is None:
        return
    for sheet in plan.sheets:
        drawing = job.dxf.get(sheet.number)
        if drawing is None:
            tally.fail(f"{sheet.name}.dxf is not checked, because it could not be read")
        else:
            _check_sequence(f"{sheet.name}.dxf", drawing, tally)
            _check_inside(f"{sheet.name}.dxf", drawing, tally)
        drawing = job.svg.get(sheet.number)
        if drawing is None:
            tally.fail(f"{sheet.name}.svg is not checked, because it could not be read")
        else:
            ranks = [LAYERS.index(layer) for layer in drawing.layers if layer in LAYERS]
            tally.expect(
                ranks == sorted(set(ranks)),
                f"{sheet.name}.svg has its layers in the order {', '.join(drawing.layers)}",
            )
            _check_inside(f"{sheet.name}.svg", drawing, tally)


def _check_sequence(where: str, drawing: Drawing, tally: Tally) -> None:
    """Check that pieces follow one another whole: engraving, holes, outline."""
    done: set[str | None] = set()
    current: str | None = None
    rank = 0
    noted = False
    for shape in drawing.shapes:
        if shape.layer == NOTES:
            noted = current is not None
        if shape.layer == NOTES or shape.piece is None:
            continue
        if shape.piece != current:
            tally.expect(
                shape.piece not in done,
                f"{where}: piece {shape.piece} is taken up again after another piece",
            )
            done.add(current)
            current, rank = shape.piece, 0
        elif noted:
            tally.fail(f"{where}: a note stands between the shapes of piece {current}")
        noted = False
        own = _RANK.get(shape.layer, rank)
        tally.expect(
            own >= rank, f"{where}: {shape.where} on {shape.layer} comes after a later operation"
        )
        rank = max(rank, own)


def _check_inside(where: str, drawing: Drawing, tally: Tally) -> None:
    """Check that holes lie strictly inside their outlines and engraving does not leave them."""
    groups = by_piece(drawing)
    outlines = {
        name: shapely.make_valid(shapely.Polygon(traced(shapes[0])))
        for (layer, name), shapes in groups.items()
        if layer == OUTLINES and len(shapes[0].points) > 2
    }
    for (layer, name), shapes in groups.items():
        if name not in outlines or layer not in (*ENGRAVE_LAYERS, HOLES):
            continue
        tally.count(len(shapes))
        if layer == HOLES:
            inside = _holes_inside(outlines[name], shapes)
        else:
            lines = np.array([shapely.LineString(traced(shape)) for shape in shapes])
            inside = shapely.covers(outlines[name], lines)
            if not np.all(inside):
                # Edge ticks may begin on the outline, whose points are rounded.
                inside = shapely.covers(shapely.buffer(outlines[name], SAME_MM), lines)
        for at in np.flatnonzero(~inside):
            tally.fail(f"{where}: {shapes[at].where} on {layer} leaves the outline")


def _holes_inside(
    outline: shapely.Geometry, shapes: Sequence[Shape]
) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return whether holes lie strictly inside an outline; a hole that is no circle does not."""
    centres = shapely.points(np.array([shape.points[0] for shape in shapes]))
    radii = np.array([np.inf if shape.radius is None else shape.radius for shape in shapes])
    clear = shapely.distance(shapely.boundary(outline), centres) > radii
    return np.asarray(clear & shapely.contains(outline, centres))
