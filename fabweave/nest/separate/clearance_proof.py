"""Measure exactly whether the pieces of one sheet keep the gap and stay inside."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.nest.item_shape import rotated
from fabweave.nest.separate.item_field import ItemField

#: Pairs that are farther apart than the gap by more than this cannot miss it.
_TOUCH_MM = 1e-9


def shortfall_mm(
    items: Sequence[ItemField],
    poses: FloatArray,
    usable_mm: tuple[float, float],
    gap_mm: float,
    barred: shapely.Geometry | None = None,
) -> float:
    """Return by how much the worst pair misses the gap, or an item leaves the usable area.

    Items keep the gap from what is barred, too. The result is negative where everything has more
    room than it needs; items that overlap miss the gap by all of it, and by the side of a square
    as large as their overlap.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.separate.item_field import item_field
    >>> from fabweave.nest.item_shape import shape_of
    >>> bar = shape_of(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [0.0, 10.0]]))[0]
    >>> poses = np.array([[15.0, 5.0, 0.0], [15.0, 16.5, 0.0]])
    >>> shortfall_mm([item_field(bar, 2.0)] * 2, poses, (30.0, 30.0), 2.0)
    0.5
    """
    placed = [
        rotated(item.outline, np.array([np.rad2deg(pose[2])]))[0] + pose[:2]
        for item, pose in zip(items, poses, strict=True)
    ]
    points = np.concatenate(placed)
    worst = float(max((-points).max(), (points - np.array(usable_mm)).max()))
    polygons = np.array([shapely.polygons(outline) for outline in placed])
    if barred is not None:
        worst = max(worst, float(_pair_shortfalls(polygons, np.array(barred), gap_mm).max()))
    near = shapely.STRtree(polygons).query(
        polygons, predicate="dwithin", distance=gap_mm + _TOUCH_MM
    )
    first, second = near[:, near[0] < near[1]]
    if len(first) == 0:
        return worst
    return max(worst, float(_pair_shortfalls(polygons[first], polygons[second], gap_mm).max()))


def _pair_shortfalls(
    first: npt.NDArray[np.object_], second: npt.NDArray[np.object_], gap_mm: float
) -> FloatArray:
    """Return by how much each pair of geometries misses the gap."""
    apart = shapely.distance(first, second)
    shortfall: FloatArray = gap_mm - apart
    touching = apart <= 0.0
    second = np.broadcast_to(second, first.shape)
    overlap = shapely.intersection(first[touching], second[touching])
    shortfall[touching] += np.sqrt(shapely.area(overlap))
    return shortfall
