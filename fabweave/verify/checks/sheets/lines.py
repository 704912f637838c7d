"""Check that no line of a sheet is too short for a machine, and none lies on another."""

import numpy as np
import shapely

from fabweave.verify.drawing import NOTES, Drawing, Floats, Ints
from fabweave.verify.read.folders import READY
from fabweave.verify.read.job_files import Job, required, sheet_drawings
from fabweave.verify.statement import Place, Tally

#: Coordinates are rounded to a ten-thousandth, which may shorten a tenth by as much.
LEAST_MM = 0.1 - 3e-4
#: Ends that agree to this are the same.
_GRID_MM = 1e-3
#: Of lines that lie on one another, so much is in common; less is a rounding of their ends.
_COMMON_MM = 0.05


def check_lines(job: Job, tally: Tally) -> None:
    """Check the segments of every sheet as its DXF has them; the SVG draws the same.

    Of sheets that are written once more to be cut, those are checked, too.
    """
    for _, drawing, place in sheet_drawings(job, "dxf", tally):
        _check_segments(drawing, place)
    for sheet in required(job.map).sheets:
        if job.ready is not None and (ready := job.ready.dxf.get(sheet.name)) is not None:
            _check_segments(ready, tally.at(f"{READY}/{job.ready.name_of(sheet.name)}.dxf"))


def _check_segments(drawing: Drawing, place: Place) -> None:
    """Check that every segment is long enough, and that none lies on another, all or in part."""
    owner = np.repeat(np.arange(len(drawing.sizes)), drawing.sizes)
    following = np.arange(1, len(owner) + 1)
    following[drawing.start[1:] - 1] = drawing.start[:-1]
    last = np.zeros(len(owner), dtype=bool)
    last[drawing.start[1:] - 1] = True
    drawn = np.flatnonzero((~last | drawing.closed[owner]) & np.isnan(drawing.radius[owner]))
    start, end = drawing.points[drawn], drawing.points[following[drawn]]
    length = np.hypot(*(end - start).T)
    if len(length):
        at = int(np.argmin(length))
        name = drawing.shape(int(owner[drawn[at]])).where
        place.at_least("segment_mm", float(length[at]), LEAST_MM, f"a side of {name} is {{}} long")
    # From either end; from the other one, left is right.
    back = (start[:, 0] > end[:, 0]) | ((start[:, 0] == end[:, 0]) & (start[:, 1] > end[:, 1]))
    low, high = (np.where(back[:, None], b, a) for a, b in ((start, end), (end, start)))
    height = np.where(back, -1.0, 1.0) * drawing.bulges[drawn] * length / 2.0
    keys = np.rint(np.column_stack([low, high, height]) / _GRID_MM).astype(np.int64)
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    place.count(len(keys))
    for at in first[counts > 1].tolist():
        name = drawing.shape(int(owner[drawn[at]])).where
        place.fail(f"a side of {name} is drawn more than once")
    # Nobody burns notes: what is dashed there may lie along an edge.
    burnt = np.array([layer != NOTES for layer in drawing.layer], dtype=bool)
    straight = burnt[owner[drawn]] & (drawing.bulges[drawn] == 0.0)
    for at in drawn[straight][_on_others(start[straight], end[straight])].tolist():
        name = drawing.shape(int(owner[at])).where
        place.fail(f"a side of {name} lies on another line for a part of its length")


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
