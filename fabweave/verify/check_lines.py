"""Check that no line of a sheet is too short for a machine, and none is there twice."""

import numpy as np

from fabweave.verify.drawing import Drawing
from fabweave.verify.loading import Job
from fabweave.verify.report import Tally

#: Coordinates are rounded to a ten-thousandth, which may shorten a tenth by as much.
LEAST_MM = 0.1 - 3e-4
#: Ends that agree to this are the same.
_GRID_MM = 1e-3


def check_lines(job: Job, tally: Tally) -> None:
    """Check the segments of every sheet as its DXF has them; the SVG draws the same."""
    plan = job.map
    if plan is None:
        return
    for sheet in plan.sheets:
        # What could not be read is told where its outlines are checked.
        if (drawing := job.dxf.get(sheet.number)) is not None:
            _check_segments(f"{sheet.name}.dxf", drawing, tally)


def _check_segments(where: str, drawing: Drawing, tally: Tally) -> None:
    """Check the length of every segment, and that no two have the same ends and bend."""
    owner = np.repeat(np.arange(len(drawing.sizes)), drawing.sizes)
    following = np.arange(1, len(owner) + 1)
    following[drawing.start[1:] - 1] = drawing.start[:-1]
    last = np.zeros(len(owner), dtype=bool)
    last[drawing.start[1:] - 1] = True
    drawn = np.flatnonzero((~last | drawing.closed[owner]) & np.isnan(drawing.radius[owner]))
    one, two = drawing.points[drawn], drawing.points[following[drawn]]
    length = np.hypot(*(two - one).T)
    if len(length):
        at = int(np.argmin(length))
        name = drawing.shape(int(owner[drawn[at]])).where
        tally.measure(
            "segment_mm",
            float(length[at]),
            LEAST_MM,
            f"{where}: a side of {name} is {length[at]:.4f} mm long",
            least=True,
        )
    # From either end; from the other one, left is right.
    back = (one[:, 0] > two[:, 0]) | ((one[:, 0] == two[:, 0]) & (one[:, 1] > two[:, 1]))
    low, high = (np.where(back[:, None], b, a) for a, b in ((one, two), (two, one)))
    height = np.where(back, -1.0, 1.0) * drawing.bulges[drawn] * length / 2.0
    keys = np.rint(np.column_stack([low, high, height]) / _GRID_MM).astype(np.int64)
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    tally.count(len(keys))
    for place in first[counts > 1].tolist():
        name = drawing.shape(int(owner[drawn[place]])).where
        tally.fail(f"{where}: a side of {name} is drawn more than once")
