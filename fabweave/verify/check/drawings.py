"""Check the sheets' drawings: what they cut and letter, and that both formats agree."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.crossing_map import CrossingMap, Piece, Sheet
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    LAYERS,
    NOTES,
    OUTLINES,
    Drawing,
    Floats,
    Ints,
    Shape,
)
from fabweave.verify.measure.geometry import distances
from fabweave.verify.read.job_files import READY, Job, required, sheet_drawings
from fabweave.verify.report import Place, Tally

#: Letters keep this far from edges, holes and marks.
CLEAR_MM = 0.2


def check_labels(job: Job, tally: Tally) -> None:
    """Check where letters stand; what they say is held by the seal."""
    plan, side = required(job.map), job.options.get("label_side", "outside")
    tally.at("job.toml").expect(
        side in ("outside", "inside"), f"labels are {side!r}, which is no side of a piece"
    )
    for sheet in plan.sheets:
        place = tally.at(sheet.name)
        place.equal(
            f"whether it is mirrored, with labels {side},", sheet.mirrored, side == "inside"
        )
        # That both formats draw the same is another check.
        drawing = job.sheets.dxf.get(sheet.name) or job.sheets.svg.get(sheet.name)
        if drawing is None:
            tally.fail(f"the labels on {sheet.name} are not checked: no drawing could be read")
            continue
        for piece in plan.on_sheet(sheet.number):
            _check_clearance(piece.id, drawing, place.at(f"piece {piece.id}"))
            _check_ticks(piece, drawing, place.at(f"piece {piece.id}"))


#: The line of a tick passes its crossing so near.
_POINTS_MM = 0.05


def _check_ticks(piece: Piece, drawing: Drawing, place: Place) -> None:
    """Check that ticks lie abreast of crossings without a hole that the piece passes under.

    Lines that point at no such crossing are guides of joints.
    """
    if not piece.ticks:
        return
    for at in piece.ticks:
        one = piece.stations[at] if 0 <= at < len(piece.stations) else None
        if one is None or one.over or piece.cut_at.get(at):
            place.fail(f"it has a tick at station {at + 1}, which nothing covers, or has a hole")
            return
    runs = [shape.run[:, :2] for shape in drawing.of("ENGRAVE_MARK", piece.id)]
    lines = np.array([run for run in runs if len(run) == 2]).reshape(-1, 2, 2)
    points = piece.placed(piece.points)
    stated, drawn = set(piece.ticks), set()
    jointed = {at for at, one in enumerate(piece.stations) if one.joint is not None}
    for line in lines:
        along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
        away = points - line.mean(axis=0)
        aside = np.abs(away @ [-along[1], along[0]])
        near = np.argsort(np.hypot(*away.T), kind="stable")[:2]
        met = stated.intersection(one for one in near.tolist() if aside[one] <= _POINTS_MM)
        drawn |= met
        if not met and not jointed.intersection(near.tolist()):
            place.fail(f"a line at station {int(near[0]) + 1} is no tick and no guide of a joint")
    for at in sorted(stated - drawn):
        place.fail(f"the tick at station {at + 1} is not drawn, or does not point at its crossing")


def _check_clearance(piece: str, drawing: Drawing, place: Place) -> None:
    """Check that letters are inside their outline, and off it, its holes and its marks."""
    letters, marks = (
        lines_of(drawing.of(layer, piece)) for layer in ("ENGRAVE_LABEL", "ENGRAVE_MARK")
    )
    outlines = drawing.of(OUTLINES, piece)
    if not len(letters) or not outlines:
        return
    outline, *holes = (
        shapely.Polygon(shape.traced) if shape.radius or len(shape.points) > 2 else None
        for shape in (outlines[0], *drawing.of(HOLES, piece))
    )
    text = shapely.multilinestrings(letters[shapely.is_geometry(letters)])
    inside = shapely.contains(shapely.make_valid(outline), text)
    place.expect(inside, "letters leave it")
    others = np.array([shapely.boundary(outline), *marks, *holes], dtype=object)
    apart = float(np.nanmin(shapely.distance(text, others), initial=np.inf))
    place.at_least("clear_mm", apart, CLEAR_MM, "letters are {} from an edge, a hole or a mark")


#: Coordinates are rounded to a ten-thousandth, which may shorten a tenth by as much.
LEAST_MM = 0.1 - 3e-4
#: Ends that agree to this are the same.
_GRID_MM = 1e-3
#: Of lines that lie on one another, so much is in common; less is a rounding of their ends.
_COMMON_MM = 0.05


def check_lines(job: Job, tally: Tally) -> None:
    """Check the segments of every sheet as its DXF has them; the SVG draws the same.

    Of sheets that are written once more to be cut, those are checked, too. Nobody burns notes.
    """
    for sheet, drawing, place in sheet_drawings(job, "dxf", tally):
        # Strips that share cuts lie edge on edge here, and are drawn anew to be cut.
        common = job.ready is not None and sheet.name in job.ready.shared
        shapes = [one for one in drawing.shapes if not (common and one.layer == OUTLINES)]
        _check_segments(shapes, place)
    for sheet in required(job.map).sheets:
        if job.ready is not None and (ready := job.ready.dxf.get(sheet.name)) is not None:
            _check_segments(ready.shapes, tally.at(f"{READY}/{job.ready.stem_of(sheet.name)}.dxf"))


def _check_segments(drawn: Sequence[Shape], place: Place) -> None:
    """Check that no segment but of notes is short, or lies on another, all or in part."""
    shapes = [shape for shape in drawn if shape.radius is None and shape.layer != NOTES]
    runs = [shape.run for shape in shapes]
    begin, goal = (
        np.concatenate([np.zeros((0, 3)), *(run[part] for run in runs)])
        for part in (slice(None, -1), slice(1, None))
    )
    of = np.repeat(np.arange(len(runs)), [len(run) - 1 for run in runs])
    start, end, bulges = begin[:, :2], goal[:, :2], begin[:, 2]
    length = np.hypot(*(end - start).T)
    if len(length):
        at = int(np.argmin(length))
        name = shapes[of[at]].where
        place.at_least("segment_mm", float(length[at]), LEAST_MM, f"a side of {name} is {{}} long")
    # From either end; from the other one, left is right.
    back = (start[:, 0] > end[:, 0]) | ((start[:, 0] == end[:, 0]) & (start[:, 1] > end[:, 1]))
    low, high = (np.where(back[:, None], b, a) for a, b in ((start, end), (end, start)))
    height = np.where(back, -1.0, 1.0) * bulges * length / 2.0
    keys = np.rint(np.column_stack([low, high, height]) / _GRID_MM).astype(np.int64)
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    place.count(len(keys))
    for at in first[counts > 1].tolist():
        name = shapes[of[at]].where
        place.fail(f"a side of {name} is drawn more than once")
    straight = np.flatnonzero(bulges == 0.0)
    for at in straight[_on_others(start[straight], end[straight])].tolist():
        place.fail(
            f"a side of {shapes[of[at]].where} lies on another line for a part of its length"
        )


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
        other = job.sheets.dxf.get(sheet.name)
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
            name is None if layer == NOTES else name in pieces,
            f"{len(shapes)} shapes on {layer} belong to "
            + (f"{name}, which has nothing there" if name else "no piece"),
        )
    for piece in pieces.values():
        outlines, cutouts = drawing.of(OUTLINES, piece.id), drawing.of(HOLES, piece.id)
        here = place.at(f"piece {piece.id}")
        check_piece_drawn(piece, outlines, cutouts, here)


def check_piece_drawn(
    piece: Piece, outlines: list[Shape], cutouts: list[Shape], place: Place
) -> None:
    """Check the shapes that are a piece's outline, and those that are its cut-outs."""
    _check_outline(piece, outlines, place)
    _check_holes(piece, [one for one in cutouts if one.radius is not None], place)
    _check_slots(piece, [one for one in cutouts if one.radius is None], place)


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
    after = np.roll(np.arange(len(ring)), -1)
    return float(np.max(_offs(ring, wanted, after), initial=0.0))


def _offs(ring: Floats, wanted: Floats, after: Ints) -> Floats:
    """Return how far vertices, and the tops of arcs over them, are off; ``after`` is the next."""
    vertices = np.hypot(*(ring - wanted)[:, :2].T)
    chords = np.hypot(*(wanted[after] - wanted)[:, :2].T)
    return np.asarray(vertices + np.abs(ring[:, 2] - wanted[:, 2]) * chords / 2.0)


def _check_holes(piece: Piece, shapes: Sequence[Shape], place: Place) -> None:
    """Check the holes of a piece."""
    holes = piece.holes
    if not place.equal(f"the number of circles on {HOLES}", len(shapes), len(holes)) or not holes:
        return
    wanted = piece.placed(np.array([(hole.x, hole.y) for hole in holes]))
    centres = np.array([shape.points[0] for shape in shapes])
    distance = distances(wanted, centres)
    nearest = np.argmin(distance, axis=1)
    place.expect(
        len(set(nearest.tolist())) == len(holes), "two of its holes are drawn in one place"
    )
    for hole, at, off in zip(holes, nearest.tolist(), distance.min(axis=1).tolist(), strict=True):
        what = f"the hole at ({hole.x:.3f}, {hole.y:.3f})"
        place.at_most("hole_mm", off, SAME_MM, f"{what} is {{}} from where it should be")
        diameter = 2.0 * (shapes[at].radius or 0.0)
        place.at_most(
            "diameter_mm",
            abs(diameter - hole.diameter_mm),
            SAME_MM,
            f"{what} is {diameter:.4f} mm wide instead of {hole.diameter_mm} mm: {{}} off",
        )


def compare_formats(drawing: Drawing, other: Drawing, place: Place) -> None:
    """Check that SVG and DXF draw the same shapes on every layer of every piece."""
    for layer, name in sorted({*drawing.groups, *other.groups}, key=str):
        mine, theirs = drawing.of(layer, name), other.of(layer, name)
        here = place.at(f"{layer} of piece {name}" if name else layer)
        if here.equal("the number of shapes, which the DXF has, too,", len(mine), len(theirs)):
            off = shapes_apart(mine, theirs)
            here.at_most("formats_mm", off, SAME_MM, "it differs from the DXF by {}")


def shapes_apart(mine: Sequence[Shape], theirs: Sequence[Shape]) -> float:
    """Return the largest distance of shapes side by side; infinite for unlike ones."""
    if [_kind_of(one) for one in mine] != [_kind_of(one) for one in theirs]:
        return float("inf")
    if not mine:
        return 0.0
    ring, wanted = (np.concatenate([one.ring for one in shapes]) for shapes in (mine, theirs))
    counts = [len(one.points) for one in mine]
    wider = [
        abs((one.radius or 0.0) - (two.radius or 0.0))
        for one, two in zip(mine, theirs, strict=True)
    ]
    after = np.arange(1, len(ring) + 1)
    after[np.cumsum(counts) - 1] -= counts
    return float(np.max(_offs(ring, wanted, after) + np.repeat(wider, counts), initial=0.0))


def _kind_of(shape: Shape) -> tuple[bool, bool, int]:
    """Return what is the same of shapes that can be compared."""
    return shape.closed, shape.radius is None, len(shape.points)


_RANK = {"ENGRAVE_LABEL": 0, "ENGRAVE_MARK": 0, HOLES: 1, OUTLINES: 2}


def check_order(job: Job, tally: Tally) -> None:
    """Check the order of cutting, and that a piece's holes and engraving are inside its outline."""
    for kind in ("dxf", "svg"):
        for _, drawing, place in sheet_drawings(job, kind, tally, needed=True):
            _check_inside(drawing, place)
    for drawings in job.drawings:
        for name, file, drawing in drawings.drawn():
            # What pieces share is cut when all of them are engraved.
            if name not in drawings.shared:
                check = _check_sequence if file.endswith(".dxf") else _check_layers
                check(drawing, tally.at(file))


def _check_layers(drawing: Drawing, place: Place) -> None:
    """Check the order of the layers of an SVG file."""
    layers = [layer for layer in drawing.layers if layer in LAYERS]
    wanted = [layer for layer in LAYERS if layer in layers]
    place.equal("the order of its layers", layers, wanted)


def _check_sequence(drawing: Drawing, place: Place) -> None:
    """Check that pieces follow one another whole: engraving, holes, outline."""
    done: set[str | None] = set()
    current: str | None = None
    rank = 0
    noted = False
    # Only the first of a run of shapes of one piece on one layer can be out of order by itself.
    shapes = [(shape.layer, shape.piece) for shape in drawing.shapes]
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
            for shape in drawing.shapes[start:end]:
                place.fail(
                    f"{shape.name} of piece {piece} on {layer} comes after a later operation"
                )
        rank = max(rank, layer_rank)


def _check_inside(drawing: Drawing, place: Place) -> None:
    """Check that holes lie strictly inside their outlines and engraving does not leave them."""
    for (layer, name), shapes in drawing.groups.items():
        if layer != OUTLINES or len(shapes[0].points) < 3:
            continue
        outline = shapely.make_valid(shapely.Polygon(shapes[0].traced))
        holes = drawing.of(HOLES, name)
        engraved = [one for each in ENGRAVE_LAYERS for one in drawing.of(each, name)]
        # Edge ticks may begin on the outline, whose points are rounded; a point is no line.
        wide = shapely.buffer(outline, SAME_MM)
        shapely.prepare(wide)
        inside = [*_holds(outline, holes), *shapely.covers(wide, lines_of(engraved)).tolist()]
        place.count(len(inside))
        for shape, held in zip([*holes, *engraved], inside, strict=True):
            if not held:
                place.fail(f"{shape.where} on {shape.layer} leaves the outline")


def _holds(outline: shapely.Geometry, holes: Sequence[Shape]) -> list[bool]:
    """Return which holes or slots lie strictly inside an outline."""
    cutouts = np.array([
        shapely.Polygon(hole.traced) if hole.radius is None else shapely.Point(hole.points[0])
        for hole in holes
    ], dtype=object)  # fmt: skip
    edge = shapely.boundary(outline)
    shapely.prepare([edge, outline])
    # Written so that NaN objects; a slot that crosses the border is not clear of it.
    clear = shapely.distance(edge, cutouts) > np.array([hole.radius or 0.0 for hole in holes])
    return (clear & shapely.contains(outline, cutouts)).tolist()


def lines_of(shapes: Sequence[Shape]) -> npt.NDArray[np.object_]:
    """Return shapes as lines; None for what is a point."""
    runs = [shape.traced for shape in shapes]
    counts = np.array([len(run) for run in runs], dtype=np.int64)
    lines, long = np.full(len(runs), None), np.flatnonzero(counts > 1)
    if len(long):
        points = np.concatenate([runs[at] for at in long.tolist()])
        lines[long] = shapely.linestrings(
            points, indices=np.repeat(np.arange(len(long)), counts[long])
        )
    return lines
