"""Give what is barred on a sheet a distance field, so that pieces can be pushed out of it."""

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.nest.container import Container
from fabweave.nest.separate.item_field import REACH_MM, ItemField, signed_distance_field
from fabweave.nest.separate.overlap import PlacedItems, distances, item_arrays, place_items

#: Between nodes of the field's grid, millimetres; more where a sheet has more than so many cells.
_STEP_MM, _MOST_CELLS = 1.0, 250_000


@frozen_value
class ObstacleField:
    """What is barred, as an item that never moves."""

    barred: shapely.Geometry
    placed: PlacedItems

    def distances(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the signed distance of points (K, 2) from what is barred, and its gradient."""
        return distances(self.placed, points, np.zeros(len(points), dtype=np.int64))


def obstacle_field(container: Container, gap_mm: float) -> ObstacleField | None:
    """Return the field of what is barred in a container; None if nothing is.

    Examples
    --------
    >>> container = Container((80.0, 60.0), shapely.box(20.0, 20.0, 30.0, 30.0))
    >>> field = obstacle_field(container, 2.0)
    >>> field.distances(np.array([[25.0, 33.0], [25.0, 21.5]]))[0].round(2).tolist()
    [3.0, -1.5]
    """
    if container.barred is None:
        return None
    reach = gap_mm + REACH_MM
    low, high = np.full(2, -reach), np.array(container.size_mm) + reach
    step = max(_STEP_MM, float(np.sqrt(np.prod(high - low) / _MOST_CELLS)))
    # Beyond the usable area nothing is nearer than its rim, which the border keeps.
    deep = float(np.hypot(*container.size_mm))
    item = ItemField(
        outline=np.zeros((1, 2)),
        centre=np.zeros(2),
        samples=np.zeros((1, 2)),
        distance=signed_distance_field(container.barred, low, high, step, deep),
        corner=low,
        step_mm=step,
        radius_mm=1.0,
        area_mm2=0.0,
    )
    return ObstacleField(container.barred, place_items(item_arrays([item]), np.zeros((1, 3))))
