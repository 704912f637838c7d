"""Check the sheets that are to be cut: their outlines stand half a kerf off the pieces."""

import numpy as np
import shapely

from fabweave.verify.checks.sheets.drawings import SAME_MM, compare_formats, shapes_apart
from fabweave.verify.checks.sheets.looks import check_dxf_looks, check_svg_looks
from fabweave.verify.crossing_map import Piece
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    NOTES,
    OUTLINES,
    Drawing,
    Floats,
    Shape,
    traced,
)
from fabweave.verify.measure.arcs import along
from fabweave.verify.read.job_files import Job
from fabweave.verify.read.kerfed_sheets import FOLDER, Ready
from fabweave.verify.report import Tally

#: Leaving out a side of a tenth of a millimetre in a hollow moves an outline by less than this.
_OFF_MM = 0.04
#: A sharp corner goes no farther than so many times half the kerf.
_MITRE = 12.5


def check_ready(job: Job, tally: Tally) -> None:
    """Check every sheet that is to be cut against its nominal sheet and the job's settings."""
    plan, ready = job.map, job.ready
    if plan is None or ready is None:
        return
    for sheet in plan.sheets:
        name = f"{FOLDER}/{ready.name_of(sheet)}"
        nominal, dxf, svg = (
            drawings.get(sheet.number) for drawings in (job.dxf, ready.dxf, ready.svg)
        )
        if nominal is None or dxf is None or svg is None:
            tally.fail(f"{name} is not checked, because it or its sheet could not be read")
            continue
        for drawing, suffix in ((dxf, "dxf"), (svg, "svg")):
            for problem in drawing.problems:
                tally.fail(f"{name}.{suffix}: {problem}")
        check_dxf_looks(f"{name}.dxf", dxf, plan.cut, plan.cut.colours, tally)
        check_svg_looks(f"{name}.svg", svg, plan.cut, plan.cut.colours, tally)
        compare_formats(f"{name}.svg", svg, dxf, tally)
        pieces = [piece for piece in plan.pieces if piece.sheet == sheet.number]
        _check_same(f"{name}.dxf", dxf, nominal, tally)
        for piece in pieces:
            _check_piece(f"{name}.dxf", piece, dxf, nominal, ready, tally)


def _check_same(where: str, drawing: Drawing, nominal: Drawing, tally: Tally) -> None:
    """Require everything but cuts to be as on the nominal sheet, and cuts of the same pieces."""
    mine, theirs = drawing.groups, nominal.groups
    tally.expect(
        mine.keys() == theirs.keys(), f"{where} has other pieces or layers than its nominal sheet"
    )
    for key in mine.keys() & theirs.keys():
        if key[0] in (*ENGRAVE_LAYERS, NOTES):
            off = shapes_apart(drawing, mine[key], nominal, theirs[key])
            tally.measure(
                "engraving_mm", off, SAME_MM, f"{where}: {key[0]} of {key[1]} is not as it was"
            )


def _check_piece(
    where: str, piece: Piece, drawing: Drawing, nominal: Drawing, ready: Ready, tally: Tally
) -> None:
    """Check the outline and the cut-outs of a piece."""
    none = np.zeros(0, dtype=np.int64)
    half = ready.kerf_mm / 2.0
    where = f"{where}: piece {piece.id}"
    runs = [drawing.shape(at) for at in drawing.groups.get((OUTLINES, piece.id), none).tolist()]
    if _check_runs(where, runs, ready, tally):
        _check_offset(
            f"{where}, outline", _joined(runs), piece.placed_ring(piece.path), half, tally
        )
    cut, whole = (
        [one.shape(at) for at in one.groups.get((HOLES, piece.id), none).tolist()]
        for one in (drawing, nominal)
    )
    if not tally.expect(
        len(cut) == len(whole), f"{where} has {len(cut)} cut-outs, not {len(whole)}"
    ):
        return
    for one, other in zip(cut, whole, strict=True):
        if one.radius is not None and other.radius is not None:
            off = float(np.hypot(*(one.points[0] - other.points[0])))
            off += abs(other.radius - half - one.radius)
            tally.measure("hole_mm", off, SAME_MM, f"{where}: a hole is {off:.4f} mm off")
        elif tally.expect(one.closed and other.radius is None, f"{where}: a cut-out is open"):
            bulges = np.zeros(len(other.points)) if other.bulges is None else other.bulges
            ring = np.column_stack([other.points, bulges])
            _check_offset(f"{where}, slot", _joined([one]), ring, -half, tally)


def _check_runs(where: str, runs: list[Shape], ready: Ready, tally: Tally) -> bool:
    """Check that an outline is one closed run, or runs with bridges of the right width between."""
    if len(runs) == 1 and runs[0].closed:
        return tally.expect(runs[0].radius is None, f"{where} is cut out round")
    most, width = ready.micro or (0, 0.0)
    right = tally.expect(
        0 < len(runs) <= most and not any(run.closed or run.radius is not None for run in runs),
        f"{where} has an outline of {len(runs)} runs; at most {most} were asked for",
    )
    for run, following in zip(runs, [*runs[1:], *runs[:1]], strict=True):
        gap = float(np.hypot(*(following.points[0] - run.points[-1])))
        off = abs(gap - ready.kerf_mm - width)
        tally.measure(
            "bridge_mm", off, _OFF_MM, f"{where} has a bridge of {gap - ready.kerf_mm:.3f} mm"
        )
    return right


def _joined(runs: list[Shape]) -> Floats:
    """Return points along runs, one after another; what is between them is straight."""
    return np.concatenate([traced(run) for run in runs])


def _check_offset(where: str, drawn: Floats, ring: Floats, outward_mm: float, tally: Tally) -> None:
    """Check that a run is at a distance from a ring of corners and bulges, all round."""
    closed = np.concatenate([ring, ring[:1]])
    nominal = shapely.Polygon(along(closed[:, :2], closed[:, 2])[0])
    shape = shapely.Polygon(drawn)
    if not tally.expect(shape.is_valid and nominal.is_valid, f"{where} crosses itself"):
        return
    near, far = outward_mm - _OFF_MM, outward_mm + _OFF_MM
    if outward_mm < 0.0:
        less, more = nominal.buffer(near, join_style="mitre"), nominal.buffer(far)
    else:
        less, more = (
            nominal.buffer(near),
            nominal.buffer(far, join_style="mitre", mitre_limit=_MITRE),
        )
    tally.expect(shape.covers(less), f"{where} is cut too near to the piece")
    tally.expect(more.covers(shape), f"{where} is cut too far from the piece")
