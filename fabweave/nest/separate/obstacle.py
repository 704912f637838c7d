"""Give what is barred on a sheet a distance field, so that pieces can be pushed out of it."""

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.nest.area import Area
from fabweave.nest.separate.item_field import REACH_MM, Body, field_of
from fabweave.nest.separate.overlap import Crowd, Stand, crowd_of, distances, stand_at

_STEP_MM = 1.0  # of the field's grid
_MOST_CELLS = 250_000  # of the field: a larger sheet has a coarser grid


@frozen_value
class Barrier:
    """What is barred, as a body that never moves."""

    barred: shapely.Geometry
    crowd: Crowd
    stand: Stand

    def distances(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the signed distance of points (K, 2) from what is barred, and its gradient."""
        return distances(self.crowd, self.stand, points, np.zeros(len(points), dtype=np.int64))


def barrier_of(area: Area, gap_mm: float) -> Barrier | None:
    """Return the barrier of a usable area; None if nothing is barred.

    Examples
    --------
    >>> barrier = barrier_of(Area((80.0, 60.0), shapely.box(20.0, 20.0, 30.0, 30.0)), 2.0)
    >>> barrier.distances(np.array([[25.0, 33.0], [25.0, 21.5]]))[0].round(2).tolist()
    [3.0, -1.5]
    """
    if area.barred is None:
        return None
    reach = gap_mm + REACH_MM
    low, high = np.full(2, -reach), np.array(area.size_mm) + reach
    step = max(_STEP_MM, float(np.sqrt(np.prod(high - low) / _MOST_CELLS)))
    # Beyond the usable area nothing is nearer than its rim, which the border keeps.
    deep = float(np.hypot(*area.size_mm))
    body = Body(
        outline=np.zeros((1, 2)),
        centre=np.zeros(2),
        samples=np.zeros((1, 2)),
        field=field_of(area.barred, low, high, step, deep),
        corner=low,
        step_mm=step,
        radius_mm=1.0,
        area_mm2=0.0,
    )
    crowd = crowd_of([body])
    return Barrier(area.barred, crowd, stand_at(crowd, np.zeros((1, 3))))
