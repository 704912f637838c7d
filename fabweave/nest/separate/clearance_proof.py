"""Prove with exact geometry that the pieces of one sheet keep the gap and stay inside."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.nest.item_shape import rotated
from fabweave.nest.separate.item_field import Body


def missing_mm(
    bodies: Sequence[Body],
    poses: FloatArray,
    usable_mm: tuple[float, float],
    gap_mm: float,
    barred: shapely.Geometry | None = None,
) -> float:
    """Return by how much the worst pair misses the gap, or a body leaves the usable area.

    What is barred is kept the gap from, too.

    Negative where everything has more room than it needs; bodies that overlap miss the gap by
    all of it and as much again as their overlap is wide.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.separate.item_field import body_of
    >>> from fabweave.nest.item_shape import shape_of
    >>> bar = shape_of(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [0.0, 10.0]]))[0]
    >>> poses = np.array([[15.0, 5.0, 0.0], [15.0, 16.5, 0.0]])
    >>> missing_mm([body_of(bar, 2.0)] * 2, poses, (30.0, 30.0), 2.0)
    0.5
    """
    placed = [
        rotated(body.outline, np.array([np.rad2deg(pose[2])]))[0] + pose[:2]
        for body, pose in zip(bodies, poses, strict=True)
    ]
    points = np.concatenate(placed)
    worst = float(max((-points).max(), (points - np.array(usable_mm)).max()))
    polygons = np.array([shapely.polygons(outline) for outline in placed])
    if barred is not None:
        worst = max(worst, float(_missing(polygons, np.array(barred), gap_mm).max()))
    near = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=gap_mm + 1e-9)
    first, second = near[:, near[0] < near[1]]
    if len(first) == 0:
        return worst
    return max(worst, float(_missing(polygons[first], polygons[second], gap_mm).max()))


def _missing(
    one: npt.NDArray[np.object_], other: npt.NDArray[np.object_], gap_mm: float
) -> FloatArray:
    """Return by how much each two geometries miss the gap."""
    apart = shapely.distance(one, other)
    missing: FloatArray = gap_mm - apart
    touching = apart <= 0.0
    others = np.broadcast_to(other, one.shape)
    missing[touching] += np.sqrt(
        shapely.area(shapely.intersection(one[touching], others[touching]))
    )
    return missing
