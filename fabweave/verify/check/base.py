"""Check the board that feet are tied to: each foot is amid two of its holes."""

import numpy as np
import shapely

from fabweave.verify.check.drawings import compare_formats
from fabweave.verify.check.fastening import carrying
from fabweave.verify.drawing import HOLES, OUTLINES, Drawing
from fabweave.verify.read.job_files import BASE, Job, required
from fabweave.verify.report import Place, Tally

#: Feet are between their holes to this, millimetres, wherever the board is moved to.
_SAME_MM = 0.02


def check_base(job: Job, tally: Tally) -> None:
    """Check the drawings of the board against the crossings that are feet."""
    place = tally.at(f"{BASE}.dxf")
    place.equal("whether there is a board", job.base is not None, job.based)
    if job.base is None or not job.based:
        return
    dxf, svg = job.base.dxf.get(BASE), job.base.svg.get(BASE)
    if dxf is None or svg is None:
        return  # it could not be read, and that is told
    compare_formats(dxf, svg, tally.at(f"{BASE}.svg"))
    _check_holes(job, dxf, place)


def _check_holes(job: Job, drawing: Drawing, place: Place) -> None:
    """Check that holes, two by two, are about the feet, by their numbers, and on the board."""
    plan = required(job.map)
    aim = None if job.form is None else job.form.get("aim")
    wished = aim or [one.position for one in plan.crossings]
    feet = np.array([wished[at] for at in sorted(carrying(job))]).reshape(-1, 3)[:, :2]
    holes = drawing.of(HOLES, BASE)
    if not place.equal("how many holes there are", len(holes), 2 * len(feet)) or not len(feet):
        return
    at = np.array([hole.points[0] for hole in holes])
    off = at.reshape(-1, 2, 2).mean(axis=1) - feet
    # The board may lie anywhere, and is not turned.
    off = np.hypot(*(off - np.median(off, axis=0)).T)
    place.at_most("base_mm", float(off.max()), _SAME_MM, "a foot is {} off the middle of its holes")
    radii = {round(hole.radius or 0.0, 4) for hole in holes}
    place.expect(len(radii) == 1 and min(radii) > 0.0, "its holes are no circles of one size")
    boards = drawing.of(OUTLINES, BASE)
    if place.equal("how many outlines there are", len(boards), 1):
        board, points = shapely.Polygon(boards[0].traced), shapely.points(at)
        inside = board.contains(points) & (board.boundary.distance(points) > max(radii))
        place.expect(bool(inside.all()), "a hole is not on the board")
