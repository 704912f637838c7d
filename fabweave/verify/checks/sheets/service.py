"""Check the files for a service: each holds its piece and no more, and quantities are right."""

import re
from collections import Counter
from itertools import chain
from pathlib import PurePosixPath

import numpy as np

from fabweave.verify.checks.plan.kinds import SAME_MM as KIND_MM
from fabweave.verify.checks.plan.kinds import apart
from fabweave.verify.checks.sheets.drawings import SAME_MM, ring_distance
from fabweave.verify.checks.sheets.looks import check_dxf_looks, check_svg_looks
from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Drawing, Floats
from fabweave.verify.measure.arcs import along, ring_area, ring_length
from fabweave.verify.read.job_files import Job
from fabweave.verify.read.service import FOLDER, LAYER, TABLE, Service
from fabweave.verify.report import Tally

#: Colour 7 is black on white and white on black; it has no exact colour.
_PLAIN = 7
_FIGURE_MM, _FIGURE_MM2 = 0.02, 0.5


def check_service(job: Job, tally: Tally) -> None:
    """Check the folder of a job for a service; of another job that there is none."""
    plan, service = job.map, job.service
    if plan is None:
        return
    wanted = plan.cut.profile == "service"
    if service is None or not wanted:
        tally.expect(
            service is None and not wanted,
            f"the profile is {plan.cut.profile!r}, and "
            + (f"{FOLDER}/{TABLE} could not be read" if wanted else f"there is a folder {FOLDER}"),
        )
        return
    named = {row["file"] for row in service.rows}
    twins = {str(PurePosixPath(name).with_suffix(".svg")) for name in named}
    for name in service.files:
        tally.expect(name in {*named, *twins, TABLE}, f"{FOLDER}/{name} is no piece's")
    _check_quantities(plan, service, tally)
    for row in service.rows:
        where = f"{FOLDER}/{row['file']}"
        members = [plan.piece.get(name) for name in row["pieces"].split()]
        pieces = [piece for piece in members if piece is not None]
        if not tally.expect(
            members and len(pieces) == len(members), f"{where} is for {row['pieces']!r}, no pieces"
        ):
            continue
        _check_row(where, row, pieces, plan, job, tally)
        drawings = (service.dxf.get(row["file"]), service.svg.get(row["file"]))
        for drawing, kind in zip(drawings, ("dxf", "svg"), strict=True):
            if drawing is None:
                tally.fail(f"{where}: its {kind} is not checked, because it could not be read")
                continue
            _check_looks(where, drawing, plan, tally)
            _check_drawing(f"{where} ({kind})", drawing, row, pieces[0], plan, tally)


def _check_quantities(plan: CrossingMap, service: Service, tally: Tally) -> None:
    """Check that every piece is asked for once, with others of its kind, in one row a kind."""
    asked = Counter(chain.from_iterable(row["pieces"].split() for row in service.rows))
    wrong = [name for name in {*asked, *plan.piece} if asked[name] != (name in plan.piece)]
    tally.expect(
        not wrong, f"{FOLDER}/{TABLE}: {', '.join(sorted(wrong)[:8])} are not asked for once each"
    )
    total = sum(int(row["quantity"]) for row in service.rows)
    tally.expect(
        total == len(plan.pieces),
        f"{FOLDER}/{TABLE}: quantities come to {total}, and there are {len(plan.pieces)} pieces",
    )
    kinds = Counter((row["kind"], row["material"], row["thickness_mm"]) for row in service.rows)
    tally.expect(
        max(kinds.values(), default=1) == 1, f"{FOLDER}/{TABLE}: a kind has more than one file"
    )


def _check_row(
    where: str, row: dict[str, str], pieces: list[Piece], plan: CrossingMap, job: Job, tally: Tally
) -> None:
    """Check what a row says of its pieces, and that they are all the same."""
    quantity, kind = int(row["quantity"]), int(row["kind"])
    tally.expect(
        quantity == len(pieces), f"{where}: {quantity} are asked for, for {len(pieces)} pieces"
    )
    numbers = re.fullmatch(r"kind_0*(\d+)_qty_0*(\d+)", PurePosixPath(row["file"]).stem)
    tally.expect(
        numbers and numbers.groups() == (str(kind), str(quantity)),
        f"{where} is for {quantity} pieces of kind {kind}",
    )
    folder = f"{row['material'].replace(':', '-')}_{float(row['thickness_mm']):g}mm"
    tally.expect(
        row["file"].startswith(f"{folder}/"), f"{where} is for pieces that belong in {folder}"
    )
    for piece in pieces:
        own = job.supplies[piece.thread]
        tally.expect(
            own.material in (None, row["material"])
            and own.thickness_mm in (None, float(row["thickness_mm"])),
            f"{where}: {row['thickness_mm']} mm of {row['material']} are not job.toml's for piece "
            f"{piece.id}",
        )
    for piece in pieces:
        tally.expect(piece.kind == kind, f"{where}: piece {piece.id} is of kind {piece.kind}")
        tally.measure(
            "kind_mm",
            min(apart(piece, pieces[0], plan, way) for way in (1, -1)),
            KIND_MM,
            f"{where}: piece {piece.id} does not cover {pieces[0].id}",
        )
    cuts = [pieces[0].path, *pieces[0].slots]
    holes = np.array([hole.diameter or 0.0 for hole in plan.holes[pieces[0].id]])
    areas = [abs(ring_area(ring[:, :2], ring[:, 2])) for ring in cuts]
    lengths = [ring_length(ring[:, :2], ring[:, 2]) for ring in cuts]
    figures = {
        "area_mm2": (2 * areas[0] - sum(areas) - float(np.sum(np.pi * holes**2 / 4)), _FIGURE_MM2),
        "cut_length_mm": (sum(lengths) + float(np.sum(np.pi * holes)), _FIGURE_MM),
        "holes": (len(holes) + len(pieces[0].slots), 0.0),
    }
    for key, (value, tolerance) in figures.items():
        tally.expect(
            abs(float(row[key]) - value) <= tolerance,
            f"{where}: {key} is {row[key]}, but comes to {value:.3f}",
        )


def _check_looks(where: str, drawing: Drawing, plan: CrossingMap, tally: Tally) -> None:
    """Check that a file has one plain layer, and colours that machines cut."""
    cut = plan.cut
    if drawing.version is None:
        check_svg_looks(where, drawing, cut, {"": cut.colours["CUT_OUTER"]}, tally)
        return
    tally.expect(
        set(drawing.layers) == {LAYER}, f"{where} has the layers {', '.join(drawing.layers)}"
    )
    check_dxf_looks(where, drawing, cut, {LAYER: (None, _PLAIN)}, tally)


def _check_drawing(
    where: str, drawing: Drawing, row: dict[str, str], piece: Piece, plan: CrossingMap, tally: Tally
) -> None:
    """Check that a drawing holds the holes and, last, the outline of a piece; nothing else."""
    for problem in drawing.problems:
        tally.fail(f"{where}: {problem}")
    count = len(drawing.sizes)
    holes = plan.holes[piece.id]
    if not tally.expect(
        count == 1 + len(holes) + len(piece.slots)
        and all(drawing.closed | ~np.isnan(drawing.radius))
        and not any(drawing.piece),
        f"{where} holds {count} shapes in place of {len(holes)} holes, {len(piece.slots)} slots "
        "and an outline; or they are open, or named",
    ):
        return
    corner, size = _extents(drawing)
    told = np.array([float(row["length_mm"]), float(row["width_mm"])])
    tally.expect(
        np.allclose(corner, 0.0, atol=SAME_MM) and np.allclose(size, told, rtol=0, atol=SAME_MM),
        f"{where} reaches from {corner.round(3)} over {size.round(3)} mm, not from the origin over "
        f"{told}",
    )
    if drawing.width_mm is not None:
        stated = (drawing.width_mm, drawing.height_mm or 0.0)
        tally.expect(
            np.allclose(stated, size, rtol=0, atol=SAME_MM), f"{where} says that it is {stated} mm"
        )
    # The file's frame is the piece's, shifted.
    shapes = [drawing.shape(at) for at in range(count)]
    shift = _low(piece.path) - corner
    rings = []
    for shape in shapes:
        bulges = np.zeros(len(shape.points)) if shape.bulges is None else shape.bulges
        rings.append(np.column_stack([shape.points + shift, bulges]))
    off = _off(rings[-1], piece.path) if shapes[-1].radius is None else np.inf
    tally.measure(
        "outline_mm",
        off,
        SAME_MM,
        f"{where}: its last shape is {off:.4f} mm off the outline of piece {piece.id}",
    )
    wanted = np.array([(hole.x, hole.y, hole.diameter or np.nan) for hole in holes]).reshape(-1, 3)
    drawn = [
        (*ring[0, :2], 2.0 * shape.radius)
        for ring, shape in zip(rings, shapes, strict=True)
        if shape.radius is not None
    ]
    _check_each(where, piece, "holes", wanted, np.array(drawn).reshape(-1, 3), tally)
    slots = [ring for ring, shape in zip(rings[:-1], shapes, strict=False) if shape.radius is None]
    for slot in piece.slots:
        nearest = min((_off(ring, slot) for ring in slots), default=np.inf)
        tally.measure(
            "slot_mm", nearest, SAME_MM, f"{where}: a slot of piece {piece.id} is out of place"
        )


def _off(ring: Floats, wanted: Floats) -> float:
    """Return how far a ring is from another; infinite if it has not as many corners."""
    return ring_distance(ring, wanted) if len(ring) == len(wanted) else float("inf")


def _check_each(
    where: str, piece: Piece, what: str, wanted: Floats, drawn: Floats, tally: Tally
) -> None:
    """Check that each wanted row of numbers is there, once."""
    if not tally.expect(
        len(drawn) == len(wanted), f"{where} has {len(drawn)} {what}, not {len(wanted)}"
    ):
        return
    far = np.abs(wanted[:, None] - drawn[None]).max(axis=2)
    off = float(far.min(axis=1).max(initial=0.0))
    once = len(set(far.argmin(axis=1).tolist())) == len(wanted)
    tally.measure(
        "hole_mm",
        off if once else np.inf,
        SAME_MM,
        f"{where}: {what} of piece {piece.id} are {off:.4f} mm out of place, or there twice",
    )


def _extents(drawing: Drawing) -> tuple[Floats, Floats]:
    """Return the lower left corner of what is drawn, and its size."""
    points, _ = drawing.traced(np.arange(len(drawing.sizes)))
    low = points.min(axis=0)
    return low, points.max(axis=0) - low


def _low(path: Floats) -> Floats:
    """Return the lower left corner of a ring of corners and bulges."""
    closed = np.concatenate([path, path[:1]])
    return along(closed[:, :2], np.append(path[:, 2], 0.0))[0].min(axis=0)
