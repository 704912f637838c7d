"""Check the rings around openings: they lie on the fasteners beside the rim, all the way round."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from fabweave.verify.check.drawings import compare_formats
from fabweave.verify.check.fastening import ring_edges
from fabweave.verify.check.sheets import check_gaps, check_room
from fabweave.verify.drawing import HOLES, OUTLINES, Drawing, Floats, traced
from fabweave.verify.measure.geometry import farthest, fit_motion
from fabweave.verify.read.job_files import RIM, RIM_RECORD, Job, required
from fabweave.verify.report import Place, Tally

#: Holes lie where they must to this, figures are rounded to a thousandth, and chords of arcs are
#: off by less than this.
_SAME_MM, _FIGURE, _CHORD_MM = 0.02, 2e-3, 0.05
#: A hole keeps two diameters off the edge, less what rounding takes.
_EDGE, _TINY = 2.0, 1e-3
#: Further off a ring cannot be fastened.
_MOST_OFF_MM = 3.0


@dataclass(frozen=True, eq=False)
class _Cone:
    """The cone nearest to some crossings, and what of it a ring is."""

    crossings: list[int]
    flat: Floats
    #: Its rise, by how much the way down it is longer than in plan, how far crossings are off it,
    #: and how far out the ring is pushed by lying above them.
    slope: float
    stretch: float
    off: float
    lift: float

    def laid(self, names: Sequence[int]) -> Floats:
        """Return where the feet of crossings lie as they follow one another around, unrolled."""
        at = [self.crossings.index(name) for name in names]
        way, turn = self.flat[at].T
        return np.column_stack((way, np.unwrap(turn, period=2.0 * np.pi / self.stretch)))


def check_rim(job: Job, tally: Tally) -> None:
    """Check every ring against the crossings that hold it, and against its drawings."""
    plan = required(job.map)
    asked = job.options.get("rim", "none") == "ring"
    place = tally.at(RIM_RECORD)
    if job.rim is None or not asked:
        tally.at(RIM).expect(
            job.rim is None and not asked,
            "rings are asked for, and there is no such folder" if asked else "nobody asked for it",
        )
        return
    openings = [one for one in job.openings if "diameter_mm" in one]
    sides = [ring.get("side") for ring in job.rings]
    if not place.equal("openings with a ring", sides, [one.get("side") for one in openings]):
        return
    for ring, opening in zip(job.rings, openings, strict=True):
        _check_ring(job, ring, opening, place.at(str(ring["side"])))
    for name, drawing in job.rim.dxf.items():
        place = tally.at(RIM, name)
        size = np.max([[sheet.width_mm, sheet.height_mm] for sheet in plan.sheets], axis=0)
        spacing = plan.layout.margin_mm, plan.layout.gap_mm
        check_side_sheet(drawing, job.rim.svg.get(name), size, spacing, place)


def _check_ring(job: Job, ring: dict[str, Any], opening: dict[str, Any], place: Place) -> None:
    """Check one ring: its figures, where its pieces begin and end, their holes and outlines."""
    plan = required(job.map)
    edges = ring_edges(required(job.mesh), opening)
    held = {one.id for one in plan.crossings if one.fastened and tuple(sorted(one.edge)) in edges}
    runs = [[int(hole["crossing"]) for hole in piece["holes"]] for piece in ring["pieces"]]
    place.same("its crossings", {name for run in runs for name in run}, held)
    if not held or {name for run in runs for name in run} != held:
        return
    round_about = all(
        run[-1] == after[0] for run, after in zip(runs, [*runs[1:], runs[0]], strict=True)
    )
    counted = sum(len(run) - 1 for run in runs)
    place.expect(
        round_about and counted == len(held) and len(runs) > 1,
        "its pieces do not follow one another around the opening, each from the last hole of the "
        "one before",
    )
    thick = [supply.thickness_mm or 0.0 for supply in job.supplies.values()]
    place.expect(
        any(abs(ring["thickness_mm"] - one) < _TINY for one in thick), "it is of no material here"
    )
    cone = _cone(job, sorted(held), opening, float(ring["thickness_mm"]))
    steep = float(np.degrees(np.arctan(abs(cone.slope))))
    place.number("slope_deg", ring["slope_deg"], steep, within=_FIGURE)
    place.number("off_mm", ring["off_mm"], cone.off, within=_FIGURE)
    place.at_most("off_mm", cone.off, _MOST_OFF_MM, "strands are {} from where it passes")
    for piece, run in zip(ring["pieces"], runs, strict=True):
        _check_piece(job, ring, piece, (cone, run), place.at(f"piece {piece['id']}"))


def _cone(job: Job, names: list[int], opening: dict[str, Any], thick: float) -> _Cone:
    """Return the cone about an opening's axis that is nearest to some crossings.

    Least squares of height over distance; the ring lies above both strands.
    """
    plan = required(job.map)
    points = np.array([plan.crossing[name].position for name in names])
    away = np.hypot(points[:, 0] - opening["x_mm"], points[:, 1] - opening["y_mm"])
    turn = np.arctan2(points[:, 1] - opening["y_mm"], points[:, 0] - opening["x_mm"])
    middle, rise = away.mean(), points[:, 2].mean()
    spread = float(((away - middle) ** 2).sum())
    slope = 0.0
    if np.ptp(away) > 1e-6:
        slope = float(((away - middle) * (points[:, 2] - rise)).sum()) / spread
    stretch = float(np.hypot(1.0, slope))
    off = (points[:, 2] - rise - slope * (away - middle)) / stretch
    up = -1.0 if opening["side"] == "bottom" else 1.0
    lift = -up * (1.5 * thick + (job.clearance_mm or 0.0) / 2.0) * slope / stretch
    way = (away + off * slope / stretch + lift) * stretch
    flat = np.column_stack((way, turn / stretch))
    return _Cone(names, flat, slope, stretch, float(np.abs(off).max()), lift)


def _check_piece(
    job: Job, ring: dict[str, Any], piece: dict[str, Any], laid: tuple[_Cone, list[int]],
    place: Place,
) -> None:  # fmt: skip
    """Check that a piece's holes come to lie on its crossings, and that its drawing has them."""
    cone, run = laid
    way, turn = cone.laid(run).T
    wanted = np.column_stack((way * np.cos(turn), way * np.sin(turn)))
    holes = np.array([(hole["x"], hole["y"], hole["hole_mm"]) for hole in piece["holes"]])
    motion = fit_motion(wanted, holes[:, :2])
    place.at_most(
        "ring_mm",
        farthest(motion.apply(wanted), holes[:, :2]),
        _SAME_MM,
        "a hole is {} from where its crossing comes to lie",
    )
    drawing = required(job.rim).dxf.get(str(piece["sheet"]))
    if drawing is None:
        place.fail(f"{piece['sheet']}.dxf could not be read")
        return
    circles = drawing.of(HOLES, str(piece["id"]))
    drawn = np.array([(*one.points.mean(axis=0), 2.0 * (one.radius or 0.0)) for one in circles])
    matched = len(drawn) == len(holes) and bool(
        np.abs(drawn[np.lexsort(drawn.T)] - holes[np.lexsort(holes.T)]).max() < _SAME_MM
    )
    place.expect(matched, "the drawing has other holes than the record")
    lines = drawing.of(OUTLINES, str(piece["id"]))
    if not place.expect(len(lines) == 1 and lines[0].closed, "it has not one closed outline"):
        return
    outline = traced(lines[0])
    border = shapely.LinearRing(outline)
    near = shapely.distance(shapely.points(holes[:, :2]), border) / holes[:, 2]
    place.at_least("edge", float(near.min()), _EDGE - _CHORD_MM, "a hole is {} diameters off")
    # The outline seen from the tip of the cone: a band between two circles.
    back = fit_motion(holes[:, :2], wanted)
    radii = np.hypot(*back.apply(outline).T)
    inner, outer = float(radii.min()), float(radii.max())
    place.number("width_mm", ring["width_mm"], outer - inner, within=_CHORD_MM)
    opening = 2.0 * (inner / cone.stretch - cone.lift)
    place.number("opening_mm", ring["opening_mm"], opening, within=2.0 * _CHORD_MM)
    aside = np.minimum(np.abs(radii - inner), np.abs(radii - outer))
    ends = np.abs(np.diff(radii, append=radii[:1])) > _CHORD_MM
    place.expect(int(np.count_nonzero((aside > _CHORD_MM) & ~ends)) == 0, "its outline is no band")


def check_side_sheet(
    drawing: Drawing,
    other: Drawing | None,
    size: Floats,
    spacing: tuple[float, float],
    place: Place,
) -> None:
    """Check that parts on a sheet keep its margin, and the gap apart; and that its SVG is alike."""
    for problem in drawing.problems:
        place.fail(problem)
    shapes = [one for one in drawing.shapes if one.layer == OUTLINES]
    polygons = np.array([shapely.Polygon(traced(one)) for one in shapes])
    names = [str(one.piece) for one in shapes]
    outline = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * size
    margin_mm, gap_mm = spacing
    check_room(names, polygons, outline, margin_mm - _SAME_MM, place)
    check_gaps(names, polygons, gap_mm - _SAME_MM, place)
    if place.expect(other is not None, "there is no SVG beside the DXF"):
        for problem in (other or drawing).problems:
            place.at("svg").fail(problem)
        compare_formats(other or drawing, drawing, place.at("svg"))
