"""Give shapes distance fields, so that how deep two of them overlap is a look-up."""

import numpy as np
import shapely
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, frozen_value, places_in_groups
from fabweave.nest.item_shape import ItemShape
from fabweave.nest.place.raster import closed_sides, filled_pixels, ring_sides

#: Between nodes of a field's grid, millimetres, and between samples of an outline there. Both are
#: in proportion less where the shape's mean width is less than three steps.
_STEP_MM, _SAMPLE_MM = 2.0, 3.0
_STEPS_ACROSS, _LEAST_STEP_MM = 3.0, 0.2
#: Cells of a field: a larger shape has a coarser grid.
_MOST_CELLS = 60_000
#: Samples of an outline in a step, from which distances of nodes are measured.
_FINE = 8.0
#: Vertices that are off the line by less, millimetres, are not corners and need no sample.
_STRAIGHT_MM = 0.05
#: How far beyond the gap a field reaches, millimetres.
REACH_MM = 14.0


@frozen_value
class ItemField:
    """A shape around its centroid, sampled, with its distance field.

    Parameters
    ----------
    outline : (K, 2) float array
        The shape's outline; its centroid is the origin.
    centre : (2,) float array
        That centroid in the shape's own frame.
    samples : (S, 2) float array
        Points along the outline, its vertices among them.
    distance : (H, W) float array
        Signed distance to the outline, negative inside, at the nodes of a grid.
    corner : (2,) float array
        Where the first node stands.
    step_mm : float
        Distance between nodes.
    radius_mm : float
        Root mean square distance of the samples from the centroid.
    area_mm2 : float
        Area of the shape.
    """

    outline: FloatArray
    centre: FloatArray
    samples: FloatArray
    distance: FloatArray
    corner: FloatArray
    step_mm: float
    radius_mm: float
    area_mm2: float


def item_field(shape: ItemShape, gap_mm: float) -> ItemField:
    """Return the field of a shape, which reaches somewhat beyond the gap.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.item_shape import shape_of
    >>> bar = shape_of(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [0.0, 10.0]]))[0]
    >>> item = item_field(bar, 2.0)
    >>> bool(-5.0 <= item.distance.min() <= -4.0), item.centre.round(6).tolist()
    (True, [15.0, 5.0])
    """
    polygon = shapely.polygons(shape.outline)
    centre = shapely.get_coordinates(shapely.centroid(polygon))[0]
    outline = shape.outline - centre
    reach = gap_mm + REACH_MM
    low, high = outline.min(axis=0) - reach, outline.max(axis=0) + reach
    width = shape.area_mm2 / max(float(shapely.length(polygon)) / 2.0, 1e-9)
    fine = max(width / _STEPS_ACROSS, _LEAST_STEP_MM)
    least = float(np.sqrt(np.prod(high - low) / _MOST_CELLS))
    step = max(min(_STEP_MM, fine), least)
    columns, rows = np.ceil((high - low) / step).astype(int) + 1
    nodes = (int(rows), int(columns))
    distance = _node_distances(closed_sides(outline), low, nodes, step, reach)
    corners = shapely.get_coordinates(shapely.simplify(shapely.polygons(outline), _STRAIGHT_MM))
    samples = _along(closed_sides(corners[:-1]), step * _SAMPLE_MM / _STEP_MM)
    return ItemField(
        outline=outline,
        centre=centre,
        samples=samples,
        distance=distance,
        corner=low,
        step_mm=step,
        radius_mm=max(float(np.sqrt((samples**2).sum(axis=1).mean())), 1e-3),
        area_mm2=shape.area_mm2,
    )


def signed_distance_field(
    region: shapely.Geometry, low: FloatArray, high: FloatArray, step_mm: float, reach_mm: float
) -> FloatArray:
    """Return the signed distance to polygons, negative in them, at the nodes of a grid.

    Parameters
    ----------
    region : polygon or multipolygon
        May have holes.
    low, high : (2,) float array
        The first node, and what the last one reaches.
    step_mm : float
        Between nodes.
    reach_mm : float
        Beyond this, distances are this.

    Examples
    --------
    >>> import numpy as np
    >>> field = signed_distance_field(
    ...     shapely.box(0.0, 0.0, 2.0, 9.0), np.zeros(2), np.array([4.0, 9.0]), 1.0, 9.0
    ... )
    >>> field[4, 3:].round(2).tolist()
    [1.0, 2.0]
    """
    columns, rows = (np.ceil((high - low) / step_mm).astype(int) + 1).tolist()
    return _node_distances(ring_sides(region), low, (rows, columns), step_mm, reach_mm)


def _node_distances(
    sides: FloatArray, low: FloatArray, shape: tuple[int, int], step: float, reach: float
) -> FloatArray:
    """Return the signed distance to the closed sides (E, 2, 2) of rings at the nodes of a grid."""
    rows, columns = shape
    # Pixel centres are half a step from the corner: nodes are the centres of pixels around them.
    inside = filled_pixels((sides - low + step / 2.0)[None], shape, step)[0]
    nodes = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1) * step + low
    near, _ = cKDTree(_along(sides, step / _FINE)).query(
        nodes.reshape(-1, 2), distance_upper_bound=reach
    )
    distance = np.minimum(near, reach).reshape(rows, columns)
    return np.where(inside, -distance, distance)


def _along(sides: FloatArray, step: float) -> FloatArray:
    """Return points along sides (E, 2, 2), at most a step apart, their first ends among them."""
    outline, side = sides[:, 0], sides[:, 1] - sides[:, 0]
    count = np.maximum(np.ceil(np.hypot(side[:, 0], side[:, 1]) / step), 1).astype(int)
    owner = np.repeat(np.arange(len(outline)), count)
    share = places_in_groups(count) / count[owner]
    return outline[owner] + share[:, None] * side[owner]
