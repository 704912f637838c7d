"""Check the sheets' drawings: what they cut, and that both formats agree."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Piece, Sheet
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    NOTES,
    OUTLINES,
    Drawing,
    Floats,
    Ints,
    Shape,
)
from fabweave.verify.measure.arcs import chords_of
from fabweave.verify.read.job_files import Job, sheet_drawing
from fabweave.verify.report import Tally

SAME_MM = 0.01


def check_dxf(job: Job, tally: Tally) -> None:
    """Check that every DXF sheet declares millimetres and cuts what the map says."""
    plan = job.map
    if plan is None:
        return
    for sheet in plan.sheets:
        drawing = sheet_drawing(job.dxf, sheet, "dxf", tally)
        if drawing is not None:
            _check_cuts(f"{sheet.name}.dxf", drawing, sheet, plan, tally)


def check_svg(job: Job, tally: Tally) -> None:
    """Check that every SVG sheet has its size, cuts what the map says and draws what DXF draws."""
    plan = job.map
    if plan is None:
        return
    for sheet in plan.sheets:
        drawing = sheet_drawing(job.svg, sheet, "svg", tally)
        if drawing is None:
            continue
        where = f"{sheet.name}.svg"
        sizes = (drawing.width_mm or 0.0, drawing.height_mm or 0.0)
        tally.expect(
            np.allclose(sizes, (sheet.width_mm, sheet.height_mm), rtol=0, atol=1e-3),
            f"{where} is {sizes[0]:g} × {sizes[1]:g} mm, its sheet "
            f"{sheet.width_mm:g} × {sheet.height_mm:g} mm",
        )
        _check_cuts(where, drawing, sheet, plan, tally)
        _check_names(where, drawing, tally)
        other = job.dxf.get(sheet.number)
        if other is None:
            tally.fail(f"{where} is not compared, because {sheet.name}.dxf could not be read")
        else:
            compare_formats(where, drawing, other, tally)


def _check_cuts(
    where: str, drawing: Drawing, sheet: Sheet, plan: CrossingMap, tally: Tally
) -> None:
    """Check a sheet's outlines and holes against its pieces; nothing extra, nothing missing."""
    for problem in drawing.problems:
        tally.fail(f"{where}: {problem}")
    pieces = {piece.id: piece for piece in plan.pieces if piece.sheet == sheet.number}
    groups, none = drawing.groups, np.zeros(0, dtype=np.int64)
    drawn = _drawn_lines(drawing)
    for (layer, name), shapes in groups.items():
        tally.expect(
            layer == NOTES or name in pieces,
            f"{where}: {len(shapes)} shapes on {layer} belong to "
            + (f"{name}, which is not on this sheet" if name else "no piece"),
        )
    for piece in pieces.values():
        outlines = [drawing.shape(at) for at in groups.get((OUTLINES, piece.id), none).tolist()]
        _check_outline(where, piece, outlines, tally)
        holes = groups.get((HOLES, piece.id), none)
        circle = ~np.isnan(drawing.radius[holes])
        _check_holes(where, piece, plan, drawing, holes[circle], tally)
        _check_slots(where, piece, [drawing.shape(at) for at in holes[~circle].tolist()], tally)
        for layer in ENGRAVE_LAYERS:
            lines = groups.get((layer, piece.id), none).tolist()
            tally.expect(
                len({drawn[at] for at in lines}) == len(lines),
                f"{where}: piece {piece.id} is engraved twice",
            )


def _drawn_lines(drawing: Drawing) -> list[bytes]:
    """Return a word for each shape that is the same for the same points in either direction."""
    points = drawing.points.round(3) + 0.0  # no negative zeros
    there, back = points.tobytes(), points[::-1].tobytes()
    ends = (drawing.start * points.itemsize * 2).tolist()
    size = len(there)
    return [min(there[begin:end], back[size - end : size - begin]) for begin, end in pairwise(ends)]


def _check_outline(where: str, piece: Piece, shapes: Sequence[Shape], tally: Tally) -> None:
    """Check the one outline of a piece."""
    if not tally.expect(
        len(shapes) == 1, f"{where}: piece {piece.id} has {len(shapes)} outlines on {OUTLINES}"
    ):
        return
    shape = shapes[0]
    if not tally.expect(
        shape.closed and shape.radius is None and len(shape.points) == len(piece.path),
        f"{where}: the outline of piece {piece.id} is not closed, or has {len(shape.points)} "
        f"vertices instead of {len(piece.path)}",
    ):
        return
    drawn = np.zeros(len(shape.points)) if shape.bulges is None else shape.bulges
    off = ring_distance(
        np.column_stack([shape.points, drawn]),
        piece.placed_ring(piece.path),
    )
    tally.measure(
        "outline_mm",
        off,
        SAME_MM,
        f"{where}: the outline of piece {piece.id} is {off:.4f} mm from where it should be",
    )


def _check_slots(where: str, piece: Piece, shapes: Sequence[Shape], tally: Tally) -> None:
    """Check the cut-outs of a piece that are no circles, in whatever order they are drawn."""
    slots, left = piece.slots, list(shapes)
    if not tally.expect(
        sorted(len(shape.points) for shape in shapes) == sorted(len(slot) for slot in slots)
        and all(shape.closed for shape in shapes),
        f"{where}: piece {piece.id} has {len(shapes)} cut-outs on {HOLES} that are no circles, "
        f"instead of {len(slots)}, or they are not closed runs of as many vertices",
    ):
        return
    for slot in slots:
        wanted = piece.placed_ring(slot)
        distances = [_slot_distance(shape, wanted) for shape in left]
        nearest = int(np.argmin(distances))
        off = distances[nearest]
        del left[nearest]
        tally.measure(
            "slot_mm",
            off,
            SAME_MM,
            f"{where}: a slot of piece {piece.id} is {off:.4f} mm from where it should be",
        )


def _slot_distance(shape: Shape, wanted: Floats) -> float:
    """Return how far a shape is from a slot; infinite if it has not as many vertices."""
    if len(shape.points) != len(wanted):
        return float("inf")
    drawn = np.zeros(len(shape.points)) if shape.bulges is None else shape.bulges
    return _side_distance(np.column_stack([shape.points, drawn]), wanted)


def ring_distance(ring: Floats, wanted: Floats) -> float:
    """Return the largest distance of two rings, whatever their start and direction.

    Rings are (N, 3): points and bulges. Vertices and the tops of arcs are compared.
    """
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
    vertices = np.hypot(*(ring - wanted)[:, :2].T)
    chords = np.hypot(*chords_of(wanted[:, :2]).T)
    return float(np.max(vertices + np.abs(ring[:, 2] - wanted[:, 2]) * chords / 2.0, initial=0.0))


def _check_holes(
    where: str, piece: Piece, plan: CrossingMap, drawing: Drawing, shapes: Ints, tally: Tally
) -> None:
    """Check the holes of a piece."""
    holes = plan.holes[piece.id]
    radii = drawing.radius[shapes]
    if not tally.expect(
        len(shapes) == len(holes) and not np.any(np.isnan(radii)),
        f"{where}: piece {piece.id} has {len(shapes)} shapes on {HOLES} instead of {len(holes)} "
        "circles",
    ):
        return
    if not holes:
        return
    wanted = piece.placed(np.array([(hole.x, hole.y) for hole in holes]))
    centres = drawing.points[drawing.start[shapes]]
    distance = np.hypot(*(wanted[:, None] - centres[None, :]).transpose(2, 0, 1))
    nearest = np.argmin(distance, axis=1)
    tally.expect(
        len(set(nearest.tolist())) == len(holes),
        f"{where}: two holes of piece {piece.id} are drawn in one place",
    )
    for hole, at, off in zip(holes, nearest.tolist(), distance.min(axis=1).tolist(), strict=True):
        tally.measure(
            "hole_mm",
            off,
            SAME_MM,
            f"{where}: the hole of piece {piece.id} at ({hole.x:.3f}, {hole.y:.3f}) is {off:.4f} "
            "mm from where it should be",
        )
        diameter = 2.0 * float(radii[at])
        change = 0.0 if hole.diameter is None else abs(diameter - hole.diameter)
        tally.measure(
            "diameter_mm",
            change,
            SAME_MM,
            f"{where}: the hole of piece {piece.id} at ({hole.x:.3f}, {hole.y:.3f}) has diameter "
            f"{diameter:.4f} instead of {hole.diameter} mm",
        )


def _check_names(where: str, drawing: Drawing, tally: Tally) -> None:
    """Check that cuts in an SVG are named after their pieces, each once."""
    names = set()
    for layer, piece, name in zip(drawing.layer, drawing.piece, drawing.name, strict=True):
        if layer == OUTLINES:
            good = name == f"{piece}.outline"
        elif layer == HOLES:
            good = name.startswith(f"{piece}.hole.")
        else:
            continue
        tally.expect(
            good and name not in names,
            f"{where}: id {name!r} on {layer} is used twice, or is not piece {piece}'s",
        )
        names.add(name)


def compare_formats(where: str, drawing: Drawing, other: Drawing, tally: Tally) -> None:
    """Check that SVG and DXF draw the same shapes on every layer of every piece."""
    mine, theirs, none = drawing.groups, other.groups, np.zeros(0, dtype=np.int64)
    pairs = [
        (key, mine.get(key, none), theirs.get(key, none))
        for key in sorted({*mine, *theirs}, key=str)
    ]
    even = [(one, two) for _, one, two in pairs if len(one) == len(two)]
    first = np.concatenate([none, *(one for one, _ in even)])
    apart = _apart_in_order(drawing, first, other, np.concatenate([none, *(b for _, b in even)]))
    done = 0
    for (layer, name), one, two in pairs:
        what = f"{where}: {layer}" + (f" of piece {name}" if name else "")
        if tally.expect(
            len(one) == len(two), f"{what} has {len(one)} shapes, the DXF has {len(two)}"
        ):
            off = float(apart[done : done + len(one)].max())
            done += len(one)
            if not off <= SAME_MM:
                off = _apart_nearest(drawing, one, other, two)
            tally.measure(
                "formats_mm", off, SAME_MM, f"{what} differs from the DXF by {off:.4f} mm"
            )


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


def _apart_nearest(drawing: Drawing, mine: Ints, other: Drawing, theirs: Ints) -> float:
    """Return the largest distance of two sets of shapes, pairing each with the nearest left."""
    rest, off = [other.shape(at) for at in theirs.tolist()], 0.0
    for shape in (drawing.shape(at) for at in mine.tolist()):
        distances = [_shape_distance(shape, one) for one in rest]
        nearest = int(np.argmin(distances))
        off = max(off, distances[nearest])
        del rest[nearest]
    return off


def _shape_distance(one: Shape, two: Shape) -> float:
    """Return the largest distance between corresponding sides; infinite for other shapes."""
    if one.points.shape != two.points.shape or one.closed != two.closed:
        return float("inf")
    if (one.radius is None) != (two.radius is None):
        return float("inf")
    radius = abs((one.radius or 0.0) - (two.radius or 0.0))
    none = np.zeros(len(one.points))
    rings = [
        np.column_stack([shape.points, none if shape.bulges is None else shape.bulges])
        for shape in (one, two)
    ]
    return _side_distance(*rings) + radius
