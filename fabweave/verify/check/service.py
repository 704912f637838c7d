"""Check the files for a service: each holds its piece and no more, and quantities are right."""

import re
from collections import Counter
from itertools import chain
from pathlib import PurePosixPath

import msgspec
import numpy as np

from fabweave.verify.check.drawings import SAME_MM, check_piece_drawn
from fabweave.verify.crossing_map import CrossingMap, Piece, Placement
from fabweave.verify.drawing import Drawing, ring_points
from fabweave.verify.read.job_files import SERVICE, TABLE, Job, Service, required
from fabweave.verify.report import Place, Tally


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
        _check_row(row, pieces, job, place)
        drawings = (service.dxf.get(row["file"]), service.svg.get(row["file"]))
        for drawing, kind in zip(drawings, ("dxf", "svg"), strict=True):
            if drawing is None:
                place.fail(f"its {kind} is not checked, because it could not be read")
                continue
            _check_drawing(drawing, pieces[0], plan, place.at(kind))


def _check_quantities(plan: CrossingMap, service: Service, place: Place) -> None:
    """Check that every piece is asked for once, with others of its kind, in one row a kind."""
    named = chain.from_iterable(row["pieces"].split() for row in service.rows)
    place.same("pieces", named, plan.cut_piece)
    total = sum(int(row["quantity"]) for row in service.rows)
    place.equal("the sum of quantities", total, len(plan.to_cut))
    kinds = Counter((row["kind"], row["material"], row["thickness_mm"]) for row in service.rows)
    place.expect(max(kinds.values(), default=1) == 1, "a kind has more than one file")


def _check_row(row: dict[str, str], pieces: list[Piece], job: Job, place: Place) -> None:
    """Check what a row says of its pieces; that those of a kind are the same is another check."""
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
        place.equal(f"the kind of piece {piece.id}", kind, piece.kind)


def _check_drawing(drawing: Drawing, piece: Piece, plan: CrossingMap, place: Place) -> None:
    """Check that a drawing holds the cut-outs and, last, the outline of a piece; nothing else."""
    for problem in drawing.problems:
        place.fail(problem)
    count = len(drawing.sizes)
    if not place.expect(
        count and all(drawing.closed | ~np.isnan(drawing.radius)) and not any(drawing.piece),
        "it holds nothing, or shapes that are open or named",
    ):
        return
    points = ring_points(piece.path)
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    if drawing.width_mm is not None:
        declared = (drawing.width_mm, drawing.height_mm or 0.0)
        place.expect(
            np.allclose(declared, size, rtol=0, atol=SAME_MM),
            f"it says that it is {declared} mm, and its piece is {size.round(3)} mm",
        )
    # The file's frame is the piece's, shifted to the origin.
    moved = msgspec.structs.replace(
        piece, placement=Placement(0.0, *(-low).tolist()), mirror_mm=None
    )
    shapes = np.arange(count)
    check_piece_drawn(moved, plan.holes[piece.id], drawing, (shapes[-1:], shapes[:-1]), place)
