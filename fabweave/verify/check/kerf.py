"""Check the sheets that are to be cut: their outlines stand half a kerf off the pieces."""

import numpy as np
import shapely

from fabweave.verify.check.drawings import SAME_MM, compare_formats, lines_of, shapes_apart
from fabweave.verify.drawing import (
    ENGRAVE_LAYERS,
    HOLES,
    NOTES,
    OUTLINES,
    Drawing,
    Floats,
    Shape,
    ring_points,
)
from fabweave.verify.read.job_files import READY, Job, Ready, required
from fabweave.verify.report import Place, Tally

#: Leaving out a side of a tenth of a millimetre in a hollow moves an outline by less than this.
_OFF_MM = 0.04
#: A sharp corner goes no farther than so many times half the kerf.
_MITRE = 12.5


def check_ready(job: Job, tally: Tally) -> None:
    """Check every sheet that is to be cut against its nominal sheet and the job's settings."""
    plan, ready = required(job.map), job.ready
    if ready is None:
        return
    for sheet in plan.sheets:
        rings = {piece.id: piece.placed_ring(piece.path) for piece in plan.on_sheet(sheet.number)}
        _check_sheet(ready, sheet.name, job.sheets.dxf.get(sheet.name), rings, tally)
    altered = bool(ready.kerf_mm) or ready.micro is not None
    for beside in (job.rim, job.former) if altered else ():
        for name, nominal in (beside.dxf if beside is not None else {}).items():
            outlines = [shape for shape in nominal.shapes if shape.layer == OUTLINES]
            rings = {str(shape.piece): shape.ring for shape in outlines}
            _check_sheet(ready, name, nominal, rings, tally)


def _check_sheet(
    ready: Ready,
    sheet: str,
    nominal: Drawing | None,
    rings: dict[str, Floats],
    tally: Tally,
) -> None:
    """Check a sheet: the nominal one, and the DXF and the SVG that are to be cut."""
    name = f"{READY}/{ready.stem_of(sheet)}"
    dxf, svg = ready.dxf.get(sheet), ready.svg.get(sheet)
    if nominal is None or dxf is None or svg is None:
        tally.fail(f"{name} is not checked, because it or its sheet could not be read")
        return
    of_dxf, of_svg = tally.at(f"{name}.dxf"), tally.at(f"{name}.svg")
    for drawing, place in ((dxf, of_dxf), (svg, of_svg)):
        for problem in drawing.problems:
            place.fail(problem)
    compare_formats(svg, dxf, of_svg)
    shared = sheet in ready.shared
    _check_same(dxf, nominal, of_dxf, shared=shared)
    if shared:
        _check_common(rings, dxf, ready.kerf_mm / 2.0, of_dxf)
    for piece, ring in rings.items():
        place, runs = of_dxf.at(f"piece {piece}"), dxf.of(OUTLINES, piece)
        if not shared and _check_runs(runs, ready, place):
            _check_offset(_joined(runs), ring, ready.kerf_mm / 2.0, place.at("outline"))
        _check_cutouts(dxf.of(HOLES, piece), nominal.of(HOLES, piece), ready, place)


def _check_common(rings: dict[str, Floats], drawing: Drawing, half_mm: float, place: Place) -> None:
    """Check that lines cut all outlines, half a kerf off, and nothing else.

    That no line is cut twice is another check: so what two pieces share is cut once.
    """
    outlines = [
        shapely.Polygon(ring_points(ring)).buffer(half_mm, join_style="mitre").exterior
        for ring in rings.values()
    ]
    runs = [shape for shape in drawing.shapes if shape.layer == OUTLINES]
    place.expect(
        not any(shape.radius is not None or shape.bulges.any() for shape in runs),
        "what is cut of straight strips is not straight",
    )
    lines = shapely.union_all(lines_of(runs))
    wanted = shapely.union_all(np.array(outlines, dtype=object))
    for name, outline in zip(rings, outlines, strict=True):
        missing = shapely.difference(outline, lines.buffer(_OFF_MM)).length
        place.at(f"piece {name}").at_most("uncut_mm", missing, _OFF_MM, "{} of it are not cut")
    extra = shapely.difference(lines, wanted.buffer(_OFF_MM)).length
    place.at_most("extra_mm", extra, _OFF_MM, "{} are cut that are no outline")


def _check_same(drawing: Drawing, nominal: Drawing, place: Place, *, shared: bool) -> None:
    """Require everything but cuts to be as on the nominal sheet, and cuts of the same pieces.

    Where cuts are ``shared``, those of others may be all that cuts a piece.
    """
    layers = [
        {key for key in one.groups if not (shared and key[0] == OUTLINES)}
        for one in (drawing, nominal)
    ]
    place.same("layers of pieces, as on the nominal sheet,", *layers)
    for key in drawing.groups.keys() & nominal.groups.keys():
        if key[0] in (*ENGRAVE_LAYERS, NOTES):
            place.at_most(
                "engraving_mm",
                shapes_apart(drawing.of(*key), nominal.of(*key)),
                SAME_MM,
                f"{key[0]} of {key[1]} is {{}} from where it was",
            )


def _check_cutouts(cut: list[Shape], whole: list[Shape], ready: Ready, place: Place) -> None:
    """Check the cut-outs of a piece against those on the nominal sheet."""
    half = ready.kerf_mm / 2.0
    if not place.equal("the number of cut-outs", len(cut), len(whole)):
        return
    for hole, wanted in zip(cut, whole, strict=True):
        if hole.radius is not None and wanted.radius is not None:
            off = float(np.hypot(*(hole.points[0] - wanted.points[0])))
            off += abs(wanted.radius - half - hole.radius)
            place.at_most("hole_mm", off, SAME_MM, "a hole is {} off")
        elif place.expect(hole.closed and wanted.radius is None, "a cut-out is open"):
            _check_offset(_joined([hole]), wanted.ring, -half, place.at("slot"))


def _check_runs(runs: list[Shape], ready: Ready, place: Place) -> bool:
    """Check that an outline is one closed run, or runs with bridges of the right width between."""
    if len(runs) == 1 and runs[0].closed:
        return place.expect(runs[0].radius is None, "it is cut out round")
    most, width = ready.micro or (0, 0.0)
    right = place.expect(
        0 < len(runs) <= most and not any(run.closed or run.radius is not None for run in runs),
        f"it has an outline of {len(runs)} runs; at most {most} were asked for",
    )
    for run, following in zip(runs, [*runs[1:], *runs[:1]], strict=True):
        gap = float(np.hypot(*(following.points[0] - run.points[-1]))) - ready.kerf_mm
        place.at_most(
            "bridge_mm",
            abs(gap - width),
            _OFF_MM,
            f"it has a bridge of {gap:.3f} mm instead of {width:g} mm: {{}} off",
        )
    return right


def _joined(runs: list[Shape]) -> Floats:
    """Return points along runs, one after another; what is between them is straight."""
    return np.concatenate([run.traced for run in runs])


def _check_offset(drawn: Floats, ring: Floats, outward_mm: float, place: Place) -> None:
    """Check that a run is at a distance from a ring of corners and bulges, all round."""
    nominal, shape = shapely.Polygon(ring_points(ring)), shapely.Polygon(drawn)
    if not place.expect(shape.is_valid and nominal.is_valid, "it crosses itself"):
        return
    near, far = outward_mm - _OFF_MM, outward_mm + _OFF_MM
    if outward_mm < 0.0:
        less, more = nominal.buffer(near, join_style="mitre"), nominal.buffer(far)
    else:
        less, more = (
            nominal.buffer(near),
            nominal.buffer(far, join_style="mitre", mitre_limit=_MITRE),
        )
    place.expect(shape.covers(less), "it is cut too near to the piece")
    place.expect(more.covers(shape), "it is cut too far from the piece")
