"""Check the sheets' drawings: what they cut, and that both formats agree."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.crossing_map import CrossingMap, Hole, Piece, Sheet
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    LAYERS,
    NOTES,
    OUTLINES,
    Drawing,
    Flags,
    Floats,
    Ints,
    Shape,
    chords_of,
)
from fabweave.verify.measure.geometry import distances
from fabweave.verify.read.job_files import READY, Job, required, sheet_drawings
from fabweave.verify.report import Place, Tally

#: Coordinates are rounded to a ten-thousandth, which may shorten a tenth by as much.
LEAST_MM = 0.1 - 3e-4
#: Ends that agree to this are the same.
_GRID_MM = 1e-3
#: Of lines that lie on one another, so much is in common; less is a rounding of their ends.
_COMMON_MM = 0.05


def check_lines(job: Job, tally: Tally) -> None:
    """Check the segments of every sheet as its DXF has them; the SVG draws the same.

    Of sheets that are written once more to be cut, those are checked, too.
    """
    for _, drawing, place in sheet_drawings(job, "dxf", tally):
        _check_segments(drawing, place)
    for sheet in required(job.map).sheets:
        if job.ready is not None and (ready := job.ready.dxf.get(sheet.name)) is not None:
            _check_segments(ready, tally.at(f"{READY}/{job.ready.name_of(sheet.name)}.dxf"))


def _check_segments(drawing: Drawing, place: Place) -> None:
    """Check that every segment is long enough, and that none lies on another, all or in part."""
    owner = np.repeat(np.arange(len(drawing.sizes)), drawing.sizes)
    following = np.arange(1, len(owner) + 1)
    following[drawing.start[1:] - 1] = drawing.start[:-1]
    last = np.zeros(len(owner), dtype=bool)
    last[drawing.start[1:] - 1] = True
    drawn = np.flatnonzero((~last | drawing.closed[owner]) & np.isnan(drawing.radius[owner]))
    start, end = drawing.points[drawn], drawing.points[following[drawn]]
    length = np.hypot(*(end - start).T)
    if len(length):
        at = int(np.argmin(length))
        name = drawing.shape(int(owner[drawn[at]])).where
        place.at_least("segment_mm", float(length[at]), LEAST_MM, f"a side of {name} is {{}} long")
    # From either end; from the other one, left is right.
    back = (start[:, 0] > end[:, 0]) | ((start[:, 0] == end[:, 0]) & (start[:, 1] > end[:, 1]))
    low, high = (np.where(back[:, None], b, a) for a, b in ((start, end), (end, start)))
    height = np.where(back, -1.0, 1.0) * drawing.bulges[drawn] * length / 2.0
    keys = np.rint(np.column_stack([low, high, height]) / _GRID_MM).astype(np.int64)
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    place.count(len(keys))
    for at in first[counts > 1].tolist():
        name = drawing.shape(int(owner[drawn[at]])).where
        place.fail(f"a side of {name} is drawn more than once")
    # Nobody burns notes: what is dashed there may lie along an edge.
    burnt = np.array([layer != NOTES for layer in drawing.layer], dtype=bool)
    straight = burnt[owner[drawn]] & (drawing.bulges[drawn] == 0.0)
    for at in drawn[straight][_on_others(start[straight], end[straight])].tolist():
        name = drawing.shape(int(owner[at])).where
        place.fail(f"a side of {name} lies on another line for a part of its length")


def _on_others(start: Floats, end: Floats) -> Ints:
    """Return which of some segments share more than their ends with one that stands before them.

    Segments that do have an end of one on the other, and the same direction.
    """
    lines = shapely.linestrings(np.stack([start, end], axis=1))
    first, second = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=_GRID_MM)
    first, second = first[first < second], second[first < second]
    covered = []
    for a, b in ((first, second), (second, first)):
        # What of b is within the grid of a is as long as what they share.
        way = end[a] - start[a]
        square = np.maximum(np.einsum("sd,sd->s", way, way), _GRID_MM**2)
        share, off = [], []
        for tip in (start[b], end[b]):
            share.append(np.einsum("sd,sd->s", tip - start[a], way) / square)
            cross = way[:, 0] * (tip - start[a])[:, 1] - way[:, 1] * (tip - start[a])[:, 0]
            off.append(np.abs(cross) / np.sqrt(square))
        low, high = np.sort(np.clip(share, 0.0, 1.0), axis=0)
        longer = square >= np.einsum("sd,sd->s", end[b] - start[b], end[b] - start[b])
        common = (high - low) * np.sqrt(square)
        near = np.max(off, axis=0) <= _GRID_MM
        covered.append(second[longer & near & (common > _COMMON_MM)])
    return np.unique(np.concatenate(covered))


SAME_MM = 0.01


def check_dxf(job: Job, tally: Tally) -> None:
    """Check that every DXF sheet declares millimetres and cuts what the map says."""
    plan = required(job.map)
    for sheet, drawing, place in sheet_drawings(job, "dxf", tally, needed=True):
        _check_cuts(drawing, sheet, plan, place)


def check_svg(job: Job, tally: Tally) -> None:
    """Check that every SVG sheet has its size, cuts what the map says and draws what DXF draws."""
    plan = required(job.map)
    for sheet, drawing, place in sheet_drawings(job, "svg", tally, needed=True):
        sizes = (drawing.width_mm or 0.0, drawing.height_mm or 0.0)
        place.expect(
            np.allclose(sizes, (sheet.width_mm, sheet.height_mm), rtol=0, atol=1e-3),
            f"it is {sizes[0]:g} × {sizes[1]:g} mm, its sheet {sheet.width_mm:g} × "
            f"{sheet.height_mm:g} mm",
        )
        _check_cuts(drawing, sheet, plan, place)
        other = job.dxf.get(sheet.number)
        if other is None:
            place.fail(f"it is not compared, because {sheet.name}.dxf could not be read")
        else:
            compare_formats(drawing, other, place)


def _check_cuts(drawing: Drawing, sheet: Sheet, plan: CrossingMap, place: Place) -> None:
    """Check a sheet's outlines and holes against its pieces; nothing extra, nothing missing."""
    for problem in drawing.problems:
        place.fail(problem)
    pieces = {piece.id: piece for piece in plan.on_sheet(sheet.number)}
    for (layer, name), shapes in drawing.groups.items():
        place.expect(
            layer == NOTES or name in pieces,
            f"{len(shapes)} shapes on {layer} belong to "
            + (f"{name}, which is not on this sheet" if name else "no piece"),
        )
    for piece in pieces.values():
        outlines, cutouts = drawing.of(OUTLINES, piece.id), drawing.of(HOLES, piece.id)
        here = place.at(f"piece {piece.id}")
        check_piece_drawn(piece, plan.holes[piece.id], drawing, (outlines, cutouts), here)


def check_piece_drawn(
    piece: Piece, holes: list[Hole], drawing: Drawing, shapes: tuple[Ints, Ints], place: Place
) -> None:
    """Check which shapes of a drawing are a piece's outline, and which its cut-outs."""
    outlines, cutouts = shapes
    circle = ~np.isnan(drawing.radius[cutouts])
    _check_outline(piece, [drawing.shape(at) for at in outlines.tolist()], place)
    _check_holes(piece, holes, drawing, cutouts[circle], place)
    _check_slots(piece, [drawing.shape(at) for at in cutouts[~circle].tolist()], place)


def _check_outline(piece: Piece, shapes: Sequence[Shape], place: Place) -> None:
    """Check the one outline of a piece."""
    if not place.equal(f"the number of outlines on {OUTLINES}", len(shapes), 1):
        return
    shape = shapes[0]
    if not place.expect(
        shape.closed and shape.radius is None and len(shape.points) == len(piece.path),
        f"its outline is not closed, or has {len(shape.points)} vertices instead of "
        f"{len(piece.path)}",
    ):
        return
    off = _ring_distance(shape.ring, piece.placed_ring(piece.path))
    place.at_most("outline_mm", off, SAME_MM, "its outline is {} from where it should be")


def _check_slots(piece: Piece, shapes: list[Shape], place: Place) -> None:
    """Check the cut-outs of a piece that are no circles, in whatever order they are drawn."""
    slots = piece.slots
    if not place.expect(
        sorted(len(shape.points) for shape in shapes) == sorted(len(slot) for slot in slots)
        and all(shape.closed for shape in shapes),
        f"it has {len(shapes)} cut-outs on {HOLES} that are no circles, instead of {len(slots)}, "
        "or they are not closed runs of as many vertices",
    ):
        return
    for slot in slots:
        wanted = piece.placed_ring(slot)
        distances = [_side_distance(shape.ring, wanted) for shape in shapes]
        nearest = int(np.argmin(distances))
        del shapes[nearest]
        place.at_most(
            "slot_mm", distances[nearest], SAME_MM, "a slot is {} from where it should be"
        )


def _ring_distance(ring: Floats, wanted: Floats) -> float:
    """Return the largest distance of two rings, whatever their start and direction.

    Rings are (N, 3): points and bulges. Vertices and the tops of arcs are compared; rings of
    unlike numbers of vertices are infinitely far apart.
    """
    if len(ring) != len(wanted):
        return float("inf")
    start = int(np.argmin(np.hypot(*(ring - wanted[0])[:, :2].T)))
    there = _side_distance(np.roll(ring, -start, axis=0), wanted)
    if there <= SAME_MM:
        return there
    back = ring[::-1].copy()
    # Backwards, a side leaves the point that it reached, and left is right.
    back[:, 2] = -np.roll(back[:, 2], -1)
    return min(there, _side_distance(np.roll(back, start + 1, axis=0), wanted))


def _side_distance(ring: Floats, wanted: Floats) -> float:
    """Return the largest distance of corresponding vertices, and of the tops of arcs over them."""
    if len(ring) != len(wanted):
        return float("inf")
    vertices = np.hypot(*(ring - wanted)[:, :2].T)
    chords = np.hypot(*chords_of(wanted[:, :2]).T)
    return float(np.max(vertices + np.abs(ring[:, 2] - wanted[:, 2]) * chords / 2.0, initial=0.0))


def _check_holes(
    piece: Piece, holes: Sequence[Hole], drawing: Drawing, shapes: Ints, place: Place
) -> None:
    """Check the holes of a piece."""
    if not place.equal(f"the number of circles on {HOLES}", len(shapes), len(holes)) or not holes:
        return
    wanted = piece.placed(np.array([(hole.x, hole.y) for hole in holes]))
    centres = drawing.points[drawing.start[shapes]]
    distance = distances(wanted, centres)
    nearest = np.argmin(distance, axis=1)
    place.expect(
        len(set(nearest.tolist())) == len(holes), "two of its holes are drawn in one place"
    )
    for hole, at, off in zip(holes, nearest.tolist(), distance.min(axis=1).tolist(), strict=True):
        what = f"the hole at ({hole.x:.3f}, {hole.y:.3f})"
        place.at_most("hole_mm", off, SAME_MM, f"{what} is {{}} from where it should be")
        diameter = 2.0 * float(drawing.radius[shapes[at]])
        change = 0.0 if hole.diameter is None else abs(diameter - hole.diameter)
        place.at_most(
            "diameter_mm",
            change,
            SAME_MM,
            f"{what} is {diameter:.4f} mm wide instead of {hole.diameter} mm: {{}} off",
        )


def compare_formats(drawing: Drawing, other: Drawing, place: Place) -> None:
    """Check that SVG and DXF draw the same shapes on every layer of every piece."""
    pairs = [
        (key, drawing.of(*key), other.of(*key))
        for key in sorted({*drawing.groups, *other.groups}, key=str)
    ]
    even = [(mine, theirs) for _, mine, theirs in pairs if len(mine) == len(theirs)]
    none = np.zeros(0, dtype=np.int64)
    first, second = (np.concatenate([none, *(pair[side] for pair in even)]) for side in (0, 1))
    apart = _apart_in_order(drawing, first, other, second)
    done = 0
    for (layer, name), mine, theirs in pairs:
        here = place.at(f"{layer} of piece {name}" if name else layer)
        if here.equal("the number of shapes, which the DXF has, too,", len(mine), len(theirs)):
            off = float(apart[done : done + len(mine)].max())
            done += len(mine)
            here.at_most("formats_mm", off, SAME_MM, "it differs from the DXF by {}")


def _apart_in_order(drawing: Drawing, mine: Ints, other: Drawing, theirs: Ints) -> Floats:
    """Return the distance of each two shapes, side by side; infinite for unlike shapes."""
    sizes, radii, others = drawing.sizes[mine], drawing.radius[mine], other.radius[theirs]
    alike = (
        (sizes == other.sizes[theirs])
        & (drawing.closed[mine] == other.closed[theirs])
        & (np.isnan(radii) == np.isnan(others))
    )
    result = np.full(len(mine), np.inf)
    if np.any(alike):
        one, two = drawing.slots(mine[alike]), other.slots(theirs[alike])
        ends = np.cumsum(sizes[alike])
        starts = ends - sizes[alike]
        points = drawing.points[one]
        chords = chords_of(points)
        chords[ends - 1] = points[starts] - points[ends - 1]
        bend = np.abs(drawing.bulges[one] - other.bulges[two]) * np.hypot(*chords.T) / 2.0
        apart = np.hypot(*(points - other.points[two]).T) + bend
        result[alike] = np.maximum.reduceat(apart, starts)
        result[alike] += np.nan_to_num(np.abs(radii - others))[alike]
    return result


def shapes_apart(drawing: Drawing, mine: Ints, other: Drawing, theirs: Ints) -> float:
    """Return the largest distance of shapes side by side; infinite for unlike ones."""
    if len(mine) != len(theirs):
        return float("inf")
    return float(np.max(_apart_in_order(drawing, mine, other, theirs), initial=0.0))


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


def lines_of(drawing: Drawing, shapes: Ints) -> npt.NDArray[np.object_]:
    """Return some shapes as lines; None for what is a point."""
    points, line = drawing.traced(shapes)
    real = np.bincount(line, minlength=len(shapes)) > 1
    kept = real[line]
    lines = np.full(len(shapes), None, dtype=object)
    lines[real] = shapely.linestrings(points[kept], indices=np.cumsum(real)[line[kept]] - 1)
    return lines


def _lines_inside(
    drawing: Drawing, shapes: Ints, outlines: npt.NDArray[np.object_], owner: Ints
) -> Flags:
    """Return whether what is engraved stays inside the outline of its piece."""
    lines = lines_of(drawing, shapes)
    result = np.asarray(shapely.is_geometry(lines))
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
