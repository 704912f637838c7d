"""Check the files for a service: each holds its piece and no more, and quantities are right."""

import re
from collections import Counter
from itertools import chain
from pathlib import PurePosixPath

import numpy as np

from fabweave.verify.checks.plan.kinds import SAME_MM as KIND_MM
from fabweave.verify.checks.plan.kinds import off_by
from fabweave.verify.checks.sheets.drawings import SAME_MM, ring_distance
from fabweave.verify.checks.sheets.looks import check_dxf_looks, check_svg_looks
from fabweave.verify.crossing_map import CrossingMap, Hole, Piece
from fabweave.verify.drawing import Drawing, Floats
from fabweave.verify.measure.arcs import ring_area, ring_length, ring_points
from fabweave.verify.read.folders import PLAIN_LAYER, SERVICE, TABLE, Service
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally, cell_number

#: Colour 7 is black on white and white on black; it has no exact colour.
_PLAIN = 7
_FIGURE_MM, _FIGURE_MM2 = 0.02, 0.5


def check_service(job: Job, tally: Tally) -> None:
    """Check the folder of a job for a service; of another job that there is none."""
    plan, service = required(job.map), job.service
    wanted = plan.cut.profile == "service"
    folder = tally.at(SERVICE)
    if service is None or not wanted:
        folder.expect(
            service is None and not wanted,
            f"the profile is {plan.cut.profile!r}, and "
            + (f"{TABLE} could not be read" if wanted else "there is such a folder"),
        )
        return
    named = {row["file"] for row in service.rows}
    twins = {str(PurePosixPath(name).with_suffix(".svg")) for name in named}
    for name in service.files:
        folder.at(name).expect(name in {*named, *twins, TABLE}, "it is no piece's")
    _check_quantities(plan, service, folder.at(TABLE))
    for row in service.rows:
        place = folder.at(row["file"])
        members = [plan.cut_piece.get(name) for name in row["pieces"].split()]
        pieces = [piece for piece in members if piece is not None]
        if not place.expect(
            members and len(pieces) == len(members), f"it is for {row['pieces']!r}, no pieces"
        ):
            continue
        _check_row(row, pieces, plan, job, place)
        drawings = (service.dxf.get(row["file"]), service.svg.get(row["file"]))
        for drawing, kind in zip(drawings, ("dxf", "svg"), strict=True):
            if drawing is None:
                place.fail(f"its {kind} is not checked, because it could not be read")
                continue
            _check_looks(drawing, plan, place.at(kind))
            _check_drawing(drawing, row, pieces[0], plan.holes[pieces[0].id], place.at(kind))


def _check_quantities(plan: CrossingMap, service: Service, place: Place) -> None:
    """Check that every piece is asked for once, with others of its kind, in one row a kind."""
    named = chain.from_iterable(row["pieces"].split() for row in service.rows)
    place.same("pieces", named, plan.cut_piece)
    total = sum(int(row["quantity"]) for row in service.rows)
    place.equal("the sum of quantities", total, len(plan.to_cut))
    kinds = Counter((row["kind"], row["material"], row["thickness_mm"]) for row in service.rows)
    place.expect(max(kinds.values(), default=1) == 1, "a kind has more than one file")


def _check_row(
    row: dict[str, str], pieces: list[Piece], plan: CrossingMap, job: Job, place: Place
) -> None:
    """Check what a row says of its pieces, and that they are all the same."""
    quantity, kind = int(row["quantity"]), int(row["kind"])
    place.equal("quantity", quantity, len(pieces))
    numbers = re.fullmatch(r"kind_0*(\d+)_qty_0*(\d+)", PurePosixPath(row["file"]).stem)
    place.expect(
        numbers and numbers.groups() == (str(kind), str(quantity)),
        f"it is for {quantity} pieces of kind {kind}",
    )
    folder = f"{row['material'].replace(':', '-')}_{float(row['thickness_mm']):g}mm"
    place.equal("its folder", str(PurePosixPath(row["file"]).parent), folder)
    for piece in pieces:
        supply = job.supplies[piece.thread]
        place.expect(
            supply.material in (None, row["material"])
            and supply.thickness_mm in (None, float(row["thickness_mm"])),
            f"{row['thickness_mm']} mm of {row['material']} are not job.toml's for piece "
            f"{piece.id}",
        )
    for piece in pieces:
        place.equal(f"the kind of piece {piece.id}", kind, piece.kind)
        place.at_most(
            "kind_mm",
            off_by(piece, pieces[0], plan),
            KIND_MM,
            f"piece {piece.id} does not cover {pieces[0].id}, they differ by {{}}",
        )
    for key, value, within in zip(
        ("area_mm2", "cut_length_mm", "holes"),
        _figures(pieces[0], plan),
        (_FIGURE_MM2, _FIGURE_MM, 0.0),
        strict=True,
    ):
        place.number(key, cell_number(row[key]), value, within=within)


def _figures(piece: Piece, plan: CrossingMap) -> tuple[float, float, int]:
    """Return what is left of the material, the length of all cuts, and how many cut-outs."""
    diameters = np.array([hole.diameter or 0.0 for hole in plan.holes[piece.id]])
    slots = piece.slots
    return (
        ring_area(piece.path)
        - float(np.sum(np.pi * diameters**2 / 4.0))
        - sum(abs(ring_area(slot)) for slot in slots),
        sum(map(ring_length, (piece.path, *slots))) + float(np.sum(np.pi * diameters)),
        len(diameters) + len(slots),
    )


def _check_looks(drawing: Drawing, plan: CrossingMap, place: Place) -> None:
    """Check that a file has one plain layer, and colours that machines cut."""
    cut = plan.cut
    if drawing.version is None:
        check_svg_looks(drawing, cut, {"": cut.colours["CUT_OUTER"]}, place)
        return
    place.equal("its layers", set(drawing.layers), {PLAIN_LAYER})
    check_dxf_looks(drawing, cut, {PLAIN_LAYER: (None, _PLAIN)}, place)


def _check_drawing(
    drawing: Drawing, row: dict[str, str], piece: Piece, holes: list[Hole], place: Place
) -> None:
    """Check that a drawing holds the holes and, last, the outline of a piece; nothing else."""
    for problem in drawing.problems:
        place.fail(problem)
    count = len(drawing.sizes)
    if not place.expect(
        count == 1 + len(holes) + len(piece.slots)
        and all(drawing.closed | ~np.isnan(drawing.radius))
        and not any(drawing.piece),
        f"it holds {count} shapes in place of {len(holes)} holes, {len(piece.slots)} slots and an "
        "outline; or they are open, or named",
    ):
        return
    corner, size = _extents(drawing)
    stated = np.array([float(row["length_mm"]), float(row["width_mm"])])
    place.expect(
        np.allclose(corner, 0.0, atol=SAME_MM) and np.allclose(size, stated, rtol=0, atol=SAME_MM),
        f"it reaches from {corner.round(3)} over {size.round(3)} mm, not from the origin over "
        f"{stated}",
    )
    if drawing.width_mm is not None:
        declared = (drawing.width_mm, drawing.height_mm or 0.0)
        place.expect(
            np.allclose(declared, size, rtol=0, atol=SAME_MM), f"it says that it is {declared} mm"
        )
    # The file's frame is the piece's, shifted.
    shift = np.append(ring_points(piece.path).min(axis=0) - corner, 0.0)
    shapes = drawing.shapes
    rings = [shape.ring + shift for shape in shapes]
    place.at_most(
        "outline_mm",
        ring_distance(rings[-1], piece.path) if shapes[-1].radius is None else np.inf,
        SAME_MM,
        f"its last shape is {{}} off the outline of piece {piece.id}",
    )
    wanted = np.array([(hole.x, hole.y, hole.diameter or np.nan) for hole in holes]).reshape(-1, 3)
    drawn = [
        (*ring[0, :2], 2.0 * shape.radius)
        for ring, shape in zip(rings, shapes, strict=True)
        if shape.radius is not None
    ]
    _check_holes(wanted, np.array(drawn).reshape(-1, 3), place)
    slots = [ring for ring, shape in zip(rings[:-1], shapes, strict=False) if shape.radius is None]
    for slot in piece.slots:
        nearest = min((ring_distance(ring, slot) for ring in slots), default=np.inf)
        place.at_most("slot_mm", nearest, SAME_MM, f"a slot of piece {piece.id} is {{}} off")


def _check_holes(wanted: Floats, drawn: Floats, place: Place) -> None:
    """Check that each wanted hole, a row of place and diameter, is there, once."""
    if not place.equal("the number of holes", len(drawn), len(wanted)) or not len(wanted):
        return
    far = np.abs(wanted[:, None] - drawn[None]).max(axis=2)
    off = float(far.min(axis=1).max(initial=0.0))
    once = len(set(far.argmin(axis=1).tolist())) == len(wanted)
    place.at_most(
        "hole_mm",
        off if once else np.inf,
        SAME_MM,
        "holes are {} out of place, infinitely if one is there twice",
    )


def _extents(drawing: Drawing) -> tuple[Floats, Floats]:
    """Return the lower left corner of what is drawn, and its size."""
    points, _ = drawing.traced(np.arange(len(drawing.sizes)))
    low = points.min(axis=0)
    return low, points.max(axis=0) - low
